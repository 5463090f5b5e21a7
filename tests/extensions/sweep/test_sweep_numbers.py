"""Numbers of a study on the terminal and on its page, against its JSON."""

import io
import json
import re
from itertools import pairwise

import pytest
from kincheck.cases import load
from kincheck.core.extensions.sweep.page import page
from kincheck.core.extensions.sweep.sweep import sweep_designs
from kincheck.core.extensions.sweep.tables import print_sweep
from kincheck.core.extensions.sweep.variation_file import read_variation
from kincheck.core.harness.record import to_json

from ...report.page import Page
from ...support.examples import examples
from ...support.printed import assert_printed, assert_row, blocks, cells_of
from ...support.variations import vary_file

(VARIED,) = examples(__file__, "varied")

LIMITS = {"half_track_change": {"low": -11.0, "high": 0.05}, "wheelbase_change": {"high": 3.9}}
# enough for the index by quantiles, in two processes
SAMPLES, JOBS = 800, 2
MM = 1e3


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    """The results as JSON, the text on a narrow terminal, and the page."""
    return study(tmp_path_factory.mktemp("study"), "monte_carlo", samples=SAMPLES, jobs=JOBS)


def variation(folder, mode):
    return read_variation(vary_file(folder, VARIED, mode, limits=LIMITS), load("mcpherson_strut"))


def study(folder, mode, **options):
    results = sweep_designs(load("mcpherson_strut"), variation(folder, mode), **options)
    text = io.StringIO()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("COLUMNS", "60")
        print_sweep(results, text)
    return json.loads(to_json(results)), text.getvalue(), Page(page(results))


def test_study_dataset_and_summary_equal_json(tmp_path):
    case = load("mcpherson_strut")
    results = sweep_designs(case, variation(tmp_path, "one_at_a_time"))
    found, data = json.loads(to_json(results)), results.dataset()
    assert results.summary() == "mcpherson_strut, one_at_a_time, 11 variants, 2 outputs"
    assert [*data.coords["stroke"].values] == found["driver"]["stroke"]
    for name, each in found["outputs"].items():
        curves = dict(zip(data.coords["band"].values, data.variables[name].values.T, strict=True))
        assert {band: values.tolist() for band, values in curves.items()} == {
            band: each[band] for band in ("nominal", "mean", "min", "max", "standard_deviation")
        }


def effect(gradient):
    return abs(gradient["largest"]) * gradient["deviation"]


def gradients_of(found, name):
    """Return the gradients of an output, the largest effect first."""
    mine = [each for each in found["gradients"] if each["output"] == name]
    return sorted(mine, key=effect, reverse=True)


def label(name):
    return {"half_track_change": "half-track change", "wheelbase_change": "wheel-base change"}[name]


def rows_of(html, heading):
    """Return the rows of a table by their first cell, cells as single lines."""
    rows = ([" ".join(cell.split()) for cell in row] for row in html.rows(heading))
    return {row[0]: row[1:] for row in rows}


def test_printed_outputs_equal_json(shown):
    found, text, html = shown
    rows = rows_of(html, "Outputs")
    heads = ["unit", "least", "variant", "most", "variant", "largest st. dev.", "largest 1-99 %"]
    heads += ["largest effect (gradient x st. dev.)"]
    for (name, each), (title, block) in zip(found["outputs"].items(), blocks(text), strict=False):
        least, most = MM * min(each["min"]), MM * max(each["max"])
        variants = each["min_variant"], each["max_variant"]
        spread = MM * max(each["standard_deviation"])
        ends = zip(each["quantiles"]["0.01"], each["quantiles"]["0.99"], strict=True)
        width = MM * max(high - low for low, high in ends)
        top = gradients_of(found, name)[0]
        effects = [top["coordinate"], MM * effect(top)]
        assert title == name
        *cells, largest = cells_of(block, heads)
        assert_row(cells, ["mm", least, variants[0], most, variants[1], spread, width])
        assert_row(largest.split(), effects)
        *cells, both, largest = rows[label(name)]
        assert_row(cells, ["mm", least, most, spread])
        assert_row(both.split(", "), variants)
        assert_row(largest.split(), effects)


def test_printed_distributions_equal_json(shown):
    found, text, _ = shown
    heads = ["unit", "at stroke [mm]", "mean", "st. dev.", "1 %", "50 %", "99 %", "histogram"]
    start = len(found["outputs"])
    some = blocks(text)[start : 2 * start]
    for (name, each), (title, block) in zip(found["outputs"].items(), some, strict=True):
        k = each["histogram"]["sample"]
        quantiles = (each["quantiles"][p][k] for p in ("0.01", "0.5", "0.99"))
        values = [found["driver"]["stroke"][k], each["mean"][k], each["standard_deviation"][k]]
        assert title == name
        assert_row(
            cells_of(block, heads)[:-1], ["mm", *(MM * value for value in (*values, *quantiles))]
        )


def test_sweep_page_shows_least_index_place(shown):
    found, _, html = shown
    for each, (*_, where) in zip(found["limits"], html.rows("Specification limits"), strict=True):
        k = each["sample"]
        at = "" if k is None else f"wheel travel {MM * found['driver']['stroke'][k]:+.4g} mm"
        assert where.replace("\N{MINUS SIGN}", "-").strip() == at


def test_page_gradients_equal_json(shown):
    found, _, html = shown
    expected = [each for name in found["outputs"] for each in gradients_of(found, name)]
    rows = html.rows("Gradients")
    assert len(rows) == len(expected)
    for row, each in zip(rows, expected, strict=True):
        values = [each[key] for key in ("coordinate", "at_design", "largest", "sample")]
        assert_row(row, [*values, "(mm)/(mm)"])
    for row, each in zip(html.rows("What varies"), found["coordinates"], strict=True):
        assert_row(row, [each["name"], each["law"], MM * each["scale"], "", "mm"])


def test_page_effects_equal_json(tmp_path):
    found, text, html = study(tmp_path, "one_at_a_time")
    assert "(gradient x offset)" in text
    assert all(each["deviation"] == each["scale"] for each in found["gradients"])
    rows = html.rows("One at a time")
    for (name, offset, *cells), each in zip(rows, found["effects"], strict=True):
        assert_row([name, *offset.split()], [each["coordinate"], MM * each["offset"], "mm"])
        assert_row(cells, [MM * each["changes"][output] for output in found["outputs"]])


def test_study_figures_equal_json(shown):
    found, _, html = shown
    near = {"rel": 1e-6}  # seven digits are drawn
    figures = html.data["figures"]
    for index, (name, each) in enumerate(found["outputs"].items()):
        nominal = each["nominal"]
        curves = {"least": each["min"], "most": each["max"], "nominal": nominal}
        curves |= {"median": each["quantiles"]["0.5"]}
        for figure, less in (("envelope", [0.0] * len(nominal)), ("spread", nominal)):
            traces = figures[f"{figure}-{index}"]["data"]
            drawn = {trace.get("name"): trace["x"] for trace in traces}
            for curve, values in curves.items():
                of = [MM * (v - n) for v, n in zip(values, less, strict=True)]
                assert drawn[curve] == pytest.approx(of, **near, abs=1e-12)
            for k, (low, high) in enumerate((("0.01", "0.99"), ("0.05", "0.95"))):
                ends = (each["quantiles"][p] for p in (low, high))
                below, above = ([MM * (v - n) for v, n in zip(e, less, strict=True)] for e in ends)
                band = [*below, *reversed(above)]
                assert traces[k]["x"] == pytest.approx(band, **near, abs=1e-12)
        limits = {f"{end} limit": MM * value for end, value in ends_of(found, name)}
        lines = {trace["name"]: trace["x"] for trace in figures[f"envelope-{index}"]["data"][-2:]}
        assert {key: lines[key] for key in limits} == {
            key: pytest.approx([limit] * 2, **near) for key, limit in limits.items()
        }
        ordered = gradients_of(found, name)[::-1]
        for sign, bars in zip((-1.0, 1.0), figures[f"tornado-{index}"]["data"], strict=True):
            assert bars["y"] == [gradient["coordinate"] for gradient in ordered]
            lengths = [sign * MM * effect(gradient) for gradient in ordered]
            assert bars["x"] == pytest.approx(lengths, **near)
        bars, *lines = figures[f"histogram-{index}"]["data"]
        edges = [MM * edge for edge in each["histogram"]["edges"]]
        assert bars["y"] == each["histogram"]["counts"]
        assert bars["x"] == pytest.approx([sum(pair) / 2.0 for pair in pairwise(edges)], **near)
        assert bars["width"] == pytest.approx([b - a for a, b in pairwise(edges)], **near)
        assert {line["name"]: line["x"] for line in lines} == {
            key: pytest.approx([limit] * 2, **near) for key, limit in limits.items()
        }


def ends_of(found, name):
    """Return the ends of an output's limits that are given."""
    (limit,) = (each for each in found["limits"] if each["output"] == name)
    return [(end, limit[end]) for end in ("low", "high") if limit[end] is not None]


def test_study_speed_counts_processes(shown):
    found, text, html = shown
    measured = found["measured"]
    per_sample = measured["seconds"] / (SAMPLES * len(found["driver"]["stroke"]))
    assert measured["jobs"] == JOBS
    assert measured["us_per_sample_and_core"] == pytest.approx(1e6 * JOBS * per_sample)
    assert measured["variants_per_second"] == pytest.approx(SAMPLES / measured["seconds"])
    printed = dict(each.rsplit(" ", 1) for each in text.splitlines()[-1].split(", "))
    for key, value in measured.items():
        words = key.replace("_", " ")
        assert_printed(printed[words], value)
        assert re.search(rf"{words}\s+{re.escape(printed[words])}\s", html.text)
