"""Results of extensions are whole in each of their forms, as those of a run are."""

import dataclasses
import json

import kincheck
import pytest
from kincheck import Supplied
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
from kincheck.core.report import sections
from rich.console import Console

from ...support.examples import examples
from ...support.planted import as_json, missing, on_terminal, text_of_page, unexplained

OF_SWEEP, OF_KC, OF_EXPLAIN = examples(__file__, "of_sweep", "of_kc", "of_explain")


@pytest.fixture(autouse=True)
def wide(monkeypatch):
    monkeypatch.setenv("COLUMNS", "1000")


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


OF_COMPARE = [(r"exceeded|other\..*", "csv", "words")]


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
