"""K&C of a double wishbone with parallel equal arms, whose slopes and rates are short formulas.

Arms along y at the heights 0.15 and 0.45 m, from pivots at 0.3 to balls at 0.7 m. Each pivot has
two bushings 0.4 m apart along x. The tie rod is rigid, at half height, 0.15 m behind. The wheel's
centre is 0.05 m outside the balls at half height, and the contact 0.3 m below it.
"""

import kincheck
import pytest

KX, KY, KZ = 2e5, 4e5, 3e5
SPRING, BAR = 6e4, 700.0
BRACKET = 0.05
# Of a ball: along y, and along x, where the arm turns on its bushings too.
BY_Y, BY_X = 1.0 / (2.0 * KY), 1.0 / (2.0 * KX) + 0.4**2 / (2.0 * KY * 0.2**2)
# Of one ball's force against the other's, by a moment at the arm of 0.3 m.
LEAN = 2.0 * BY_Y / 0.3**2


def rise(spring):
    """Return the wheel's rise by an upward force: spring at half the arm, bushing, and lean."""
    return 4.0 / spring + 1.0 / (2.0 * KZ) + BRACKET**2 * LEAN


def corner(name, side, factor):
    """Return bodies, joints and springs of a side."""

    def at(x, y, z):
        return [factor * x, factor * side * y, factor * z]

    text = f'[bodies.knuckle{name}]\n[points.center{name}]\nbody = "knuckle{name}"\n'
    text += f"position = {at(0.0, 0.75, 0.3)}\n"
    for arm, z in (("lower", 0.15), ("upper", 0.45)):
        text += f'[bodies.{arm}{name}]\n[joints.{arm}_ball{name}]\ntype = "spherical"\n'
        text += f'bodies = ["{arm}{name}", "knuckle{name}"]\npoint = {at(0.0, 0.7, z)}\n'
        text += (
            f'[joints.{arm}_pivot{name}]\ntype = "revolute"\nbodies = ["ground", "{arm}{name}"]\n'
        )
        text += f"point = {at(0.0, 0.3, z)}\naxis = [1.0, 0.0, 0.0]\n"
        for end, x in (("front", 0.2), ("rear", -0.2)):
            text += f"[joints.{arm}_pivot{name}.bushings.{end}]\npoint = {at(x, 0.3, z)}\n"
            text += f"stiffness = {[KX / factor, KY / factor, KZ / factor]}\n"
    text += f'[joints.tie{name}]\ntype = "distance"\nbodies = ["ground", "knuckle{name}"]\n'
    text += f"points = [{at(-0.15, 0.3, 0.3)}, {at(-0.15, 0.7, 0.3)}]\n"
    text += f'[forces.spring{name}]\ntype = "spring_damper"\nbodies = ["ground", "lower{name}"]\n'
    text += (
        f"points = [{at(0.0, 0.5, 0.55)}, {at(0.0, 0.5, 0.15)}]\nstiffness = {SPRING / factor}\n"
    )
    text += f'[drivers.jounce{name}]\ntype = "point_coordinate"\npoint = "center{name}"\n'
    return text + "direction = [0.0, 0.0, 1.0]\n"


def wheel(convention="iso8855", side="left", radius=0.3, more=""):
    return f"""[sweep]
driver = "jounce"
start = -0.05
stop = 0.05
steps = 3
[suspension]
convention = "{convention}"
side = "{side}"
forward = [1.0, 0.0, 0.0]
up = [0.0, 0.0, 1.0]
wheel_center = "center"
wheel_radius = {radius}
travel = "jounce"
{more}
[outputs.toe]
type = "toe"
[outputs.camber]
type = "camber"
"""


def study(tmp_path, text, *args, **options):
    file = tmp_path / "car.toml"
    file.write_text('schema = "kincheck-case/1"\nname = "car"\nsource = "by hand"\n' + text)
    return kincheck.compliance(file, *args, **options)


@pytest.mark.parametrize("convention", ["iso8855", "sae_j670"])
@pytest.mark.parametrize("side", ["left", "right"])
def test_slope_signs_by_side_and_convention(tmp_path, side, convention):
    """A force on the contact towards the middle leans the wheel out at its top; the tie rod behind
    the axis then steers it in.
    """
    text = corner("", 1.0 if side == "left" else -1.0, 1.0) + wheel(convention, side)
    found = study(tmp_path, text, [0.0]).travel
    values = {name: curve.values[0] for name, curve in found.outputs.items()}
    inward = -1.0 if (side == "left") == (convention == "iso8855") else 1.0
    steer = 0.5 * BY_Y / 0.15  # both balls together move by half of one ball's alone
    assert values["toe.per_lateral_force"] == pytest.approx(inward * steer, rel=1e-12)
    # the force at the bracket that holds the height leans the wheel back a little
    held = 0.3 * LEAN * (1.0 - BRACKET**2 * LEAN / rise(SPRING))
    assert values["camber.per_lateral_force"] == pytest.approx(inward * held, rel=1e-12)
    turn = 0.5 * BY_Y / 0.15**2
    assert values["toe.per_aligning_torque"] == pytest.approx(inward * turn, rel=1e-12)
    assert values["toe.per_longitudinal_force"] == pytest.approx(BRACKET * turn, rel=1e-12)
    assert values["toe.per_braking_force"] == pytest.approx(-BRACKET * turn, rel=1e-12)
    lean = -BRACKET * LEAN / rise(SPRING)
    assert values["camber.per_travel"] == pytest.approx(lean, rel=1e-12)


@pytest.mark.parametrize(
    ("key", "load"), [("brakes", "braking"), ("drive", "longitudinal")], ids=["brakes", "drive"]
)
@pytest.mark.parametrize("place", ["inboard", "outboard"])
def test_brake_or_drive_torque_on_knuckle(tmp_path, key, load, place):
    """Outboard the force acts at the contact: the lower ball has 1.5 of it; else both have half."""
    text = corner("", 1.0, 1.0) + wheel(more=f'{key} = "{place}"')
    text += '[points.low]\nbody = "knuckle"\nposition = [0.0, 0.7, 0.15]\n'
    text += '[outputs.low]\npoint = "low"\ncomponent = "x"\n'
    found = study(tmp_path, text, [0.0]).travel.outputs[f"low.per_{load}_force"].values[0]
    sign = -1.0 if load == "braking" else 1.0
    part = 1.5 if place == "outboard" else 0.5
    assert found == pytest.approx(sign * part * BY_X, rel=1e-12)


BAR_TEXT = "".join(
    f"""[bodies.bar{name}]
origin = [0.4, {side * 0.3}, 0.05]
[joints.link{name}]
type = "distance"
bodies = ["bar{name}", "lower{name}"]
points = [[0.0, {side * 0.5}, 0.05], [0.0, {side * 0.5}, 0.15]]
[joints.hinge{name}]
type = "revolute"
bodies = ["ground", "bar{name}"]
point = [0.4, {side * 0.3}, 0.05]
axis = [0.0, 1.0, 0.0]
"""
    for name, side in (("", 1.0), ("_right", -1.0))
)
BAR_TEXT += f"""[forces.bar]
type = "bushing"
bodies = ["bar", "bar_right"]
point = [0.4, 0.0, 0.05]
turning_stiffness = [0.0, {BAR}, 0.0]
"""
OTHER = '[suspension.other]\nwheel_center = "center_right"\ntravel = "jounce_right"\n'
OTHER += '[drivers.jounce_right.motion]\ntype = "ramp"\nrate = 1.0\n'
