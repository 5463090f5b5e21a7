"""When other rows are looked for, how often, and which are taken."""

from dataclasses import replace

import numpy as np
import pytest
from kincheck import cases
from kincheck.core.kinematics.compiled.compiled_model import recent_model
from kincheck.core.kinematics.compiled.request import SIGMA, Request
from kincheck.core.kinematics.compiled.routes import Route
from kincheck.core.kinematics.continuation import segments, singular_samples
from kincheck.core.kinematics.continuation.segments import Followed, chosen, with_better_rows
from kincheck.core.kinematics.continuation.sweep import follow
from kincheck.core.kinematics.continuation.walk import SideWalk, follow_samples
from kincheck.core.kinematics.one_design import solve
from kincheck.core.mechanism.motions import Path, Ramp

from .test_redundancy import locomotive
from .test_row_choice import ALONG, DEAD, loop


def test_row_exchange_stops_at_limit(monkeypatch):
    """Then the motion ends, or is refused, and says that it was the choice of rows."""
    turn = np.linspace(0.0, 3.0, 31)
    monkeypatch.setattr(segments, "MOST", 0)
    found = solve(loop(), "turn", turn)
    assert not found.solved.all()
    assert "the mechanism is regular there" in found.message


def test_limit_of_failed_row_exchanges(monkeypatch):
    tried, found, renew = list[float](), list[int](), Followed.renew
    monkeypatch.setattr(
        segments,
        "with_better_rows",
        lambda route, lane, *_: tried.append(lane[route.model.slots["from time"]]),
    )
    monkeypatch.setattr(
        Followed,
        "renew",
        lambda self, lanes: tried.clear() or renew(self, lanes) or found.append(len(tried)),
    )
    solve(locomotive(np.pi / 2.0), "turn", DEAD - np.linspace(1e-3, 1e-4, 99))
    assert found == [segments.WITHOUT]


def test_unreached_sample_is_kept(monkeypatch):
    monkeypatch.setattr(Followed, "visit", lambda self, samples: {})
    turn, question = np.append(0.0, DEAD - np.geomspace(1.0, 1e-2, 12)), segments.needs_check
    found = list[int]()
    monkeypatch.setattr(
        segments,
        "needs_check",
        lambda *a, **k: found.append(question(*a, **k).sum()) or question(*a, **k),
    )
    assert solve(locomotive(np.pi / 2.0), "turn", turn).solved.all()
    assert found[0] >= 1


def test_dead_centre_is_examined_once(monkeypatch):
    """The Bricard linkage comes near its dead centre, which no choice of rows changes."""
    asked, values = list[int](), singular_samples.smallest_singular_values
    monkeypatch.setattr(
        singular_samples,
        "smallest_singular_values",
        lambda *given: asked.append(1) or values(*given),
    )
    case = cases.load("bricard")
    route = Route(recent_model(case.mechanism, Request(("hinge",), ("P3",))), case.sweep.path)
    first, second = (follow(route, 1e-12) for _ in range(2))
    assert len(asked) == 1
    assert first.details == second.details
    assert "rows_chosen_anew" not in first.details
    follow(route, 1e-13)
    assert len(asked) == 2


def test_known_rows_are_chosen_if_good():
    matrix = np.array([[1.0, 0.0], [0.0, 1e-3], [0.0, 1.0], [0.0, 0.2]])
    drivers, none = 0, ()
    assert chosen(matrix, [(0, 1), (0, 3)], drivers, none) == (0, 2)
    assert chosen(matrix, [(0, 1), (0, 2)], drivers, none) == (0, 2)
    matrix[3, 1] = 0.5
    assert chosen(matrix, [(0, 1), (0, 3)], drivers, none) == (0, 3)
    # there are not two
    assert chosen(np.array([[1.0, 0.0], [1.0, 0.0], [1.0, 1e-17]]), [(0, 1)], drivers, none) == (
        0,
        1,
    )


def test_pose_off_chosen_rows_is_refused():
    """What rows chosen anew make of a pose is near it, or it is another."""
    model = recent_model(loop(), Request(("turn",), ("tracer",)))
    route = Route(model, Path({"turn": Ramp(1.0)}, np.array([0.0, 1.5])))
    lane = follow_samples(route, 1e-12, visit={1}).visited[1]
    standing = with_better_rows(route, lane, route.path, [model])
    assert standing is None  # none are better there
    beside = replace(route, path=Path({"turn": Ramp(1.0)}, np.array([0.0, ALONG - 1e-3])))
    lane = follow_samples(beside, 1e-12, visit={1}).visited[1]
    standing = with_better_rows(beside, lane, beside.path, [model])
    assert standing is not None
    before = {name: lane[model.vectors[f"from {name}"]] for name in model.state}
    sample = beside.sampled(np.array([ALONG - 1e-3]))
    assert segments._standing(standing.model, before, sample, 1e-6) is not None
    off = {name: value + 1e-3 * (name == "u coupler") for name, value in before.items()}
    assert segments._standing(standing.model, off, sample, 1e-6) is None


def test_pose_against_redundant_rows_is_refused(monkeypatch):
    """Rows chosen anew leave out others than before: those must hold as well. A hinge is askew by a
    part of what is allowed.
    """
    skew = replace(loop().joint("C"), axis=(4.0 + 1e-9, -3.0, 12.0))
    mechanism = replace(
        loop(), joints=[skew if joint.name == "C" else joint for joint in loop().joints]
    )
    model = recent_model(mechanism, Request(("turn",), ()))
    state = {name: np.array(value) for name, value in model.state.items()}
    sample = Route(model, Path({"turn": Ramp(1.0)}, np.array([0.3]))).sampled(np.array([0.3]))
    assert segments._standing(model, state, sample, 1.0) is not None
    monkeypatch.setattr(segments, "CONSISTENT", 1e-12)
    assert segments._standing(model, state, sample, 1.0) is None


@pytest.mark.parametrize("part", [2.0, 4.0])
def test_sample_is_replaced_if_more_regular(part, monkeypatch):
    model = recent_model(loop(), Request(("turn",), ("tracer",)))
    route = Route(model, Path({"turn": Ramp(1.0)}, np.array([0.1, 0.2, 0.3])))
    found = follow_samples(route, 1e-12)
    sigma, other = model.rows[SIGMA].start, np.full_like(found.kept, 7.0)
    other[sigma] = part * found.kept[sigma]
    monkeypatch.setattr(segments, "follow_samples", lambda *_, **__: found._replace(kept=other))
    whole = Followed(route, found._replace(kept=found.kept.copy()), 1e-12)
    whole._follow(route, np.arange(3))
    assert (whole.found.kept[0] == 7.0).tolist() == [part > 3.0] * 3
    assert whole.part_of.tolist() == [int(part > 3.0)] * 3


def test_row_exchange_comes_before_division(monkeypatch):
    """Down to where nothing is seen through rounding takes thirty parts each time."""
    divided, divide = list[float](), SideWalk._divided
    monkeypatch.setattr(
        SideWalk, "_divided", lambda self, *where: divided.append(1.0) or divide(self, *where)
    )
    found = solve(loop(), "turn", np.linspace(0.0, 2.0 * np.pi, 73))
    assert found.details["rows_chosen_anew"] >= 3
    assert len(divided) <= 10  # 110 where rows are not chosen before
