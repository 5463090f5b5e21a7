"""A planar four-bar of four parallel hinges as a case file, with axes off by digits, and its
forces: of the solver, and the independent ones of the stress run for exact axes.
"""

import json
import tempfile
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from kincheck import solve
from kincheck.core.case.io.case_file import load_case

HINGES = {"a": (0.0, 0.0, 0.0), "b": (0.0, 0.0, 0.3), "c": (0.5, 0.0, 0.5), "d": (0.6, 0.0, 0.0)}
BODIES = {"a": ("ground", "crank"), "b": ("crank", "coupler"), "c": ("coupler", "rocker")}
BODIES["d"] = ("rocker", "ground")
CENTERS = {"crank": (0.0, 0.05, 0.15), "coupler": (0.25, 0.02, 0.4), "rocker": (0.55, -0.03, 0.25)}
MASS, INERTIA, GRAVITY = 1.0, 0.1, np.array([0.0, 0.0, -9.81])
ANGLES = (-0.3, 0.0, 0.3)


def outputs():
    """Outputs of all reactions and of the effort."""
    found = {
        f"{joint} {kind} {axis}": {"type": f"joint_{kind}", "joint": joint, "component": axis}
        for joint, kind, axis in product("abcd", ("force", "moment"), "xyz")
    }
    return found | {"effort": {"type": "driver_effort", "driver": "turn"}}


def written(
    folder,
    axes=None,
    order="abcd",
    bodies=(*CENTERS,),
    scale=1.0,
    turn=None,
    cross=None,
    twin=None,
    last="revolute",
    **more,
):
    """The case as a file.

    Args:
        axes: of hinges, by name, in place of the exact ones.
        order: of joints.
        scale: of all lengths; forces grow by it, moments by its square.
        turn: rotation of everything.
        cross: second axis of a universal joint in place of hinge "c".
        twin: point of a second hinge, "twin", of the bodies of "d".
        last: type of joint "d".
        more: further tables of the file, such as closure and units; in millimetres the numbers are
            a thousand times larger.
    """
    turn = np.eye(3) if turn is None else turn
    units = more.get("units", {}).get("length", "m")
    length = scale * {"m": 1.0, "mm": 1e3}[units]

    def place(point):
        return (length * turn @ np.array(point)).tolist()

    joints = {
        name: {
            "type": "revolute",
            "bodies": [*BODIES[name]],
            "point": place(HINGES[name]),
            "axis": (turn @ np.array((axes or {}).get(name, (0.0, 1.0, 0.0)))).tolist(),
        }
        for name in order
    }
    if cross is not None:
        joint = joints["c"]
        joint |= {
            "type": "universal",
            "axes": [joint.pop("axis"), (turn @ np.array(cross)).tolist()],
        }
    if twin is not None:
        joints["twin"] = joints["d"] | {"point": place(twin)}
    joints["d"]["type"] = last
    if last == "spherical":
        del joints["d"]["axis"]
    about = [length**2 * INERTIA] * 3 + [0.0] * 3
    masses = {
        name: {"mass": MASS, "center_of_mass": place(CENTERS[name]), "inertia": about}
        for name in bodies
    }
    keys = {
        "schema": "kincheck-case/1",
        "name": "four_bar",
        "source": "made up",
        "gravity": place(GRAVITY),
        "bodies": masses,
        "joints": joints,
        "points": {"tip": {"body": "coupler", "position": place((0.7, 0.0, 0.6))}},
        "drivers": {"turn": {"type": "joint_angle", "joint": "a"}},
        "sweep": {"driver": "turn", "start": ANGLES[0], "stop": ANGLES[-1], "steps": len(ANGLES)},
        "outputs": outputs(),
        **more,
    }
    file = folder / "four_bar.json"
    file.write_text(json.dumps(keys))
    return file


def components(forces, turn=None, scale=1.0):
    """Reactions along the turned axes, in the unit of the unscaled case: shape (samples, joints,
    6), and the efforts.
    """
    turn = np.eye(3) if turn is None else turn
    found = [
        [
            forces.joints[name].along(turn[:, k], moment=moment) / scale ** (1 + moment)
            for moment in (False, True)
            for k in range(3)
        ]
        for name in "abcd"
    ]
    return np.array(found).transpose(2, 0, 1), forces.drivers["turn"] / scale**2


def solved(file, turn=None, scale=1.0):
    """The case of a file, and its `components`."""
    case = load_case(file)
    found = solve(case.mechanism, "turn", case.sweep.values, forces=True)
    assert found.solved.all(), found.message
    return case, components(found.forces, turn, scale)


@cache
def truth(cross=None):
    """Reactions and efforts of exact axes, as `components`: not a number where rigid bodies do not
    determine them.
    """
    follow_motion = pytest.importorskip(
        "kincheck.core.extensions.laboratory.truth.motion"
    ).follow_motion
    known_forces = pytest.importorskip(
        "kincheck.core.extensions.laboratory.truth.forces"
    ).known_forces
    with tempfile.TemporaryDirectory() as folder:
        case = load_case(written(Path(folder), cross=cross))
    known = known_forces(case, follow_motion(case))
    found = {name: np.where(each.determined, each.values, np.nan) for name, each in known.items()}
    reactions = [
        [found[f"{joint} {kind} {axis}"] for kind in ("force", "moment") for axis in "xyz"]
        for joint in "abcd"
    ]
    return np.array(reactions).transpose(2, 0, 1), found["effort"]
