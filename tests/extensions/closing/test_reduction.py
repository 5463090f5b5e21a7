"""Joints that hold less where rows are redundant but for digits."""

from dataclasses import replace

from kincheck import Body, Gear, Revolute
from kincheck.core.extensions.closing.reduction import reduce_rows

from ...support.mechanisms import Y, planar_four_bar


def test_redundancy_beside_many_branches():
    """A four-bar with a tilted hinge, among a thousand wheels that follow its crank."""
    bars = planar_four_bar(Y, (3.0, 2.0, 0.0), (3.0, 0.0, 0.0))
    joints = [
        each.changed(axis=(1e-6, 0.0, 1.0)) if each.name == "pin" else each for each in bars.joints
    ]
    bars = replace(bars, joints=joints, points=[], drivers=[])
    wheels = [f"wheel{k}" for k in range(1100)]
    axles = [
        Revolute(x, "ground", x, (float(k), 5.0, 0.0), (0.3, 0.0, 0.9))
        for k, x in enumerate(wheels)
    ]
    whole = replace(
        bars,
        bodies=[*bars.bodies, *map(Body, wheels)],
        joints=[*joints, *axles],
        couplers=[Gear(f"gear {x}", ("pivot", x), 2.0) for x in wheels],
    )
    alone, among = (
        [str(each.joint) for each in reduce_rows(m, 1e-5).mechanism.reduced] for m in (bars, whole)
    )
    assert alone == among != []
