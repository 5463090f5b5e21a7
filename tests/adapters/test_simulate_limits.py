"""What the simulators' own solvers cannot express, and the command line that keeps modes apart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from kincheck import adapters
from kincheck.adapters.shared.equivalents import jointed
from kincheck.core import (
    Body,
    Distance,
    Gear,
    JointAngle,
    Mechanism,
    Point,
    Revolute,
)
from kincheck.core.case.case import Case, Output, Sweep, Truth
from kincheck.core.case.joint_probe import probes
from kincheck.core.cli import main
from kincheck.core.harness.record import Outcome, from_json
from kincheck.core.mechanism.motions import Sine

from ..support.mechanisms import mcpherson
from ..support.simulating import record, simulation, strut, worst


def test_a_rod_of_another_length_stays_a_distance():
    plain = mcpherson()
    joints = [
        replace(joint, length=joint.rod_length + 1e-3) if isinstance(joint, Distance) else joint
        for joint in plain.joints
    ]
    assert any(
        isinstance(joint, Distance) for joint in jointed(replace(plain, joints=joints)).joints
    )
    case = replace(strut(), mechanism=replace(plain, joints=joints))
    assert "tie_rod" in adapters.engine("pinocchio", "simulate").unsupported(case)


def gears():
    z = (0.0, 0.0, 1.0)
    mechanism = Mechanism(
        "gears",
        [Body("one"), Body("two")],
        [
            Revolute("a", "ground", "one", (0.0, 0.0, 0.0), z),
            Revolute("b", "ground", "two", (1.0, 0.0, 0.0), z),
        ],
        [Point("tip", "two", (1.5, 0.0, 0.0))],
        [JointAngle("turn", "a")],
        [Gear("mesh", ("a", "b"), ratio=-2.0)],
    )
    output = Output("x", "tip", (1.0, 0.0, 0.0), False, 1e-9, 0.0, "made up")
    sweep = Sweep("turn", np.linspace(0.0, 7.0, 71))
    return Case("gears", "made up", Truth.CONSENSUS_ONLY, mechanism, sweep, (output,))


def test_what_a_solver_cannot_express_is_named():
    case = gears()
    uneven = replace(case, sweep=Sweep("turn", np.array([0.0, 0.1, 0.3])))
    assert "equidistant" in adapters.engine("exudyn", "simulate").unsupported(uneven)
    # two turns and more of the second gear
    assert record(case, simulation("exudyn-static")).outcome is Outcome.PASS


COUPLED = "constant_velocity gear linear_coupler polynomial rack_pinion screw"
EXUDYN = "constant_velocity polynomial revolute_spherical"
REFUSED = {
    **dict.fromkeys(("mujoco", "mujoco-default", "mujoco-projecting"), ""),
    **dict.fromkeys(("pinocchio", "dart"), COUPLED),
    **dict.fromkeys(("exudyn", "exudyn-alpha", "exudyn-static", "exudyn-static-modified"), EXUDYN),
    **dict.fromkeys(("drake", "simbody"), "polynomial"),
}
"""Joint and coupler types that simulators refuse; all others they simulate."""


@pytest.mark.parametrize("name", adapters.SIMULATIONS)
def test_joints_of_simulators_are_those_of_the_table(name):
    engine = adapters.engine(name, "simulate")
    found = {case.name: engine.unsupported(case) for case in probes()}
    refused = {kind: message for kind, message in found.items() if message is not None}
    assert " ".join(sorted(refused)) == REFUSED[name]
    assert all(f"'tested' ({kind})" in message for kind, message in refused.items())


def test_steps_refuse_what_their_simulator_has_no_constraint_of():
    drake, dart = (adapters.engine(n, "simulate") for n in ("drake", "dart"))
    uneven = replace(gears(), sweep=Sweep("turn", np.array([0.0, 0.1, 0.3])))
    assert "equidistant" in drake.unsupported(uneven)
    joints = [
        replace(joint, length=joint.rod_length + 1e-3) if isinstance(joint, Distance) else joint
        for joint in mcpherson().joints
    ]
    rod = replace(strut(), mechanism=replace(mcpherson(), joints=joints))
    assert "tie_rod" in dart.unsupported(rod)
    assert drake.unsupported(rod) is None


def test_gears_of_drake_turn_with_a_motion_that_is_not_steady():
    motion = {"turn": Sine(0.5, 1.0)}
    case = replace(gears(), sweep=Sweep("time", np.linspace(0.0, 0.4, 41), motions=motion))
    assert worst(record(case, simulation("drake")))[0] <= 1e-8  # nearly rigid


def simulated(tmp_path, *options):
    file = tmp_path / "results.json"
    # in this process: a worker takes longer to begin than to solve
    status = main.main(["run", "mcpherson_strut", "--jobs", "0", *options, "--json", str(file)])
    return status, [(each.engine, each.mode) for each in from_json(file.read_bytes()).records]


def test_the_command_line_keeps_modes_apart(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(
        adapters, "ENGINES", {name: adapters.ENGINES[name] for name in ("native", "mujoco")}
    )
    assert simulated(tmp_path, "--mode", "simulate", "--engine", "mujoco") == (
        1,
        [("mujoco", "simulate")],
    )
    assert simulated(tmp_path, "--engine", "mujoco-projecting") == (
        0,
        [("mujoco-projecting", "simulate")],
    )
    assert simulated(tmp_path) == (0, [(name, "projection") for name in adapters.ENGINES])
    assert (
        main.main(["run", "mcpherson_strut", "--mode", "projection", "--engine", "exudyn-static"])
        == 2
    )
    assert (
        "engine 'exudyn-static' has the mode 'simulate', not 'projection'"
        in capsys.readouterr().err
    )
    assert main.main(["list"]) == 0
    assert "exudyn-static-modified" in capsys.readouterr().out
