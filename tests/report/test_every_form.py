"""Every number, unit, note and reason of a result is on the terminal, in JSON, in JUnit and on the
page. What a form leaves out on purpose is listed here, with the reason.
"""

import dataclasses
import html
import io
import json
import re

import kincheck
import msgspec
import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.cli.main import main
from kincheck.core.extensions.compare import designs
from kincheck.core.extensions.compliance import page as compliance_page
from kincheck.core.extensions.compliance import study
from kincheck.core.extensions.compliance import views as compliance_views
from kincheck.core.extensions.explain.text import print_diagnosis
from kincheck.core.extensions.hardpoints.templates import TEMPLATES, sample_table
from kincheck.core.extensions.reports.reports import print_report
from kincheck.core.extensions.sweep import page as sweep_page
from kincheck.core.extensions.sweep.tables import print_sweep
from kincheck.core.harness.record import Explanation, Outcome, Suspect, to_json
from kincheck.core.history.findings import (
    Change,
    Finding,
    Kind,
    Loose,
    Regressions,
    RunName,
    Step,
)
from kincheck.core.report import junit, regressions, report, sections, table
from rich.console import Console

from ..support.planted import missing, text_of_page, unfilled
from ..support.strut_results import results

replace = msgspec.structs.replace


def on_terminal(write):
    def form(result):
        write(result, text := io.StringIO())
        return text.getvalue()

    return form


def as_json(result):
    return to_json(result).decode()


@pytest.fixture(autouse=True)
def wide(monkeypatch):
    monkeypatch.setenv("COLUMNS", "1000")


def unexplained(found, exempt):
    """Places that a form lacks without a reason, and reasons that no form needs any more."""
    lacking = {(place, form) for place, forms in found.items() for form in forms}
    excused = {
        each: {
            (place, form)
            for place, form in lacking
            if re.fullmatch(each[0], place) and form in each[1].split()
        }
        for each in exempt
    }
    needless = [each for each, pairs in excused.items() if not pairs]
    return sorted(lacking.difference(*excused.values())), needless


def filled(record):
    """The record with all that a record may say."""
    found = {
        name: replace(each, sense="outward is positive", acceleration=[0.5] * len(each.position))
        for name, each in record.outputs.items()
    }
    errors = {
        name: replace(
            each, acceleration=replace(each.position, max_abs=7.7e-7), lost=3, contradicted=2
        )
        for name, each in record.errors.items()
    }
    evidence = replace(
        record.evidence,
        units={"half_track_change": "inch"},
        signs="outward",
        grid="3 of 21 samples",
        limits={"half_track_change": "0.1 mm of reading"},
    )
    return replace(
        record,
        outputs=found,
        errors=errors,
        evidence=evidence,
        seconds=replace(record.seconds, compare=0.3, waited=0.4),
        faults=["balance of power off by 3 W"],
        table={"length": "mm"},
    )


def a_run():
    """A run with every outcome, notes, signs, reasons, and pairs that were not run."""
    run = results()
    native, one, two = run.records
    native = replace(filled(native), message="passes a pose", reasons={"rank": "it has none"})
    one = filled(one)
    more = [
        replace(two, engine=each, outcome=outcome, message=f"{each} says why")
        for each, outcome in (("three", Outcome.ERROR), ("four", Outcome.UNSUPPORTED))
    ]
    facts = run.run["cases"]["strut"] | {"notes": ["a rod is long"], "signs": "x is forward"}
    explained = Explanation(
        outputs=["half_track_change"],
        quantities=["position"],
        change="with another sign",
        difference=1.5e-10,
        tolerance=1e-9,
        unit="m",
    )
    suspect = Suspect(
        engines=["one"],
        agreement=1e-12,
        output="half_track_change",
        quantity="position",
        sample=3,
        difference=2.5e-3,
        tolerance=1e-9,
        unit="m",
        outputs={"half_track_change": ["velocity"]},
        explanations=[explained],
        unexplained=["wheelbase_change"],
        message="the reference is off; with another sign it fits",
    )
    about = {"cases": {"strut": facts, "other": {}}, "missing": [["other", "five", "projection"]]}
    return replace(
        run, run=run.run | about, records=[native, one, two, *more], suspects={"other": suspect}
    )


def page_of_run(result, tmp_path):
    report.write_report(result, file := tmp_path / "report.html")
    return text_of_page(file.read_text("utf-8"))


OF_RUN = [
    ("schema", "terminal junit page", "for programs"),
    (r"run\.(kincheck|tol|engines|cases\.source).*", "terminal junit", "of all records: the page"),
    (r"run\.cases\.driver\..*", "terminal junit page", "the description of the case"),
    (r".*\.truth", "junit", "each error names its standard"),
    (r".*\.(driver|details|settings|table)\..*", "terminal junit page", "curves and programs"),
    (
        r"(.*\.outputs|references)\.(position|velocity|acceleration|unit)",
        "terminal junit",
        "curves",
    ),
    (r".*\.outputs\.sense", "page", "once for each case"),
    (r".*\.(faults|errors\.(lost|contradicted))", "terminal junit page", "in the message"),
    (r".*\.seconds\.(compare|waited)", "page", "the time of a sample is without them"),
    (r"(.*\.outputs|references)\.reason", "terminal junit page", "in the reason of its errors"),
    (r".*\.errors\.\w+\.rms", "terminal page", "the largest error judges"),
    (r".*\.errors\.\w+\.(worst_step|against)", "terminal", "in the message of what fails"),
    (r".*\.evidence\.sha256", "terminal junit", "its first digits"),
    (r"records\.<one>\.(truth|evidence\..*)", "page", "once for each case"),
    (r"suspects\.(?!message).*", "terminal junit page", "in the message"),
    (r"records\.<(two|three|four)>\.(?!message).*", "terminal junit page", "solved nothing"),
]


def test_run_reaches_every_form(tmp_path):
    forms = {
        "terminal": on_terminal(table.print_outputs),
        "json": as_json,
        "junit": lambda result: html.unescape(junit.to_junit(result).decode()),
        "page": lambda result: page_of_run(result, tmp_path),
    }
    ours = ("strut", "other", "half_track_change", "wheelbase_change")
    run = a_run()
    assert unfilled(run) == {"Results.scenes"}
    assert unexplained(missing(run, forms, ours), OF_RUN) == ([], [])
    for outcome in Outcome:
        if not outcome.judged:
            last = replace(run.records[-1], outcome=outcome)
            changed = replace(run, records=[*run.records[:-1], last])
            for name, form in forms.items():
                assert (outcome.value if name == "json" else outcome.shown) in form(changed)


def table_of(tmp_path, name="a.csv", *changes):
    """A sample table of a double wishbone, changed."""
    text = sample_table(TEMPLATES["double_wishbone"])
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (file := tmp_path / name).write_text(text)
    return file


def few_outputs(case):
    kept = [each for each in case.outputs if each.name in ("toe", "camber")]
    return dataclasses.replace(case, outputs=tuple(kept))


OF_EXPLAIN = [
    ("schema", "terminal", "for programs"),
    (r"samples\.(largest|orientation|direction\..*)", "terminal", "as condition, sign and words"),
    (r"moves\..*", "terminal", "those that move together"),
    (r"determinacy\.joints", "terminal", "of joints that are not determined"),
    ("redundant_residual", "terminal", "of redundant rows"),
]


def test_explain_reaches_every_form(tmp_path):
    found = kincheck.explain(few_outputs(load(table_of(tmp_path))), samples=2)
    forms = {
        "terminal": on_terminal(
            lambda result, file: print_diagnosis(
                result, Console(file=file, width=400), verbose=True
            )
        ),
        "json": as_json,
    }
    assert unexplained(missing(found, forms), OF_EXPLAIN) == ([], [])


OF_KC = [
    (r".*(spin_axis|compliance)", "terminal page csv", "for programs"),
    (r".*wheel_center", "terminal page", "tables"),
    (r".*\.(sense|notes)", "terminal page csv", "once, as signs; notes go to standard error"),
    (r".*\.(axis|at|rigid|wheel_load)", "terminal", "curves"),
    ("case", "csv", "the name of the file"),
    (r"loads\..*\.unit", "csv", "as over travel"),
]


def test_kc_reaches_every_form(tmp_path):
    rubber = tmp_path / "b.toml"
    rubber.write_text("[bushings.lca_front]\nstiffness = 5e6\nturning_stiffness = 100.0\n")
    case = load(table_of(tmp_path), Supplied(bushings=rubber))
    found = study.compliance(case, [-0.02, 0.0, 0.02], {"lateral": [-100.0, 0.0, 100.0]})
    forms = {
        "terminal": lambda result: "\n".join(compliance_views.lines(result)),
        "json": lambda result: json.dumps(compliance_views.as_data(result)),
        "page": lambda result: text_of_page(compliance_page.page(result)),
        "csv": compliance_views.table,
    }
    lacking = missing(found, forms, [*found.travel.outputs], r"(?!cases\.).*")
    assert unexplained(lacking, OF_KC) == ([], [])


OF_COMPARE = [
    (r"exceeded|other\..*", "csv", "words"),
]


def test_compare_reaches_every_form(tmp_path):
    other = table_of(tmp_path, "b.csv", ("lca_outer,5,575,118", "lca_outer,7,575,121"))
    found = kincheck.compare(*(few_outputs(load(each)) for each in (table_of(tmp_path), other)))
    beyond = ("toe differs by more than is accepted",)
    found = type(found)(**{**vars(found), "exceeded": beyond, "other": {"track": "of a point"}})

    def page(result):
        return designs.comparison(result, result.exceeded)

    forms = {
        "terminal": on_terminal(lambda result, file: print_report(page(result), file)),
        "json": lambda result: as_json(designs.with_comparison(result, result.exceeded)),
        "page": lambda result: text_of_page(sections.page(page(result))),
        "csv": lambda result: str(designs.side_by_side(result)),
    }
    lacking = missing(found, forms, ["a", "b", "toe", "camber"], r"(?!results|cases|facts).*")
    assert unexplained(lacking, OF_COMPARE) == ([], [])


OF_SWEEP = [
    ("schema", "terminal page", "for programs"),
    ("mode|seed|quantiles_of", "terminal", "on the page"),
    ("retried", "page", "how, not what"),
    (r"coordinates\..*", "terminal page", "the file of the variation"),
    (r"gradients\..*", "terminal page", "the largest of each output; all in gradients.csv"),
    (r"outputs\.(?!unit).*", "terminal", "the ends over all samples"),
    (r"outputs\.(mean|count|standard_errors.*|histogram\..*)", "page", "in envelope.csv"),
    (r"limits\..*|incomplete", "terminal page", "counts behind the yield, in limits.csv"),
]


def test_sweep_reaches_every_form(tmp_path):
    vary = tmp_path / "vary.toml"
    vary.write_text(
        'schema = "kincheck-vary/1"\nmode = "monte_carlo"\n[units]\nlength = "mm"\n'
        '[hardpoints.ball]\nat = "lca_outer"\nsigma = 0.5\n'
    )
    found = kincheck.sweep(
        table_of(tmp_path), vary, samples=40, output=["toe", "camber"], limit=["toe:-2:2deg"]
    )
    forms = {
        "terminal": on_terminal(print_sweep),
        "json": as_json,
        "page": lambda result: text_of_page(sweep_page.page(result)),
    }
    lacking = missing(found, forms, ["a", "toe", "camber"], r"(?!run\.).*")
    assert unexplained(lacking, OF_SWEEP) == ([], [])


def a_change():
    """Changes between two runs, one of every sort."""
    name = {
        "name": "run 7",
        "number": 7,
        "started": "2026-11-28T03:17",
        "host": "h",
        "commit": None,
    }
    version = Change(what="mujoco", before="3.6.0", now="3.7.0")
    pair = {"case": "strut", "engine": "one", "mode": "projection"}
    drifted = Finding(
        **pair, kind=Kind.DRIFTED, message="x is worse", output="x", motion="position", since=5
    )
    lost = Finding(**pair, kind=Kind.FAILURE, message="fails now")
    step = Step(
        **pair,
        quantity="position",
        output="x",
        unit="m",
        first=5,
        started="2026-11-26T03:17",
        last=3,
        before=2.5e-12,
        now=4.5e-9,
        worse=True,
        changes=[version],
    )
    over = replace(step, quantity="time", output=None, before=0.25, now=0.75, repaired=6)
    return Regressions(
        run=RunName(**name),
        against=RunName(**name | {"name": "run 3", "number": 3}),
        reason="",
        pairs=12,
        failing=[("strut", "one", "projection"), ("strut", "two", "projection")],
        unjudged=[("strut", "three", "projection")],
        passed_by=[9],
        time_limit=1.3,
        findings=[drifted, lost],
        changes=[version],
        steps=[step, over],
        loose=[Loose(case="strut", output="x", runs=4, largest=2e-3, factor=500.0, why="old")],
    )


OF_REPORT = [
    ("schema|pairs|time_limit|loose.largest", "terminal markdown junit page", "for programs"),
    (r"(run|against)\.(number|started|host)", "terminal markdown junit page", "its name"),
    (r".*\.started", "terminal markdown page", "to the minute"),
    ("reason|unable", "terminal markdown junit page", "where there is nothing to compare with"),
    (r"(failing|unjudged)", "terminal markdown junit page", "their number"),
    (r"findings\..*(output|motion)", "terminal markdown page", "in the message"),
    (r"findings\..*(motion|since|mode|case|engine)", "junit", "of its test"),
    (r"(run|against|changes|steps|loose|passed_by).*", "junit", "changes of runs, not of tests"),
]


def test_report_reaches_every_form():
    run = results()
    forms = {
        "terminal": on_terminal(regressions.print_regressions),
        "markdown": regressions.to_markdown,
        "json": as_json,
        "junit": lambda found: html.unescape(junit.to_regression_junit(run, found).decode()),
        "page": lambda found: html.unescape(str(regressions.to_markup(found))),
    }
    assert unexplained(missing(a_change(), forms, ["strut"]), OF_REPORT) == ([], [])


ARM = """<robot name="r"><link name="base"/><link name="arm"><inertial><mass value="MASS"/>
<inertia ixx="0.2" iyy="0.3" izz="0.4"/></inertial></link>
<joint name="J" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
<limit lower="-1.0" upper="UPPER" effort="1" velocity="1"/></joint></robot>"""


@pytest.mark.parametrize(("mass", "upper", "lost"), [("2.00004", "1.2", 2), ("2.000016", "1.0", 0)])
def test_same_reaches_every_form(mass, upper, lost, tmp_path, capsys):
    """Words are printed as in JSON. Masses differ beyond 1e-5 of them, digits that tools print."""
    files = [tmp_path / "first.urdf", tmp_path / "second.urdf"]
    for file, numbers in zip(files, (("2", "1.0"), (mass, upper)), strict=True):
        file.write_text(ARM.replace("MASS", numbers[0]).replace("UPPER", numbers[1]))
    assert main(["same", *map(str, files), "--json", str(tmp_path / "found.json")]) == 0
    printed, found = capsys.readouterr().out, json.loads((tmp_path / "found.json").read_text())
    assert found["verdict"] == "same"
    assert len(found["lost"]) == lost
    for words in (*found["lost"], *found["notes"], found["reason"], f"{found['largest_m']:.1e} m"):
        assert words in printed
