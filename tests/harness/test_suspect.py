"""Where all engines agree and the reference does not fit, it is the reference that is suspected,
with the slip that explains it.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from kincheck.core.case.case import Series
from kincheck.core.case.suspension import camber_of_front_view
from kincheck.core.harness.record import Outcome, from_json, to_json
from kincheck.core.harness.run import run
from kincheck.core.harness.suspects import FACTORS, Held, slips
from kincheck.core.mechanism.motions import Ramp
from kincheck.core.report.junit import to_junit
from kincheck.core.report.report import headline, write_report
from kincheck.core.report.table import messages, to_markdown

from ..support.fakes import Fake, crank, off

ENGINES = [Fake("native"), Fake("other"), Fake("third")]
S = np.linspace(-1.0, 1.3, 24)
WAVY = 0.3 * np.sin(1.7 * S + 0.4) + 0.1 * S**2


def with_reference(change):
    """The crank with its references changed: a function of the series of each output."""
    case = crank()
    return replace(
        case,
        reference={
            name: change(name, series, case.reference) for name, series in case.reference.items()
        },
    )


def every(series, change):
    return Series(
        *(change(each) for each in (series.position, series.velocity, series.acceleration))
    )


def suspected(change, engines=ENGINES):
    results = run([with_reference(change)], engines, tol=1e-12)
    return results, results.suspects.get("crank")


CHANGES = {
    "with the other sign": lambda name, x, _: every(x, np.negative),
    "times 1/1000": lambda name, x, _: every(x, lambda a: 1000.0 * a),
    "times 1000": lambda name, x, _: every(x, lambda a: a / 1000.0),
    "times pi/180": lambda name, x, _: every(x, lambda a: a * 180.0 / math.pi),
    "times 25.4": lambda name, x, _: every(x, lambda a: a / 25.4),
    "with the other sign and times 1000": lambda name, x, _: every(x, lambda a: -a / 1000.0),
    "minus 0.7 m": lambda name, x, _: Series(x.position + 0.7, x.velocity, x.acceleration),
    "shifted by one sample": lambda name, x, _: every(
        x, lambda a: np.roll(a, 1)[[1, *range(1, len(a))]]
    ),
    "taken as that of output": lambda name, x, all_: all_["y" if name == "x" else "x"],
}


@pytest.mark.parametrize("words", CHANGES)
def test_slip_of_reference_is_named(words):
    results, found = suspected(CHANGES[words])
    assert found is not None
    assert found.engines == ["native", "other", "third"]
    named = [each for each in found.explanations if words in each.change]
    assert named
    assert all(each.difference <= each.tolerance for each in found.explanations)
    assert all(record.outcome is Outcome.FAIL for record in results.records)
    assert "all 3 engines agree within" in found.message
    assert f"at sample {found.sample} " in found.message
    assert "suspect the reference, the output's component or a sign" in found.message
    assert from_json(to_json(results)) == results


@pytest.mark.parametrize(
    ("driver", "unit", "written"),
    [("angle", "deg", "angle = 28.64788976 deg"), ("angle", "rad", "angle = 0.5 rad")]
    + [("time", "deg", "time = 0.5 s")],
)
def test_suspected_sample_has_unit_of_file(driver, unit, written):
    bump = np.where(np.arange(9) == 6, 0.01, 0.0)
    case = with_reference(lambda name, x, _: Series(x.position + bump, x.velocity, x.acceleration))
    sweep = replace(case.sweep, driver=driver)
    if driver == "time":
        sweep = replace(sweep, rate=1.0, motions={"angle": Ramp(2.0)})
    suspects = run([replace(case, sweep=sweep, angle_unit=unit)], ENGINES, tol=1e-12).suspects
    assert f"at sample 6 ({written}) of output" in suspects["crank"].message


def test_reversed_samples_differ_from_sign():
    """The crank's y is odd: its reversed positions are its negative ones, its velocities are
    even.
    """
    _, found = suspected(
        lambda name, x, _: every(x, lambda a: a[::-1].copy()) if name == "y" else x
    )
    words = {each.change for each in found.explanations}
    # velocities are within
    assert words == {"with the other sign, or with its samples in reversed order"}
    assert suspected(lambda name, x, _: every(x, np.negative) if name == "y" else x)[
        1
    ].explanations[0].change == ("with the other sign")


def test_suspected_reference_is_named_once(tmp_path):
    results, _ = suspected(CHANGES["with the other sign"])
    assert messages(results) == {}
    assert to_markdown(results).count("Suspect: crank: all 3 engines agree") == 1
    assert "Fail: crank" not in to_markdown(results)
    assert headline(results).endswith("suspect the reference of crank")
    write_report(results, tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text()
    assert page.count("all 3 engines agree within") == 1
    assert "Worst: engine" not in page
    junit = to_junit(results).decode()
    assert junit.count("suspect: all 3 engines") == 1
    assert junit.count("suspect the reference rather than the engine") == 6


def test_run_names_suspected_reference_once(kincheck_main, capsys):
    case = with_reference(CHANGES["with the other sign"])
    assert kincheck_main("run", "crank", engines=ENGINES, cases={"crank": case}) == 1
    out = capsys.readouterr().out
    assert (
        out.count("suspect: crank: all 3 engines agree") == out.count("suspect the reference") == 1
    )
    assert "fail: crank" not in out


def test_suspicion_without_slip_is_unexplained():
    bump = np.zeros(9)
    bump[4] = 0.01
    _, found = suspected(
        lambda name, x, _: (
            Series(x.position + bump, x.velocity, x.acceleration) if name == "y" else x
        )
    )
    assert found.explanations == []
    assert found.unexplained == ["y (position)"]
    assert (found.output, found.sample) == ("y", 4)
    assert found.difference == pytest.approx(0.01)
    assert "explains it" in found.message


def test_disagreeing_engines_suspect_nobody():
    wrong = Fake("wrong", off("position", lambda p: p + 1e-6))
    results, found = suspected(CHANGES["with the other sign"], [Fake("native"), wrong])
    assert found is None
    assert len(messages(results)) == 2


def test_one_wrong_engine_suspects_nobody():
    assert (
        run(
            [crank()], [Fake("native"), Fake("wrong", off("position", lambda p: -p))], tol=1e-12
        ).suspects
        == {}
    )
    assert run([crank()], ENGINES, tol=1e-12).suspects == {}
    assert run([crank(reference=False)], ENGINES, tol=1e-12).suspects == {}


def test_one_engine_alone_agrees_with_nobody():
    """It is told only what a slip explains wholly."""
    _, found = suspected(CHANGES["times 1000"], [Fake("native")])
    assert "native is the only engine that solved it" in found.message
    assert (
        suspected(
            lambda name, x, _: every(x, lambda a: a + 1e-3 * np.arange(9.0) ** 2), [Fake("native")]
        )[1]
        is None
    )


def held(values, atol=1e-9):
    return Held(np.asarray(values, dtype=float), atol, 0.0, "m")


def words(values, reference, others=None):
    return [
        each.change
        for each in slips(held(values), np.asarray(reference, dtype=float), others or {})
    ]


@pytest.mark.parametrize("name", FACTORS)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_every_factor_is_found_with_either_sign(name, sign):
    assert words(WAVY, sign * WAVY / FACTORS[name]) == [
        f"{'with the other sign and ' if sign < 0 else ''}times {name}"
    ]


def test_pairs_are_tried_where_nothing_alone_fits():
    assert words(WAVY, 0.4 - WAVY) == ["with the other sign and plus 0.4 m"]
    assert words(WAVY, -WAVY[::-1]) == [
        "with the other sign and with its samples in reversed order"
    ]
    assert words(WAVY, 1000.0 * (WAVY + 0.2)) == ["times 1/1000 and minus 0.2 m"]
    other = held(np.cos(3.0 * S))
    assert words(WAVY, -other.values, {"z": other}) == [
        "with the other sign taken as that of output z"
    ]


def test_other_output_is_tried_with_signs():
    toe = 0.3 * S
    seen = np.arctan(np.tan(WAVY) / np.cos(toe))
    definitions = [("taken as another", lambda x: camber_of_front_view(x, toe))]

    def named(reference):
        return [each.change for each in slips(held(WAVY), reference, {}, definitions=definitions)]

    assert named(seen) == ["taken as another"]
    assert "with the other sign and taken as another" in named(-seen)
    assert "times pi/180 and taken as another" in named(np.degrees(seen))
    assert named(np.arctan(np.tan(WAVY) / np.cos(2.0 * toe))) == []


def test_a_shift_by_one_sample_is_found_both_ways():
    later, earlier = np.r_[WAVY[1:], 7.0], np.r_[7.0, WAVY[:-1]]
    assert words(WAVY, later) == ["shifted by one sample, each taken from the one before"]
    assert words(WAVY, earlier) == ["shifted by one sample, each taken from the next"]
    assert words(WAVY, np.r_[0.0, WAVY[:-1]] * 1000.0) == [
        "times 1/1000 and shifted by one sample, each taken from the next"
    ]


@pytest.mark.parametrize(
    ("values", "reference"),
    [
        (np.zeros(24), np.full(24, 1e-3)),
        (np.full(24, 1e-12), np.full(24, -0.4)),
        (np.full(24, 0.3), np.full(24, 0.1)),
        (WAVY[:2], -WAVY[:2]),
        (WAVY[:2], WAVY[:2] + 0.5),
        (np.where(np.arange(24) < 2, WAVY, np.nan), -WAVY),
        (WAVY, -WAVY + 1e-8 * S),
        (WAVY, WAVY * 1.01),
    ],
    ids=[
        "zeros",
        "as good as zeros",
        "constant",
        "two",
        "two, off",
        "two known",
        "nearly",
        "another factor",
    ],
)
def test_nothing_is_invented(values, reference):
    assert words(values, reference) == []


def test_samples_that_are_not_known_do_not_count():
    values = np.where(np.arange(24) == 5, np.nan, WAVY)
    assert words(values, -np.where(np.arange(24) == 7, np.nan, WAVY)) == ["with the other sign"]
