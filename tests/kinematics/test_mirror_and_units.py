"""One motion in a mirror, far away, in other units, at other samples, by other names."""

import json
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from kincheck import RackPinion, Screw, adapters
from kincheck.core.case.io.case_file import load_case
from kincheck.core.case.joint_probe import probes
from kincheck.core.joints import Follower

from ..support.mechanisms import four_bar, mcpherson, placed, slider_crank
from .test_equivalence import LIMITS, NATIVE, STROKES, TURNS, assert_same, motion

# Worlds


def mirrored(mechanism):
    """The mechanism in a mirror, y -> -y: what turns right turns left."""

    def seen(a):
        return tuple(np.multiply(a, (1.0, -1.0, 1.0)).tolist())

    m = placed(mechanism, seen, seen)
    # an axis keeps its place and sense along itself, so a turn about it changes its sign, and what
    # ties a turn to a slide
    joints = [
        replace(joint, lead=-joint.lead) if isinstance(joint, Screw) else joint
        for joint in m.joints
    ]
    couplers = [
        replace(each, radius=-each.radius)
        if isinstance(each, RackPinion)
        else each.in_units(1.0, -1.0)
        if isinstance(each, Follower)
        else each
        for each in m.couplers
    ]
    bodies = [
        replace(b, euler_parameters=tuple(np.multiply(b.euler_parameters, (1.0, -1.0, 1.0, -1.0))))
        for b in m.bodies
    ]
    return replace(m, joints=joints, couplers=couplers, bodies=bodies)


@pytest.mark.parametrize("engine", adapters.ENGINES)
def test_mirrored_strut_in_every_engine(engine):
    found = motion(mirrored(mcpherson()), STROKES, engine)
    assert_same(found * (1.0, -1.0, 1.0), motion(mcpherson(), STROKES), LIMITS[engine])


@pytest.mark.by_day(3)
@pytest.mark.parametrize("case", probes(), ids=lambda each: each.name)
def test_mirrored_joints(case):
    """A turn backwards: the velocity changes its sign once more."""
    turns = np.linspace(-0.4, 0.4, 9)
    found, expected = motion(mirrored(case.mechanism), -turns), motion(case.mechanism, turns)
    # sums in another order: round-off over the smallest pivot of a probe, once more for each
    # derivative
    limits = 2.2e-16 * np.array([50.0, 50.0**2, 50.0**3])
    assert_same(
        found * (1.0, -1.0, 1.0) * np.array([1.0, -1.0, 1.0])[:, None, None], expected, limits
    )


FAR = np.array([1000.0, -1000.0, 500.0])


@pytest.mark.parametrize("engine", adapters.ENGINES)
@pytest.mark.parametrize(
    ("mechanism", "values"),
    [(mcpherson(), STROKES), (four_bar(), TURNS)],
    ids=["strut", "four_bar"],
)
def test_motion_kilometre_away(mechanism, values, engine):
    """Every hardpoint is rounded at 1.1e-13 m there, and so is every sum that a simulator makes of
    them.
    """
    found = motion(placed(mechanism, lambda point: tuple((FAR + point).tolist())), values, engine)
    found[0] -= FAR
    assert_same(found, motion(mechanism, values), 1000.0 * NATIVE + LIMITS[engine])


LENGTHS = ("origin", "point", "points", "position", "length", "atol")


@pytest.mark.parametrize(("name", "swept"), [("mcpherson_strut", 1e3), ("rssr", np.pi / 180.0)])
def test_case_in_other_units(name, swept, tmp_path):
    """The strut is in metres, the RSSR in metres and degrees; both once more in millimetres and
    radians.
    """
    file = Path(__file__).parents[2] / "cases" / f"{name}.toml"
    tables = tomllib.loads(file.read_text("utf-8"))
    for entry in (
        each
        for table in ("bodies", "joints", "points", "outputs")
        for each in tables[table].values()
    ):
        # a point may be a name
        lengths = {key for key in LENGTHS if not isinstance(entry.get(key, ""), str)}
        entry |= {key: np.multiply(1e3, entry[key]).tolist() for key in lengths}
    tables["sweep"] |= {key: swept * tables["sweep"][key] for key in ("start", "stop", "rate")}
    tables["units"] = {"length": "mm"}
    tables.pop("reference", None)
    (tmp_path / "case.json").write_text(json.dumps(tables))
    one, other = load_case(file), load_case(tmp_path / "case.json")
    assert other.sweep.rate == pytest.approx(one.sweep.rate, rel=1e-15)
    # numbers of the RSSR are up to 5.5 m, and it turns by up to 6.3 rad
    assert_same(
        motion(other.mechanism, other.sweep.change),
        motion(one.mechanism, one.sweep.change),
        6.0 * NATIVE,
    )


# Samples


@pytest.mark.parametrize("engine", adapters.ENGINES)
@pytest.mark.parametrize(
    ("mechanism", "values"),
    [(mcpherson(), STROKES), (slider_crank(), TURNS)],
    ids=["strut", "slider_crank"],
)
def test_samples_do_not_depend_on_order(mechanism, values, engine):
    once = motion(mechanism, values, engine)
    assert_same(motion(mechanism, values[::-1], engine)[:, ::-1], once, LIMITS[engine])
    twice = np.linspace(values[0], values[-1], 2 * len(values) - 1)
    assert_same(motion(mechanism, twice, engine)[:, ::2], once, LIMITS[engine])
