"""The list of types is that of the registries, and its keys are those that case files take."""

import re
from dataclasses import dataclass

import msgspec
from kincheck.core.case.io import schema
from kincheck.core.case.io.catalogue import catalogue, rows_of
from kincheck.core.case.io.mechanism_sections import DRIVERS
from kincheck.core.case.io.schema import keys_of
from kincheck.core.cli import main
from kincheck.core.errors import MechanismError
from kincheck.core.joints import Coupler, Joint, Spherical
from kincheck.core.joints.base import directions
from kincheck.core.mechanism.loads import ELEMENTS
from kincheck.core.mechanism.motions import Motion
from kincheck.core.studies.variation import variation_schema

# Rows as in textbooks: six less the freedoms left.
ROWS = {
    "constant_velocity": 4,
    "cylindrical": 4,
    "distance": 1,
    "fixed": 6,
    "in_plane": 1,
    "inline": 2,
    "orientation_lock": 3,
    "parallel_axes": 2,
    "perpendicular_axes": 1,
    "planar": 3,
    "revolute": 5,
    "revolute_spherical": 2,
    "screw": 5,
    "spherical": 3,
    "translational": 5,
    "universal": 4,
}


def lines():
    """The printed lines by type."""
    return {line.split()[0]: line for line in catalogue() if line.startswith("  ")}


def test_every_type_is_printed(capsys):
    assert main.main(["list", "--joints"]) == 0
    assert capsys.readouterr().out.splitlines() == list(catalogue())
    joints, motions = {*Joint.registry, *Coupler.registry}, {*DRIVERS, *Motion.registry}
    assert lines().keys() == joints | motions | {*ELEMENTS}


def test_every_key_is_printed():
    for registry, keys in (
        (Joint.registry | Coupler.registry, keys_of),
        (DRIVERS, keys_of),
        (Motion.registry, keys_of),
        (ELEMENTS, keys_of),
    ):
        for name, cls in registry.items():
            for key in set(keys(cls).__struct_fields__) - {"type", "bodies", "joints", "motion"}:
                assert key in lines()[name]


def test_every_type_says_what_it_does(own_joint_types):
    @dataclass(frozen=True)
    class Mute(Spherical):
        type = "mute_of_test_catalogue"

    found = lines()
    for registry in (Joint.registry, Coupler.registry, DRIVERS, Motion.registry):
        for name, cls in registry.items():
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


def test_rows_and_freedoms():
    ours = {
        name: cls for name, cls in Joint.registry.items() if cls.__module__.startswith("kincheck.")
    }
    assert {name: rows_of(cls) for name, cls in ours.items()} == ROWS
    for name, rows in ROWS.items():
        assert f"  {rows} row" in lines()[name]
        assert f"  {6 - rows} free" in lines()[name]
    assert lines()["gear"].split()[:8] == [
        "gear",
        "ratio",
        "1",
        "row",
        "couples",
        "rotation",
        "and",
        "rotation",
    ]
    assert "points, (length)" in lines()["distance"]


def test_a_new_type_is_listed_even_if_its_rows_are_not_known():
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


def test_every_key_of_a_file_is_in_the_reference_that_is_printed(capsys):
    """Read off the structures that take them; what is optional stands in brackets."""
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
