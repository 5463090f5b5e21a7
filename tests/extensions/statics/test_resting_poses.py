"""Efforts and reactions at rest, resting poses, efforts at other joints, frames of reactions."""

import json
from dataclasses import replace

import numpy as np
import pytest
from kincheck import CaseError, KincheckError, Outcome, adapters, cases
from kincheck.core.case.io.case_file import case_text, load_case
from kincheck.core.case.measures import DriverEffort
from kincheck.core.case.quantity import with_markers
from kincheck.core.cli.main import main
from kincheck.core.harness.compare import output_series
from kincheck.core.harness.native_engine import NativeEngine
from scipy.optimize import brentq

from ...support.examples import examples
from ...support.fakes import record_of

ARM, SWEEP, TURNED, PARALLEL = examples(__file__, "arm", "sweep", "turned", "parallel")

G = 9.81
EFFORTS = """
[outputs.lift]
type = "driver_effort"
driver = "lift"
[outputs.bend]
type = "driver_effort"
driver = "bend"
"""


def read(tmp_path, text):
    file = tmp_path / "arm.toml"
    file.write_text(text)
    return load_case(file)


def values(case, engine="native"):
    """Return the outputs of a case by an engine."""
    engine = adapters.engine(engine)
    record = record_of(engine, case, baseline=adapters.engine("native"))
    assert not record.outcome.bad, record.message
    return {name: np.array(each.position, float) for name, each in record.outputs.items()}


def held(lift, bend):
    """Return the efforts that hold the arm, from potential energy: turns about y lower x > 0."""
    both = lift + bend
    elbow = -G * 0.1 * np.cos(both)
    weight = G * (2.0 * 0.2 * np.cos(lift) + 1.0 * 0.4 * np.cos(lift))
    return -weight + elbow + 50.0 * lift, elbow


def components(frame, kind, joint, more=""):
    """Return the outputs of a reaction in a frame."""
    return "".join(
        f'[outputs.{frame}_{x}]\ntype = "joint_{kind}"\njoint = "{joint}"\ncomponent = "{x}"\n'
        f'frame = "{frame}"\n{more}'
        for x in "xyz"
    )


WRIST = "[forces.wrist]\ntype = 'torsion_spring_damper'\njoint = 'elbow'\nstiffness = 8.0\n"
ANGLE = '[outputs.angle]\ntype = "joint_angle"\njoint = "shoulder"\n'
ENGINES = ["native", "pinocchio", "mujoco", "exudyn"]


@pytest.mark.parametrize("engine", ENGINES)
def test_rate_zero_gives_static_efforts(tmp_path, engine):
    """Without a damper's and inertia's part, at all samples of both drivers."""
    found = values(read(tmp_path, ARM + SWEEP + EFFORTS), engine)
    lift = np.linspace(-0.4, 0.4, 5)
    expected = held(lift, 0.5 * lift)
    assert found["lift"] == pytest.approx(expected[0], abs=1e-11)
    assert found["bend"] == pytest.approx(expected[1], abs=1e-11)


def test_static_case_is_written_as_read(tmp_path):
    case = read(tmp_path, ARM + SWEEP + EFFORTS)
    again = tmp_path / "again.toml"
    again.write_text(case_text(case))
    assert load_case(again).sweep.static
    assert values(load_case(again))["lift"] == pytest.approx(values(case)["lift"], rel=1e-15)


def test_static_results_have_no_rates(tmp_path):
    case = read(tmp_path, ARM + SWEEP + '[outputs.x]\npoint = "tip"\ncomponent = "x"\n')
    engine = adapters.engine("pinocchio")
    record = record_of(engine, case, baseline=adapters.engine("native"))
    assert (record.outcome.value, record.message) == ("pass", "")
    assert record.outputs["x"].velocity is None


def test_option_static_equals_rate_zero(tmp_path, capsys):
    moving = (ARM + SWEEP + EFFORTS).replace("rate = 0\n", "rate = 2.0\n")
    (tmp_path / "arm.toml").write_text(moving)
    out = tmp_path / "out.json"
    command = ["run", str(tmp_path / "arm.toml"), "--engine", "native", "pinocchio", "--static"]
    assert main([*command, "--json", str(out)]) == 0
    records = json.loads(out.read_text())["records"]
    lift = np.linspace(-0.4, 0.4, 5)
    for record in records:
        assert record["outputs"]["lift"]["position"] == pytest.approx(
            held(lift, 0.25 * lift)[0], abs=1e-11
        )
    capsys.readouterr()


@pytest.mark.parametrize("engine", ENGINES)
def test_resting_pose_needs_no_effort(tmp_path, engine):
    """Both drivers are free: a coil at the shoulder, and the hand hangs straight down."""
    found = values(read(tmp_path, ARM + "[equilibrium]\n" + EFFORTS + ANGLE + WRIST), engine)
    assert found["lift"] == pytest.approx([0.0], abs=1e-12)
    assert found["bend"] == pytest.approx([0.0], abs=1e-12)

    def bent(lift):
        return brentq(lambda x: held(lift, x)[1] + 8.0 * x, -2.0, 2.0, xtol=1e-15)

    angle = brentq(lambda x: held(x, bent(x))[0], -1.0, 1.0, xtol=1e-15)
    assert found["angle"] == pytest.approx([angle], abs=1e-12)


def test_resting_pose_needs_no_drivers(tmp_path):
    """Joints' coordinates that nothing drives are held where they rest, by drivers of their
    names; one of both is enough to be driven.
    """
    bare = ARM[: ARM.index("[drivers.lift]")] + ARM[ARM.index("[forces.coil]") :]
    bare += WRIST + '[outputs.z]\npoint = "tip"\ncomponent = "z"\n[equilibrium]\n'
    lift = '[drivers.lift]\ntype = "joint_angle"\njoint = "shoulder"\n'
    heights = [values(read(tmp_path, text))["z"] for text in (bare, bare + lift)]
    assert heights[0] == pytest.approx(heights[1], abs=1e-14)
    case = read(tmp_path, bare)
    assert [driver.name for driver in case.mechanism.drivers] == ["shoulder", "elbow"]
    assert "the resting pose is held by drivers of shoulder, elbow" in case.assembly
    found = values(case, "mujoco")
    for name in ("shoulder", "elbow"):
        assert found[f"{name}.effort"] == pytest.approx([0.0], abs=1e-11)


def test_driver_named_as_sprung_joint(tmp_path):
    """A single joint; its row had been left out with the driver's."""
    alone = ARM.partition("[bodies.hand]")[0] + ARM[ARM.index("[forces.coil]") :]
    alone += TURNED[TURNED.index("[joints.pin]") : TURNED.index("[points.post]")]
    alone += TURNED[TURNED.index("[drivers.turn]") :]
    alone = alone.replace('"beam"', '"arm"').replace("drivers.turn", "drivers.pin")
    alone = alone.replace('joint = "shoulder"', 'joint = "pin"').replace('"turn"', '"pin"')
    alone += '[outputs.effort]\ntype = "driver_effort"\ndriver = "pin"\n'
    turn = np.array([0.0, 0.3, 0.6])
    expected = 50.0 * turn - 2.0 * G * 0.2 * np.cos(turn)
    assert values(read(tmp_path, alone))["effort"] == pytest.approx(expected, abs=1e-12)


def test_missing_effort_at_dead_centre(tmp_path):
    """A straight slider crank: no force on the slider holds it."""
    text = ARM.partition("[bodies.arm]")[0] + TURNED[TURNED.index("[drivers.turn]") :]
    for body, x in (("crank", 0.5), ("rod", 2.0), ("slider", 3.0)):
        text += f"[bodies.{body}]\nmass = 1.0\ncenter_of_mass = [{x}, 0.0, 0.0]\n"
    for name, i, j, x in (
        ("pin", "ground", "crank", 0.0),
        ("knee", "crank", "rod", 1.0),
        ("wrist", "rod", "slider", 3.0),
    ):
        text += f'[joints.{name}]\ntype = "revolute"\nbodies = ["{i}", "{j}"]\n'
        text += f"point = [{x}, 0.0, 0.0]\naxis = [0.0, 1.0, 0.0]\n"
    text += '[joints.slide]\ntype = "translational"\nbodies = ["ground", "slider"]\n'
    text += "point = [3.0, 0.0, 0.0]\naxis = [1.0, 0.0, 0.0]\n"
    text += '[outputs.e]\ntype = "driver_effort"\ndriver = "turn"\nat = "slide"\n'
    record = record_of(NativeEngine(), read(tmp_path, text))
    assert record.outputs["e"].position[0] is None
    assert "at 1 of 3 samples joint 'slide' is at a dead centre" in record.outputs["e"].reason


class Heavy(NativeEngine):
    """An engine with twice the gravity."""

    def __init__(self):
        super().__init__(name="heavy")

    def build(self, case):
        gravity = tuple(2.0 * x for x in case.mechanism.gravity)
        return super().build(replace(case, mechanism=replace(case.mechanism, gravity=gravity)))


def test_equilibrium_without_effort_outputs_is_judged(tmp_path):
    """The efforts of free drivers vanish; bushings of joints wait for a compliance study."""
    text = ARM + "[equilibrium]\n" + ANGLE + WRIST
    text += "[joints.shoulder.bushings.rubber]\nstiffness = 1e5\nturning_stiffness = 90.0\n"
    case = read(tmp_path, text)
    found = values(case, "native")
    assert [found[f"{name}.effort"][0] for name in ("lift", "bend")] == pytest.approx([0.0] * 2)
    record = record_of(Heavy(), case, baseline=NativeEngine())
    assert record.outcome is Outcome.FAIL
    assert "lift.effort" in record.message


def test_resting_pose_follows_held_driver(tmp_path):
    text = ARM + '[equilibrium]\nheld = ["bend"]\n' + EFFORTS + ANGLE
    text += '[sweep]\ndriver = "bend"\nstart = -0.5\nstop = 0.5\nsteps = 3\n'
    case = read(tmp_path, text)
    found = values(case, "mujoco")
    assert found["lift"] == pytest.approx(np.zeros(3), abs=1e-11)
    for bend, angle, effort in zip((-0.5, 0.0, 0.5), found["angle"], found["bend"], strict=True):
        expected = brentq(lambda x, bend=bend: held(x, bend)[0], -1.0, 1.0, xtol=1e-15)
        assert angle == pytest.approx(expected, abs=1e-12)
        assert effort == pytest.approx(held(expected, bend)[1], abs=1e-11)


def test_unstable_resting_pose_is_noted(tmp_path):
    upright = ARM.replace("gravity = [0.0, 0.0, -9.81]", "gravity = [-100.0, 0.0, 0.0]")
    case = read(tmp_path, upright + '[equilibrium]\nheld = ["bend"]\n' + EFFORTS)
    assert "unstable: body" in "".join(case.assembly)


@pytest.mark.parametrize(
    ("more", "expected"),
    [
        ('[equilibrium]\nheld = ["twist"]\n', "'twist'"),
        ("[equilibrium]\n" + SWEEP, "'bend' moves, and .equilibrium. leaves it free"),
        ("", "sweep: missing"),
    ],
)
def test_equilibrium_of_contradictions_is_refused(tmp_path, more, expected):
    with pytest.raises(CaseError, match=expected):
        read(tmp_path, ARM + more + EFFORTS)


def test_pose_without_equilibrium_is_refused(tmp_path):
    """A hand on a frictionless elbow, held out by nothing."""
    loose = ARM.replace("gravity = [0.0, 0.0, -9.81]", "gravity = [0.0, 0.0, 0.0]")
    with pytest.raises(KincheckError, match=r"body 'hand' turns about .* freely"):
        read(tmp_path, loose + "[equilibrium]\n" + EFFORTS)


@pytest.mark.parametrize("name", ["rssr", "four_bar"])
def test_effort_at_joint_by_virtual_work(name):
    """An actuator there holds the same mechanism: found by driving that joint instead."""
    case = cases.load(name)
    mechanism = case.mechanism
    driver = mechanism.drivers[0]
    other = "rocker_pivot"
    wanted = DriverEffort("there", 1e-9, 0.0, "", driver=driver.name, at=other)
    wanted = wanted.bound(mechanism)
    sweep = replace(case.sweep, values=np.array([0.2, 0.9]), rate=0.0)
    moved = replace(
        case,
        mechanism=with_markers(mechanism, [wanted]),
        outputs=(wanted,),
        sweep=sweep,
        reference={},
    )
    native = adapters.engine("native")
    solved = native.solve(native.build(moved), moved, 1e-13)
    found = output_series(moved, wanted, solved).position
    # virtual work by finite differences of the rocker's angle
    own = DriverEffort("own", 1e-9, 0.0, "", driver=driver.name).bound(mechanism)
    plain = replace(moved, mechanism=with_markers(mechanism, [own]), outputs=(own,))
    effort = output_series(plain, own, native.solve(native.build(plain), plain, 1e-13)).position
    (there, _) = wanted.rates
    h = 1e-5

    def angles(x):
        at = replace(moved, sweep=replace(sweep, values=sweep.values + x, rate=1.0))
        at = replace(at, mechanism=with_markers(mechanism, [there]), outputs=(there,))
        return output_series(at, there, native.solve(native.build(at), at, 1e-13)).position

    slope = (angles(h) - angles(-h)) / (2.0 * h)
    assert found == pytest.approx(effort / slope, rel=1e-8)


def test_reaction_frames_and_moment_points(tmp_path):
    outputs = components("global", "force", "elbow") + components("body", "force", "elbow")
    outputs += components("joint", "force", "shoulder")
    for name, about in (("tip", 'about = "tip"\n'), ("elbow", "")):
        outputs += f'[outputs.{name}]\ntype = "joint_moment"\njoint = "elbow"\n'
        outputs += f'component = "y"\n{about}'
    case = read(tmp_path, ARM + SWEEP + outputs)
    # the hand weighs 9.81 N, and hangs on the elbow: it is turned by 1.5 times the driver
    turn = 1.5 * np.linspace(-0.4, 0.4, 5)
    for engine in ("native", "pinocchio"):
        found = values(case, engine)
        assert found["global_z"] == pytest.approx(np.full(5, G), abs=1e-11)
        assert found["body_x"] == pytest.approx(-G * np.sin(turn), abs=1e-11)
        assert found["body_z"] == pytest.approx(G * np.cos(turn), abs=1e-11)
        # z of the joint's frame is its axis, y of the global one
        size = np.hypot(found["joint_x"], found["joint_y"])
        assert size == pytest.approx(np.full(5, 3.0 * G), abs=1e-11)
        assert found["joint_z"] == pytest.approx(np.zeros(5), abs=1e-11)
        # the tip is 0.2 m beyond the elbow
        assert found["tip"] == pytest.approx(found["elbow"] + G * 0.2 * np.cos(turn), abs=1e-11)


@pytest.mark.parametrize("engine", ["native", "mujoco", "exudyn"])
def test_moments_about_point_in_frames(tmp_path, engine):
    """The beam's own y is up at design, its z forward; the joint's z is its axis."""
    head = ARM.partition("[bodies.arm]")[0]
    about = 'about = "post"\n'
    outputs = components("global", "moment", "pin", about) + components("body", "force", "pin")
    outputs += components("joint", "moment", "pin", about)
    found = values(read(tmp_path, head + TURNED + outputs), engine)
    turn, weight = np.array([0.0, 0.3, 0.6]), np.full(3, 2.0 * G)
    expected = {
        "global_x": -0.1 * weight,
        "global_y": 0.25 * weight,
        "body_y": weight * np.cos(turn),
        "body_z": -weight * np.sin(turn),
        "joint_z": 0.25 * weight,
    }
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, abs=1e-10)
    across = np.hypot(found["joint_x"], found["joint_y"])
    assert across == pytest.approx(0.1 * weight, abs=1e-10)


def test_redundant_rows_leave_turned_components_undetermined(tmp_path):
    """Each end bears half of the rod; along the axis, and what a body's own axes mix with it,
    rigid bodies tell nothing.
    """
    head, sweep = ARM.partition("[bodies.arm]")[0], TURNED[TURNED.index("[drivers.turn]") :]
    outputs = "".join(components(frame, "force", "b") for frame in ("global", "body", "joint"))
    text = head + PARALLEL + sweep.replace('"pin"', '"a"') + outputs
    found = values(read(tmp_path, text), "pinocchio")
    assert found["global_z"] == pytest.approx(np.full(3, 1.5 * G), abs=1e-11)
    lost = {name for name, value in found.items() if np.isnan(value).all()}
    assert lost == {"global_y", "body_y", "body_z", "joint_z"}


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ('type = "joint_force"\nabout = "tip"', "the same about any point"),
        ('type = "joint_moment"\nabout = "toe"', "'toe'"),
        ('type = "joint_force"\nframe = "wheel"', "global, body, joint"),
    ],
)
def test_reaction_in_unknown_frame_is_refused(tmp_path, keys, expected):
    output = f'[outputs.r]\n{keys}\njoint = "elbow"\ncomponent = "x"\n'
    with pytest.raises(KincheckError, match=expected):
        read(tmp_path, ARM + SWEEP + output)


def test_reactions_option_adds_every_determined_force(tmp_path, capsys):
    (tmp_path / "arm.toml").write_text(ARM + SWEEP + EFFORTS)
    out = tmp_path / "out.json"
    case = str(tmp_path / "arm.toml")
    command = ["run", case, "--reactions", "--engine", "native", "pinocchio", "--json", str(out)]
    assert main(command) == 0
    outputs = json.loads(out.read_text())["records"][1]["outputs"]
    assert [*outputs][:3] == ["shoulder.force_x", "shoulder.force_y", "shoulder.force_z"]
    assert outputs["elbow.force_z"]["position"] == pytest.approx([G] * 5, abs=1e-11)
    assert outputs["coil.force"]["unit"] == "N m"
    shown = capsys.readouterr().out
    assert shown.index("N m") < shown.index("m/s")


def test_reactions_option_names_undetermined_joints(tmp_path, capsys):
    assert main(["run", "four_bar", "--reactions", "--static", "--engine", "native"]) == 0
    said = capsys.readouterr().out
    assert said.count("redundant rows leave") == 4
    assert "joint 'crank_pin': redundant rows leave" in said
