"""The acceleration term of a tendon equality: a mass that circles on a rod of constant length."""

import mujoco

SOFT = 'solref="0.002 1" solimp="0.9999 0.9999 0.001 0.5 2"'
MODEL = f"""
<mujoco>
  <option gravity="0 0 0" iterations="500" tolerance="0"/>
  <worldbody>
    <site name="hub"/>
    <body name="mass" pos="0.5 0 0">
      <joint type="slide" axis="1 0 0"/>
      <joint type="slide" axis="0 1 0"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <site name="end"/>
    </body>
  </worldbody>
  <tendon><spatial name="rod"><site site="hub"/><site site="end"/></spatial></tendon>
  <equality><tendon tendon1="rod" {SOFT}/></equality>
</mujoco>
"""
m = mujoco.MjModel.from_xml_string(MODEL)
d = mujoco.MjData(m)
d.qvel[:] = 0.0, 2.0  # across the rod: no gap, and no rate of its length
mujoco.mj_forward(m, d)
print(f"MuJoCo {mujoco.__version__}")
print(f"acceleration along the rod: expected {-(2.0**2) / 0.5:g}, found {d.qacc[0] + 0.0:g} m/s^2")
print(f"efc_aref: expected {-(2.0**2) / 0.5:g} (minus Jdot v), found {d.efc_aref[0] + 0.0:g} m/s^2")
