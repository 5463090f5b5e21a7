"""Each coupler and force element through each command: right by a closed form, or refused with the
reason. The cells are the products of the two lists, so that none is empty.
"""

import json
import math
from dataclasses import replace

import kincheck
import numpy as np
import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.measures import DriverEffort
from kincheck.core.case.models.files import load
from kincheck.core.case.quantity import with_markers
from kincheck.core.cli.main import main
from kincheck.core.doors import offers
from kincheck.core.joints import Coupler
from kincheck.core.mechanism.loads import ELEMENTS

from ...support.engine_motion import SIMULATORS, installed
from ...support.one_freedom import (
    ARM,
    SUBJECTS,
    G,
    effort,
    end,
    hold,
    of_bushing,
    resting,
    tip,
    types,
    write,
)

RATE, TURNS = 1.5, np.linspace(-0.4, 0.5, 4)
OUTPUTS = {
    "tip": {"point": "tip", "component": "z"},
    "effort": {"type": "driver_effort", "driver": "turn"},
}
END = {"end": {"point": "end", "component": "z", "relative": True}}
EVERY = pytest.mark.parametrize("name", SUBJECTS)
ENGINES = ["native", *(pytest.param(each, marks=pytest.mark.nightly) for each in SIMULATORS)]
TREES = ("mjcf", "urdf", "sdf")
UNPROVED = {
    "spline": "proofs know none; give a polynomial",
    "with stop": "proofs know neither; give a stiffness",
    "in angles": "proofs know neither; give a stiffness",
}
"""What `kincheck reference` refuses, by a part of the subject's name."""
NO_COUNTERPART = {
    "polynomial": ("sdf", "exudyn"),
    "spline": ("mjcf", "sdf", "exudyn"),
    "linear_coupler": ("sdf", "osim", "exudyn"),
}
"""Formats that cannot hold a coupler."""


def test_every_coupler_and_element_is_there():
    assert types() == {*Coupler.registry, "screw", *ELEMENTS}


def swept(folder, subject, **more):
    outputs = OUTPUTS | (END if subject.follows else {})
    sweep = {"driver": "turn", "start": -0.4, "stop": 0.5, "steps": len(TURNS), "rate": RATE}
    return write(folder, subject, sweep=sweep, **{"outputs": outputs} | more)


def wanted(subject, order=0):
    """Return the outputs over the sweep, or their derivatives by time."""
    found = {"tip": [tip(q)[order] * RATE**order for q in TURNS]}
    if subject.follows:
        found["end"] = [end(subject, q)[order] * RATE**order for q in TURNS]
    if not order:
        found["effort"] = [effort(subject, q, RATE) for q in TURNS]
    return found


def checked(records, engine):
    """Return the record of an engine that claims the case; its refusal names the subject."""
    record = next(each for each in records if each.engine == engine)
    if record.outcome.value == "unsupported":
        assert "'x'" in record.message or "'rail'" in record.message
        pytest.skip(record.message)
    return record


@EVERY
@pytest.mark.parametrize("engine", ENGINES)
def test_run_equals_closed_form(engine, name, tmp_path):
    installed(engine)
    record = checked(kincheck.run(str(swept(tmp_path, SUBJECTS[name])), [engine]).records, engine)
    for order, quantity in enumerate(("position", "velocity", "acceleration")):
        for output, values in wanted(SUBJECTS[name], order).items():
            # Exudyn's Jacobian has an error of a millionth of a millionth
            found = getattr(record.outputs[output], quantity)
            assert found == pytest.approx(values, rel=1e-10, abs=1e-11), output


@pytest.mark.by_day(3)
@EVERY
@pytest.mark.parametrize("engine", ENGINES)
def test_equilibrium_equals_root(engine, name, tmp_path):
    installed(engine)
    file = write(tmp_path, SUBJECTS[name], drivers={}, equilibrium={"held": []})
    record = checked(kincheck.run(str(file), ["native", engine]).records, engine)
    expected = "unjudged" if engine == "native" else "pass"
    assert record.outcome.value == expected, record.message
    height = tip(resting(SUBJECTS[name]))[0]
    assert record.outputs["tip.z"].position == pytest.approx([height], abs=1e-13)


def lifted(tmp_path, subject):
    """Write the crank as a suspension, its tip being the wheel's centre."""
    points = {"tip": {"body": "crank", "position": [ARM, 0.0, 0.0]}}
    lift = {"type": "point_coordinate", "point": "tip", "direction": [0, 0, 1]}
    return write(
        tmp_path,
        subject,
        drivers={"travel": lift},
        points=points | subject.more.get("points", {}),
        sweep={"driver": "travel", "start": 0.0, "stop": 0.01, "steps": 2},
        compliance={"wheel": "crank", "contact": "tip"},
    )


@pytest.mark.by_day(3)
@EVERY
def test_kc_equals_virtual_work(name, tmp_path):
    """The load F of the wheel has F dz = (V' - Q) dq."""
    subject, travel = SUBJECTS[name], np.array([-0.062, -0.033, 0.0101, 0.05])
    found = kincheck.compliance(str(lifted(tmp_path, subject)), travel).travel

    def load_at(z):
        q = math.asin(-z / ARM)
        return hold(subject, q) / tip(q)[1]

    assert found.wheel_load == pytest.approx([load_at(z) for z in travel], rel=1e-12, abs=1e-12)
    # differences of sixth order of a smooth piece, 1e-4 m wide
    weights, h = {3: 1 / 60, 2: -3 / 20, 1: 3 / 4}, 3e-5
    rates = [
        sum(w * (load_at(z + k * h) - load_at(z - k * h)) for k, w in weights.items()) / h
        for z in travel
    ]
    assert found.outputs["wheel_rate"].values == pytest.approx(rates, rel=1e-8)


@pytest.mark.nightly
@EVERY
@pytest.mark.parametrize("engine", [*SIMULATORS, "exudyn-static"])
def test_kc_passes_in_engines(engine, name, tmp_path):
    installed(engine.removesuffix("-static"))
    file = lifted(tmp_path, SUBJECTS[name])
    found = kincheck.compliance(str(file), [-0.03, 0.0101], engines=[engine])
    record = checked(found.checked.records, engine)
    assert record.outcome.value == "pass", record.message


@pytest.mark.by_day(3)
@EVERY
def test_sweep_of_designs_equals_closed_form(name, tmp_path, capsys):
    """The tip is 5 mm higher in half of the variants; a number of the element varies if it can."""
    subject = SUBJECTS[name]
    points = {"tip": {"at": "tip", "values": [[0.0], [0.0], [0.0, 0.005]]}}
    forces = [subject.force]
    if subject.varied:
        number, change, other = subject.varied
        points["number"] = {"at": f"forces.x.{number}", "values": [0.0, change]}
        forces.append(other)
    vary = {"schema": "kincheck-vary/1", "mode": "grid", "hardpoints": points}
    (file := tmp_path / "vary.json").write_text(json.dumps(vary | {"units": {"length": "m"}}))
    options = ["--vary", str(file), "--out", str(tmp_path / "out")]
    assert main(["sweep", str(swept(tmp_path, subject)), *options]) == 0, capsys.readouterr().err
    found = json.loads((tmp_path / "out" / "sweep.json").read_text())["outputs"]
    tips = [[tip(q)[0] + up * math.cos(q) for q in TURNS] for up in (0.0, 0.005)]
    inertial = [effort(subject, q, RATE) - hold(subject, q, RATE) for q in TURNS]
    efforts = [
        [x + hold(subject, q, RATE, force) for x, q in zip(inertial, TURNS, strict=True)]
        for force in forces
    ]
    ends = [wanted(subject)["end"]] if subject.follows else []
    for output, values in (("tip", tips), ("effort", efforts), ("end", ends)):
        for key, choose in (("min", np.min), ("max", np.max)) if values else ():
            assert found[output][key] == pytest.approx(choose(values, axis=0), rel=1e-9, abs=1e-11)


@EVERY
def test_reference_is_proved_or_refused(name, tmp_path, capsys):
    subject = SUBJECTS[name]
    status = main(["reference", str(swept(tmp_path, subject)), "--out", str(tmp_path)])
    said = capsys.readouterr().err
    if reason := next((UNPROVED[part] for part in UNPROVED if part in name), None):
        assert status == 2
        assert f"'x' ({subject.type})" in said
        assert reason in said
        return
    assert status == 0, said
    found = json.loads((tmp_path / "one_freedom.reference.json").read_text())["outputs"]
    for order, quantity in enumerate(("position", "velocity", "acceleration")):
        for output, values in wanted(subject, order).items():
            proved = [float(x) for x in found[output][quantity]]
            assert proved == pytest.approx(values, rel=1e-13, abs=1e-14), (output, quantity)


@pytest.mark.by_day(3)
@EVERY
@pytest.mark.parametrize("to", offers("writers"))
def test_export_holds_or_names_it(to, name, tmp_path, capsys):
    subject = SUBJECTS[name]
    ending = ".py" if to == "exudyn" else f".{'xml' if to == 'mjcf' else to}"
    file = tmp_path / f"written{ending}"
    status = main(["export", str(swept(tmp_path, subject)), "--to", to, "--out", str(file)])
    said = capsys.readouterr().err
    if to in NO_COUNTERPART.get(subject.type, ()):
        assert status == 2
        assert "joint 'x'" in said
        assert "no counterpart" in said
        return
    assert status == 0, said
    text = "".join(each.read_text() for each in tmp_path.glob("written*"))
    if f"force 'x' ({subject.type})" in said:
        assert "note: left out: " in said
    else:
        assert subject.type not in text or "Left out" not in text or "'x'" not in said
        assert "x" in text


@pytest.mark.by_day(3)
@EVERY
@pytest.mark.parametrize(
    "to", ["osim", *(pytest.param(each, marks=pytest.mark.nightly) for each in TREES)]
)
def test_export_read_again_moves_alike(to, name, tmp_path, capsys):
    """Without what the export says that it leaves out, the read file needs the same effort."""
    subject = SUBJECTS[name]
    if to in NO_COUNTERPART.get(subject.type, ()):
        return  # refused, see above
    file = tmp_path / f"written.{'xml' if to == 'mjcf' else to}"
    assert main(["export", str(swept(tmp_path, subject)), "--to", to, "--out", str(file)]) == 0
    # what has no gravity in the file gets the format's own: 9.8 m/s^2 in SDF, else 9.81
    without, gravity = capsys.readouterr().err.replace("gravity", ""), 9.8 if to == "sdf" else G
    case = load(file, Supplied(drive=("pin:-0.4:0.5:4",)))
    (driver,) = case.mechanism.drivers
    output = DriverEffort("effort", 1e-9, 0.0, "round-off", driver=driver.name)
    outputs = (*case.outputs, output.bound(case.mechanism))
    mechanism = with_markers(case.mechanism, outputs)
    sweep = replace(case.sweep, rate=RATE)
    case = replace(case, outputs=outputs, mechanism=mechanism, sweep=sweep)
    (record,) = kincheck.run(case, ["native"]).records
    if "ExpressionBasedPointToPointForce" in case.source:
        without += "'x'"  # the reader of OpenSim's expressions is OpenSim
    force = subject.force
    if name == "bushing in angles" and to in ("urdf", "sdf"):
        force = of_bushing(4.0)  # Drake's is read by the other law, with a note
    efforts = [
        effort(subject, q, RATE, force=force, without=without)
        + (gravity - G) / G * (hold(subject, q, without="'clock''x'"))
        for q in TURNS
    ]
    # numbers that stand in for missing inertia, and conversions of units
    assert record.outputs["effort"].position == pytest.approx(efforts, rel=1e-6, abs=1e-6)
