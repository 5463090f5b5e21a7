"""Equilibria against closed forms, energies and a strut that six simulators agree on.

tests/data/elastokinematics has the numbers, and where they come from.
"""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from kincheck import (
    GROUND,
    Body,
    Cylindrical,
    JointAngle,
    Mechanism,
    Point,
    PointCoordinate,
    Revolute,
    SolveError,
    Translational,
    cases,
)
from kincheck.core.extensions.statics.equations import with_free_coordinates
from kincheck.core.extensions.statics.equilibrium import StaticModel
from kincheck.core.mechanism.loads import Bushing, SpringDamper, TorsionSpringDamper
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq, minimize_scalar

from ...oracles.naive import tilde
from ...support.mechanisms import ORIGIN, X, Y, Z

DATA = Path(__file__).parents[2] / "data" / "elastokinematics"


def read(name):
    return json.loads((DATA / name).read_text())


def bushing_of(facts, name, i, j, factor=1.0, turning=1.0):
    """Return a bushing of the data, its stiffness times factors."""
    return Bushing(
        name,
        i,
        j,
        facts["point"],
        facts["axes"][:2],
        tuple(factor * k for k in facts["stiffness"]),
        tuple(turning * k for k in facts["turning_stiffness"]),
    )


def three(facts):
    every = enumerate(facts["bushings"])
    return [bushing_of(each, f"b{k}", GROUND, "block") for k, each in every]


def block(bushings):
    return StaticModel(
        Mechanism("block", [Body("block")], [], forces=bushings), [Point("o", "block", ORIGIN)]
    )


def compliance(found, load="o", body="block", point=ORIGIN):
    return found.motion(found.by_load[load][0], body, point)


def test_compliance_is_inverse_bushing_stiffness():
    """C = (sum S^T K S)^-1 at zero load."""
    facts = read("1_body_on_three_bushings.json")
    bushings = three(facts)
    stiffness = np.zeros((6, 6))
    for each in bushings:
        axes, S = np.array(each.triad), np.eye(6)
        S[:3, 3:] = tilde(each.point).T
        own = np.zeros((6, 6))
        own[:3, :3] = axes.T @ np.diag(each.stiffness) @ axes
        own[3:, 3:] = axes.T @ np.diag(each.turning_stiffness) @ axes
        stiffness += S.T @ own @ S
    expected = np.linalg.inv(stiffness)
    loads = np.array([[0.0] * 6, facts["finite_load"]])
    found = block(bushings).solve({"o": loads}, {})
    C = compliance(found)
    assert np.abs(C[0] - expected).max() <= 4e-15 * np.abs(expected).max()
    assert np.abs(C[0] - C[0].T).max() <= 1e-14 * np.abs(C[0]).max()
    assert np.abs(C[1] - C[1].T).max() > 1e-6 * np.abs(C[1]).max()  # the load is not at zero torque
    assert found.place("block", ORIGIN)[1] == pytest.approx(facts["displacement"], abs=1e-17)
    assert found.bodies["block"].p[1] == pytest.approx(facts["euler_parameters"], abs=1e-15)


ARM = Mechanism("arm", [Body("arm")], [Revolute("hinge", GROUND, "arm", ORIGIN, Z)])
STOP = ((-0.1, -100.0), (0.0, 0.0), (0.1, 100.0), (0.1001, 120.0), (0.2, 18100.0))
PROGRESSIVE = PchipInterpolator(*np.array(STOP).T)


ELEMENTS = {
    # k sin(th) = F a cos(th)
    "torsion": (
        Bushing("t", GROUND, "arm", ORIGIN, turning_stiffness=(0.0, 0.0, 500.0)),
        300.0,
        math.atan(300.0 * 0.4 / 500.0),
    ),
    # k b sin(th) b cos(th) = F a cos(th)
    "side": (
        Bushing("s", GROUND, "arm", (0.25, 0.0, 0.0), stiffness=(0.0, 2e5, 0.0)),
        8000.0,
        math.asin(8000.0 * 0.4 / (2e5 * 0.25**2)),
    ),
    # k th = F a cos(th)
    "coil": (
        TorsionSpringDamper("c", "hinge", 500.0),
        900.0,
        brentq(lambda x: 500.0 * x - 900.0 * 0.4 * math.cos(x), 0.0, 1.5, xtol=1e-15),
    ),
    # progressive(b sin(th)) b cos(th) = F a cos(th), beyond the stop at 0.1 m
    "stop": (
        Bushing("b", GROUND, "arm", (0.25, 0.0, 0.0), curve=((), STOP, ())),
        400.0,
        math.asin(brentq(lambda x: PROGRESSIVE(x) * 0.25 - 160.0, 0.0, 0.2, xtol=1e-16) / 0.25),
    ),
}


@pytest.mark.parametrize("name", ELEMENTS)
def test_equilibrium_angle_of_loaded_arm(name):
    element, load, angle = ELEMENTS[name]
    model = StaticModel(replace(ARM, forces=[element]), [Point("tip", "arm", (0.4, 0.0, 0.0))])
    found = model.solve({"tip": np.array([[0.0, load, 0.0, 0.0, 0.0, 0.0]])}, {})
    assert found.reached.all()
    x, y, _ = found.direction("arm", X)[0]
    assert math.atan2(y, x) == pytest.approx(angle, abs=1e-14)


def test_load_at_elastic_centre_only_translates():
    places = [(0.3, 0.0, 0.0), (-0.3, 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, -0.3, 0.0)]
    bushings = [
        Bushing(f"b{k}", GROUND, "block", place, stiffness=(1e5, 2e5, 3e5), turning_stiffness=10.0)
        for k, place in enumerate(places)
    ]
    load = np.array([[5e4, -3e4, 2e4, 0.0, 0.0, 0.0]])
    found = block(bushings).solve({"o": load}, {})
    assert found.place("block", ORIGIN)[0] == pytest.approx([0.125, -0.0375, 1.0 / 60.0], abs=1e-16)
    assert found.bodies["block"].p[0] == pytest.approx([1.0, 0.0, 0.0, 0.0], abs=1e-16)


@pytest.mark.parametrize(
    ("a", "h", "stiffness", "side"),
    [
        ((0.103, 0.416), 0.1725, (52700.0, 316.0), 6280.0),
        ((0.636, 0.0805), 0.244, (5e5, 3e6), 0.0),
        ((0.3, 0.3), 0.06, (1e5, 1e5), 0.0),
    ],
    ids=["steep", "uneven", "flat"],
)
def test_load_beyond_snap_through_is_refused(a, h, stiffness, side):
    """The stiffness is as much before as behind, so its sign alone tells nothing. A second body
    on a soft spring, which moves more, bears the load.
    """
    at, top = (0.0, 0.0, h), (0.0, 0.0, h + 0.3)

    def force(z):
        pulls = (
            k * (math.hypot(x, z) - math.hypot(x, h)) * z / math.hypot(x, z)
            for x, k in zip(a, stiffness, strict=True)
        )
        return -sum(pulls) + side * (h - z)

    limit = -minimize_scalar(lambda z: -force(z), bounds=(0.0, h), method="bounded").fun
    ends = [(a[0], 0.0, 0.0), (-a[1], 0.0, 0.0)]
    springs = [
        SpringDamper(f"s{end}", "slider", GROUND, (at, end), k)
        for end, k in zip(ends, stiffness, strict=True)
    ]
    soft = (0.0, 0.0, limit / 0.05)
    forces = [*springs, Bushing("soft", "slider", "top", at, stiffness=soft)]
    forces.append(SpringDamper("side", "slider", GROUND, (at, (0.0, 0.0, h + 1.0)), side))
    bodies = {"slider": at, "top": top}
    guides = [Translational(f"{x} guide", GROUND, x, bodies[x], Z) for x in bodies]
    mechanism = Mechanism("snap", [Body(*x) for x in bodies.items()], guides, forces=forces)
    factors = np.array([0.3, 0.99, 1.01, 1.5, 7.0, 30.0, 100.0])
    loads = np.zeros((len(factors), 6))
    loads[:, 2] = -factors * limit
    for body, place in bodies.items():
        found = StaticModel(mechanism, [Point("p", body, place)]).solve({"p": loads}, {})
        assert found.reached.tolist() == [x < 1.0 for x in factors]
        assert (found.share * factors)[2:] == pytest.approx([1.0] * 5, rel=1e-8)
        heights = found.place("slider", at)[:2, 2]
        assert [force(z) for z in heights] == pytest.approx([0.3 * limit, 0.99 * limit], rel=1e-9)
        with pytest.raises(SolveError, match=r"no equilibrium at 1\.01.*last is at 1\.00.*snap"):
            found.require_reached(lambda k, share: f"{share * factors[k]:.2f}")


def strut(factor=1.0, turning=1.0, rigid=False):
    facts = read("5_strut_kc.json")
    given = cases.load("mcpherson_strut_loaded").mechanism
    if rigid:
        soft, bushings = (), []
    else:
        soft = ("lca_pivot", "strut_top")
        bushings = [
            bushing_of(each, each["name"], *each["bodies"], factor, turning)
            for each in facts["bushings"]
        ]
    mechanism = replace(
        given,
        joints=[joint for joint in given.joints if joint.name not in soft],
        forces=[*given.forces, *bushings],
    )
    patch = tuple(facts["contact_patch"])
    return StaticModel(mechanism, [Point("patch", "knuckle", patch)]), facts


def test_strut_equilibrium_agrees_with_simulators():
    model, facts = strut()
    rows = facts["results"]
    loads = np.array([each["load_at_contact_patch"] for each in rows])
    found = model.solve({"patch": loads}, {"stroke": np.array([each["travel"] for each in rows])})
    expected = [each["wheel_center"] for each in rows]
    assert np.abs(found.place("knuckle", facts["wheel_center"]) - expected).max() <= 1e-15
    axes = [each["spin_axis"] for each in rows]
    assert np.abs(found.direction("knuckle", facts["spin_axis"]) - axes).max() <= 1e-14
    wheel = [each["wheel_load"] for each in rows]
    assert found.efforts["stroke"] == pytest.approx(wheel, abs=1e-10)
    patch = tuple(facts["contact_patch"])
    for C, each in zip(compliance(found, "patch", "knuckle", patch), rows, strict=True):
        given = np.array(each["compliance_contact_patch"])
        assert np.abs(C - given).max() <= 1e-14 * np.abs(given).max()


def test_equilibrium_blocks_equal_single_samples():
    """Samples are solved in blocks, whose programs keep nothing of those before."""
    model, _ = strut()
    loads, travel = np.zeros((700, 6)), np.linspace(-0.05, 0.05, 700)
    loads[:, 1] = np.linspace(3000.0, -3000.0, 700)
    found = model.solve({"patch": loads}, {"stroke": travel})
    for k in (0, 255, 256, 699):
        alone = model.solve({"patch": loads[k : k + 1]}, {"stroke": travel[k : k + 1]})
        assert found.efforts["stroke"][k] == pytest.approx(alone.efforts["stroke"][0], abs=1e-10)
        assert compliance(found, "patch", "knuckle")[k] == pytest.approx(
            compliance(alone, "patch", "knuckle")[0], abs=1e-17
        )
    resting = model.solve({}, {"stroke": travel[:1]})
    still = model.solve({"patch": np.zeros((1, 6))}, {"stroke": travel[:1]})
    assert resting.efforts["stroke"][0] == pytest.approx(still.efforts["stroke"][0], abs=1e-10)


def test_wheel_rate_is_wheel_load_derivative():
    model, _ = strut()
    travel, h = np.array([-0.03, 0.0, 0.04]), 1e-4
    loads = {"patch": np.zeros((3, 6))}
    found = model.solve(loads, {"stroke": travel})
    ends = [model.solve(loads, {"stroke": travel + x}).efforts["stroke"] for x in (h, -h)]
    expected = (ends[0] - ends[1]) / (2.0 * h)
    assert found.by_driver["stroke"][1][:, 0] == pytest.approx(expected, rel=1e-6)


def test_load_work_is_stored_energy():
    """Gauss's rule over the ramp; the energy is written down in terms of places alone."""
    facts = read("1_body_on_three_bushings.json")
    bushings = three(facts)
    load = 2.0 * np.array(facts["finite_load"])
    load[3:] = 0.0
    nodes, weights = np.polynomial.legendre.leggauss(8)
    shares = np.append(0.5 * (nodes + 1.0), 1.0)
    found = block(bushings).solve({"o": shares[:, None] * load}, {})
    C = compliance(found)[:8]
    work = 0.5 * np.sum(weights * shares[:8] * np.einsum("i,nij,j->n", load, C, load))
    energy = 0.0
    for each in bushings:
        moved = np.array(each.triad) @ (found.place("block", each.point)[-1] - each.point)
        turned = 2.0 * np.array(each.triad) @ found.bodies["block"].p[-1, 1:]
        energy += 0.5 * (each.stiffness @ moved**2 + each.turning_stiffness @ turned**2)
    assert work == pytest.approx(energy, rel=1e-13)


def test_unheld_body_is_named():
    bushing = Bushing(
        "soft", GROUND, "arm", ORIGIN, stiffness=1e5, turning_stiffness=(9.0, 9.0, 0.0)
    )
    mechanism = Mechanism("free", [Body("arm")], [], forces=[bushing])
    with pytest.raises(SolveError, match=r"'arm' turns about \[0, 0, 1\] freely.*'soft'"):
        StaticModel(mechanism)


def test_soft_upright_pendulum_is_unstable():
    def least(stiffness):
        mechanism = replace(
            ARM,
            bodies=[Body("arm", mass=2.0, center_of_mass=(0.0, 0.5, 0.0))],
            forces=[TorsionSpringDamper("coil", "hinge", stiffness)],
            gravity=(0.0, -10.0, 0.0),
        )
        model = StaticModel(mechanism, [Point("o", "arm", ORIGIN)])
        return model.solve({"o": np.zeros((1, 6))}, {}).unstable[0]

    assert least(10.5) == ""
    assert least(9.5) == "body 'arm' turns about [0, 0, 1]"


def test_driver_holding_nothing_is_refused():
    mechanism = replace(
        ARM,
        points=[Point("tip", "arm", (0.4, 0.0, 0.0))],
        drivers=[JointAngle("turn", "hinge"), PointCoordinate("push", "tip", Y)],
    )
    with pytest.raises(SolveError, match="driver 'push' holds nothing"):
        StaticModel(mechanism)


def test_free_coordinates_of_cylindrical_become_drivers():
    rod = Cylindrical("rod", GROUND, "arm", ORIGIN, Z)
    found = with_free_coordinates(replace(ARM, joints=[rod], drivers=[]))
    assert [each.name for each in found.drivers] == ["rod.rotation", "rod.translation"]
    held = with_free_coordinates(replace(ARM, joints=[rod], drivers=[JointAngle("turn", "rod")]))
    assert [each.name for each in held.drivers] == ["turn", "rod"]
