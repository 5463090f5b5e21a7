"""Drivers against degrees of freedom, at any size: what the sparse count finds is what the dense
one does, and is told alike.
"""

from dataclasses import replace

import pytest
from kincheck import (
    Body,
    Fixed,
    Gear,
    JointAngle,
    Mechanism,
    PointCoordinate,
    Revolute,
    SolveError,
    Spherical,
    cases,
)
from kincheck.core.cli import main
from kincheck.core.kinematics import degrees_of_freedom, require_driven
from kincheck.core.kinematics.formulation.constraints import frames
from kincheck.core.kinematics.structure.degrees_of_freedom import DENSE, account

from ..support.case_texts import write
from ..support.examples import examples
from ..support.mechanisms import ORIGIN, X, Z, chain, slider_crank

(MISMATCHES,) = examples(__file__, "mismatches")

LOOPS = 14  # 29 bodies
WELDED = DENSE + 1


def large(mechanism):
    """The mechanism with so many welded blocks beside it that freedoms are counted sparsely."""
    blocks = [f"block {k}" for k in range(WELDED)]
    return replace(
        mechanism,
        bodies=[*mechanism.bodies, *map(Body, blocks)],
        joints=[*mechanism.joints, *(Fixed(f"weld {k}", "ground", k) for k in blocks)],
    )


@pytest.mark.by_day(3)
@pytest.mark.parametrize("name", cases.names())
def test_sparse_freedom_count_equals_dense(name):
    mechanism = cases.load(name).mechanism
    dof = account(mechanism, frames(mechanism)).dof
    again = [replace(driver, name=f"{driver.name} again") for driver in mechanism.drivers]
    whole = large(mechanism)
    assert len(whole.moving) > DENSE
    for drivers in (whole.drivers, (), (*whole.drivers, *again)):
        assert degrees_of_freedom(replace(whole, drivers=drivers)) == dof
    require_driven(whole)


@pytest.mark.parametrize("count", [1, 4, 11])
def test_freedom_count_of_free_balls(count):
    bodies = [Body(f"b{k}", (float(k), 0.0, 0.0)) for k in range(count)]
    balls = [Spherical(f"s{k}", "ground", f"b{k}", (float(k), 0.0, 0.0)) for k in range(count)]
    free = large(Mechanism("loose", bodies, balls))
    assert degrees_of_freedom(free) == 3 * count
    columns, dof = 6 * (count + WELDED), 3 * count
    with pytest.raises(
        SolveError,
        match=rf"{dof} degrees of freedom \({columns} coordinates - rank {columns - dof}\) but 0 ",
    ):
        require_driven(free)


def test_freedom_count_with_gear():
    axles = [Revolute(name, "ground", name, ORIGIN, Z) for name in ("first", "second")]
    bodies, mesh = [Body("first"), Body("second")], Gear("mesh", ("first", "second"), -2.0)
    assert degrees_of_freedom(large(Mechanism("gears", bodies, axles, couplers=[mesh]))) == 1
    assert degrees_of_freedom(large(Mechanism("gears", bodies, axles))) == 2


def test_driver_locked_at_design_is_accepted():
    push = PointCoordinate("push", "end", X)
    require_driven(large(replace(slider_crank(), drivers=[push])))


def test_large_mechanism_driver_mismatch_names_parts():
    whole = chain(LOOPS)
    require_driven(whole)
    with pytest.raises(
        SolveError,
        match=r"1 degree of freedom \(174 coordinates - rank 173\) but 0 drivers; what can still",
    ):
        require_driven(replace(whole, drivers=()))
    twice = replace(whole, drivers=(*whole.drivers, JointAngle("second", "pivot7")))
    with pytest.raises(
        SolveError,
        match=r"but 2 drivers; not independent are '(turn|second)', '(turn|second)'; remove 1 or",
    ):
        require_driven(twice)
    spinning = replace(
        whole,
        bodies=[*whole.bodies, Body("stray")],
        joints=[*whole.joints, Spherical("s", "crank3", "stray", (9, 9, 9))],
    )
    with pytest.raises(
        SolveError,
        match=(
            r"4 degrees of freedom .* but 1 driver; what can still move is most of all 'stray'; add"
        ),
    ):
        require_driven(spinning)


def written(mechanism, drivers):
    """A case file of a chain."""
    lines = [
        'schema = "kincheck-case/1"',
        'name = "long"',
        'source = "made up for this test"',
        'truth = "consensus_only"',
    ]
    lines += [f"[bodies.{body.name}]" for body in mechanism.bodies]
    for joint in mechanism.joints:
        axes = f"axes = {[list(axis) for axis in joint.axes]}" if hasattr(joint, "axes") else ""
        axes = f"axis = {list(joint.axis)}" if hasattr(joint, "axis") else axes
        place = f"bodies = {list(joint.bodies)}\npoint = {[float(x) for x in joint.point]}"
        lines += [f'[joints.{joint.name}]\ntype = "{joint.type}"\n{place}\n{axes}']
    lines += [
        f'[points.end]\nbody = "{mechanism.points[0].body}"\nposition ='
        f" {[float(x) for x in mechanism.points[0].position]}"
    ]
    lines += [
        f'[drivers.{name}]\ntype = "joint_angle"\njoint = "{joint}"'
        for name, joint in drivers.items()
    ]
    return "\n".join([*lines, '[sweep]\ndriver = "turn"\nstart = 0.0\nstop = 0.1\nsteps = 3'])


@pytest.mark.parametrize(
    ("loops", "drivers", "left_out", "status", "said"),
    MISMATCHES.values(), ids=MISMATCHES,
)  # fmt: skip
def test_driver_mismatch_exit_status_and_message(
    loops, drivers, left_out, status, said, tmp_path, capsys
):
    whole = chain(loops)
    partial = replace(whole, joints=[joint for joint in whole.joints if joint.name != left_out])
    file = write(tmp_path, written(partial, drivers))
    assert main.main(["run", str(file), "--engine", "native", "--jobs", "0"]) == status
    stream = capsys.readouterr()
    assert said in stream.err
    if "nothing was compared" not in said:
        assert f"kincheck: {file}: drivers: mechanism 'long': " in stream.err
        assert stream.out == ""
