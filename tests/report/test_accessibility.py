"""Pages in a browser under axe, where it is installed."""

from __future__ import annotations

import pytest
from kincheck.core.harness.labels import output_label
from kincheck.core.report.figures import Effort, Past, Style, precision_figure
from kincheck.core.report.page_model import Plot
from kincheck.core.report.report import write_report
from kincheck.core.report.sections import Diagram, Report, Section, page

from ..support.browser import AXE
from .test_report_browser import several, strut

pytestmark = pytest.mark.skipif(
    not AXE.is_file(), reason="axe is not installed: npm install axe-core"
)


def run_page(file):
    past = [Past(run, "one", {"position": 1e-3}, 10.0) for run in ("2026-11-01", "2026-11-02")]
    efforts = [Effort("one", "tol 1e-6", 1e-7, 20.0), Effort("one", "tol 1e-3", 1e-4, 9.0)]
    write_report(strut(), file, history={"strut": past}, precision={"strut": efforts})


def many_cases_page(file):
    write_report(several(), file)


def bench_page(file):
    figure = precision_figure([Effort("one", "default", 1e-7, 20.0)], {})
    diagram = Diagram(Plot("speed", "error against time", "."), figure, [Style.number(0, "one")])
    columns, rows = ("", output_label("toe")), [["one", "2"]]
    section = Section("Speed", ["It is fast."], ["Measured."], columns, 1, rows, [diagram])
    file.write_text(page(Report("bench", "A benchmark", ["facts"], [section])), "utf-8")


@pytest.mark.parametrize("written", [run_page, many_cases_page, bench_page])
def test_report_pages_pass_axe(written, browser, tmp_path):
    written(file := tmp_path / "page.html")
    browser.visit(file.as_uri())
    browser.run("all('details').forEach((each) => { each.open = true; }); await settled();")
    assert browser.violations() == []
