"""Robots of a folder, such as a checked-out public repository, against simulators' own equations:

    python -m tests.oracles.public_robots FOLDER

Each model with closed loops is driven by its first actuated joint, with the rest held. Poses are
compared with an independent Newton iteration: on MuJoCo's residuals for MJCF, on Pinocchio's frames
for URDF with YAML. A table in Markdown is printed. Further arguments are files or folders too.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from kincheck import KincheckError, Supplied
from kincheck.core.case.io.readers import LEFT_OUT
from kincheck.core.case.models.files import load
from kincheck.core.extensions.trees import case as trees
from kincheck.core.extensions.trees.reader import read_tree
from kincheck.core.kinematics import NativeSolver

from .mujoco_newton import MujocoNewton
from .naive import A

SPAN, SAMPLES = 0.1, 9
SUBSTEP = 0.02
"""Longest step between poses of the oracle, so that it stays on its branch [rad or m]."""
CLOSED = 1e-9
"""Residual of a closed oracle, unless the file's digits leave more [m or rad]."""
COLUMNS = (
    *("Model", "Freedoms", "Bodies, joints", "Closures", "Left out", "Solved, compared"),
    *("Largest difference [m]", "[rad]", "Residual"),
)


@dataclass(frozen=True)
class Row:
    """What was found of a model.

    Attributes:
        cells: of the table, in its order.
    """

    cells: Sequence[str]

    def __str__(self):
        return f"| {' | '.join(self.cells)} |"


def rows_of(paths, drive=""):
    """Yield the rows of all models with loops, and of those that are refused.

    Args:
        drive: the joint to be driven; the first actuated one unless given.
    """
    for path in paths:
        files = sorted(path.rglob("*")) if path.is_dir() else [path]
        for file in files:
            if file.suffix not in (".xml", ".urdf") or not _has_loops(file):
                continue
            name = str(file.relative_to(path)) if path.is_dir() else file.name
            try:
                found = compared(file, drive)
            except KincheckError as error:
                found = (f"refused: {str(error).removeprefix(f'{file}: ')}",)
            except (ValueError, AssertionError) as error:  # of the oracle
                found = (f"not compared: {' '.join(str(error).split())}",)
            yield Row((name, *found))


def _has_loops(file):
    if file.suffix == ".urdf":
        return file.with_suffix(".yaml").exists()
    text = _text(file, file.parent)
    return (
        re.match(r"(<[?!].*?>|\s)*<mujoco[\s>]", text, re.DOTALL) is not None
        and re.search(r"<(connect|weld|joint|tendon)\s[^>]*(1=)", text) is not None
    )


def _text(file, folder):
    """Return the text of a model and of the files that it includes from its folder."""
    text = file.read_text(errors="replace")
    included = re.findall(r'<include\s+file\s*=\s*"([^"]+)"', text)
    files = [folder / name for name in included if (folder / name).is_file()]
    return "".join([text, *(_text(each, folder) for each in files if each != file)])


def compared(file, drive=""):
    """Return the cells of a model: its size, and the largest differences.

    Raises:
        KincheckError: the model is refused.
    """
    dof, joint = _freedoms(file, drive)
    *_, assembled = posed(file, Supplied(drive=(f"{joint}:0:1",), hold_rest=True))
    at = assembled.tree.joints[joint].value
    sweep = f"{joint}:{at - SPAN!r}:{at + SPAN!r}:{SAMPLES}"
    case, _, assembled = posed(file, supplied := Supplied(drive=(sweep,), hold_rest=True))
    mechanism = case.mechanism
    solved, reached, worst = differences(file, supplied)
    left_out = re.sub(r"[a-z]+: [a-z]+ \(\d+\),? ?", "", case.source.split(LEFT_OUT)[1])
    return (
        str(dof),
        f"{len(mechanism.moving)}, {len(mechanism.joints)}",
        str(len(assembled.tree.ties)),
        left_out.strip(", ") or "nothing",
        f"{solved}, {reached} of {SAMPLES}",
        *(f"{each:.0e}" for each in worst),
    )


def _freedoms(file, drive):
    """Return the freedom of a model and its first actuated joint, which the message names."""
    try:
        case = load(file)  # by its own motors and limits
        return len(case.mechanism.drivers), drive or case.sweep.driver
    except KincheckError as error:
        freedom = re.search(r"has (\d+) degree", str(error))
        joints = re.search(r"Joints, actuated ones first: (.*?)\.( |$)", str(error))
        if freedom and (drive or joints):
            return int(freedom[1]), drive or joints[1].split(", ")[0]
        raise


def posed(file, supplied):
    """Return the case of a model, its driven and held joints, and its start."""
    assembled, driving, _ = trees.model_of(read_tree(file), supplied)
    return load(file, supplied), driving, assembled


def differences(file, supplied):
    """Return the number of samples that are solved, of those that the oracle reaches too, and the
    largest differences there [m, rad] with the oracle's residual.
    """
    case, driving, assembled = posed(file, supplied)
    names = tuple(body.name for body in case.mechanism.moving)
    found = NativeSolver(order=0).prepare(case.mechanism, case.sweep.path, bodies=names)(1e-12)
    oracle = _oracle(file, assembled, driving)
    ((swept, values),) = driving.driven.items()
    held = {name: assembled.tree.joints[name].value for name in driving.held}
    start, at = oracle.state, assembled.tree.joints[swept].value
    closed = max(CLOSED, 10.0 * assembled.closing.tolerance)
    reached, worst = 0, np.zeros(3)
    for side in (1.0, -1.0):
        oracle.state, last = start, at
        for k in sorted(range(len(values)), key=lambda k: abs(values[k] - at)):
            # the start itself belongs to one side
            if (values[k] - at) * side < 0.0 or (values[k] == at and side < 0.0):
                continue
            steps = int(np.ceil(abs(values[k] - last) / SUBSTEP)) + 1
            for value in np.linspace(last, values[k], steps):
                oracle.move({**held, swept: value})
            last = values[k]
            if oracle.residual > closed:  # where the mechanism locks
                break
            if not found.solved[k]:
                continue
            reached += 1
            worst = np.maximum(worst, [*_apart(found, k, oracle, assembled), oracle.residual])
    return int(found.solved.sum()), reached, worst


def _apart(found, k, oracle, assembled):
    """Return the largest distance of a sample's bodies [m], and the largest turn between them."""
    far = turned = 0.0
    for name, motion in found.bodies.items():
        if name in assembled.tree.massless or (place := oracle.body(name)) is None:
            continue
        turn = A(motion.p[k]) @ place[1].T - np.eye(3)
        far = max(far, float(np.abs(motion.r[k] - place[0]).max()))
        turned = max(turned, float(np.abs(turn).max()))
    return far, turned


def _oracle(file, assembled, driving):
    if file.suffix == ".xml":
        return MujocoNewton(file, assembled, driving.fixed)
    from .pinocchio_newton import PinocchioNewton  # its solver takes a second to load

    return PinocchioNewton(file, assembled, driving.fixed)


def main(arguments):
    """Print the table."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.oracles.public_robots",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("path", type=Path, nargs="+", metavar="FOLDER")
    parser.add_argument("--drive", default="", help="joint to be driven; the first actuated one")
    options = parser.parse_args(arguments)
    print(Row(COLUMNS))
    print(Row(["---"] * len(COLUMNS)))
    for row in rows_of(options.path, options.drive):
        print(row, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
