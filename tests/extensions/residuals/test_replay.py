"""Replay of motions from elsewhere: of ADAMS, of closed forms, and of plants in them.

ADAMS' data (source and licence in the data file) are of one body that hangs on one joint: phi, J v
- nu and J a - gamma of the right joint vanish within what was printed, those of a wrong one don't.
"""

from dataclasses import replace

import numpy as np
import pytest
from kincheck import (
    Body,
    Distance,
    Gear,
    JointAngle,
    Mechanism,
    Polynomial,
    Revolute,
    RevoluteSpherical,
    SolveError,
    Spherical,
    Translational,
    Universal,
    UnknownNameError,
    residuals,
    solve,
)

from ...oracles import naive
from ...support.adams_single_joints import CASES, NAMES, axes, right
from ...support.mechanisms import X, Y, four_bar

# The data have six significant digits, trailing zeros left out.
DIGITS = 6
# The decks name no integrator, and ADAMS' default holds the constraints on positions alone (index
# 3): velocities and accelerations satisfy theirs no better than it integrates. Measured, as parts
# of the largest of a case: 1.3e-5 and 1.1e-4.
INTEGRATED = {"velocity": 2e-5, "acceleration": 2e-4}
# A wrong joint has to be wrong beyond doubt: by this many limits, in its positions already.
BEYOND_DOUBT = 100.0

POSE, VELOCITY, ACCELERATION = slice(0, 7), slice(7, 13), slice(13, 19)


def half_widths(numbers):
    """Half a unit of the last digit of each number, and what the integrator adds to rates."""
    size = np.abs(numbers)
    first = np.floor(np.log10(np.where(size > 0.0, size, 1.0)))
    half = 0.5 * 10.0 ** (first - (DIGITS - 1)) * (size > 0.0)
    for part, share in ((VELOCITY, "velocity"), (ACCELERATION, "acceleration")):
        largest = [size[:, part][:, :3].max(), size[:, part][:, 3:].max()]  # shift and turn
        half[:, part] += INTEGRATED[share] * np.repeat(largest, 3)
    return half


def worst(name, joint):
    """The largest residuals of phi, velocity and acceleration, in what is allowed."""
    numbers = np.array(CASES[name]["samples"])[:, 1:]
    half = half_widths(numbers)
    A = np.array([naive.A(p / np.linalg.norm(p)) for p in numbers[:, 3:7]])
    for part in (slice(10, 13), slice(16, 19)):  # angular rates are global there
        numbers[:, part] = np.einsum("nji,nj->ni", A, numbers[:, part])
        half[:, part] = np.einsum("nji,nj->ni", np.abs(A), half[:, part])
    body = Body("body", tuple(numbers[0, :3]), tuple(numbers[0, 3:7]))
    parts = ({"body": numbers[:, each]} for each in (POSE, VELOCITY, ACCELERATION))
    found = residuals(Mechanism("m", [body], [joint]), *parts, digits={"body": half})
    # beside what is printed as zero there is round-off of numbers up to some hundred metres
    each = (found.worst(q, 1e-13) for q in ("position", "velocity", "acceleration"))
    return [one.value / one.allowed for one in each]


@pytest.mark.parametrize("name", CASES)
def test_replay_of_adams_joint(name):
    assert worst(name, right(CASES[name])) == pytest.approx([0.0, 0.0, 0.0], abs=1.0)


@pytest.mark.parametrize(
    "name", [name for name, case in CASES.items() if case["joint"] != "revolute_spherical"]
)
def test_replay_of_reversed_adams_joint(name):
    """With the body as the first one; a revolute-spherical joint would be another, with its hinge
    on the body.
    """
    assert worst(name, right(CASES[name]).reversed()) == pytest.approx([0.0, 0.0, 0.0], abs=1.0)


def wrong_joints(case):
    """Joints of the same type with other axes or points, and of types that leave less."""
    if case["joint"] in ("distance", "revolute_spherical"):
        ends = (case["ground_point"], case["body_point"])
        yield (
            "its points exchanged",
            type(right(case))(*NAMES, ends[::-1], *([case["axis"]] if "axis" in case else [])),
        )
        yield "a ball at its end", Spherical(*NAMES, ends[1])
        if case["joint"] == "distance":
            yield "a millimetre longer", Distance(*NAMES, ends, case["length"] + 1e-3)
        else:
            yield "along x", RevoluteSpherical(*NAMES, ends, X)
            yield "along y", RevoluteSpherical(*NAMES, ends, Y)
        return
    at, (x, y, z) = case["point"], axes(case)
    if case["joint"] in ("revolute", "translational", "cylindrical"):
        yield "along x", type(right(case))(*NAMES, at, x)
        yield "along y", type(right(case))(*NAMES, at, y)
    if case["joint"] in ("translational", "cylindrical"):
        yield "a revolute", Revolute(*NAMES, at, z)
    if case["joint"] in ("revolute", "cylindrical"):
        yield "a slider", Translational(*NAMES, at, z)
    if case["joint"] == "universal":
        yield "its axes exchanged", Universal(*NAMES, at, (y, x))
        yield "a revolute along x", Revolute(*NAMES, at, x)
        yield "a revolute along y", Revolute(*NAMES, at, y)
    if case["joint"] == "spherical":
        yield "elsewhere", Spherical(*NAMES, tuple(np.add(at, (0.0, 0.0, 1e-3))))
        for letter, axis in zip("xyz", (x, y, z), strict=True):
            yield f"a revolute along {letter}", Revolute(*NAMES, at, axis)
        for letters, pair in (("xy", (x, y)), ("yz", (y, z)), ("zx", (z, x))):
            yield f"a universal along {letters}", Universal(*NAMES, at, pair)


BLIND = {
    # the swing is about the joint frame's y, or about one of the two axes: what allows that is
    # right here
    "Spherical_Case01": {"a revolute along y", "a universal along xy", "a universal along yz"},
    "Universal_Case01": {"its axes exchanged", "a revolute along x"},
    "Universal_Case02": {"its axes exchanged", "a revolute along y"},
    # the body does not slide, or only falls, or rests
    "Cylindrical_Case01": {"a slider"},
    "Cylindrical_Case02": {"a revolute"},
    "Prismatic_Case03": {"along x", "along y", "a revolute"},
}
"""What a case cannot tell from its own joint; every other wrong joint must be found out."""

WRONG = [(name, what) for name, case in CASES.items() for what, _ in wrong_joints(case)]


@pytest.mark.parametrize(("name", "what"), WRONG)
def test_replay_finds_wrong_adams_joint(name, what):
    found = worst(name, dict(wrong_joints(CASES[name]))[what])
    if what in BLIND.get(name, ()):
        assert max(found) <= 1.0
    else:
        assert found[0] > BEYOND_DOUBT


def test_replay_blind_sides_are_tried():
    assert {(name, what) for name, found in BLIND.items() for what in found} <= set(WRONG)


# Closed loops, and plants in them


def moving(mechanism, values, rate=2.0, **options):
    """Poses, velocities and accelerations of all bodies on a sweep of the first driver."""
    names = [body.name for body in mechanism.moving]
    found = solve(mechanism, mechanism.drivers[0].name, values, rate=rate, bodies=names, **options)
    poses = {name: np.hstack([each.r, each.p]) for name, each in found.bodies.items()}
    return poses, *({n: getattr(b, k) for n, b in found.bodies.items()} for k in "va")


@pytest.fixture(scope="module")
def loop():
    mechanism = four_bar()
    return mechanism, *moving(mechanism, np.linspace(-0.6, 0.8, 41))


def test_replay_of_solved_loop(loop):
    found = residuals(*loop)
    for quantity in ("position", "velocity", "acceleration"):
        assert found.worst(quantity).value < 1e-13
    assert not found.not_judged
    assert set(found.joints) == {joint.name for joint in loop[0].joints}


def test_replay_names_planted_error(loop):
    mechanism, poses, *rates = loop
    body = mechanism.moving[1].name
    planted = {**poses, body: poses[body].copy()}
    planted[body][17, 1] += 1e-5
    found = residuals(mechanism, planted, *rates).worst("position", 1e-9)
    assert found.sample == 17
    assert body in found.bodies
    assert found.value == pytest.approx(1e-5, rel=0.6)
    assert found.joint in {j.name for j in mechanism.joints if body in j.bodies}


def test_replay_finds_wrong_rates(loop):
    mechanism, poses, v, a = loop
    slow = {name: 0.5 * each for name, each in v.items()}
    assert residuals(mechanism, poses, slow).worst("velocity").value < 1e-13
    assert residuals(mechanism, poses, slow, a).worst("acceleration").value > 0.1


def test_replay_of_some_bodies(loop):
    mechanism, poses, *_ = loop
    absent = mechanism.moving[2].name
    found = residuals(mechanism, {k: x for k, x in poses.items() if k != absent})
    touching = {j.name for j in mechanism.joints if absent in j.bodies}
    assert found.not_judged == dict.fromkeys(touching, absent)
    assert set(found.joints).isdisjoint(touching)
    assert found.worst("position").value < 1e-13


def test_replay_with_missing_sample(loop):
    mechanism, poses, v, a = loop
    body = mechanism.moving[0].name
    gap = {**poses, body: poses[body].copy()}
    gap[body][5] = np.nan
    found = residuals(mechanism, gap, v, a)
    assert found.worst("acceleration").value < 1e-13
    assert np.isnan(found.position[5]).any()
    assert np.isfinite(np.delete(found.position, 5, axis=0)).all()


GEAR = Gear("gear", ("hinge one", "hinge two"), -0.4)
CURVE = Polynomial("gear", ("hinge two", "hinge one"), (0.0, 0.5, 0.03))


def geared(coupler):
    bodies = [Body("one"), Body("two", origin=X)]
    hinges = [
        Revolute(f"hinge {b.name}", "ground", b.name, b.origin, (0.0, 0.1, 1.0)) for b in bodies
    ]
    drivers = [JointAngle("turn", "hinge one")]
    return Mechanism("geared", bodies, hinges, drivers=drivers, couplers=[coupler])


@pytest.mark.parametrize(
    ("right", "wrong"),
    [(GEAR, replace(GEAR, ratio=-0.41)), (CURVE, replace(CURVE, coefficients=(0.0, 0.5, 0.031)))],
    ids=["gear", "polynomial"],
)
def test_replay_judges_coupler_ratio(right, wrong):
    mechanism = geared(right)
    motions = moving(mechanism, np.linspace(-8.0, 8.0, 65))
    for quantity in ("position", "velocity", "acceleration"):
        assert residuals(mechanism, *motions).worst(quantity).value < 1e-12
    other = replace(mechanism, couplers=[wrong])
    for quantity in ("position", "velocity"):
        found = residuals(other, *motions).worst(quantity)
        assert found.joint == "gear"
        assert set(found.bodies) == {"one", "two"}


def test_replay_digits_match_changed_numbers(loop):
    """Compared with the same rows after each number is moved in truth."""
    mechanism, *motions = loop
    names = [body.name for body in mechanism.moving]
    rng = np.random.default_rng(4)
    half = {name: 1e-7 * rng.uniform(0.2, 1.0, (41, 19)) for name in names}
    found = residuals(mechanism, *motions, digits=half)
    base = residuals(mechanism, *motions)
    for quantity in ("position", "velocity", "acceleration"):
        total = 0.0
        for name in names:
            for k in range(19):
                which, column = (0, k) if k < 7 else (1, k - 7) if k < 13 else (2, k - 13)
                moved = [dict(each) for each in motions]
                moved[which][name] = moved[which][name].copy()
                moved[which][name][:, column] += half[name][:, k]
                change = getattr(residuals(mechanism, *moved), quantity)
                total = total + np.abs(change - getattr(base, quantity))
        assert found.allowed[quantity] == pytest.approx(total, rel=1e-4, abs=1e-12)


SHORT = np.zeros((41, 6))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"poses": {}}, "no pose"),
        ({"poses": {"nobody": np.zeros((2, 7))}}, "moving body"),
        ({"poses": {"crank": SHORT}}, r"poses of body .* have shape \(41, 6\), expected"),
        ({"accelerations": {"crank": SHORT}}, "accelerations need velocities"),
        ({"digits": {"crank": SHORT}}, "digits of body"),
    ],
    ids=["no pose", "unknown body", "shape", "no velocities", "digits"],
)
def test_replay_refuses_bad_arguments(loop, arguments, message):
    mechanism, poses, *_ = loop
    with pytest.raises((SolveError, UnknownNameError), match=message):
        residuals(mechanism, **({"poses": poses} | arguments))
