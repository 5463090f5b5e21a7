"""Written models, read by their simulators alone: they close at the design and elsewhere, and move
as the mechanism does.
"""

from dataclasses import replace

import numpy as np
import pytest
from kincheck import adapters
from kincheck.adapters.shared.poses import at_start
from kincheck.core import (
    GROUND,
    Body,
    JointAngle,
    KincheckError,
    Mechanism,
    Polynomial,
    Revolute,
)
from kincheck.core.case.io.model_writer import way_to
from kincheck.core.case.joint_probe import probes
from kincheck.core.mechanism.tree import Branch, SpanningTree, spanning_tree

from ..support.exported import READERS, read
from ..support.mechanisms import mcpherson
from ..support.written_mechanisms import CASES, Z, assert_read, case, way


def reading(to, name, folder, elsewhere=True):
    mechanism, path = CASES[name].mechanism, way(name, elsewhere)
    return read(to, adapters.writer(to)(mechanism, path, {}), mechanism, folder), path


NO_POLYNOMIAL = {"exudyn": "Exudyn", "sdf": "SDF"}


@pytest.mark.parametrize("elsewhere", [False, True], ids=["design", "elsewhere"])
@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("to", READERS)
def test_a_written_model_closes_where_the_native_engine_says(to, name, elsewhere, tmp_path):
    if name == "polynomial" and to in NO_POLYNOMIAL:
        with pytest.raises(KincheckError, match=f"has no counterpart in {NO_POLYNOMIAL[to]}"):
            reading(to, name, tmp_path, elsewhere)
        return
    found, path = reading(to, name, tmp_path, elsewhere)
    assert_read(found, CASES[name].mechanism, path, elsewhere)


def test_polynomials_count_from_the_start():
    """With y = x + 0.2 x^2, and x = 0.5 at the start."""
    hinges = [
        Revolute(name, "ground", name.upper(), (k, 0.0, 0.0), Z) for k, name in enumerate("ab")
    ]
    cam = Polynomial("cam", ("b", "a"), (0.0, 1.0, 0.2))
    bodies, turn = [Body("A"), Body("B", (1.0, 0.0, 0.0))], JointAngle("turn", "a")
    mechanism = Mechanism("cams", bodies, hinges, [], [turn], [cam])
    (moved,) = at_start(mechanism, way_to(case(mechanism, 0.5), 0.5)).couplers
    np.testing.assert_allclose(moved.coefficients, [0.0, 1.2, 0.2], rtol=0.0, atol=1e-15)


def cut_elsewhere(mechanism, first=()):
    """The tree without the joint that is probed: what it carried is free, and it closes the
    loop.
    """
    tree = spanning_tree(mechanism, first)
    tested = [
        joint
        for joint in mechanism.joints
        if joint.name in ("tested", "second") and joint not in tree.cut
    ]
    branches = [
        Branch(GROUND, each.child, None) if each.joint in tested else each for each in tree.branches
    ]
    return SpanningTree(tuple(branches), (*tree.cut, *tested))


@pytest.mark.parametrize("name", [each.name for each in probes()])
@pytest.mark.parametrize("to", ["mjcf", "urdf", "sdf", "osim"])
def test_a_joint_closes_a_loop_as_it_carries_a_body(to, name, tmp_path, monkeypatch):
    if name == "polynomial" and to in NO_POLYNOMIAL:
        return  # refused above
    monkeypatch.setattr("kincheck.adapters.shared.tree_plan.spanning_tree", cut_elsewhere)
    found, path = reading(to, name, tmp_path)
    assert_read(found, CASES[name].mechanism, path, True)


def test_the_cases_move_and_count_turns():
    for name in CASES:
        assert (
            max(
                np.abs(motion.r[-1] - motion.r[0]).max() + np.abs(motion.p[-1] - motion.p[0]).max()
                for motion in way(name, True).values()
            )
            > 0.01
        )
    # 150 rad of 0.01 m a turn
    assert abs(way("gear_train", True)["nut"].r[-1, 2] - 0.3 + 1.5 / (2.0 * np.pi)) <= 1e-14


@pytest.mark.parametrize("to", READERS)
def test_a_start_of_another_mechanism_is_seen(to, tmp_path):
    """The tie rod a millimetre longer than where the poses are from."""
    mechanism = mcpherson()
    rod = mechanism.joint("tie_rod")
    longer = replace(
        mechanism, joints=[*mechanism.joints[:-1], replace(rod, length=rod.design_distance + 1e-3)]
    )
    texts = adapters.writer(to)(longer, way("mcpherson", True), {})
    found = read(to, texts, longer, tmp_path)
    assert np.linalg.norm(found.residuals) == pytest.approx(1e-3, abs=1e-14)
