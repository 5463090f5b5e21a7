"""Broken drivers, couplers and motions in case files: one clear message each."""

from pathlib import Path

import pytest
from kincheck.core.case.io.case_file import load_case

from ..support.case_texts import complains, edited, write

# A crank and a slider, coupled and driven in several ways

DRIVEN = edited(
    (
        "[points.tip]",
        """[bodies.crank]
[bodies.pinion]
[joints.pivot]
type = "revolute"
bodies = ["ground", "crank"]
point = [0, 0, 0]
axis = [0, 0, 1]
[joints.axle]
type = "revolute"
bodies = ["ground", "pinion"]
point = [0, 1, 0]
axis = [0, 0, 1]
[joints.mesh]
type = "gear"
joints = ["axle", "pivot"]
ratio = -2.0
[drivers.turn]
type = "joint_angle"
joint = "pivot"
[drivers.turn.motion]
type = "table"
times = [-1, 0, 1]
values = [0.5, 0, 0.5]
[points.tip]""",
    )
)


TURN = DRIVEN[DRIVEN.index("[drivers.turn.motion]") : DRIVEN.index("[points.tip]")]
PUSH = '[drivers.push.motion]\ntype = "ramp"\nrate = 1\n'
MESH = DRIVEN[DRIVEN.index("[joints.mesh]") : DRIVEN.index("[drivers.turn]")]
TIME = ('driver = "push"', 'driver = "time"')
NO_RATE = ("rate = 2.0\n", "")
DRIVEN_BROKEN = {
    "bodies of a gear": (
        [('joints = ["axle"', 'bodies = ["axle"')],
        ["joints.mesh.bodies", "unknown key", "joints, ratio"],
    ),
    "no joints": (
        [('joints = ["axle", "pivot"]\n', "")],
        ["joints.mesh.joints", "missing", '["first joint", "second joint"]'],
    ),
    "three joints": (
        [('["axle", "pivot"]', '["axle", "pivot", "guide"]')],
        ["joints.mesh.joints", "two names"],
    ),
    "unknown joint": (
        [('["axle", "pivot"]', '["axle", "pivt"]')],
        ["joints.mesh.joints", "'pivt'", "did you mean 'pivot'"],
    ),
    "the same joint": (
        [('["axle", "pivot"]', '["axle", "axle"]')],
        ["joints.mesh", "couples 'axle' with itself"],
    ),
    "no such freedom": (
        [('["axle", "pivot"]', '["axle", "guide"]')],
        ["joints.mesh.joints", "'guide' is", "no rotation"],
    ),
    "coupled coupler": (
        [(MESH, MESH + '[joints.more]\ntype = "gear"\njoints = ["mesh", "axle"]\nratio = 1\n')],
        ["joints.more.joints", "no joint 'mesh'"],
    ),
    "no ratio": ([("ratio = -2.0", "")], ["joints.mesh.ratio", "missing", "a number"]),
    "zero ratio": (
        [("ratio = -2.0", "ratio = 0")],
        ["joints.mesh", "ratio = 0.0", "other than zero"],
    ),
    "ratio of text": (
        [("ratio = -2.0", 'ratio = "2:1"')],
        ["joints.mesh.ratio", "'2:1'", "a number"],
    ),
    "radius of a gear": (
        [("ratio = -2.0", "radius = 1")],
        ["joints.mesh.radius", "unknown key", "ratio"],
    ),
    "joints of a revolute": (
        [('bodies = ["ground", "crank"]', 'joints = ["axle", "guide"]')],
        ["joints.pivot.joints", "unknown key"],
    ),
    "unknown motion": (
        [('type = "table"', 'type = "tabel"')],
        ["drivers.turn.motion.type", "'tabel'", "did you mean 'table'"],
    ),
    "no motion type": (
        [('type = "table"', "")],
        ["drivers.turn.motion.type", "expected a motion type"],
    ),
    "motion is a number": ([(TURN, "motion = 3\n")], ["drivers.turn.motion", "found 3", "a table"]),
    "unknown key of a motion": (
        [("times = [-1, 0, 1]", "rate = 1")],
        ["drivers.turn.motion.rate", "unknown key", "times, values"],
    ),
    "no values": (
        [("values = [0.5, 0, 0.5]\n", "")],
        ["drivers.turn.motion.values", "missing", "a list of numbers"],
    ),
    "fewer values": (
        [("[0.5, 0, 0.5]", "[0.5, 0]")],
        ["drivers.turn.motion", "3 times and 2 values"],
    ),
    "times back and forth": (
        [("[-1, 0, 1]", "[-1, 1, 0]")],
        ["drivers.turn.motion", "times do not increase"],
    ),
    "NaN in a table": (
        [("[0.5, 0, 0.5]", "[0.5, nan, 0.5]")],
        ["drivers.turn.motion.values[1]", "nan"],
    ),
    "table too short": (
        [("[-1, 0, 1]", "[-0.01, 0, 1]")],
        ["drivers.turn.motion", "from -0.01 to 1 s", "-0.05 to 0.05 s"],
    ),
    "motion of the swept": (
        [(TURN, TURN + PUSH)],
        ["drivers.push.motion", "swept driver", 'driver = "time"'],
    ),
    "nothing moves in time": (
        [TIME, NO_RATE, (TURN, "")],
        ["sweep.driver", "found 'time'", "no driver has a motion"],
    ),
    "nothing moves": (
        [('driver = "push"\n', ""), NO_RATE, (TURN, "")],
        ["sweep.driver", "missing", "name the driver to sweep"],
    ),
    "rate of time": ([TIME], ["sweep.rate", "found 2.0", "sweep of time", "remove it"]),
    "rate without driver": (
        [('driver = "push"\n', "")],
        ["sweep.rate", "found 2.0", "name the driver to sweep"],
    ),
    "driver called time": (
        [("[drivers.turn]", "[drivers.time]"), (TURN, "")],
        ["drivers.time", "rename the driver"],
    ),
    "time stands still": (
        [TIME, NO_RATE, ("stop = 0.1", "stop = -0.1")],
        ["sweep.stop", "found the start"],
    ),
    "overflowing motion": (
        [
            ("[-1, 0, 1]", "[-1, -1e-100, 0, 1e-100, 1]"),
            ("[0.5, 0, 0.5]", "[0, 1e100, -1e100, 1e100, 0]"),
        ],
        ["drivers.turn.motion", "overflow"],
    ),
}


@pytest.mark.parametrize(("edits", "fragments"), DRIVEN_BROKEN.values(), ids=DRIVEN_BROKEN)
def test_broken_couplers_and_motions(
    tmp_path: Path, edits: list[tuple[str, str]], fragments: list[str]
):
    complains(write(tmp_path, edited(*edits, base=DRIVEN)), fragments)


def test_what_is_broken_above_was_whole(tmp_path: Path):
    assert load_case(write(tmp_path, DRIVEN)).mechanism.couplers
    assert load_case(write(tmp_path, edited(TIME, NO_RATE, base=DRIVEN))).sweep.driver == "time"
