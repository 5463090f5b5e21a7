"""Models with few digits: their digits do not move them."""

import numpy as np
import pytest
from kincheck.core.case.models.files import load

from ...support.model_files import driven

# Hinges are parallel to the file's six digits: across the plane, their slopes are as small as the
# gap itself.
FIVE_BAR = """<mujoco><compiler angle="radian"/><worldbody>
<body name="crank"><joint name="crank" axis="0 1 {tilt}"/><body name="rod" pos="0.03 0 0.04">
<joint name="pin" axis="{tilt} 1 0"/><site name="a" pos="0.08 {gap} 0.012345"/></body></body>
<body name="other" pos="0.2 0 0"><joint name="other" axis="{tilt} 1 0"/>
<body name="rocker" pos="-0.1 0 0"><joint name="rocker" axis="0 1 0"/>
<site name="b" pos="0.01 0 0.052345"/></body></body></worldbody>
<equality><connect site1="a" site2="b"/></equality></mujoco>"""


@pytest.mark.parametrize("tilt", ["0.000001", "0.000004"])
@pytest.mark.parametrize("gap", ["0.0000004", "0.000001"])
def test_gap_within_digits_moves_no_body(tmp_path, tilt, gap):
    file = tmp_path / "model.xml"
    file.write_text(FIVE_BAR.format(tilt=tilt, gap=gap))
    case = load(file, driven("crank:0:0.1:3", hold_rest=True))
    rod = case.mechanism.body("rod")
    assert np.allclose(rod.origin, (0.03, 0.0, 0.04), rtol=0, atol=1e-6)
    assert np.allclose(rod.euler_parameters, (1, 0, 0, 0), rtol=0, atol=1e-6)


def test_joint_moved_by_digits_stays_free(tmp_path):
    """The joint across the plane moves by a ten thousandth of what the others move by."""
    file = tmp_path / "model.xml"
    across = '<joint name="across" axis="1 0 0"/><joint name="pin"'
    file.write_text(FIVE_BAR.format(tilt="0.00001", gap="0").replace('<joint name="pin"', across))
    case = load(file, driven("crank:0:0.1:3", hold_rest=True))
    assert [driver.name for driver in case.mechanism.drivers] == ["crank", "pin"]
