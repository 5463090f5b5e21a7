"""The acceleration term of connects and welds: a mass that is tied to the tip of a turning arm."""

import mujoco

SOFT = 'solref="0.002 1" solimp="0.9999 0.9999 0.001 0.5 2"'
MODEL = """
<mujoco>
  <option gravity="0 0 0" iterations="500" tolerance="0"/>
  <worldbody>
    <body name="arm">
      <joint type="hinge" axis="0 0 1"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
    </body>
    <body name="mass" pos="0.5 0 0">
      <joint type="slide" axis="1 0 0"/>
      <joint type="slide" axis="0 1 0"/>
      <joint type="hinge" axis="0 0 1"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
    </body>
  </worldbody>
  <equality>%s</equality>
</mujoco>
"""
TIES = {
    "connect": f'<connect body1="arm" body2="mass" anchor="0.5 0 0" {SOFT}/>',
    "weld": f'<weld body1="arm" body2="mass" {SOFT}/>',
}
EXPECTED = -(2.0**2) * 0.5


def show(program, tie, found):
    """Print the acceleration of the mass beside the expected one."""
    print(f"{program}, {tie}: acceleration to the axle: expected {EXPECTED:g}, found {found:.4g}")


for tie, text in TIES.items():
    m = mujoco.MjModel.from_xml_string(MODEL % text)
    d = mujoco.MjData(m)
    d.qvel[:] = 2.0, 0.0, 1.0, 2.0  # both turn at 2 rad/s: no gap, and no rate of it
    mujoco.mj_forward(m, d)
    show(f"MuJoCo {mujoco.__version__}", tie, d.qacc[1] + 0.0)
    try:
        from importlib.metadata import version

        import jax
        from mujoco import mjx
    except ImportError:
        continue  # MuJoCo alone is a result too
    jax.config.update("jax_enable_x64", True)
    of_mjx = jax.jit(mjx.forward)(mjx.put_model(m), mjx.put_data(m, d))
    show(f"MJX {version('mujoco-mjx')}", tie, float(of_mjx.qacc[1]) + 0.0)
