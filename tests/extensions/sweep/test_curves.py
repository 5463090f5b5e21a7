"""Curves of many designs and their slopes: against runs of each design, and differences of proved
values.
"""

from dataclasses import fields, is_dataclass, replace
from fractions import Fraction

import kincheck
import numpy as np
import pytest
from kincheck.adapters import engine
from kincheck.core import CaseError, KincheckError, PointCoordinate, Supplied
from kincheck.core.case.case import HELD_BUT
from kincheck.core.case.models.files import load
from kincheck.core.extensions.hardpoints.suspension import Vehicle
from kincheck.core.extensions.hardpoints.templates import TEMPLATES, sample_table
from kincheck.core.extensions.notebook.tables import table_of
from kincheck.core.extensions.proofs.verified_reference import prove_case
from kincheck.core.extensions.sweep.varied_places import Geometry
from kincheck.core.harness.execution import Answer, Pair, attempt
from kincheck.core.joints import Kind
from kincheck.core.kinematics import placed, places

from ...support.examples import examples

(WRONG,) = examples(__file__, "wrong")

CLOSE = 1e-12
VEHICLE = {"wheelbase": "2.6", "cg_height": "0.5", "brake_share": "0.6", "rack_per_turn": "0.05"}


def table(folder, name, axes="forward,left,up", units="mm", per_mm=1.0):
    """A template's sample in other axes and units."""
    ways = dict(zip(("forward", "left", "up"), range(3), strict=True))
    ways |= {"rearward": ways["forward"], "right": ways["left"], "down": ways["up"]}
    lines = [f"# template: {name}", f"# units: {units}", f"# axes: {axes}", "name,x,y,z"]
    for name_of_row, *place in (
        line.split(",")[:4] for line in sample_table(TEMPLATES[name]).splitlines()[4:]
    ):
        along = [
            (-1.0 if way in ("rearward", "right", "down") else 1.0) * float(place[ways[way]])
            for way in axes.split(",")
        ]
        lines.append(",".join([name_of_row, *(repr(per_mm * x) for x in along)]))
    file = folder / f"{name}.csv"
    file.write_text("\n".join(lines) + "\n")
    return file


def numbers_of(case):
    """Every number of a table, by its name."""
    return [f"{row.name} {axis}" for row in case.hardpoints if row.moves for axis in "xyz"]


def run_alone(case):
    """All outputs by the native engine and the equations over arrays, drivers held where they are
    for some.
    """
    found = attempt(Pair(case, engine("native"), 1e-12, timed=False)).result
    assert isinstance(found, Answer), found
    return {name: series.position for name, series in found.outputs.items()}


def assert_equal(found, design, expected):
    assert {*found.values} == {*expected}
    for name, values in expected.items():
        scale = max(1.0, np.nanmax(np.abs(values), initial=0.0))
        own = found.values[name][design]
        np.testing.assert_allclose(own, values, rtol=0.0, atol=CLOSE * scale, err_msg=name)


FORMS = [
    ("forward,left,up", "mm", 1.0),
    ("rearward,down,right", "cm", 0.1),
    ("up,rearward,left", "m", 1e-3),
]


@pytest.mark.parametrize("form", FORMS, ids=[form[0] for form in FORMS])
@pytest.mark.by_day(3)
@pytest.mark.parametrize("name", TEMPLATES)
def test_curves_of_corner_equal_runs(tmp_path, name, form):
    file = table(tmp_path, name, *form)
    case = load(file, Supplied(travel="0.03:5", position="front", **VEHICLE))
    moved = numbers_of(case)
    offsets = np.random.default_rng(66).normal(size=(2, len(moved))) * 1e-3
    offsets[0] = 0.0
    found = kincheck.curves(case, moved, offsets)
    assert found.solved.all()
    assert found.reasons == {}
    for k, row in enumerate(offsets):
        designs = {
            each.name: row.reshape(-1, 3)[None, n]
            for n, each in enumerate(each for each in case.hardpoints if each.moves)
        }
        geometry = {place: tuple(value[0]) for place, value in case.geometry(designs).items()}
        own = replace(case, mechanism=placed(case.mechanism, geometry))
        assert_equal(found, k, run_alone(own))


AXLES = [
    (name, motion)
    for name in TEMPLATES
    for motion in ("heave", "roll", "steer")
    if TEMPLATES[name].steered or motion != "steer"
]


def along_sweep(output):
    """An output of wheels that travel along the sweep alone, which drivers of their own give else:
    in heave both are the same, and proofs have no drivers that move alone.
    """
    if isinstance(output, tuple):
        return tuple(map(along_sweep, output))
    if isinstance(output, Vehicle):
        return replace(output, travel=())
    if not is_dataclass(output):
        return output
    own = {each.name: getattr(output, each.name) for each in fields(output) if each.init}
    return replace(output, **{name: along_sweep(each) for name, each in own.items()})


def asymmetric(case):
    """The axle with every place of its left side moved by itself."""
    random = np.random.default_rng(7)
    moved = {
        place: (np.array(value) + random.normal(size=3) * 5e-4).tolist()
        for place, value in places(case.mechanism).items()
        if place.startswith("joints.left") and len(value) == 3 and ".ax" not in place
    }
    return replace(case, mechanism=placed(case.mechanism, moved), hardpoints=())


def proved(case, variable, axis, move):
    """Values of outputs of a moved design, proved to 40 digits."""
    moved = {
        place: (np.array(value) + move * variable.moves[place][:, axis]).tolist()
        for place, value in places(case.mechanism).items()
        if place in variable.moves
    }
    case = replace(case, mechanism=placed(case.mechanism, moved))
    found, _ = prove_case(case, digits=40, numbers="double", tol=CLOSE)
    assert not any(each.reason for each in found.outputs.values())
    return {
        name: [None if x is None else Fraction(x) for x in each.position]
        for name, each in found.outputs.items()
    }


FINE = 2.0**40
"""Places that move are multiples of one over this: with a step of 2^-27 they have 53 binary digits.
"""


@pytest.mark.by_day(11)
@pytest.mark.parametrize("whole", [*((name, None) for name in TEMPLATES), *AXLES], ids=str)
def test_slopes_equal_differences_of_proved_digits(tmp_path, whole):
    """Of all outputs: central differences of values proved to 40 digits, at three steps. What the
    extrapolation leaves out is of sixth order in the step of 1e-8 m over 1e-4 m, where the longest
    swing arms bend. Moved places are exact doubles.
    """
    name, axle = whole
    how = {"axle": axle} if axle else {"position": "front"}
    how |= {**VEHICLE, "swing_arms": True}
    case = load(table(tmp_path, name), Supplied(travel="0.03:3", **how))
    case = asymmetric(case) if axle else case
    geometry, left = Geometry(case), "joints.left" if axle else ""
    points = [each for each in geometry.variables if each.moves and each.kind is Kind.POSITION]
    variables = [each for each in points if each.name.startswith(left)]
    variable = variables[len(name) % len(variables)]
    number, axis = variable.numbers[-1], len(variable.numbers) - 1
    known = places(case.mechanism)
    grid = {
        place: (np.round(np.array(known[place]) * FINE) / FINE).tolist() for place in variable.moves
    }
    case = replace(case, mechanism=placed(case.mechanism, grid))
    if axle in ("roll", "steer"):  # of wheels whose travel is not that of the sweep
        case = replace(case, outputs=[x for x in case.outputs if HELD_BUT not in x.facts])
    still = replace(case, outputs=tuple(along_sweep(each) for each in case.outputs))
    steps = [2.0**-25, 2.0**-26, 2.0**-27]
    ends = [[proved(still, variable, axis, sign * x) for sign in (1.0, -1.0)] for x in steps]
    names = [each.name for each in case.outputs]
    found = kincheck.curves(case, [number], [[0.0]], slopes=names)
    for output in names:
        own = found.slopes[output][0, :, 0]
        for k, slope in enumerate(own.tolist()):
            values = [[each[output][k] for each in pair] for pair in ends]
            if None in (x for pair in values for x in pair):
                assert np.isnan(slope), output
                continue
            a, b, c = ((p - q) / Fraction(2.0 * h) for (p, q), h in zip(values, steps, strict=True))
            once = [(4 * fine - coarse) / 3 for coarse, fine in ((a, b), (b, c))]
            expected = float((16 * once[1] - once[0]) / 15)
            assert slope == pytest.approx(expected, rel=1e-11, abs=1e-11), (output, number)


@pytest.fixture(scope="module")
def corner(tmp_path_factory):
    file = table(tmp_path_factory.mktemp("corner"), "double_wishbone")
    return load(file, Supplied(travel="0.03:5"))


def test_chunks_equal_whole(corner):
    offsets = np.random.default_rng(1).normal(size=(7, 2)) * 1e-3
    moved = ["tierod_inner z", "lca_front y"]
    whole = kincheck.curves(corner, moved, offsets, ["toe"], ["toe"])
    parts = [*kincheck.curves_by_chunk(corner, moved, np.split(offsets, [3]), ["toe"], ["toe"])]
    assert [len(each.solved) for each in parts] == [3, 4]
    np.testing.assert_array_equal(
        np.concatenate([each.values["toe"] for each in parts]), whole.values["toe"]
    )
    np.testing.assert_array_equal(
        np.concatenate([each.slopes["toe"] for each in parts]), whole.slopes["toe"]
    )
    assert whole.units == {"toe": "rad"}
    assert whole.places == dict.fromkeys(moved, "m")


def test_curves_become_tables(corner):
    found = kincheck.curves(corner, ["tierod_inner z"], [[0.0], [1e-3]], ["toe"], ["toe"])
    assert str(found) == (
        "<DesignCurves: stroke -0.03 to 0.03 m, 2 designs of 5 samples, 1 output>"
    )
    data = found.dataset()
    assert data.variables["toe.slopes"].unit == "rad/m"
    columns = table_of(data)
    assert len(columns["toe"]) == 10
    np.testing.assert_array_equal(
        columns["toe.slopes.tierod_inner z"], found.slopes["toe"][:, :, 0].ravel()
    )


def test_design_out_of_reach_says_why(corner):
    """A tie rod beside the wheel's centre, too short for the travel of its outer end."""
    found = kincheck.curves(corner, ["tierod_inner y"], [[0.0], [0.335]], ["toe"], ["toe"])
    assert found.solved[0].all()
    assert not found.solved[1].all()
    assert found.messages[1]
    for each in (found.values, found.slopes):
        assert np.isnan(each["toe"][1][~found.solved[1]]).all()


@pytest.mark.parametrize(("arguments", "said"), WRONG.values(), ids=WRONG)
def test_wrong_arguments_have_one_message(corner, arguments, said):
    with pytest.raises(KincheckError) as error:
        kincheck.curves(corner, *arguments)
    assert said in str(error.value)


def test_name_with_space_is_no_axis():
    case = kincheck.load("modelica_four_bar_distance")

    def with_rod(name):
        joints = [
            replace(each, name=name, length=each.rod_length) if each.name == "rod" else each
            for each in case.mechanism.joints
        ]
        longer = replace(case, mechanism=replace(case.mechanism, joints=joints))
        place, out = f"joints.{name}.length", "slider_pin_x"
        return kincheck.curves(longer, [place], [[1e-3]], [out]).values[out]

    np.testing.assert_allclose(with_rod("tie rod"), with_rod("rod"), rtol=0.0, atol=CLOSE)


def test_absolute_driver_of_varied_point(corner):
    drivers = [
        replace(each, relative=False) if isinstance(each, PointCoordinate) else each
        for each in corner.mechanism.drivers
    ]
    case = replace(corner, mechanism=replace(corner.mechanism, drivers=drivers))
    with pytest.raises(CaseError, match="absolute position of a point that varies"):
        kincheck.curves(case, ["wheel_center z"], [[0.0]])
    assert kincheck.curves(corner, ["wheel_center z"], [[0.0]], ["toe"]).solved.all()
