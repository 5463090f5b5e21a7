"""Forces of loops that close within the digits of a file: rigid bodies determine few of them."""

import json
from dataclasses import replace
from functools import partial
from io import StringIO
from itertools import product

import numpy as np
import pytest
from kincheck import CaseError, adapters, solve
from kincheck.core.case.io.case_file import case_text, load_case
from kincheck.core.case.quantity import with_markers
from kincheck.core.forces import Multipliers
from kincheck.core.harness.run import run
from kincheck.core.kinematics import NativeSolver
from kincheck.core.report.terminal import console

from ...oracles import naive
from ...support.engine_forces import Beside, every_force, values
from ...support.four_bar_within_digits import solved, truth, written
from ...support.written_again import written_again

TILTED = naive.A(np.array([0.8, 0.36, 0.48, 0.0]))


def off_by(digits, axis=0):
    """An axis beside y."""
    found = [0.0, 1.0, 0.0]
    found[axis] = digits
    return tuple(found)


def within(found, digits, expected=None):
    """Check components and efforts against the true ones but for digits: reactions are some 16 N,
    and digits shift them by one or two times the largest of it.
    """
    for each, right in zip(found, expected or truth(), strict=True):
        assert (np.isnan(each) == np.isnan(right)).all()
        assert np.nanmax(np.abs(each - right)) <= 32.0 * digits + 1e-12


TWO_OFF = {"c": off_by(1e-6), "b": off_by(-2e-6, 2)}


MM = {"units": {"length": "mm"}}


def closing(tolerance=1e-5, **more):
    return {"closure": {"tolerance": tolerance, **more}}


def rounded(folder, axes=None, **more):
    """A four-bar whose redundant rows fit within digits."""
    return written(folder, axes or {"c": off_by(1e-6)}, **closing() | more)


def test_exact_axes_give_true_forces(tmp_path):
    case, found = solved(written(tmp_path))
    assert case.closure is None
    within(found, 0.0)


@pytest.mark.by_day(5)
@pytest.mark.parametrize("rounding", [*product("abcd", [0, 2], [1e-6, 1e-5, 1e-4])], ids=str)
def test_rounded_axis_gives_true_forces(tmp_path, rounding):
    hinge, axis, digits = rounding
    file = rounded(tmp_path, {hinge: off_by(digits, axis)}, **closing(2.0 * digits))
    case, found = solved(file)
    assert case.closure
    within(found, digits)


@pytest.mark.by_day(3)
@pytest.mark.parametrize(
    "more",
    [
        *({"order": order} for order in ("abcd", "dcba", "cabd", "bdac")),
        {"bodies": ("rocker", "coupler", "crank")},
        {"bodies": ("coupler", "crank", "rocker")},
        *map(closing, (4e-6, 1e-4, 1e-3)),
        {"turn": TILTED},
        MM | closing(1e-2),
        {"scale": 1e-3} | closing(1e-8),
        {"scale": 64.0} | MM | closing(0.64),
    ],
    ids=str,
)
def test_four_bar_variant_keeps_forces(tmp_path, more):
    """Forces but for digits, and what is undetermined: of another order the joint that loses rows
    is another one.
    """
    file = rounded(tmp_path, TWO_OFF, **more)
    case, found = solved(file, more.get("turn"), more.get("scale", 1.0))
    assert case.closure
    within(found, 2e-6)


@pytest.mark.parametrize("carrying", ["bd", "bc", "cd"])
def test_universal_joint_carries_cross_moment(tmp_path, carrying):
    """A universal joint carries a moment across its axes, wherever they are."""
    cross = (0.6, 0.0, 0.8)
    more = {"turn": TILTED, "cross": cross} | closing(carrying=[*carrying])
    case, found = solved(rounded(tmp_path, {"b": off_by(1e-6)}, **more), TILTED)
    assert [each.joint.name for each in case.mechanism.reduced] == [*{*"bcd"}.difference(carrying)]
    within(found, 1e-6, truth(cross))


def test_joint_without_rows_is_undetermined(tmp_path):
    """A second hinge beside another one shares its load in any proportion."""
    case, found = solved(rounded(tmp_path, twin=(0.6, 0.2, 1e-6)))
    kept = {each.joint.name: each.kept for each in case.mechanism.reduced}
    assert kept["twin"] == ()
    right, expected = truth()
    right = right.copy()
    right[:, 3, [0, 2]] = np.nan
    within(found, 1e-6, (right, expected))
    found = solve(case.mechanism, "turn", case.sweep.values, forces=["twin"]).forces.joints["twin"]
    assert found.determined() == (0, 1, 1)
    assert np.abs(found.along((0.0, 1.0, 0.0), moment=True)).max() < 1e-12
    assert np.isnan(found.along((1.0, 0.0, 0.0))).all()
    written_again(case, tmp_path)


def test_sprung_hinge_keeps_its_rows(tmp_path):
    """The spring counts its turns; it does nothing here."""
    for name in "bcd":
        spring = {"type": "torsion_spring_damper", "joint": name, "stiffness": 0.0}
        case, found = solved(rounded(tmp_path, forces={"spring": spring}))
        assert [each.joint.name for each in case.mechanism.reduced] != [name]
        within(found, 1e-6)


@pytest.mark.parametrize(
    "more",
    [{}, {"order": "dbca"}, {"cross": (0.6, 0.0, 0.8)}, {"twin": (0.6, 0.2, 1e-6)}],
    ids=["plain", "order", "cross", "twin"],
)
@pytest.mark.parametrize("engine", ["mujoco", "pinocchio", "exudyn", "simbody", "drake", "dart"])
def test_engines_agree_on_undetermined_forces(tmp_path, engine, more):
    if adapters.engine(engine).version() is None:
        pytest.skip(f"{engine} is not installed")
    axes = {"a": off_by(1e-6), "b": off_by(-2e-6, 2)}
    case = load_case(rounded(tmp_path, axes, **more))
    case = replace(case, outputs=every_force(case.mechanism))
    case = replace(case, mechanism=with_markers(case.mechanism, case.outputs))
    assert case.closure
    (native, right), (found, solution) = values(case, "native"), values(case, engine)
    assert Beside(native, found).same_missing
    assert Beside(native, found).worst <= 1e-11
    # what is undetermined is one space of wrenches of all joints, in any engine
    expected, spanned = (
        np.concatenate([each.free for each in forces.joints.values()], axis=1)
        for forces in (right.forces, solution.forces)
    )
    projected = expected @ (expected.swapaxes(1, 2) @ spanned)
    assert np.abs(projected - spanned).max() < 1e-4
    assert np.abs(np.linalg.norm(spanned, axis=1) - 1.0).max() < 1e-12


def test_amplified_forces_are_reported(tmp_path):
    """Only digits keep the four-bar from moving; what moves is a pendulum beside it."""
    keys = json.loads((file := written(tmp_path, {"c": off_by(1e-6)})).read_text())
    keys["bodies"]["pendulum"] = {"mass": 1.0, "center_of_mass": [2.0, 0.0, 0.5]}
    beside = {"bodies": ["ground", "pendulum"], "point": [2.0, 0.0, 0.0]}
    keys["joints"]["beside"] = keys["joints"]["a"] | beside
    keys["drivers"]["turn"]["joint"] = "beside"
    file.write_text(json.dumps(keys))
    (record,) = run([load_case(file)], [adapters.engine("native")], tol=1e-12).records
    assert "forces at 3 samples, the first at time -0.3, multiply the digits" in record.message
    assert "by up to 7e+06" in record.message
    file.write_text(json.dumps(keys | closing()))
    case = load_case(file)
    assert case.closure is None
    (note,) = case.assembly
    assert "rows of joint 'd' (revolute) are redundant within 1e-05 m" in note
    assert "without them the drivers do not determine the motion" in note


def test_digits_of_all_samples_count():
    """At some pose digits may not show."""
    one, rows = np.ones(2), np.zeros((2, 0))
    found = Multipliers(rows, rows[..., None], np.array([1e-6, 0.0]), 0.5 * one, one, one)
    assert found.known[0] == found.known[1] > 1e-6
    assert not found.singular.any()
    assert replace(found, regular=np.array([0.5, 5e-5])).singular.tolist() == [False, True]


def test_case_text_keeps_reduced_joints(tmp_path):
    case = load_case(rounded(tmp_path, order="dcba"))
    assert written_again(case, tmp_path).closure.tolerance == case.closure.tolerance
    assert 'type = "inline"' not in case_text(case)


def test_unknown_carrying_joint_is_refused(tmp_path):
    file = written(tmp_path, **closing(carrying=["x"]))
    with pytest.raises(CaseError, match=r"closure\.carrying: .*joint.* 'x'"):
        load_case(file)


def test_carrying_joints_keep_their_rows(tmp_path):
    for carrying, reduced in (("bcd", "d"), ("cd", "b")):  # the drive has "a"
        case = load_case(rounded(tmp_path, **closing(carrying=[*carrying])))
        assert [each.joint.name for each in case.mechanism.reduced] == [reduced]


def test_explain_names_redundant_rows(tmp_path):
    print_diagnosis = pytest.importorskip("kincheck.core.extensions.explain.text").print_diagnosis
    diagnose = pytest.importorskip("kincheck.core.extensions.explain.diagnose").diagnose
    file = rounded(tmp_path)
    found = diagnose(load_case(file), samples=3, tol=1e-12)
    assert [each.row.owner for each in found.redundant] == ["d"] * 3
    assert 1e-7 < max(each.off for each in found.redundant) < 1e-6
    assert "3 redundant rows" in found.verdict
    partly = {
        each.joint: (each.force, each.moment, each.wrench) for each in found.determinacy.partly
    }
    assert partly == dict.fromkeys("abcd", (2, 1, 3))
    for each in found.determinacy.partly:
        assert (len(each.force_along), len(each.moment_along)) == (2, 1)
        assert np.abs(np.array(each.force_along)[:, 1]).max() < 1e-5
        assert abs(abs(each.moment_along[0][1]) - 1.0) < 1e-5
    print_diagnosis(found, console(printed := StringIO()))
    printed = printed.getvalue()
    assert "redundant to 3.3e-07: d: Dot11 (about x) = 1 [a: Dot11 (about x)]" in printed
    assert "all reactions and efforts are determined" not in printed


def test_proof_omits_undetermined_components(tmp_path):
    prove_case = pytest.importorskip(
        "kincheck.core.extensions.proofs.verified_reference"
    ).prove_case
    pytest.importorskip("flint")
    file = rounded(tmp_path)
    case = load_case(file)
    made, _ = prove_case(case, digits=20, numbers="double", tol=1e-12)
    assert all(sample.proved for sample in made.samples)
    for joint, row in zip("abcd", np.moveaxis(truth()[0], 1, 0), strict=True):
        for k, (kind, axis) in enumerate(product(("force", "moment"), "xyz")):
            found = made.outputs[f"{joint} {kind} {axis}"]
            if np.isnan(row[:, k]).any():
                assert found.position == [None] * 3
                assert "redundant rows leave 2 of 3" in found.reason
            else:
                exact = np.array(found.position, dtype=float)
                assert np.abs(exact - row[:, k]).max() <= 32e-6


def component(name, k, moment, found):
    return found.joints[name].along(np.eye(3)[k], moment=moment)


def test_design_variants_keep_undetermined_forces(tmp_path):
    file = rounded(tmp_path)
    mechanism, path = (case := load_case(file)).mechanism, case.sweep.path
    prepared = pytest.importorskip("kincheck.core.extensions.designs.prepared")
    designs = prepared.prepare_designs(
        NativeSolver(order=2), mechanism, path, ["joints.c.point"], forces=[*"abcd", "turn"]
    )
    geometry = np.array(mechanism.joint("c").point)[:, None] + np.outer([1, 0, 1], [0.0, 1e-3])
    found = designs.solve(geometry, 1e-12)
    every = designs.forces(found, geometry, 1e-12)
    for name, moment, k in product("abcd", (False, True), range(3)):
        read = every.read(partial(component, name, k, moment))
        right = truth()[0][:, "abcd".index(name), 3 * moment + k]
        assert (np.isnan(read) == np.isnan(right)[:, None]).all()
        assert not np.nanmax(np.abs(read[:, 0] - right), initial=0.0) > 32e-6
