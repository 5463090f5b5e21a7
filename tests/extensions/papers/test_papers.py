"""Summaries of two pages, and figures as files."""

import math
import re
import shutil
from pathlib import Path

import pytest
from kincheck.core.cli.main import main
from kincheck.core.extensions.hardpoints.templates import TEMPLATES, sample_table
from kincheck.core.extensions.papers import browser
from kincheck.core.extensions.papers.paper import paper_of
from kincheck.core.extensions.papers.summary import summary
from kincheck.core.extensions.reports.svg import svg
from kincheck.core.harness.record import to_json
from kincheck.core.report.sections import Report, Section
from msgspec.structs import replace

from ...support.browser import CHROMIUM
from ...support.examples import examples
from ...support.strut_results import GRID, results, series

(SLIPS,) = examples(__file__, "slips")

NUMBER = r"(-?[\d.]+)"


def measured():
    return results("third_party_data")


def many_cases():
    """Forty cases with long names and messages: more than two pages hold."""
    run = results()
    names = [f"a_case_with_a_name_that_is_long_{k}" for k in range(40)]
    records = [
        replace(each, case=name, message=f"{name} {k}: " + 30 * "it says why, and ")
        for name in names
        for k, each in enumerate(run.records)
    ]
    (facts,) = run.run["cases"].values()
    (known,) = run.references.values()
    return replace(
        run,
        run=run.run | {"cases": dict.fromkeys(names, facts)},
        records=records,
        references=dict.fromkeys(names, known),
    )


def wide_tables():
    columns = ["output", "design", *("a column of numbers" for _ in range(7))]
    rows = [[f"output {k}", "b", *["-12.345 (+0.00123456)"] * 7] for k in range(300)]
    sections = [Section(f"Table {k}", [60 * "word "] * 9, [], columns, 2, rows) for k in range(4)]
    return Report("compare", 12 * "a name against another, ", [200 * "fact "], sections)


def marks_at(drawn):
    """Return the places of the discs of a figure."""
    disc = rf'translate\({NUMBER} {NUMBER}\)"[^>]*stroke="#7f7f7f"'
    return [(float(x), float(y)) for x, y in re.findall(disc, drawn)]


def test_summary_says_verdict_and_gaps():
    page = summary(paper_of(measured()))
    assert re.search(
        r"<h1>1 of 2 comparisons is outside tolerance; farthest beyond its tolerance:"
        r" (half-track|wheel-base) change \(600 %\)\.</h1>",
        page,
    )
    # the engine one is off by 6e-9 m, six times its tolerance
    assert re.search(r'class="wrong">.*third-party data.*1e-9 m.*6e-9 m.*600 %', page, re.S)
    assert "two on strut (unavailable): two is not installed." in page
    assert "half-track change, wheel-base change: acceleration: none." in page
    assert page.count("<svg xmlns") == 2
    assert "<script" not in page
    page = summary(paper_of(measured()), "run 7 against run 6: 1 new failure")
    assert "<h1>run 7 against run 6: 1 new failure. 1 of 2 comparisons" in page


def test_measured_points_are_discs():
    """All samples of a measurement, as far apart as their values; an oracle is a line."""
    drawn = [svg(each.figure) for each in paper_of(measured()).diagrams.values()]
    places = marks_at(drawn[0].partition("</svg>")[0])
    assert len(places) == len(GRID)
    values = series(GRID).position
    scale = (places[-1][0] - places[0][0]) / (values[-1] - values[0])
    for (x, _), value in zip(places, values, strict=True):
        assert x - places[0][0] == pytest.approx(scale * (value - values[0]), abs=0.2)
    assert [*zip(*places, strict=True)][1] == tuple(sorted((y for _, y in places), reverse=True))
    assert not marks_at(svg(next(iter(paper_of(results()).diagrams.values())).figure))


@pytest.mark.parametrize(
    ("kind", "values"), [("linear", [-2.0, 0.0, 3.0]), ("log", [1e-2, 1.0, 100.0])]
)
def test_values_stand_on_their_ticks(kind, values):
    """A marker at the value of a tick is on the tick's line."""
    side = {"type": kind, "title": {"text": "a < b"}}
    marks = {"marker": {"color": "#7f7f7f"}, "mode": "markers", "x": values, "y": values}
    drawn = svg({"data": [marks], "layout": {"xaxis": {}, "yaxis": side}})
    lines = dict.fromkeys(re.findall(rf'y="{NUMBER}" text-anchor="end"[^>]*>([^<]+)<', drawn))
    heights = {float(text.replace("−", "-")): float(y) - 4 for y, text in lines}
    places = dict(zip(values, [y for _, y in marks_at(drawn)], strict=True))
    shared = {*heights} & {*places}
    assert len(shared) == len(values)
    for value in shared:
        assert heights[value] == pytest.approx(places[value], abs=0.1)
    first, middle, last = map(math.log10 if kind == "log" else float, values)
    share = (places[values[1]] - places[values[0]]) / (places[values[2]] - places[values[0]])
    assert share == pytest.approx((middle - first) / (last - first), abs=1e-3)
    assert "a &lt; b" in drawn


def test_worst_judged_output_is_first():
    run = measured()
    worse = {
        each.engine: replace(
            each,
            errors={
                "half_track_change": each.errors["half_track_change"],
                "wheelbase_change": replace(
                    each.errors["wheelbase_change"],
                    position=replace(each.errors["wheelbase_change"].position, max_abs=7e-9),
                ),
            },
        )
        for each in run.records[:2]
    }
    found = paper_of(replace(run, records=[*worse.values()]))
    assert found.four[0].plot.title.startswith("wheel-base change against")
    assert "wheel-base change" in found.verdict


@pytest.fixture
def without_browser(monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name: None)


def test_stored_run_becomes_a_paper(tmp_path, without_browser, capsys):
    """Also without a browser, which is said in one line for each option."""
    (tmp_path / "results.json").write_bytes(to_json(measured()))
    page, figures = tmp_path / "short.html", tmp_path / "figures"
    words = ["report", str(tmp_path / "results.json"), "--summary", str(page)]
    main([*words, "--figures", str(figures)])
    assert "farthest beyond its tolerance" in page.read_text("utf-8")
    assert {each.name for each in figures.iterdir()} == {
        f"{what}{name}_change_against_wheel_travel.svg"
        for what in ("", "position_difference_of_", "velocity_difference_of_")
        for name in ("half_track", "wheel_base")
    }
    said = [line for line in capsys.readouterr().err.splitlines() if "Chromium" in line]
    assert said == [
        f"kincheck: no PDF of {page}: no Chromium is installed.",
        f"kincheck: no PNG in {figures}: no Chromium is installed.",
    ]


def test_compare_and_kc_become_papers(tmp_path, without_browser, capsys):
    lines = sample_table(TEMPLATES["double_wishbone"])
    (tmp_path / "old.csv").write_text(lines)
    (tmp_path / "new.csv").write_text(
        lines.replace("tierod_outer,75,560,148", "tierod_outer,75,560,151")
    )
    page, figures = tmp_path / "short.html", tmp_path / "figures"
    files = ["--summary", str(page), "--figures", str(figures)]
    tables = [str(tmp_path / name) for name in ("old.csv", "new.csv")]
    main(["compare", *tables, "--travel", "40mm:3", "--tolerance", "toe=0.05 deg", *files])
    assert re.search(
        r"<h1>new against old: toe of new differs by .*, more than 0.05 deg",
        page.read_text("utf-8"),
    )
    assert "tierod_outer" in page.read_text("utf-8")
    drawn = {each.stem for each in figures.iterdir()}
    assert {"toe_against_wheel_travel", "camber_against_wheel_travel"} <= drawn
    main(["kc", tables[0], "--travel", "40mm:3", "--summary", str(page)])
    text = page.read_text("utf-8")
    assert "all 3 samples have an equilibrium" in text
    assert [*map(str.strip, re.findall(r'fill="#16191d">(\w+) \[deg\]', text))][:2] == [
        "toe",
        "camber",
    ]


@pytest.mark.parametrize(
    ("words", "said"),
    SLIPS,
)
def test_slips_of_files_are_early(tmp_path, monkeypatch, words, said, capsys):
    monkeypatch.chdir(tmp_path)
    Path("taken").write_text("")
    assert main(["run", "rssr", "--engine", "native", *words]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.nightly
@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
@pytest.mark.parametrize("shown", [measured, many_cases, wide_tables])
def test_summary_prints_on_two_pages(shown):
    made = browser.pdf(summary(paper_of(shown()), 20 * "a sentence "))
    assert len(re.findall(rb"/Type\s*/Page\b", made)) == 2


@pytest.mark.nightly
@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
def test_pictures_are_those_of_their_figures():
    drawn = {name: svg(each.figure) for name, each in paper_of(measured()).diagrams.items()}
    found = browser.png(drawn)
    assert {*found} == {*drawn}
    assert len({*found.values()}) > 1
    assert all(each.startswith(b"\x89PNG") for each in found.values())
