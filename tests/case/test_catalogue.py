"""The catalogue of types, and the JSON Schema of case files."""

import json
import re
import tomllib
from dataclasses import dataclass
from pathlib import Path

import kincheck.cases
import msgspec
import pytest
from kincheck import CaseError, Joint, MechanismError, Spherical
from kincheck.core.case.io import schema
from kincheck.core.case.io.case_file import load_case
from kincheck.core.case.io.catalogue import case_schema, catalogue, rows_of
from kincheck.core.case.io.mechanism_sections import DRIVERS
from kincheck.core.case.io.schema import keys_of
from kincheck.core.cli import main
from kincheck.core.cli.lists import SCHEMAS, schema_of
from kincheck.core.harness.record import to_json
from kincheck.core.joints import Coupler
from kincheck.core.joints.base import directions, position
from kincheck.core.mechanism.loads import ELEMENTS
from kincheck.core.mechanism.motions import Motion

from ..support.case_texts import validator
from ..support.examples import examples

FAULTS, ROWS = examples(__file__, "faults", "rows")

# Rows as in textbooks: six less the freedoms left.


def types():
    return Joint.registry | Coupler.registry | DRIVERS | Motion.types()


def lines():
    """The printed lines by type."""
    return {line.split()[0]: line for line in catalogue() if line.startswith("  ")}


def test_list_joints_prints_every_type(capsys):
    assert main.main(["list", "--joints"]) == 0
    assert capsys.readouterr().out.splitlines() == list(catalogue())
    assert lines().keys() == {*types(), *ELEMENTS}


def test_catalogue_prints_every_key():
    printed = lines()
    for name, cls in (types() | ELEMENTS).items():
        for key in {*keys_of(cls).__struct_fields__} - {"type", "bodies", "joints", "motion"}:
            assert key in printed[name]


def test_catalogue_quotes_docstrings(own_joint_types):
    @dataclass(frozen=True)
    class Mute(Spherical):
        type = "mute_of_test_catalogue"

    found = lines()
    for name, cls in types().items():
        if cls.__module__.startswith("kincheck."):
            # a whole sentence, also where the source breaks the line
            meaning = found[name].rpartition("  ")[2]
            assert meaning.endswith(".")
            assert " ".join(cls.__doc__.split()).startswith(meaning)
    assert found["revolute"].endswith(
        "  Both bodies share the point and the axis and turn about it."
    )
    # not the signature that a dataclass has for a text
    assert found[Mute.type].endswith("rotation z")


def test_catalogue_rows_and_freedoms():
    ours = {
        name: rows_of(cls)
        for name, cls in Joint.registry.items()
        if cls.__module__.startswith("kincheck.")
    }
    assert ours == ROWS
    for name, rows in ROWS.items():
        assert f"  {rows} row" in lines()[name]
        assert f"  {6 - rows} free" in lines()[name]
    gear = " ".join(lines()["gear"].split())
    assert gear.startswith("gear ratio 1 row couples rotation and rotation")
    assert "points, (length)" in lines()["distance"]


def test_catalogue_of_type_without_specimen():
    @dataclass(frozen=True)
    class Picky(Spherical):
        type = "picky_of_test_catalogue"
        axes: tuple = directions()

        def __post_init__(self):
            super().__post_init__()
            raise MechanismError(f"{self}: no axes are good enough; give better ones")

    try:
        assert rows_of(Picky) is None
        assert "point, axes" in lines()[Picky.type]
        assert "? rows  ? free" in lines()[Picky.type]
    finally:
        del Joint.registry[Picky.type]


def test_list_schema_prints_every_key(capsys):
    """Read off the structures that take them; what is optional stands in brackets."""
    variation_schema = pytest.importorskip("kincheck.core.extensions.sweep.variation_schema")
    assert main.main(["list", "--schema"]) == 0
    said = capsys.readouterr().out
    structures = [
        each
        for room in (schema, variation_schema)
        for each in vars(room).values()
        if isinstance(each, type)
    ]
    keys = [
        each
        for each in structures
        if issubclass(each, msgspec.Struct) and each is not msgspec.Struct
    ]
    assert len(keys) >= 8
    keys += [*map(keys_of, ELEMENTS.values())]
    for name in [name for each in keys for name in msgspec.structs.fields(each)]:
        assert re.search(rf"[\[( ]{name.encode_name}\b", said), name.encode_name
    assert "kincheck-case/1" in said
    assert "kincheck-vary/1" in said


CASES = [*map(kincheck.cases.file, kincheck.cases.names())]
DATA = Path(__file__).parents[1] / "data"
OURS = [*CASES, *sorted((DATA / "case_files").glob("*.toml")), *sorted(DATA.glob("stress/*.toml"))]


@pytest.fixture(scope="module")
def case():
    return validator("case")


def read(path):
    return tomllib.loads(path.read_text("utf-8"))


def test_case_files_satisfy_schema(case):
    assert len(CASES) >= 32
    assert {path.name: found for path in OURS if (found := [*case.iter_errors(read(path))])} == {}


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: ".".join(map(str, fault[:-1])))
def test_schema_refuses_as_reader_does(case, tmp_path, fault):
    """Each fault by itself, in a file that is valid without it."""
    *places, last, value = fault
    tables = read(kincheck.cases.FOLDER / "rssr.toml")
    at = tables
    for place in places:
        at = at[place] if place in at else at.setdefault(place, {})
    at[last] = value
    file = tmp_path / "case.json"
    file.write_text(json.dumps(tables))
    with pytest.raises(CaseError):
        load_case(file)
    assert [*case.iter_errors(tables)]


def test_schema_defines_every_type():
    defined = case_schema()["$defs"]
    assert set(Joint.registry) <= {
        name.removeprefix("joints.") for name in defined if name.startswith("joints.")
    }
    assert {f"motion.{name}" for name in Motion.types()} <= set(defined)
    assert defined["joints.revolute"]["properties"]["type"] == {"const": "revolute"}
    assert defined["bodies"]["properties"]["fixed"]["description"] == "true or false"


def test_schema_contains_own_joint_type(own_joint_types):
    @dataclass(frozen=True)
    class Own(Joint):
        type = "own"
        point: tuple[float, float, float] = position()

        def primitives(self, i, j):
            return ()

    assert "point" in case_schema()["$defs"]["joints.own"]["properties"]


@pytest.mark.needs("suspects", "hardpoints")
def test_results_and_regressions_satisfy_schema(tmp_path, capfdbinary):
    found = kincheck.run(["rssr", "mcpherson_suspension"], "native")
    written = json.loads(to_json(found))
    results = validator("results")
    assert [*results.iter_errors(written)] == []
    written["records"][0]["outcome"] = "passed"
    assert [*results.iter_errors(written)]
    worse = [msgspec.structs.replace(each, outcome="fail") for each in found.records]
    for name, each in (("was", found), ("now", msgspec.structs.replace(found, records=worse))):
        (tmp_path / f"{name}.json").write_bytes(to_json(each))
    now, was = str(tmp_path / "now.json"), str(tmp_path / "was.json")
    assert main.main(["report", now, "--against", was, "--json", "-"]) == 1
    compared = json.loads(capfdbinary.readouterr().out)
    assert compared["findings"]
    assert [*validator("regression").iter_errors(compared)] == []


@pytest.mark.parametrize("name", SCHEMAS)
def test_schema_command_prints_schema(name, capfdbinary):
    assert main.main(["schema", name]) == 0
    assert json.loads(capfdbinary.readouterr().out) == json.loads(json.dumps(schema_of(name)))


def test_unknown_schema_is_refused(capsys):
    assert main.main(["schema", "cases"]) == 2
    assert "none of case, results, regression" in capsys.readouterr().err
