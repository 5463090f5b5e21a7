"""Four-bars that nearly fold, with more rows than they need: no choice of rows hides a corner."""

from dataclasses import replace

import numpy as np
import pytest
from kincheck.core import (
    Body,
    Distance,
    JointAngle,
    Mechanism,
    Point,
    Revolute,
    Universal,
    solve,
)

from .test_corners import ORIGIN, Z, corner, latin, pin


def universal_loop(pin, meet, rest, across=(1.0, 0.0, 0.0)):
    """A four-bar with its rod on two universals, one row more than is needed. Its crank's pivot is
    the origin.
    """
    hinges = [
        Revolute("pivot", "ground", "crank", ORIGIN, Z),
        Revolute("rest", "ground", "rocker", rest, Z),
    ]
    ends = [
        Universal("pin", "crank", "rod", pin, (across, Z)),
        Universal("end", "rod", "rocker", meet, (Z, across)),
    ]
    bodies = [Body("crank"), Body("rod"), Body("rocker")]
    return Mechanism(
        "loop",
        bodies,
        [*hinges, *ends],
        [Point("meet", "rocker", meet)],
        [JointAngle("turn", "pivot")],
    )


def revolute_loop(pin, meet, rest):
    """All on hinges, three rows more than are needed."""
    at = {"pivot": ORIGIN, "pin": pin, "end": meet, "rest": rest}
    pairs = zip(
        ("ground", "crank", "rod", "ground"), ("crank", "rod", "rocker", "rocker"), strict=True
    )
    hinges = [Revolute(name, *pair, at[name], Z) for name, pair in zip(at, pairs, strict=True)]
    bodies = [Body("crank"), Body("rod"), Body("rocker")]
    return Mechanism(
        "loop", bodies, hinges, [Point("meet", "rocker", meet)], [JointAngle("turn", "pivot")]
    )


# and nearly parallelograms: pin, end of the rod, rest of the rocker, last turn, samples
NEARLY_KITES = {
    "kite": (
        (0.4260866094025061, 0.09610141632702796),
        (0.05330114251731225, 0.32373794595045846),
        1.0098026454771485,
        -5.6167,
        73,
    ),
    "kite that folds": (
        (-0.9963803731629649, -0.5891443362735412),
        (0.061853652076719, 0.016510422670654),
        1.2192612306465147,
        4.1357,
        25,
    ),
    "never locks": (
        (0.9697033471070498, -0.3443453141456345),
        (0.6073751573486417, -1.3075254632217728),
        1.7110737849494355,
        -6.2769,
        19,
    ),
    "locks": (
        (0.407187255644269, -0.06317054565251659),
        (1.4280674729874876, -0.0631734360870428),
        1.0208806657722926,
        3.2062,
        13,
    ),
    "turns unseen": (
        (-0.8114361531517722, 0.4497902962488659),
        (0.11192415924912638, 0.5400567995235857),
        1.3589039496745472,
        3.4404473351597655,
        7,
    ),
    "twisted": (
        (0.6286049409194256, -0.008145844979201),
        (2.1516027678897336, -0.008643655436957),
        1.5230044750512732,
        -4.8815,
        7,
    ),
}


def side_of_the_line(pin, rest, turn, found):
    """By its sign on which side of the line from the pin to the rocker's pivot the rod's end is:
    there it stays.
    """
    (x, y), cos, sin = pin, np.cos(turn), np.sin(turn)
    across = np.stack([rest - (x * cos - y * sin), -(x * sin + y * cos)], axis=-1)
    d = found.points["meet"].position[:, :2] - (np.array([rest, 0.0]) - across)
    return across[:, 0] * d[:, 1] - across[:, 1] * d[:, 0]


STYLES = ["native", "paper", "conventional", "mixed", "relative"]


# Each kite with both linkages, and with three of the styles, two of which are always the native and
# the relative one.
CHOSEN = [
    (name, (universal_loop, revolute_loop)[(row + column) % 2], style)
    for row, name in enumerate(NEARLY_KITES)
    for column, style in enumerate(("native", STYLES[1 + row % 3], "relative"))
]


@pytest.mark.parametrize(("name", "made", "style"), CHOSEN)
def test_chosen_rows_do_not_hide_corner(name, made, style):
    """A determinant of rows chosen from more changes its sign by a singular pose, and by one of the
    choice; not by both.
    """
    (x, y), meet, rest, last, count = NEARLY_KITES[name]
    turn = np.linspace(0.0, last, count)
    found = solve(
        made((x, y, 0.0), (*meet, 0.0), (rest, 0.0, 0.0)), "turn", turn, order=0, style=style
    )
    side = side_of_the_line((x, y), rest, turn, found)
    assert (side[found.solved] * side[0] > 0.0).all()
    assert found.solved.all() or "there is a singular pose ahead" in found.message
    assert found.solved.sum() >= 3


@pytest.mark.parametrize(
    ("made", "beside", "style"),
    latin([universal_loop, revolute_loop], [1e-2, -3e-3, 1e-3], ["native", "relative"]),
)
def test_nearly_singular_kite_exchanges_rows(made, beside, style):
    """Those that were chosen at design depend on each other where it lies flat, or so nearly that
    it cannot be told from that.
    """
    start, turn = np.float64(-1.5), np.linspace(0.0, 3.3, 31)
    mechanism = made(
        tuple(pin(start).tolist()),
        tuple(corner(start, beside, 1.2, 1.2).tolist()),
        (1.0 - beside, 0.0, 0.0),
    )
    found = solve(mechanism, "turn", turn, style=style, order=0)
    assert found.solved.all(), found.message
    assert np.abs(
        found.points["meet"].position - corner(start + turn, beside, 1.2, 1.2)
    ).max() <= 1e-13 / abs(beside)


# every count with the native style and another one
@pytest.mark.parametrize(
    ("count", "style"),
    [
        (count, style)
        for k, count in enumerate([4, 7, 8, 10, 12, 15])
        for style in ("native", STYLES[1 + k % 4])
    ],
)
def test_small_loop_does_not_hide_corner(count, style):
    """Its singular values are the smaller ones all the way round, but where the large one folds."""
    x, y, rest, end = (
        -0.35245745516404536,
        -0.7148047631848835,
        2.802282190370843,
        (2.175441305403854, 0.49218148289661845),
    )
    large = universal_loop(
        (x, y, 0.0), (*end, 0.0), (rest, 0.0, 0.0), (np.cos(1.345), np.sin(1.345), 0.0)
    )
    pin, meet = (
        (-0.023472379164771337, -0.0056469601124647896, 0.0),
        (0.0017654205974588259, 0.11112362657419883, 0.0),
    )
    joints = [
        Revolute(
            "small rest", "ground", "small", (0.12433883023528294, 0.04634680743282863, 0.0), Z
        ),
        Distance("small rod", "crank", "small", (pin, meet)),
    ]
    both = replace(large, bodies=[*large.bodies, Body("small")], joints=[*large.joints, *joints])
    turn = np.linspace(0.0, 5.0379839, count)
    found = solve(both, "turn", turn, order=0, style=style)
    assert found.solved.all(), found.message
    side = side_of_the_line((x, y), rest, turn, found)
    assert (side * side[0] > 0.0).all()
