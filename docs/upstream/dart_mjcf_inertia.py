"""What DART's reader of MJCF keeps of an `inertial`: mass, centre and tensor."""

import tempfile
from pathlib import Path

import dartpy

MODEL = """
<mujoco model="m"><worldbody><body name="body">
  <joint axis="0 0 1"/>
  <inertial pos="0.3 0 0" mass="2" {}/>{}
</body></worldbody></mujoco>
"""
print(f"DART {dartpy.__version__}")
for tensor in ('diaginertia="2 3 4"', 'fullinertia="2 3 4 0.1 0.2 0.3"'):
    for geom in ("", '<geom size="0.1"/>'):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "model.xml"
            file.write_text(MODEL.format(tensor, geom), encoding="utf-8")
            world = dartpy.utils.MjcfParser.readWorld(str(file))
            found = world.getSkeleton(0).getBodyNode("body").getInertia()
        moments = [float(found.getMoment()[k, k]) for k in range(3)]
        print(
            f"{tensor}, {'with' if geom else 'without'} geom: expected mass 2, centre 0.3, moments"
            f" [2.0, 3.0, 4.0]; found mass {found.getMass():g}, centre {found.getLocalCOM()[0]:g},"
            f" moments {moments}"
        )
