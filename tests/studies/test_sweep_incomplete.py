"""Yield of a study whose variants do not all reach every sample, and how it is printed."""

import csv
import io
import json
import math
import re
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from kincheck.core.case.case import Case, Output, Sweep, Truth
from kincheck.core.case.io.case_file import case_text
from kincheck.core.cli.main import main
from kincheck.core.harness.record import to_json
from kincheck.core.joints import Distance, Revolute
from kincheck.core.mechanism.mechanism import Body, Mechanism, Point
from kincheck.core.mechanism.motions import JointAngle
from kincheck.core.studies.tolerance.page import page
from kincheck.core.studies.tolerance.study import RowLimit, limit_counts
from kincheck.core.studies.tolerance.sweep import sweep_designs
from kincheck.core.studies.tolerance.tables import limits_csv, print_sweep
from kincheck.core.studies.variation.study_choices import Incomplete
from kincheck.core.studies.variation.variation import Limit
from scipy.stats import beta

from ..report.page import Page
from .test_vary import HEAD, vary

CRANK, PIVOT, END, LOW = 1.0, 4.0, (3.0, 2.0, 0.0), 0.7
JOINT = {"at": "joints.rod.points.1", "sigma": [150.0, 150.0, 0.0]}
VARIANTS = 120


def four_bar():
    """A crank of one metre, one turn from the pivot of the rocker, four metres away."""
    mechanism = Mechanism(
        "bars",
        [Body("crank"), Body("rocker")],
        [
            Revolute("input", "ground", "crank", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
            Revolute("output", "ground", "rocker", (PIVOT, 0.0, 0.0), (0.0, 0.0, 1.0)),
            Distance("rod", "crank", "rocker", ((CRANK, 0.0, 0.0), END)),
        ],
        [Point("end", "rocker", END)],
        [JointAngle("turn", "input")],
    )
    sweep = Sweep("turn", np.linspace(0.0, 2.0 * math.pi, 25))
    height = Output("height", "end", (0.0, 1.0, 0.0), False, 1e-9, 0.0, "test")
    return Case("bars", "made up", Truth.CONSENSUS_ONLY, mechanism, sweep, (height,))


def heights(case, at):
    """The height of the rocker's end by two circles; none if the crank cannot turn wholly."""
    rod, rocker = math.dist(at, (CRANK, 0.0)), math.dist(at, (PIVOT, 0.0))
    if rod + rocker < PIVOT + CRANK:  # stretched before the crank points away from the pivot
        return None
    tip = CRANK * np.exp(1j * case.sweep.values)
    along = PIVOT - tip
    d = np.abs(along)
    foot = (rod**2 - rocker**2 + d**2) / (2.0 * d)
    return (tip + along / d * (foot + 1j * np.sqrt(rod**2 - foot**2))).imag


def limited(folder):
    """The variation of the rocker's end, with a limit of its height."""
    return replace(vary(folder, four_bar(), end=JOINT), limits=(Limit("height", low=LOW),))


@pytest.fixture(scope="module")
def studied(tmp_path_factory):
    """Results by judgement; the numbers of variants: complete, and of them inside the limit."""
    case = four_bar()
    variation = limited(tmp_path_factory.mktemp("vary"))
    found = {
        each: sweep_designs(case, variation, samples=VARIANTS, seed=3, incomplete=each)
        for each in Incomplete
    }
    offsets = variation.offsets(3, 0, VARIANTS)
    known = [heights(case, np.add(END[:2], each)) for each in offsets.T]
    complete = [each for each in known if each is not None]
    return found, len(complete), int(sum(each.min() >= LOW for each in complete))


def test_incomplete_variants_are_outside_unless_ignored(studied):
    found, complete, inside = studied
    assert VARIANTS / 4 < complete < 0.75 * VARIANTS
    assert 0 < inside < complete
    for judgement, results in found.items():
        known = VARIANTS if judgement is Incomplete.OUTSIDE else complete
        assert results.incomplete == judgement
        for each in results.limits:
            assert (each.known, each.incomplete) == (known, VARIANTS - complete)
            assert each.outside == known - inside
            assert each.share == inside / known
            assert each.share_of_all == inside / VARIANTS
            assert each.share_of_complete == inside / complete
            low = beta.ppf(0.025, inside, known - inside + 1)
            high = beta.ppf(0.975, inside + 1, known - inside)
            assert each.interval == pytest.approx((low, high), rel=1e-9)
    below = [results.limits[0].below for results in found.values()]
    assert below[0] > below[1] == complete - inside


def test_variants_are_counted_by_side_and_whether_complete():
    nan = np.nan
    values = np.array(
        [
            [[0.0, 0.0, 9.0, nan, nan, -9.0], [0.0, -9.0, 0.0, 0.0, 9.0, 9.0]],
            [[0.0] * 6, [0.0, 0.0, 0.0, 0.0, 0.0, nan]],
        ]
    )
    limits = [RowLimit(0, -1.0, 1.0), RowLimit(1, -1.0, np.inf)]
    reached = np.ones((2, 6), dtype=np.bool_)
    # variants, incomplete, below, above; of the complete ones below, above, outside
    assert limit_counts(values, reached, np.zeros((2, 2)), limits).tolist() == [
        [6, 2, 2, 3, 2, 2, 3],
        [6, 1, 0, 0, 0, 0, 0],
        [6, 3, 2, 3, 1, 1, 2],
    ]


def test_samples_without_a_nominal_value_are_not_judged():
    """Ackermann of straight wheels has no value in any variant; a lock-up is of one."""
    values, reached = np.zeros((1, 4, 5)), np.ones((4, 5), dtype=np.bool_)
    nominal = np.array([[0.0, 0.0, np.nan, 0.0]])
    values[0, 2] = np.nan  # in no variant: all are complete
    values[0, 1, 1] = np.nan  # a value is missing
    values[0, :, 2] = np.nan  # all are
    reached[2, 3] = False  # a sample is
    counts = limit_counts(values, reached, nominal, [RowLimit(0, -1.0, 1.0)])
    assert counts[:, 1].tolist() == [3, 3]
    unknown = np.full((1, 4), np.nan)
    assert limit_counts(values, reached, unknown, [RowLimit(0, -1.0, 1.0)])[0, 1] == 2


def on_page(results):
    """The cells of the table of limits, heads first."""
    (rows,) = (
        rows for above, rows in Page(page(results)).tables if above == "Specification limits"
    )
    return [
        [cell.strip() for cell in row[:-1]] for row in rows
    ]  # without the place of the least Cpk


def on_terminal(results):
    """The cells of the table of limits, heads first; of two lines they are the second."""
    text = io.StringIO()
    print_sweep(results, text)
    lines = text.getvalue().split("Specification limits")[1].splitlines()
    start = next(k for k, line in enumerate(lines) if line.startswith("output"))
    rows = [re.split(r"  +", line.strip()) for line in lines[start : start + 3]]
    rows[-1].insert(1, "")  # all together has no unit
    return rows


def printed(text):
    """A number as printed, of a share too; None for a dash."""
    return None if text == "–" else float(text.removesuffix(" %")) / (100.0 if "%" in text else 1.0)


def near(value, **tolerance):
    return None if value is None else pytest.approx(value, **tolerance)


NOTHING = {"share": 0.0, "interval": (0.0, 0.25), "share_of_all": 0.0, "share_of_complete": None}
UNKNOWN = {"share": None, "interval": None, "share_of_all": 0.5, "share_of_complete": 0.0}


@pytest.mark.parametrize("judgement", Incomplete)
@pytest.mark.parametrize("cells", [on_page, on_terminal])
@pytest.mark.parametrize("changed", [{}, NOTHING, UNKNOWN, {"cp": 0.0, "cpk": 0.0, "below": 0}])
def test_printed_limits_are_those_of_the_results(studied, judgement, cells, changed):
    """Zero is a number, and no number is a dash."""
    found, _, _ = studied
    first, whole = found[judgement].limits
    first = msgspec.structs.replace(first, **changed)
    results = msgspec.structs.replace(found[judgement], limits=[first, whole])
    head, *rows = cells(results)
    other = "of complete" if judgement is Incomplete.OUTSIDE else "of all"
    assert any(each.endswith(other) for each in head)
    for row, limit in zip(rows, json.loads(to_json(results))["limits"], strict=True):
        output, _, low, high, below, above, judged, interval, beside, *indices = row
        assert output == (limit["output"] or "all together")
        ends = ["–"] * 2 if interval == "–" else [f"{x} %" for x in interval[:-2].split(" to ")]
        unjudged = limit["share_of_complete" if other == "of complete" else "share_of_all"]
        shares = [limit["share"], unjudged, *(limit["interval"] or [None] * 2)]
        assert [*map(printed, (judged, beside, *ends))] == [
            near(share, abs=5.1e-5) for share in shares
        ]
        in_mm = [each and 1000.0 * each for each in (limit["low"], limit["high"])]
        others = [*in_mm, *(limit[key] for key in ("below", "above", "cp", "cpk", "by_quantiles"))]
        assert [*map(printed, (low, high, below, above, *indices))] == [
            near(value, rel=5.1e-3) for value in others
        ]


def test_csv_of_limits_is_that_of_the_results(studied):
    for judgement, results in studied[0].items():
        for row, each in zip(
            csv.DictReader(io.StringIO(limits_csv(results))), results.limits, strict=True
        ):
            assert float(row["yield"]) == each.share
            assert (float(row["yield_from"]), float(row["yield_to"])) == each.interval
            assert float(row["yield_of_all"]) == each.share_of_all
            assert float(row["yield_of_complete"]) == each.share_of_complete
            counts = ("known", "below", "above", "outside", "incomplete")
            assert [int(row[key]) for key in counts] == [getattr(each, key) for key in counts]
        assert results.incomplete == judgement


@pytest.mark.parametrize(
    ("option", "judgement", "words"),
    [
        ([], "outside", "Incomplete, and so outside: "),
        (["--incomplete", "ignore"], "ignore", "Incomplete, and left out: "),
    ],
)
def test_command_states_how_incomplete_variants_count(tmp_path, capsys, option, judgement, words):
    file, points, out = tmp_path / "bars.toml", tmp_path / "vary.json", tmp_path / "out.json"
    file.write_text(case_text(four_bar()))
    tables = {**HEAD, "mode": "monte_carlo", "hardpoints": {"end": JOINT}}
    points.write_text(json.dumps(tables | {"limits": {"height": {"low": 1000.0 * LOW}}}))
    command = f"sweep {file} --vary {points} --samples 40 --json {out}".split()
    assert main([*command, *option]) == 1
    found = json.loads(out.read_text())
    limit = found["limits"][0]
    assert (found["incomplete"], limit["known"]) == (
        judgement,
        40 - (limit["incomplete"] if option else 0),
    )
    told = capsys.readouterr().out
    assert f"{words}{limit['incomplete']} variants without all samples" in told
    assert f"{100.0 * limit['share_of_all']:.2f} %" in told
    assert f"{100.0 * limit['share_of_complete']:.2f} %" in told
