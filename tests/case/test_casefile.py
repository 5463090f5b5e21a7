"""Case files: what is read, and in which units."""

import json
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from kincheck.core.case.case import Case, Truth
from kincheck.core.case.io.case_file import load_case
from kincheck.core.case.io.outputs import DEFAULT_ATOL, DEFAULT_RTOL, DEFAULT_WHY
from kincheck.core.joints import Distance, Joint, Spherical
from kincheck.core.joints.base import length, position

from ..support.case_texts import BASE, INLINE, edited, write

EXAMPLES = sorted((Path(__file__).parents[1] / "data" / "case_files").glob("*.toml"))


def same(a: Case, b: Case) -> None:
    assert (a.name, a.source, a.truth) == (b.name, b.source, b.truth)
    assert a.mechanism == b.mechanism
    assert a.outputs == b.outputs
    assert (a.sweep.driver, a.sweep.rate, a.sweep.design) == (
        b.sweep.driver,
        b.sweep.rate,
        b.sweep.design,
    )
    assert np.array_equal(a.sweep.values, b.sweep.values)
    assert a.reference.keys() == b.reference.keys()


def test_all_examples_are_here():
    assert len(EXAMPLES) == 6


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda file: file.stem)
def test_examples_are_read(file: Path):
    text = tomllib.loads(file.read_text())
    case = load_case(str(file))
    assert case.name == file.stem
    assert case.truth is Truth.CONSENSUS_ONLY  # without a reference, whatever the file claims
    assert {joint.name: joint.type for joint in case.mechanism.joints} == {
        k: v["type"] for k, v in text["joints"].items()
    }
    assert [output.name for output in case.outputs] == list(text["outputs"])
    assert len(case.sweep.values) == text["sweep"]["steps"]
    assert (case.sweep.values[0], case.sweep.values[-1]) == (
        text["sweep"]["start"],
        text["sweep"]["stop"],
    )


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda file: file.stem)
def test_json_is_the_same(file: Path, tmp_path: Path):
    data = json.dumps(tomllib.loads(file.read_text()))
    same(load_case(write(tmp_path, data, "case.json")), load_case(file))
    same(load_case(write(tmp_path, data, "case")), load_case(file))  # told by its brace


def test_every_value_lands_where_it_belongs(tmp_path: Path):
    case = load_case(write(tmp_path, BASE + INLINE))
    assert (case.name, case.source, case.truth) == (
        "slider",
        "made up for this test",
        Truth.CLOSED_FORM,
    )
    assert case.mechanism.body("slider").origin == (1.0, 2.0, 3.0)
    assert case.mechanism.joint("guide").bodies == ("ground", "slider")
    assert case.mechanism.point("tip").position == (1.5, 2.0, 3.0)
    assert (case.sweep.driver, case.sweep.rate, case.sweep.design) == ("push", 2.0, 0.0)
    assert case.sweep.values.tolist() == [-0.1, 0.0, 0.1]
    (output,) = case.outputs
    assert (output.name, output.point, output.direction, output.relative) == (
        "tip_x",
        "tip",
        (1.0, 0.0, 0.0),
        False,
    )
    assert (output.atol, output.rtol, output.why) == (1e-9, 0.0, "made up for this test")
    series = case.reference["tip_x"]
    assert series.position.tolist() == [1.4, 1.5, 1.6]
    assert series.velocity is not None
    assert series.velocity.tolist() == [2.0, 2.0, 2.0]
    assert series.acceleration is None


def test_millimetres_and_degrees_are_the_same_case(tmp_path: Path):
    """Four joints, both kinds of driver: every number of the millimetre file is 1000 times that of
    the metre file.
    """
    metres = """
    schema = "kincheck-case/1"
    name = "arm"
    source = "made up for this test"
    truth = "closed_form"
    [bodies.arm]
    origin = [0.1, 0.2, 0.3]
    [bodies.rod]
    fixed = true
    [joints.pivot]
    type = "revolute"
    bodies = ["ground", "arm"]
    point = [0.1, 0.2, 0.3]
    axis = [0, 0, 5]
    [joints.tie]
    type = "distance"
    bodies = ["rod", "arm"]
    points = [[0.4, 0.5, 0.6], [0.7, 0.8, 0.9]]
    length = 0.52
    [points.tip]
    body = "arm"
    position = [0.9, 0.8, 0.7]
    [drivers.turn]
    type = "joint_angle"
    joint = "pivot"
    [sweep]
    driver = "turn"
    start = 0.0
    stop = 1.5707963267948966
    steps = 3
    rate = 3.141592653589793
    [outputs.tip_y]
    point = "tip"
    direction = [0, 3, 4]
    atol = 1e-3
    rtol = 0.5
    why = "made up for this test"
    [reference]
    rows = [[0.0, 0.8], [0.7853981633974483, 0.6], [1.5707963267948966, 0.4]]
    """
    millimetres = edited(
        ("[bodies.arm]", '[units]\nlength = "mm"\nangle = "deg"\n[bodies.arm]'),
        ("origin = [0.1, 0.2, 0.3]", "origin = [100, 200, 300]"),
        ("point = [0.1, 0.2, 0.3]", "point = [100, 200, 300]"),
        ("[[0.4, 0.5, 0.6], [0.7, 0.8, 0.9]]", "[[400, 500, 600], [700, 800, 900]]"),
        ("length = 0.52", "length = 520"),
        ("[0.9, 0.8, 0.7]", "[900, 800, 700]"),
        ("stop = 1.5707963267948966", "stop = 90"),
        ("rate = 3.141592653589793", "rate = 180"),
        ("atol = 1e-3", "atol = 1"),
        (
            "[[0.0, 0.8], [0.7853981633974483, 0.6], [1.5707963267948966, 0.4]]",
            "[[0, 800], [45, 600], [90, 400]]",
        ),
        base=metres,
    )
    a, b = load_case(write(tmp_path, metres)), load_case(write(tmp_path, millimetres))
    same(a, b)
    assert np.array_equal(a.reference["tip_y"].position, b.reference["tip_y"].position)
    assert b.outputs[0].direction == (0.0, 0.6, 0.8)
    assert b.outputs[0].rtol == 0.5
    tie = b.mechanism.joint("tie")
    assert isinstance(tie, Distance)
    assert tie.length == 0.52


def test_displacements_are_lengths(tmp_path: Path):
    millimetres = load_case(
        write(
            tmp_path,
            edited(("[bodies.slider]", '[units]\nlength = "mm"\nangle = "deg"\n[bodies.slider]')),
        )
    )
    assert millimetres.sweep.values.tolist() == [-1e-4, 0.0, 1e-4]
    assert millimetres.sweep.rate == 2e-3


def test_design_value_of_an_absolute_point_driver(tmp_path: Path):
    absolute = 'type = "point_coordinate"\npoint = "tip"\ndirection = [0, 3, 4]\nrelative = false'
    text = edited(('type = "joint_displacement"\njoint = "guide"', absolute))
    case = load_case(write(tmp_path, text))
    assert case.sweep.design == pytest.approx((3 * 2.0 + 4 * 3.0) / 5, rel=1e-15)
    assert (
        load_case(write(tmp_path, text.replace("relative = false", "relative = true"))).sweep.design
        == 0.0
    )


def test_default_outputs_say_that_they_are(tmp_path: Path):
    case = load_case(write(tmp_path, BASE[: BASE.index("[outputs")]))
    assert [output.name for output in case.outputs] == ["tip.x", "tip.y", "tip.z"]
    assert [output.direction for output in case.outputs] == [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
    assert all(
        not output.relative and output.atol > 0 and "default" in output.why
        for output in case.outputs
    )


def test_an_output_without_tolerance_gets_the_default(tmp_path: Path):
    (output,) = load_case(
        write(tmp_path, edited(('atol = 1e-9\nwhy = "made up for this test"', "")))
    ).outputs
    assert (output.atol, output.rtol, output.why) == (DEFAULT_ATOL, DEFAULT_RTOL, DEFAULT_WHY)


@pytest.mark.parametrize("where", ["named", "all"])
def test_the_default_of_a_small_mechanism_is_a_millionth_of_its_size(tmp_path: Path, where: str):
    """The tip is 5 um from the joint: a nanometre would let pass what is wrong in the fourth
    digit.
    """
    text = BASE[: BASE.index("[outputs") if where == "all" else BASE.index("atol")]
    for large, small in (
        ("[1.5, 2.0, 3.0]", "[1.000005, 2.0, 3.0]"),
        ("-0.1", "-1e-7"),
        ("stop = 0.1", "stop = 1e-7"),
    ):
        text = text.replace(large, small)
    assert load_case(write(tmp_path, text)).outputs[0].atol == pytest.approx(5e-12, rel=1e-9)


def test_a_tolerance_without_a_part_of_the_range_has_none(tmp_path: Path):
    (output,) = load_case(write(tmp_path, BASE)).outputs
    assert (output.atol, output.rtol) == (1e-9, 0.0)


@pytest.mark.parametrize(
    ("start", "stop", "steps", "values"),
    [("0.1", "-0.1", "3", [0.1, 0.0, -0.1]), ("0.2", "0.2", "1", [0.2])],
)
def test_sweeps_may_run_down_or_have_one_sample(
    tmp_path: Path, start: str, stop: str, steps: str, values: list[float]
):
    text = edited(
        ("start = -0.1", f"start = {start}"),
        ("stop = 0.1", f"stop = {stop}"),
        ("steps = 3", f"steps = {steps}"),
    )
    assert load_case(write(tmp_path, text)).sweep.values.tolist() == values


def test_rate_is_one_unless_given(tmp_path: Path):
    assert load_case(write(tmp_path, edited(("rate = 2.0\n", "")))).sweep.rate == 1.0


def test_a_new_joint_type_can_be_named_at_once(tmp_path: Path):
    @dataclass(frozen=True)
    class Offset(Spherical):
        type = "offset_of_test_casefile"
        shift: float = length(default=0.0)
        second: tuple[float, float, float] | None = position(default=None)

    try:
        text = edited(
            ("[bodies.slider]", '[units]\nlength = "mm"\n[bodies.slider]'),
            ('type = "translational"', 'type = "offset_of_test_casefile"\nshift = 7'),
            ("axis = [1.0, 0.0, 0.0]", ""),
            (
                'type = "joint_displacement"\njoint = "guide"',
                'type = "point_coordinate"\npoint = "tip"\ndirection = [1, 0, 0]',
            ),
        )
        joint = load_case(write(tmp_path, text)).mechanism.joint("guide")
        assert isinstance(joint, Offset)
        assert (joint.point, joint.shift, joint.second) == ((0.001, 0.002, 0.003), 0.007, None)
    finally:
        del Joint.registry[Offset.type]


def test_byte_order_mark_and_windows_lines_are_read(tmp_path: Path):
    same(
        load_case(write(tmp_path, "\ufeff" + BASE.replace("\n", "\r\n"))),
        load_case(write(tmp_path, BASE, "b.toml")),
    )
