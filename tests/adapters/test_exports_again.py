"""Built-in cases, exported as models and read again: the motion that is read satisfies all joints
of the case.

Each case goes through one format, in turn. All of them through all formats:

    KINCHECK_EXPORTS=all pytest tests/adapters/test_exports_again.py
"""

import os
from pathlib import Path

import numpy as np
import pytest
from kincheck import adapters, cases
from kincheck.core.case.case import Case
from kincheck.core.case.io.model_writer import written
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.errors import KincheckError
from kincheck.core.kinematics import NativeSolver, largest_residual
from kincheck.core.trajectory import BodyMotion

from ..oracles.naive import A

FORMATS = ("mjcf", "urdf", "sdf")
NAMES = cases.names()
ALL = os.environ.get("KINCHECK_EXPORTS") == "all"
PAIRS = [
    (name, each)
    for k, name in enumerate(NAMES)
    for each in (FORMATS if ALL else [FORMATS[k % len(FORMATS)]])
]
# Round-off of metre-sized coordinates, and of angles between links at arms of their size.
EXACT = 1e-10
STEP = 0.02
"""End of the motion [rad or m]: far from any singular pose of the built-in cases."""


def exported(case: Case, kind: str, folder: Path) -> Path:
    """Write a model and the files beside it; return its file."""
    texts = written(case, adapters.writer(kind))
    files = [folder / f"model{ending}" for ending in texts]
    for file, text in zip(files, texts.values(), strict=True):
        file.write_text(text)
    return files[0]


def read_again(case: Case, file: Path) -> Case:
    """Return the case of a model, driven by the first joint of the original that moves it."""
    reasons: list[str] = []
    for joint in case.mechanism.joints:
        for name in (joint.name, f"{joint.name}.rotation", f"{joint.name}.1"):
            try:
                return load(file, Supplied(drive=(f"{name}:0:{STEP}:2",), hold_rest=True))
            except KincheckError as error:
                reasons.append(str(error))
    raise AssertionError(reasons)


def carried(case: Case, again: Case) -> dict[str, BodyMotion]:
    """Return the motions of the bodies of a case, from those of the frames of another one."""
    names = tuple(body.name for body in again.mechanism.moving)
    solver = NativeSolver(order=0, compiled=False)
    found = solver.prepare(again.mechanism, again.sweep.path, bodies=names)(1e-12)
    assert found.solved.all(), found.message
    motions: dict[str, BodyMotion] = {}
    for body in case.mechanism.moving:
        other, motion = again.mechanism.body(body.name), found.bodies[body.name]
        turns = [A(p) @ A(np.array(other.euler_parameters)).T for p in motion.p]
        arm = np.subtract(body.origin, other.origin)
        r = np.array([at + turn @ arm for at, turn in zip(motion.r, turns, strict=True)])
        p = np.array([quaternion(turn @ A(np.array(body.euler_parameters))) for turn in turns])
        motions[body.name] = BodyMotion(r, p, None, None)
    return motions


def quaternion(R: np.ndarray) -> np.ndarray:
    """Return the Euler parameters of a rotation matrix: the largest column of their products."""
    e = [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]
    products = np.empty((4, 4))
    products[0, 0] = 1.0 + np.trace(R)
    products[0, 1:] = products[1:, 0] = e
    products[1:, 1:] = R + R.T + (1.0 - np.trace(R)) * np.eye(3)
    column = products[:, np.argmax(np.diag(products))]
    return column / np.linalg.norm(column)


@pytest.mark.parametrize(("name", "kind"), PAIRS)
def test_an_export_is_read_and_moves_alike(name: str, kind: str, tmp_path: Path):
    case = cases.load(name)
    again = read_again(case, exported(case, kind, tmp_path))
    motions = carried(case, again)
    parts = [*case.mechanism.joints, *case.mechanism.couplers]
    assert largest_residual(case.mechanism, parts, motions) < EXACT
    assert max(np.ptp(motion.p, axis=0).max() for motion in motions.values()) > 1e-5
    for body in case.mechanism.moving:
        there = again.mechanism.body(body.name)
        assert there.mass == pytest.approx(body.mass, abs=EXACT)
