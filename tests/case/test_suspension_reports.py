"""Units and signs of suspension outputs in results, tables and reports."""

import json
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from kincheck.adapters.native import Native
from kincheck.core.cli import main
from kincheck.core.harness.record import Outcome, from_json, to_json
from kincheck.core.harness.run import run
from kincheck.core.report.junit import to_junit
from kincheck.core.report.matrix import print_matrix, to_markdown
from kincheck.core.report.report import write_report
from kincheck.core.report.table import print_table

from ..studies.test_vary import HEAD
from ..support.suspension_changes import TOE, changed
from ..support.suspension_files import STRUT, TABLE, loaded, unreferenced

SIGNS = (
    "ISO 8855 (x forward, y left, z up); front right wheel; forward is [-1, 0, 0] and up [0, 0, 1]"
    " in the case's axes"
)


HEADING = f"Signs of mcpherson_suspension: {SIGNS}"


@dataclass(frozen=True)
class Bent:
    """The native engine with a wheel that is twisted by a micrometre at its axis."""

    native: Native = field(default_factory=Native)
    name: str = "bent"
    mode: str = "projection"
    loop: str = "python"

    def __getattr__(self, name):
        return getattr(self.native, name)

    def solve(self, model, case, tol):
        found = self.native.solve(model, case, tol)
        spin = found.points["~wheel_center.spin"]
        twisted = replace(spin, position=spin.position + np.array([1e-6, 0.0, 0.0]))
        return replace(found, points={**found.points, "~wheel_center.spin": twisted})


@pytest.fixture(scope="module")
def results():
    return run([loaded(STRUT)], [Native(), Bent()], tol=1e-12)


def test_a_twisted_wheel_fails_in_radians(results):
    native, bent = results.records
    assert (native.outcome, bent.outcome) == (Outcome.PASS, Outcome.FAIL)
    error = bent.errors["toe"].position
    assert error.max_abs == pytest.approx(1e-6 / 0.25, rel=0.02)
    assert " rad at sample" in bent.message or " rad/m at sample" in bent.message
    assert 'message="toe: position is off by 4e-06 rad at sample' in to_junit(results).decode()


def test_signs_head_everything(results, tmp_path):
    again = from_json(to_json(results))
    assert again.run["cases"]["mcpherson_suspension"]["signs"] == SIGNS
    assert again.records[0].outputs["steer_angle"].sense == "positive: to the left"
    assert again.records[0].outputs["toe.per_travel"].unit == "rad/m"
    with (tmp_path / "table").open("w+") as file:
        print_table(results, file)
        print_matrix(results, file)
        file.seek(0)
        assert [line.startswith(HEADING) for line in file].count(True) == 2
        file.seek(0)
        assert next(file).startswith(HEADING)
    assert to_markdown(results).startswith(f"{HEADING}.\n\n|")
    write_report(results, tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text().replace("&#39;", "'")
    assert SIGNS in page
    assert "Positive: toe-in." in page
    assert "# signs: iso8855" in TABLE


def test_signs_head_the_tables_of_other_commands(tmp_path, capsys):
    parquet = pytest.importorskip("pyarrow.parquet")
    file = tmp_path / "strut.json"
    file.write_text(json.dumps(unreferenced(changed("sweep", steps=3)) | TOE))
    varied = {"ball": {"at": "ball", "sigma": 1.0}}
    (tmp_path / "vary.json").write_text(
        json.dumps({**HEAD, "mode": "monte_carlo", "hardpoints": varied})
    )
    sweep = [
        "sweep",
        "--samples",
        "2",
        "--out",
        str(tmp_path),
        "--store",
        str(tmp_path / "all.parquet"),
        "--vary",
    ]
    for command, first in (
        (["explain"], "output "),
        (["reference"], "native error"),
        ([*sweep, str(tmp_path / "vary.json")], "output"),
    ):
        assert main.main([*command, str(file)]) == 0
        lines = capsys.readouterr().out.splitlines()
        tables = [k for k, line in enumerate(lines) if line.strip().startswith(first)]
        assert tables
        assert all(any(SIGNS in line for line in lines[k - 3 : k]) for k in tables), command
    assert SIGNS in (tmp_path / "sweep.html").read_text().replace("&#39;", "'")
    assert (
        json.loads(parquet.read_schema(tmp_path / "all.parquet").metadata[b"kincheck"])["signs"]
        == SIGNS
    )


def test_tables_keep_lengths_and_angles_apart(results):
    """Lengths are shown where there are any; errors in other units have theirs beside them."""
    assert "[" not in cells(results)[1]
    native, bent = cells(run([loaded(unreferenced(STRUT | TOE))], [Native(), Bent()], tol=1e-12))
    # no truth, and nothing else to be compared with
    assert native.startswith("not judged, residual")
    assert bent.startswith("fail: 4e-06 [rad] · ")


def cells(results):
    row = next(
        line
        for line in to_markdown(results).splitlines()
        if line.startswith("| `mcpherson_suspension`")
    )
    return [cell.strip() for cell in row.split("|")[2:-1]]
