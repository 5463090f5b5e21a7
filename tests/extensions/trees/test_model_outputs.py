"""Outputs of every joint and body of a model, and whether closures enter them."""

from dataclasses import replace

import kincheck.cases
import numpy as np
from kincheck import adapters
from kincheck.core.case.io.case_file import load_case
from kincheck.core.case.io.outputs import with_all_coordinates
from kincheck.core.case.models.files import load
from kincheck.core.case.notes import notes
from kincheck.core.extensions.trees.outputs import with_all_motions
from kincheck.core.harness.record import Outcome
from kincheck.core.harness.run import run
from kincheck.core.joints import Cylindrical, Polynomial, Revolute
from kincheck.core.mechanism.mechanism import Body

from ...support.case_texts import write
from ...support.measure_cases import AXIS, arm
from ...support.model_files import driven

FOUR_BAR = """
<mujoco model="four bar"><compiler angle="radian"/><worldbody>
 <body name="crank"><joint name="crank" axis="0 0 1"/><geom size=".01"/>
  <body name="rod" pos="0.1 0 0"><joint name="rod" axis="0 0 1"/><geom size=".01"/></body></body>
 <body name="rocker" pos="0.4 -0.1 0"><joint name="rocker" axis="0 0 1"/><geom size=".01"/></body>
 </worldbody><equality><connect body1="rod" body2="rocker" anchor="0.3 0.15 0"/></equality></mujoco>
"""


def test_model_outputs_in_every_engine(tmp_path):
    file = write(tmp_path, FOUR_BAR, "four_bar.xml")
    case = load(file, driven("crank:-0.3:6.6:24"))
    names = [output.name for output in case.outputs]
    for each in ("crank", "rod", "rocker"):
        assert f"{each}.angle" in names
        assert [f"{each}.e{k}" in names for k in range(4)] == [True] * 4
    assert notes(case) == []
    every = [adapters.engine(name) for name in adapters.ENGINES]
    results = run([case], [each for each in every if each.version()], tol=1e-10)
    assert [record.outcome for record in results.records] == [Outcome.UNJUDGED] + [Outcome.PASS] * (
        len(results.records) - 1
    )
    for record in results.records:
        rocker = np.array(record.outputs["rocker.angle"].position)
        e0, e3 = (np.array(record.outputs[f"rocker.{each}"].position) for each in ("e0", "e3"))
        np.testing.assert_allclose(2.0 * np.arctan2(e3, e0), rocker, atol=1e-9)


def test_outputs_without_closure_are_noted(tmp_path):
    case = load(write(tmp_path, FOUR_BAR, "four_bar.xml"), driven("crank:-0.3:0.3:7"))
    vacuous = tuple(each for each in case.outputs if each.name.startswith("crank"))
    (note,) = notes(replace(case, outputs=vacuous))
    assert "no output depends on a closure" in note
    rocking = tuple(each for each in case.outputs if each.name == "rocker.angle")
    assert notes(replace(case, outputs=rocking)) == []


def test_driven_point_coordinate_without_closure_noted():
    case = load_case(kincheck.cases.FOLDER / "mcpherson_strut.toml")
    driven = case.mechanism.drivers[0]
    up = with_all_coordinates(case, [driven.point]).outputs[2]
    (note,) = [n for n in notes(replace(case, outputs=(up,), reference={})) if "closure" in n]
    assert "follow from the drivers" in note
    assert not [n for n in notes(case) if "closure" in n]


def test_open_chain_without_closure_note():
    assert notes(with_all_motions(arm([0.0, 1.0]))) == []


def test_coupler_that_moves_design_is_noted():
    """In the file's unit; a coupler through zero is not."""
    for coefficients, told in (
        ((0.2, 0.5), ["'lever' begins at 0.2 rad, zero as given"]),
        ((0.0, 0.5), []),
    ):
        case = arm([0.0])
        levers = [
            Revolute("lever", "ground", "lever", (3.0, 0.0, 0.0), AXIS),
            Cylindrical("slide", "ground", "rack", (5.0, 0.0, 0.0), AXIS),
        ]
        knee = Polynomial("knee", ("lever", "hinge"), coefficients)
        cam = Polynomial(
            "cam", ("slide", "hinge"), coefficients, freedoms=("translation", "rotation")
        )
        mechanism = replace(
            case.mechanism,
            bodies=(*case.mechanism.bodies, Body("lever"), Body("rack")),
            joints=(*case.mechanism.joints, *levers),
            couplers=(knee, cam),
        )
        found = notes(replace(case, mechanism=mechanism, length_unit="mm"))
        wanted = [*told, *(["'slide' begins at 200 mm, zero as given"] if told else [])]
        begins = [note for note in found if "begins" in note]
        assert len(begins) == len(wanted)
        assert all(text in note for text, note in zip(wanted, begins, strict=True))
