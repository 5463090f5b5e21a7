"""Suspension outputs that a table of hardpoints has by default, against an independent solution of
rods and lines.
"""

import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.cli.main import main
from kincheck.core.errors import CaseError
from kincheck.core.extensions.hardpoints.templates import TEMPLATES, sample_table

from ...support.case_texts import complains, rows, supplied, write
from ...support.examples import examples
from ...support.rods_of_templates import CLOSE, DATA, RODS, expected, solved
from ...support.written_again import written_again

(FAULTS,) = examples(__file__, "faults")


def sample(folder, name, travel="0.05:11", extra=""):
    file = folder / f"{name}.csv"
    file.write_text(sample_table(TEMPLATES[name]) + extra)
    return load(file, Supplied(travel=travel))


@pytest.mark.parametrize("name", RODS)
def test_template_outputs_in_closed_form(tmp_path, name):
    case = sample(tmp_path, name)
    found, at = solved(case), TEMPLATES[name].sample
    for k, travel in enumerate(case.sweep.values):
        true = expected(name, at, travel)
        values = {key: found[key][k] for key in found if not key.endswith(".per_travel")}
        assert values.keys() == true.keys()
        assert values == pytest.approx(true, abs=CLOSE)


@pytest.mark.parametrize("name", RODS)
def test_hardpoint_case_file_round_trip(tmp_path, name):
    written_again(sample(tmp_path, name), tmp_path)


def test_road_outputs_need_wheel_radius():
    case = load(DATA / "chrono_double_wishbone.json")
    names = {output.name for output in case.outputs}
    assert {"toe", "camber", "caster", "spring_ratio", "damper_ratio"} <= names
    assert not names & {"scrub_radius", "mechanical_trail", "roll_center_height"}
    assert "--wheel-radius" in case.source
    track = next(each for each in case.outputs if each.name == "half_track_change")
    assert track.at == "wheel_center"


@pytest.mark.parametrize(("options", "extra", "message"), rows(FAULTS))
def test_suspension_option_and_wheel_faults(tmp_path, options, extra, message):
    places = TEMPLATES["double_wishbone"].sample.items()
    lines = [
        f"{role},{1e3 * x!r},{1e3 * y!r},{1e3 * z!r}"
        for role, (x, y, z) in places
        if role != "wheel_contact"
    ]
    file = write(tmp_path, "\n".join(["name,x,y,z", *lines, extra]), "car.csv")
    said = supplied(f"template=double_wishbone units=mm axes=iso {options}")
    complains(file, message, said)


def test_templates_command_prints_runnable_tables(tmp_path, capsys):
    assert main(["templates"]) == 0
    printed = capsys.readouterr().out
    assert [name for name in TEMPLATES if f"# template: {name}\n" not in printed] == []
    assert main(["templates", "five_link"]) == 0
    file = tmp_path / "car.csv"
    file.write_text(capsys.readouterr().out)
    assert main(["run", str(file), "--engine", "native"]) == 2  # nothing to compare
    assert "column meaning" in capsys.readouterr().err
    assert main(["templates", "five_links"]) == 2
    assert "'five_link'" in capsys.readouterr().err


def test_template_samples_have_all_roles():
    for template in TEMPLATES.values():
        names = {role.name for role in template.roles}
        assert names <= template.sample.keys()
        assert template.sample.keys() <= names | {role.name for role in template.optional}


def test_template_comment_of_table(tmp_path):
    file = tmp_path / "car.csv"
    file.write_text(sample_table(TEMPLATES["mcpherson"]))
    with pytest.raises(CaseError, match="expected mcpherson"):
        load(file, Supplied("five_link"))
    assert load(file, Supplied("mcpherson")).mechanism == load(file).mechanism


@pytest.mark.parametrize(
    ("travel", "ends"),
    {
        "50mm": (-0.05, 0.05),
        "5 cm:7": (-0.05, 0.05),
        "-80:80mm:33": (-0.08, 0.08),
        "-80mm:0.12m:33": (-0.08, 0.12),
        "-0.04:0.12:33": (-0.04, 0.12),
        "2inch": (-0.0508, 0.0508),
    }.items(),
)
def test_travel_option_units(tmp_path, travel, ends):
    case = sample(tmp_path, "double_wishbone", travel)
    assert (case.sweep.values[0], case.sweep.values[-1]) == pytest.approx(ends, rel=1e-15)
