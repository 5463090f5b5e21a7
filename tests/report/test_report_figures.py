"""The figures of the report hold the numbers of its records."""

from __future__ import annotations

import math
import re

import pytest
from kincheck import Outcome, Results
from kincheck.core.harness.labels import number
from kincheck.core.harness.record import Deviation, Deviations
from kincheck.core.report.axis import SAMPLES
from kincheck.core.report.figures import SYMBOLS, Past
from kincheck.core.report.report import write_report
from msgspec.structs import replace

from ..support.strut_results import CRANK, GRID, distances, judged, record, results, series
from .page import report, traces


def test_figures_hold_outputs_in_millimetres(tmp_path):
    run = results()
    page = report(run, tmp_path)
    assert page.data["drivers"]["case-0"] == [1000 * d for d in GRID]
    for each in run.records[:2]:
        [curve] = traces(page, "case-0-0", each.engine, "lines")
        assert curve["y"] == "driver"
        expected = [1000 * v for v in each.outputs["half_track_change"].position if v is not None]
        assert curve["x"] == pytest.approx(expected, rel=1e-9)  # ten digits are kept
    [reference] = traces(page, "case-0-0", "reference", "lines")
    assert reference["x"] == pytest.approx(
        [1000 * v for v in series(GRID).position if v is not None], rel=1e-9
    )
    layout = page.data["figures"]["case-0-0"]["layout"]
    assert layout["xaxis"]["title"]["text"] == "half-track change [mm]"
    assert "wheel travel [mm]" in layout["yaxis"]["title"]["text"]


def test_driver_angle_axis_is_in_degrees(tmp_path):
    page = report(results(driver=CRANK | {"name": "stroke"}), tmp_path)
    [curve] = traces(page, "case-0-0", "one", "lines")
    assert curve["x"] == "driver"
    assert page.data["drivers"]["case-0"] == pytest.approx(
        [math.degrees(d) for d in GRID], rel=1e-15
    )


def test_page_order_of_outputs(tmp_path):
    """A constant output that is wrong is not folded."""

    def with_more(record):
        moving, errors = record.outputs["half_track_change"], record.errors["half_track_change"]
        still = [0.3] * len(GRID)
        resting = replace(moving, position=still, velocity=[0.0] * len(GRID))
        right = judged(resting, resting, 1e-9, "closed_form")
        wrong = replace(right, position=replace(right.position, within=False))
        load = replace(moving, unit="N")
        outputs = {"x": moving, "height": resting, "depth": resting, "load": load}
        judgements = {"x": errors, "height": right, "depth": wrong, "load": errors}
        return replace(record, outputs=outputs, errors=judgements)

    run = results()
    page = report(Results(run=run.run, records=[with_more(run.records[0])]), tmp_path)
    text = (tmp_path / "report.html").read_text("utf-8")
    headings = re.findall(r'<h3 id="(case-0-\d)">(\w+)</h3>', text)
    assert [name for _, name in headings] == ["load", "x", "depth", "height"]
    folded = text[text.index("Constant: height") :]
    assert '<h3 id="case-0-1">height' in folded
    assert '<h3 id="case-0-2">' not in folded
    assert [row[0] for row in page.rows("Largest deviations")] == ["load", "x", "height", "depth"]
    contents = text.partition('aria-label="Contents"')[2].partition("</nav>")[0]
    targets = re.findall(r'href="#([\w-]+)"', contents)
    assert targets == ["overview", "case-0", "settings", "caveats"]
    assert {*targets} <= {tag["id"] for _, tag in page.tags if "id" in tag}


def in_unit(found, unit):
    outputs = {name: replace(each, unit=unit) for name, each in found.outputs.items()}
    return replace(found, outputs=outputs)


@pytest.mark.parametrize("unit", ["m", "rad", "N"])
@pytest.mark.parametrize("motion", ["position", "velocity"])
def test_error_figures_have_distances_from_reference(tmp_path, motion, unit):
    made = results()
    run = replace(made, records=[in_unit(record, unit) for record in made.records])
    page = report(run, tmp_path)
    word = "value" if (motion, unit) == ("position", "N") else motion
    of = unit if motion == "position" else f"{unit}/s"
    axis = page.data["figures"][f"case-0-0-{motion}"]["layout"]["yaxis"]
    assert axis["title"]["text"] == f"{word} difference [{of}]"
    (title,) = (
        tag["aria-label"] for _, tag in page.tags if tag.get("data-figure") == f"case-0-0-{motion}"
    )
    assert title == f"{word} difference of half-track change against wheel travel, log axis"
    worst = getattr(run.records[1].errors["half_track_change"], motion)
    assert f"Worst {number(worst.max_abs)} {of}: one, sample {worst.worst_step} (" in page.text
    for each in run.records[:2]:
        [curve] = traces(page, f"case-0-0-{motion}", each.engine, "lines+markers")
        deviation: Deviation = getattr(each.errors["half_track_change"], motion)
        expected = distances(
            getattr(each.outputs["half_track_change"], motion), getattr(series(GRID), motion)
        )
        assert curve["y"] == pytest.approx(expected, rel=5e-3)  # three digits are kept
        assert curve["y"][deviation.worst_step] == pytest.approx(deviation.max_abs, rel=5e-3)
        assert max(curve["y"]) == pytest.approx(deviation.max_abs, rel=5e-3)
    [ring] = traces(page, f"case-0-0-{motion}", "worst", "markers")
    top = getattr(run.records[1].errors["half_track_change"], motion)
    assert (ring["x"], ring["y"]) == ([1000 * GRID[top.worst_step]], [top.max_abs])
    assert "case-0-0-acceleration" not in page.data["figures"]


def test_figures_without_reference_show_differences(tmp_path):
    run = results("consensus_only")
    native, one, _ = run.records
    nothing = Deviations(
        position=None, velocity=None, acceleration=None, reason="the case has no reference"
    )
    native = replace(native, errors=dict.fromkeys(native.errors, nothing), outcome=Outcome.UNJUDGED)
    output = {
        name: judged(one.outputs[name], native.outputs[name], 1e-9, "native")
        for name in one.outputs
    }
    page = report(Results(run=run.run, records=[native, replace(one, errors=output)]), tmp_path)
    assert traces(page, "case-0-0", "reference", "lines") == []
    assert traces(page, "case-0-0-position", "native", "lines+markers") == []
    [curve] = traces(page, "case-0-0-position", "one", "lines+markers")
    assert max(curve["y"]) == pytest.approx(output["half_track_change"].position.max_abs, rel=5e-3)  # type: ignore[union-attr]
    words = page.words
    assert "1 of 1 comparisons is outside tolerance, 1 not judged" in words
    assert "✗ fail 1 ? not judged 1" in words
    assert "Not judged: native on strut the case has no reference" in words


def test_missing_values_leave_gaps(tmp_path):
    run = results()
    whole = run.records[1]
    holed = [
        None if k == 4 else math.nan if k == 5 else v
        for k, v in enumerate(series(GRID, 3e-9).position)
    ]
    output = replace(whole.outputs["half_track_change"], position=holed)
    broken = replace(
        whole, outputs={"half_track_change": output}, solved=19, us_per_step=None, rank=None
    )
    page = report(replace(run, records=[broken]), tmp_path)
    [curve] = traces(page, "case-0-0", "one", "lines")
    assert [k for k, value in enumerate(curve["x"]) if value is None] == [4, 5]
    [errors] = traces(page, "case-0-0-position", "one", "lines+markers")
    assert [k for k, value in enumerate(errors["y"]) if value is None] == [4, 5]
    assert "19 of 21 samples were solved" in page.text
    overview = page.text[page.text.index("Overview") : page.text.index("Engines")]
    assert "µs" not in overview


def test_zero_errors_have_floor(tmp_path):
    figure = report(results(), tmp_path).data["figures"]["case-0-0-position"]
    errors = [e for trace in figure["data"] if trace["mode"] == "lines+markers" for e in trace["y"]]
    assert 0 in errors
    assert 0 < figure["layout"]["meta"]["floor"] < min(e for e in errors if e)
    assert figure["layout"]["yaxis"]["ticktext"][0] == "exactly 0"


@pytest.mark.parametrize(("tolerance", "floor"), [(2e-3, 1e-10), (0.0, 1e-16)])
def test_exact_agreement_has_floor(tolerance, floor, tmp_path):
    run = results()
    found = series(GRID)
    errors = {"half_track_change": judged(found, found, tolerance, "closed_form")}
    exact = replace(run.records[0], outputs={"half_track_change": found}, errors=errors)
    figure = report(replace(run, records=[exact]), tmp_path).data["figures"]["case-0-0-position"]
    assert figure["layout"]["meta"]["floor"] == pytest.approx(floor, abs=0.0)


def test_long_series_are_thinned(tmp_path):
    driver = [1e-4 * k for k in range(3 * SAMPLES)]
    spike = 1234
    found = series(driver)
    position = [
        v + (1e-7 if k == spike else 0.0) for k, v in enumerate(found.position) if v is not None
    ]
    output = replace(found, position=position)
    errors = {"half_track_change": judged(output, series(driver), 1e-9, "closed_form")}
    long = record(
        "strut",
        "closed_form",
        "one",
        0,
        driver,
        outputs={"half_track_change": output},
        errors=errors,
    )
    run = Results(
        run=results().run,
        records=[long],
        references={"strut": {"half_track_change": series(driver)}},
    )
    page = report(run, tmp_path)
    [curve] = traces(page, "case-0-0", "one", "lines")
    assert SAMPLES <= len(curve["x"]) <= SAMPLES + 2
    assert len(page.data["drivers"]["case-0"]) == len(curve["x"])
    [drawn] = traces(page, "case-0-0-position", "one", "lines+markers")
    assert max(drawn["y"]) == pytest.approx(1e-7, rel=5e-3)
    assert "Thinned figures: strut" in page.text


def test_figures_of_earlier_runs(tmp_path):
    runs = [
        Past(run=str(k), engine="one", errors={"position": 1.0}, us_per_step=2.0) for k in range(2)
    ]
    for past, drawn in ((runs[1:], False), (runs, True)):
        write_report(results(), tmp_path / "report.html", history={"strut": past})
        text = (tmp_path / "report.html").read_text("utf-8")
        assert ("<h3>Earlier runs</h3>" in text, "case-0-trend-position-error" in text) == (
            drawn,
            drawn,
        )


def test_legend_swatches_differ(tmp_path):
    """What the legend shows is what is drawn: symbols without one would all be told by the same
    cross.
    """
    records = [
        record("strut", "closed_form", f"engine {k}", 1e-12, GRID) for k in range(len(SYMBOLS))
    ]
    write_report(Results(run={}, records=records), tmp_path / "report.html")
    legend = (
        (tmp_path / "report.html").read_text("utf-8").split("Curves shown")[1].split("</div>")[0]
    )
    shapes = [each.partition("/>")[2] for each in re.findall(r"<svg(.*?)</svg>", legend, re.DOTALL)]
    assert len(shapes) == len(set(shapes)) == len(SYMBOLS)


def test_round_off_is_drawn_within_tolerance(tmp_path):
    """Else the round-off of an output that stays where it is looks like a motion."""
    still = replace(series(GRID), position=[1e-17 * (k % 3) for k in range(21)])
    errors = {"x": judged(still, replace(still, position=[0.0] * 21), 1e-9, "native")}
    run = results("consensus_only")
    one = replace(run.records[1], outputs={"x": still}, errors=errors)
    native = replace(run.records[0], outputs={"x": still}, errors={})
    figures = report(Results(run=run.run, records=[native, one]), tmp_path).data["figures"]
    assert figures["case-0-0"]["layout"]["xaxis"]["range"] == pytest.approx([-2e-6, 2e-6])
    moving = report(results(), tmp_path).data["figures"]["case-0-0"]["layout"]
    assert "range" not in moving["xaxis"]


def test_measured_values_are_points(tmp_path):
    """Third-party data are discs above the curves, a recording's values marks without a line."""
    run = results("third_party_data")
    recorded = [replace(each, mode="recorded") for each in run.records[1:2]]
    run = replace(run, records=[run.records[0], *recorded])
    page = report(run, tmp_path)
    figure = page.data["figures"]["case-0-0"]["data"]
    assert figure[-1]["meta"] == "reference"
    expected = [1000 * v for v in series(GRID).position if v is not None]
    for name in ("reference", "one · recorded"):
        [points] = traces(page, "case-0-0", name, "markers")
        assert len(points["x"]) == len(GRID)
        assert not traces(page, "case-0-0", name, "lines")
    assert figure[-1]["x"] == pytest.approx(expected, rel=1e-9)
    assert traces(page, "case-0-0", "native", "lines")
