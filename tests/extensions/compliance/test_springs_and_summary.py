"""Springs of the option --spring, values without a meaning, and the summary."""

import json
import re

import kincheck
import pytest
from kincheck.core.cli.main import main
from kincheck.core.errors import KincheckError
from kincheck.core.extensions.hardpoints.templates import TEMPLATES, sample_table

from ...support.examples import examples

(OTHER,) = examples(__file__, "other")


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    file = tmp_path_factory.mktemp("table") / "car.csv"
    file.write_text(sample_table(TEMPLATES["double_wishbone"]))
    return file


def test_table_without_spring_lacks_rate(table, tmp_path, capsys):
    files = [f"--{kind}={tmp_path / kind}" for kind in ("json", "out")]
    assert main(["kc", str(table), "--travel=-20mm:20mm:3", *files]) == 0
    found = json.loads((tmp_path / "json").read_text())
    assert found["wheel_load"] == [None] * 3
    for name in ("wheel_load", "wheel_rate", "roll_stiffness"):
        assert name not in found["outputs"]
        assert 'Add --spring "spring: 35 N/mm"' in found["not_computed"][name]
    assert found["outputs"]["toe.per_lateral_force"]["position"] == [0.0] * 3
    assert {x for row in found["compliance"][0] for x in row} == {0.0}
    quoted = {each["name"]: each["value"] for each in found["summary"]}
    assert quoted["wheel_rate"] is None
    assert quoted["toe.per_travel"] == found["outputs"]["toe.per_travel"]["position"][1]
    page = (tmp_path / "out" / "kc.html").read_text()
    assert page.index("Summary") < page.index("<h3>toe</h3>") < page.index("<details>")
    assert "wheel load over travel" not in page
    assert not re.search(r">\S*e-[12]\d<", page)
    said = capsys.readouterr().err
    assert "note: nothing is elastic" in said
    assert "--bushings FILE" in said


def test_spring_rates_follow_virtual_work(table):
    """A spring of rate k, compressed by F: the wheel carries F i, at a rate of k i² without F."""
    springs = {"spring": (35e3, 3400.0), "tire": 2e5}
    loaded = kincheck.compliance(table, [0.0, 1e-5], springs=springs).travel
    free = kincheck.compliance(table, [0.0], springs={"spring": 35e3, "tire": 2e5}).travel
    ratio = free.outputs["spring_ratio"].values[0]
    rate = free.outputs["wheel_rate"].values[0]
    assert rate == pytest.approx(35e3 * ratio**2, rel=1e-12)
    assert free.outputs["ride_rate"].values[0] == pytest.approx(1 / (1 / rate + 1 / 2e5), rel=1e-12)
    assert loaded.wheel_load[0] == pytest.approx(3400.0 * ratio, rel=1e-12)
    ratios = loaded.outputs["spring_ratio"].values
    more = 3400.0 * (ratios[1] - ratios[0]) / 1e-5
    assert loaded.outputs["wheel_rate"].values[0] == pytest.approx(rate + more, rel=1e-5)


def test_axle_has_springs_on_both_sides(table, tmp_path):
    out = tmp_path / "kc.json"
    more = ["--spring=spring: 35 N/mm, 3.4kN", "--axle=roll", "--travel=0", f"--json={out}"]
    assert main(["kc", str(table), *more]) == 0
    found = json.loads(out.read_text())["outputs"]
    loads = [found[f"wheel_load_{side}"]["position"][0] for side in ("left", "right")]
    assert loads == pytest.approx([3400.0 * found["left_spring_ratio"]["position"][0]] * 2)
    rate = found["wheel_rate_opposite"]["position"][0]
    track = found["track"]["position"][0]
    assert found["roll_stiffness"]["position"][0] == pytest.approx(track**2 / 2 * rate)


def test_spring_has_the_tables_own_name(tmp_path, capsys):
    """Of a German table: what both points are called, one of them, or kincheck's name."""
    table, out = tmp_path / "achse.csv", tmp_path / "kc.json"
    text = sample_table(TEMPLATES["double_wishbone"])
    table.write_text(
        text.replace("spring_lower,", "Feder unten,").replace("spring_upper,", "Feder oben,")
    )
    names = tmp_path / "namen.toml"
    names.write_text('spring_lower = "Feder unten"\nspring_upper = "Feder oben"\n')
    line = ["kc", str(table), f"--names={names}", "--travel=0", f"--json={out}"]
    rates = list[float]()
    for name in ("spring", "Feder", "Feder oben"):
        assert main([*line, "--spring", f"{name}: 35 N/mm"]) == 0
        rates.append(json.loads(out.read_text())["outputs"]["wheel_rate"]["position"][0])
    assert rates == [rates[0]] * 3
    capsys.readouterr()
    assert main([*line, "--spring", "Dämpfer: 35 N/mm"]) == 2
    assert "no spring 'Dämpfer', but spring, Feder unten, Feder oben, Feder, tire" in (
        capsys.readouterr().err
    )
    assert main([*line, "--spring=spring: 35 N/mm", "--spring=Feder: 35 N/mm"]) == 2
    assert "already. Leave out 'Feder'" in capsys.readouterr().err


@pytest.mark.parametrize(("spring", "said"), OTHER)
def test_other_springs_are_refused(table, capsys, spring, said):
    assert main(["kc", str(table), "--travel=0", "--spring", spring]) == 2
    assert said in capsys.readouterr().err


def test_case_without_ratio_names_forces():
    with pytest.raises(KincheckError, match=r'Add \[forces.NAME\] type = "spring_damper"'):
        kincheck.compliance("mcpherson_strut_loaded", [0.0], springs={"spring": 1e4})
