"""Mechanisms: what is refused, their topology, and formulas of freedoms."""

import pickle
import random
import re
from dataclasses import replace

import numpy as np
import pytest
from kincheck import (
    Body,
    Cylindrical,
    Distance,
    Fixed,
    Gear,
    Joint,
    JointAngle,
    Mechanism,
    MechanismError,
    PerpendicularAxes,
    Point,
    PointCoordinate,
    Ramp,
    Revolute,
    Screw,
    Spherical,
    Table,
    Universal,
    UnknownNameError,
    clear_caches,
    solve,
)
from kincheck.core.mechanism.loads import TorsionSpringDamper
from kincheck.core.mechanism.tree import spanning_tree
from kincheck.core.studies.checks.check_joint import specimens_of

from ..support.mechanisms import ORIGIN, X


def rssr(held=tuple):
    """An RSSR linkage of points held in tuples, lists or arrays."""
    return Mechanism(
        "rssr",
        [Body("crank", held((0.1, 0.2, 0.3)), held((1.0, 0.0, 0.0, 0.0))), Body("rocker")],
        [
            Revolute("input", "ground", "crank", held(ORIGIN), held((0.0, 0.0, 1.0))),
            Revolute("output", "ground", "rocker", held((2.0, 1.0, 3.0)), held(X)),
            Distance("rod", "crank", "rocker", held([held(X), held((2.0, 4.9, 2.2))])),
        ],
        [Point("end", "rocker", held((2.0, 4.9, 2.2)))],
        [JointAngle("turn", "input")],
    )


@pytest.mark.parametrize("held", [list, np.array])
def test_mechanism_of_lists_and_arrays(held):
    assert rssr(held) == rssr()
    assert hash(rssr(held)) == hash(rssr())
    assert repr(rssr(held)) == repr(rssr())  # plain numbers all
    turn = np.linspace(0.0, 1.0, 5)
    expected = solve(rssr(), "turn", turn).points["end"].acceleration.copy()
    clear_caches()
    np.testing.assert_array_equal(
        solve(rssr(held), "turn", turn).points["end"].acceleration, expected
    )
    assert PointCoordinate("lift", "end", held((0.0, 0.0, 1.0))) == PointCoordinate(
        "lift", "end", (0.0, 0.0, 1.0)
    )
    assert Table(held([0.0, 1.0]), held([0.0, 2.0])) == Table((0.0, 1.0), (0.0, 2.0))
    assert Gear("gear", ["input", "output"], ratio=2.0) == Gear(
        "gear", ("input", "output"), ratio=2.0
    )


def test_mechanism_copies_mutable_arrays():
    place = np.array([2.0, 4.9, 2.2])
    point = Point("end", "rocker", place)
    place[:] = 0.0
    assert point.position == (2.0, 4.9, 2.2)


WRONG = [
    (
        lambda: Revolute("a", "b", "c", (1, 2), (0, 0, 1)),
        "joint 'a' (revolute): point is (1, 2), expected a point",
    ),
    (lambda: Distance("a", "b", "c", (1, 2, 3)), "points is (1, 2, 3), expected two points"),
    (lambda: Body("b", (0, 0, 0, 1)), "body 'b': origin is (0, 0, 0, 1), expected a point"),
    (
        lambda: PointCoordinate("d", "end", (0, 1)),
        "driver 'd': direction is (0, 1), expected a direction",
    ),
    (
        lambda: Body("b", (0, np.nan, 0)),
        "body 'b': origin = (0, nan, 0) is not finite; give a point",
    ),
    (
        lambda: Point("P", "b", ("1", "2", "3")),
        "position = ('1', '2', '3') is not finite; give a point",
    ),
    (
        lambda: Revolute("a", "b", "c", ORIGIN, (0, 0, 1e-200)),
        "axis has length 1e-200, whose square",
    ),
    (lambda: PointCoordinate("d", "P", ORIGIN), "driver 'd': direction is zero"),
    (lambda: Ramp("a"), "ramp motion: rate is 'a'; give a finite number"),
    (
        lambda: Revolute("a", "b", "c", ORIGIN, None),
        "joint 'a' (revolute): axis is None, expected a direction",
    ),
    (
        lambda: Distance("a", "b", "c", (ORIGIN, (0.4, 0, 0)), -4.0),
        (
            "length is -4 m, expected a positive one; the points are 0.4 m apart at design, which"
            " is the length where none is given"
        ),
    ),
    (
        lambda: Distance("a", "b", "c", (ORIGIN, (0.4, 0, 0)), 0.0),
        "length is 0 m, expected a positive one",
    ),
    (lambda: Distance("a", "b", "c", (X, X), 2.0), "the points coincide at design"),
    (
        lambda: PerpendicularAxes("a", "b", "c", (X, (0.02, 1, 0))),
        "joint 'a' (perpendicular_axes): the axes are not perpendicular, the cosine of their angle"
        " is 0.02",
    ),
    (
        lambda: Universal("a", "b", "c", ORIGIN, (X, (-0.02, 1, 0))),
        "joint 'a' (universal): the axes are not perpendicular, the cosine of their angle is -0.02",
    ),
    (
        lambda: Screw("a", "b", "c", ORIGIN, (0, 0, 1), None),
        "joint 'a' (screw): lead is None, expected a length",
    ),
    (
        lambda: Revolute("a", "b", "c", np.zeros((3, 1)), (0, 0, 1)),
        "point = ([0.0], [0.0], [0.0]) is not",
    ),
    (
        lambda: Screw("a", "b", "c", ORIGIN, (0, 0, 1), [1.0]),
        "lead = [1.0] is not finite; give a length",
    ),
    (lambda: Gear("g", ("a", "b"), ratio=np.array(1 + 2j)), "ratio = (1+2j) is not finite"),
    (
        lambda: Ramp(np.complex128(0.1 + 5j)),
        "ramp motion: rate is np.complex128(0.1+5j); give a finite number",
    ),
    (
        lambda: Table((0.0, 1.0), ("a", 1.0)),
        "table motion: a time or value is not finite; give numbers",
    ),
    (
        lambda: Table((0.0, 1.0), None),
        "table motion: values is None, expected as many numbers as samples",
    ),
]


@pytest.mark.parametrize(("make", "message"), WRONG, ids=[message for _, message in WRONG])
def test_description_of_wrong_kind_is_refused(make, message):
    with pytest.raises(MechanismError, match=re.escape(message)):
        make()


@pytest.mark.parametrize("given", [None, "abcd", 1.0, X, (float("nan"), 0.0, 0.0, 0.0)], ids=str)
def test_bad_euler_parameters_are_refused(given):
    with pytest.raises(MechanismError, match="body 'a': euler_parameters"):
        Body("a", euler_parameters=given)


def test_scalar_array_becomes_number():
    """It may change, and has no hash."""
    lead, ratio = np.array(0.5), np.array([2.0])
    screw, gear = (
        Screw("a", "b", "c", ORIGIN, (0, 0, 1), lead),
        Gear("g", ("a", "b"), ratio=ratio),
    )
    lead[...] = ratio[...] = 7.0
    assert (screw.lead, gear.ratio) == (0.5, 2.0)
    assert hash(screw) == hash(Screw("a", "b", "c", ORIGIN, (0, 0, 1), 0.5))


def held(*joints, drivers=(), couplers=()):
    """A crank on a bed, and joints between the bed and the bench, which are both fixed."""
    bodies = [Body("bed", fixed=True), Body("bench", (1.0, 2.0, 3.0), fixed=True), Body("crank")]
    pivot = Revolute("pivot", "bed", "crank", ORIGIN, (0.0, 0.0, 1.0))
    tip = Point("tip", "crank", X)
    return Mechanism(
        "held", bodies, [*joints, pivot], [tip], [JointAngle("turn", "pivot"), *drivers], couplers
    )


@pytest.mark.parametrize(
    "name",
    sorted(
        name for name, kind in Joint.registry.items() if kind.__module__.startswith("kincheck.")
    ),
)
def test_joint_between_fixed_bodies_is_grounded(name):
    (joint,) = (
        replace(each, i="bed", j="bench")
        for each in specimens_of(Joint.registry[name], np.random.default_rng(1), 1)
    )
    mechanism = held(joint)
    assert mechanism.joints == held().joints
    assert mechanism.grounded == (joint,)
    assert replace(mechanism, name="again").grounded == (joint,)
    freed = replace(mechanism, bodies=[Body("bed", fixed=True), Body("bench"), Body("crank")])
    assert (freed.joints, freed.grounded) == ((*held().joints, joint), ())
    found, expected = (
        each.points["tip"]
        for each in (solve(each, "turn", [0.0, 1.0]) for each in (mechanism, held()))
    )
    np.testing.assert_array_equal(found.position, expected.position)


def test_grounded_joint_conflicts_are_refused():
    apart = (ORIGIN, (0.4, 0.0, 0.0))
    assert held(Distance("rod", "bed", "ground", apart, 0.4 + 1e-10)).grounded
    with pytest.raises(
        MechanismError,
        match=(
            r"joint 'rod' \(distance\): 'bed' and 'ground' are both fixed, and at the design .* off"
            r" by 0.1"
        ),
    ):
        held(Distance("rod", "bed", "ground", apart, 0.5124))
    hinge = Revolute("hinge", "ground", "bench", ORIGIN, (0.0, 0.0, 1.0))
    with pytest.raises(
        MechanismError,
        match="'bench' are both fixed, and driver 'd' needs it to move; free one of them",
    ):
        held(hinge, drivers=[JointAngle("d", "hinge")])
    with pytest.raises(
        MechanismError, match=r"are both fixed, and joint 'g' \(gear\) needs it to move"
    ):
        held(hinge, couplers=[Gear("g", ("pivot", "hinge"), ratio=2.0)])
    with pytest.raises(MechanismError, match="the name 'pivot' is used more than once"):
        held(replace(hinge, name="pivot"))


@pytest.mark.parametrize("kind", ["body", "joint", "point", "driver", "force"])
def test_unknown_name_suggests_similar(kind):
    """It is a KeyError too, as of any mapping."""
    mechanism = Mechanism(
        "arm",
        [Body("turned", mass=1.0)],
        [Revolute("turns", "ground", "turned", ORIGIN, (0.0, 0.0, 1.0))],
        [Point("turning", "turned", X), Point("~hidden", "turned", ORIGIN)],
        [JointAngle("turn", "turns")],
        forces=[TorsionSpringDamper("turner", "turns", 1.0, 0.0)],
    )
    known = {"body": "turned", "joint": "turns", "point": "turning", "driver": "turn"}
    meant = known.get(kind, "turner")
    assert getattr(mechanism, kind)(meant).name == meant
    what = "force element" if kind == "force" else kind
    with pytest.raises(UnknownNameError) as caught:
        getattr(mechanism, kind)(meant[:-1])
    assert str(caught.value) == f"there is no {what} {meant[:-1]!r}; did you mean {meant!r}?"
    assert isinstance(caught.value, KeyError)
    with pytest.raises(UnknownNameError, match=f"there is no {what} '3'"):
        getattr(mechanism, kind)(3)
    with pytest.raises(UnknownNameError) as caught:
        getattr(mechanism, kind)("xyz")
    assert "~" not in str(caught.value)
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


def test_pickled_mechanism_holds_fields_only():
    bodies = [Body("turned")]
    mechanism = Mechanism("arm", bodies, [Revolute("pivot", "ground", "turned", ORIGIN, (0, 0, 1))])
    packed = pickle.dumps(mechanism)
    assert hash(mechanism) == hash(replace(mechanism))
    assert mechanism.moving  # kept for the next question
    assert pickle.dumps(mechanism) == packed  # programs on disk are found by it
    assert pickle.loads(packed) == mechanism != replace(mechanism, name="leg")


def test_unknown_name_in_mechanism_queries():
    mechanism = Mechanism("arm", [Body("turned")], [], [], [])
    for asked in (mechanism.is_fixed, mechanism.design_value):
        with pytest.raises(UnknownNameError, match="there is no"):
            asked("tuned")


# The spanning tree against a search through all joints at every step


Z = (0.0, 0.0, 1.0)


def searched(mechanism):
    """Parent, child and joint of every branch: at each step the first of the best joints that lead
    out of the tree.
    """
    named = {driver.joint for driver in mechanism.drivers} | {
        name for each in mechanism.couplers for name in each.joints
    }
    placed = {"ground"} | {body.name for body in mechanism.bodies if body.fixed}
    waiting = [body.name for body in mechanism.moving]
    found = []
    while waiting:
        reaching = [
            joint
            for joint in mechanism.joints
            if joint.rows >= 3 and (joint.i in placed) != (joint.j in placed)
        ]
        best = max(reaching, key=lambda joint: (joint.name in named, joint.rows), default=None)
        parent, child = (
            ("ground", waiting[0])
            if best is None
            else best.bodies
            if best.i in placed
            else best.bodies[::-1]
        )
        placed.add(child)
        waiting.remove(child)
        found.append(("ground" if mechanism.is_fixed(parent) else parent, child, best))
    return found


def scrambled(seed):
    """Bodies, some fixed, with joints of all ranks between any two; parts may hang together loosely
    or not at all.
    """
    pick = random.Random(seed)
    bodies = [Body(f"b{k}", fixed=pick.random() < 0.15) for k in range(pick.randint(1, 14))]
    still = {"ground", *(body.name for body in bodies if body.fixed)}
    point = (0.1, 0.2, 0.3)
    joints = []
    for k in range(pick.randint(0, 25)):
        i, j = pick.choices(["ground", *(body.name for body in bodies)], k=2)
        if i != j and not {i, j} <= still:
            kinds = [
                (Revolute, point, Z),
                (Spherical, point),
                (Distance, (point, Z)),
                (Cylindrical, point, Z),
                (Fixed,),
            ]
            kind, *geometry = pick.choice(kinds)
            joints.append(kind(f"j{k}", i, j, *geometry))
    turning = [joint.name for joint in joints if isinstance(joint, Revolute | Cylindrical)]
    pick.shuffle(turning)
    drivers = [JointAngle("turn", name) for name in turning[:1]]
    couplers = [Gear("gear", tuple(turning[1:3]), 2.0)] if len(turning) > 2 else []
    return Mechanism("scrambled", bodies, joints, (), drivers, couplers)


@pytest.mark.parametrize("seed", range(60))
def test_spanning_tree_equals_full_search(seed):
    mechanism = scrambled(seed)
    tree = spanning_tree(mechanism)
    assert [(branch.parent, branch.child, branch.joint) for branch in tree.branches] == searched(
        mechanism
    )
    used = {branch.joint.name for branch in tree.branches if branch.joint is not None}
    assert [joint.name for joint in tree.cut] == [
        joint.name for joint in mechanism.joints if joint.name not in used
    ]
