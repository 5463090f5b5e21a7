"""Verdicts on the answers of a stress run."""

from dataclasses import replace

import numpy as np
import pytest
from kincheck.core import solve
from kincheck.core.errors import SolveError
from kincheck.core.failures import FailureKind
from kincheck.core.harness.execution import Answer, Failure, Pair
from kincheck.core.harness.record import Outcome
from kincheck.core.studies.stress.families import Specimen
from kincheck.core.studies.stress.families.base import as_case
from kincheck.core.studies.stress.families.linkages import any_plane, crank_rocker, four_bar
from kincheck.core.studies.stress.solving import once
from kincheck.core.studies.stress.verdicts import Verdict, judged, refused_description
from kincheck.core.studies.truth.motion import Reach, followed

from .test_stress import NATIVE

ROUNDING = frozenset({FailureKind.BELOW_ROUNDING})


@pytest.fixture(scope="module")
def case():
    rng = np.random.default_rng(8)
    mechanism, _ = four_bar(any_plane(rng), *crank_rocker(rng), "rod")
    return as_case(mechanism, "turn", np.linspace(-1.0, 1.0, 5))


@pytest.fixture(scope="module")
def truth(case):
    return followed(case)


class Fake:
    """An engine that answers with the native motion, changed."""

    name, mode, loop, settings = "native", "projection", "python", {}

    def __init__(self, change=lambda motion: motion, failures=(), fails=None):
        self.change, self.failures, self.fails = change, failures, fails

    def version(self):
        return "1"

    def unsupported(self, case):
        return None

    def build(self, case):
        if self.fails:
            raise self.fails
        return solve(case.mechanism, case.sweep.driver, case.sweep.values)

    def solve(self, model, case, tol):
        points = {name: self.change(motion) for name, motion in model.points.items()}
        solved = np.isfinite([motion.position for motion in points.values()]).all(axis=(0, 2))
        return replace(model, points=points, solved=solved, failures=self.failures)


def judge(case, truth, engine, **about):
    return judged(Specimen("one", case, **about), case, truth, once(Pair(case, engine, 1e-12)))


def moved(by, quantity="position", samples=slice(None)):
    def change(motion):
        values = getattr(motion, quantity).copy()
        values[samples] += by
        return replace(motion, **{quantity: values})

    return change


def test_a_right_answer_is_right(case, truth):
    found = judge(case, truth, NATIVE)
    assert found.counts[Verdict.RIGHT] == 5
    *motion, force = found.worst
    assert all(0.0 < ratio < 0.1 for ratio in motion)
    assert force is None


@pytest.mark.parametrize(
    ("quantity", "by"), [("position", 1e-12), ("velocity", 1e-10), ("acceleration", 1e-9)]
)
def test_an_error_beyond_round_off_is_silently_wrong(case, truth, quantity, by):
    found = judge(case, truth, Fake(moved(by, quantity, slice(1, 3))))
    assert list(found.verdicts == Verdict.SILENTLY_WRONG) == [False, True, True, False, False]
    assert found.elsewhere == 0
    assert found.first(Verdict.SILENTLY_WRONG) == 1


def test_other_assembly_is_counted_apart(case, truth):
    assert judge(case, truth, Fake(moved(0.1))).elsewhere == 5


def test_answer_beyond_reach_is_silently_wrong(case, truth):
    beyond = replace(truth, reach=np.array([Reach.BEYOND, *[Reach.REACHED] * 4]))
    found = judge(case, beyond, NATIVE)
    assert (found.counts[Verdict.SILENTLY_WRONG], found.elsewhere) == (1, 1)
    assert (
        judge(case, None, NATIVE, reasons=frozenset(FailureKind)).counts[Verdict.SILENTLY_WRONG]
        == 5
    )


def test_unknown_truth_is_not_judged(case, truth):
    unknown = replace(truth, reach=np.array([*[Reach.REACHED] * 4, Reach.UNKNOWN]))
    assert judge(case, unknown, Fake(moved(0.1))).counts == {
        **dict.fromkeys(Verdict, 0),
        Verdict.SILENTLY_WRONG: 4,
        Verdict.UNJUDGED: 1,
    }


@pytest.mark.parametrize(
    ("singular", "failures", "about", "right"),
    [
        (False, [FailureKind.SINGULAR_AHEAD], {}, 0),  # there is none
        (True, [FailureKind.SINGULAR_AHEAD], {}, 2),
        (True, [], {}, 0),  # which names no cause
        (True, [FailureKind.TOO_MANY_PARTS], {}, 0),
        (False, [FailureKind.BELOW_ROUNDING], {"reasons": ROUNDING, "excused": True}, 2),
        # it can be solved, and is no excuse
        (False, [FailureKind.BELOW_ROUNDING], {"reasons": ROUNDING}, 0),
        (False, [FailureKind.FREE], {"reasons": ROUNDING, "excused": True}, 0),
    ],
)
def test_refusal_is_judged_by_its_reason(case, truth, singular, failures, about, right):
    truth = replace(truth, singular=np.array([singular] * 2 + [False] * 3))
    found = judge(case, truth, Fake(moved(np.nan, samples=slice(0, 2)), failures), **about)
    assert found.counts[Verdict.REFUSED_RIGHTLY] == right
    assert found.counts[Verdict.REFUSED_WRONGLY] == 2 - right
    assert found.counts[Verdict.RIGHT] == 3


def test_errors_and_crashes_as_refusals(case):
    free = SolveError("a body can turn", FailureKind.FREE)
    reasons = frozenset({FailureKind.FREE})
    assert judge(case, None, Fake(fails=free), reasons=reasons).counts[Verdict.REFUSED_RIGHTLY] == 5
    one = Specimen("one", case, None, reasons=reasons)
    for outcome, verdict in (
        (Outcome.CRASHED, Verdict.REFUSED_WRONGLY),
        (Outcome.UNSUPPORTED, Verdict.UNSUPPORTED),
    ):
        failure = Failure(outcome, "free", kind=FailureKind.FREE)
        assert judged(one, case, None, failure).counts[verdict] == 5
    for refused, verdict in (
        (Specimen("one", free, None, reasons=reasons), Verdict.REFUSED_RIGHTLY),
        (Specimen("one", SolveError("odd"), None, reasons=reasons), Verdict.REFUSED_WRONGLY),
        (Specimen("one", free), Verdict.REFUSED_WRONGLY),
    ):
        assert refused_description(refused, 3).counts[verdict] == 3


def test_a_contradiction_must_be_told(case, truth):
    answer = once(Pair(case, NATIVE, 1e-12))
    assert isinstance(answer, Answer)
    one, violated = (
        Specimen("one", case, tilt=0.0),
        replace(truth, violated=np.array([0.0, 1e-10, 0.0, 0.0, 0.0])),
    )
    told = replace(answer, details={"redundant_residual": 5e-11})
    assert judged(one, case, violated, answer).counts[Verdict.SILENTLY_WRONG] == 1
    assert judged(one, case, violated, told).counts[Verdict.SILENTLY_WRONG] == 0
