"""Forces where rows are left out within the digits of a file: what exact axes leave undetermined is
undetermined, and the rest is as with exact axes but for the digits.
"""

import json
from dataclasses import replace
from functools import partial
from io import StringIO
from itertools import product

import numpy as np
import pytest
from kincheck import adapters
from kincheck.core.case.io.case_file import case_text, load_case
from kincheck.core.case.quantity import with_markers
from kincheck.core.errors import CaseError
from kincheck.core.forces import Multipliers
from kincheck.core.harness.run import run
from kincheck.core.kinematics import NativeSolver, solve
from kincheck.core.report.terminal import console
from kincheck.core.studies.diagnosis.diagnose import diagnose
from kincheck.core.studies.diagnosis.text import print_diagnosis
from kincheck.core.studies.verified_reference import prove_case

from ..kinematics.test_chain import chain
from ..kinematics.test_singular import BRANCH
from ..oracles import naive
from ..oracles.four_bar_forces import forces
from ..support.engine_forces import Beside, every_force, force_case, values
from ..support.four_bar_within_digits import ANGLES, solved, written
from ..support.loads import loaded

TILTED = naive.A(np.array([0.8, 0.36, 0.48, 0.0]))
TRUTH = [forces(angle) for angle in ANGLES]
REACTIONS, EFFORTS = (np.array(each) for each in zip(*TRUTH, strict=True))


def off_by(digits, axis=0):
    """An axis beside y."""
    found = [0.0, 1.0, 0.0]
    found[axis] = digits
    return tuple(found)


def within(found, digits, truth=(REACTIONS, EFFORTS)):
    """Check components and efforts against the true ones but for digits: reactions are some 16 N,
    and digits shift them by one or two times the largest of it.
    """
    for each, right in zip(found, truth, strict=True):
        assert (np.isnan(each) == np.isnan(right)).all()
        assert np.nanmax(np.abs(each - right)) <= 32.0 * digits + 1e-12


def test_exact_axes_give_the_true_forces(tmp_path):
    case, found = solved(written(tmp_path))
    assert case.closure is None
    within(found, 0.0)


@pytest.mark.parametrize("digits", [1e-6, 1e-5, 1e-4])
@pytest.mark.parametrize("hinge", "abcd")
@pytest.mark.parametrize("axis", [0, 2])
def test_an_axis_off_by_digits_gives_the_true_forces(tmp_path, hinge, axis, digits):
    axes, closure = {hinge: off_by(digits, axis)}, {"tolerance": 2.0 * digits}
    case, found = solved(written(tmp_path, axes, closure=closure))
    assert case.closure
    within(found, digits)


@pytest.mark.parametrize("order", ["abcd", "dcba", "cabd", "bdac"])
def test_the_order_of_joints_changes_digits_only(tmp_path, order):
    """The joint that loses rows is another one: they leave the same undetermined."""
    axes = {"c": off_by(1e-6), "b": off_by(-2e-6, 2)}
    case, found = solved(written(tmp_path, axes, order, closure={"tolerance": 1e-5}))
    assert case.closure
    within(found, 2e-6)


@pytest.mark.parametrize("bodies", [("rocker", "coupler", "crank"), ("coupler", "crank", "rocker")])
def test_the_order_of_bodies_changes_digits_only(tmp_path, bodies):
    axes, closure = {"c": off_by(1e-6)}, {"tolerance": 1e-5}
    _, found = solved(written(tmp_path, axes, bodies=bodies, closure=closure))
    within(found, 1e-6)


@pytest.mark.parametrize("tolerance", [2e-6, 1e-4, 1e-3])
def test_the_tolerance_does_not_decide_what_is_determined(tmp_path, tolerance):
    file = written(tmp_path, {"c": off_by(1e-6)}, closure={"tolerance": tolerance})
    within(solved(file)[1], 1e-6)


@pytest.mark.parametrize(("scale", "unit"), [(1.0, "mm"), (1e-3, "m"), (64.0, "mm")])
def test_units_and_size_change_digits_only(tmp_path, scale, unit):
    tolerance = 1e-5 * scale * {"m": 1.0, "mm": 1e3}[unit]
    more = {"closure": {"tolerance": tolerance}, "units": {"length": unit}}
    file = written(tmp_path, {"c": off_by(1e-6)}, scale=scale, **more)
    case, found = solved(file, scale=scale)
    assert case.closure
    within(found, 1e-6)


def test_a_turned_plane_leaves_the_same_undetermined(tmp_path):
    closure = {"tolerance": 1e-5}
    case, found = solved(
        written(tmp_path, {"c": off_by(1e-6)}, turn=TILTED, closure=closure), turn=TILTED
    )
    assert case.closure
    within(found, 1e-6)


@pytest.mark.parametrize("carrying", ["bd", "bc", "cd"])
def test_a_cross_turns_with_both_bodies(tmp_path, carrying):
    """A universal joint carries a moment across its axes, wherever they are."""
    cross, closure = (0.6, 0.0, 0.8), {"tolerance": 1e-5, "carrying": [*carrying]}
    more = {"turn": TILTED, "cross": cross, "closure": closure}
    case, found = solved(written(tmp_path, {"b": off_by(1e-6)}, **more), TILTED)
    assert [each.joint.name for each in case.mechanism.reduced] == [*{*"bcd"}.difference(carrying)]
    truth = [forces(angle, cross) for angle in ANGLES]
    within(found, 1e-6, [np.array(each) for each in zip(*truth, strict=True)])


def test_a_joint_without_a_row_left_is_undetermined(tmp_path):
    """A second hinge beside another one shares its load in any proportion."""
    file = written(
        tmp_path, {"c": off_by(1e-6)}, twin=(0.6, 0.2, 1e-6), closure={"tolerance": 1e-5}
    )
    case, (reactions, efforts) = solved(file)
    kept = {each.joint.name: each.kept for each in case.mechanism.reduced}
    assert kept["twin"] == ()
    right = REACTIONS.copy()
    right[:, 3, [0, 2]] = np.nan
    within((reactions, efforts), 1e-6, (right, EFFORTS))
    found = solve(case.mechanism, "turn", case.sweep.values, forces=["twin"]).forces.joints["twin"]
    assert found.determined() == (0, 1, 1)
    assert np.abs(found.along((0.0, 1.0, 0.0), moment=True)).max() < 1e-12
    assert np.isnan(found.along((1.0, 0.0, 0.0))).all()
    (again := tmp_path / "again.toml").write_text(case_text(case))
    assert load_case(again).mechanism == case.mechanism


def test_a_hinge_with_a_torsional_spring_keeps_its_rows(tmp_path):
    """The spring counts its turns; it does nothing here."""
    springs = {
        f"spring {name}": {"type": "torsion_spring_damper", "joint": name, "stiffness": 0.0}
        for name in "bcd"
    }
    for name in "bcd":
        more = {"closure": {"tolerance": 1e-5}, "forces": {name: springs[f"spring {name}"]}}
        case, found = solved(written(tmp_path, {"c": off_by(1e-6)}, **more))
        assert [each.joint.name for each in case.mechanism.reduced] != [name]
        within(found, 1e-6)


@pytest.mark.parametrize(
    "more", [{}, {"order": "dbca"}, {"cross": (0.6, 0.0, 0.8)}, {"twin": (0.6, 0.2, 1e-6)}]
)
@pytest.mark.parametrize("engine", ["mujoco", "pinocchio", "exudyn", "simbody", "drake", "dart"])
def test_every_engine_leaves_the_same_undetermined(tmp_path, engine, more):
    if adapters.engine(engine).version() is None:
        pytest.skip(f"{engine} is not installed")
    axes, closure = {"a": off_by(1e-6), "b": off_by(-2e-6, 2)}, {"tolerance": 1e-5}
    case = load_case(written(tmp_path, axes, closure=closure, **more))
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


def test_forces_that_multiply_digits_are_told(tmp_path):
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
    file.write_text(json.dumps(keys | {"closure": {"tolerance": 1e-5}}))
    case = load_case(file)
    assert case.closure is None
    (note,) = case.assembly
    assert "rows of joint 'd' (revolute) are redundant within 1e-05 m" in note
    assert "without them the drivers do not determine the motion" in note


def test_missing_forces_at_a_singular_pose_are_told():
    case = force_case(loaded(chain(1)), [0.0, 0.7, 1.4, BRANCH, 2.3, 3.0])
    (record,) = run([case], [adapters.engine("native")], tol=1e-12).records
    assert (record.solved, record.samples) == (6, 6)
    assert "no forces at 1 sample" in record.message


def test_digits_of_all_samples_count_at_each():
    """At some pose digits may not show."""
    one, rows = np.ones(2), np.zeros((2, 0))
    found = Multipliers(rows, rows[..., None], np.array([1e-6, 0.0]), 0.5 * one, one, one)
    assert found.known[0] == found.known[1] > 1e-6
    assert not found.singular.any()
    assert replace(found, regular=np.array([0.5, 5e-5])).singular.tolist() == [False, True]


def test_a_written_case_has_the_joints_as_given(tmp_path):
    file = written(tmp_path, {"c": off_by(1e-6)}, "dcba", closure={"tolerance": 1e-5})
    case = load_case(file)
    (again := tmp_path / "again.toml").write_text(case_text(case))
    read = load_case(again)
    assert read.mechanism == case.mechanism
    assert (read.closure.tolerance, read.assembly) == (case.closure.tolerance, case.assembly)
    assert 'type = "inline"' not in again.read_text()


def test_a_joint_that_is_to_carry_must_exist(tmp_path):
    file = written(tmp_path, closure={"tolerance": 1e-5, "carrying": ["x"]})
    with pytest.raises(CaseError, match=r"closure\.carrying: .*joint.* 'x'"):
        load_case(file)


def test_joints_that_are_to_carry_keep_their_rows(tmp_path):
    closure = {"tolerance": 1e-5, "carrying": ["b", "c", "d"]}
    case = load_case(written(tmp_path, {"c": off_by(1e-6)}, closure=closure))
    assert [each.joint.name for each in case.mechanism.reduced] == ["d"]  # the drive has "a"
    closure["carrying"] = ["c", "d"]
    case = load_case(written(tmp_path, {"c": off_by(1e-6)}, closure=closure))
    assert [each.joint.name for each in case.mechanism.reduced] == ["b"]


def test_explain_names_redundant_rows_and_determined_directions(tmp_path):
    file = written(tmp_path, {"c": off_by(1e-6)}, closure={"tolerance": 1e-5})
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


def test_proofs_print_determined_components_only(tmp_path):
    pytest.importorskip("flint")
    file = written(tmp_path, {"c": off_by(1e-6)}, closure={"tolerance": 1e-5})
    case = load_case(file)
    made, _ = prove_case(case, digits=20, numbers="double", tol=1e-12)
    assert all(sample.proved for sample in made.samples)
    for joint, row in zip("abcd", np.moveaxis(REACTIONS, 1, 0), strict=True):
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


def test_variants_of_a_design_leave_the_same_undetermined(tmp_path):
    file = written(tmp_path, {"c": off_by(1e-6)}, closure={"tolerance": 1e-5})
    mechanism, path = (case := load_case(file)).mechanism, case.sweep.path
    designs = NativeSolver(order=2).prepare_designs(
        mechanism, path, ["joints.c.point"], forces=[*"abcd", "turn"]
    )
    geometry = np.array(mechanism.joint("c").point)[:, None] + np.outer([1, 0, 1], [0.0, 1e-3])
    found = designs.solve(geometry, 1e-12)
    every = designs.forces(found, geometry, 1e-12)
    for name, moment, k in product("abcd", (False, True), range(3)):
        read = every.read(partial(component, name, k, moment))
        right = REACTIONS[:, "abcd".index(name), 3 * moment + k]
        assert (np.isnan(read) == np.isnan(right)[:, None]).all()
        assert not np.nanmax(np.abs(read[:, 0] - right), initial=0.0) > 32e-6
