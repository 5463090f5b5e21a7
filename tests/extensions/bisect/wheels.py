"""Wheels of a small simulator, made by hand: a wheel is a zip file."""

from math import cos, sin
from zipfile import ZipFile

ENGINE = """
import numpy as np
from kincheck import PointMotion, Trajectory
{imports}


class Wobble:
    name, mode, loop, settings = "wobble", "projection", "python", {{}}

    def version(self):
        return "{version}"

    def unsupported(self, case):
        return None

    def build(self, case):
        return None

    def solve(self, model, case, tol):
        angle, rate = case.sweep.change[:, None], case.sweep.rate
        {deed}
        points = {{}}
        for point in case.points:
            x, y, _ = case.mechanism.point(point).position
            a = np.array([[x, y, 0.0]]) * np.cos(angle) + np.array([[-y, x, 0.0]]) * np.sin(angle)
            t = np.array([[x, y, 0.0]]) * -np.sin(angle) + np.array([[-y, x, 0.0]]) * np.cos(angle)
            points[point] = PointMotion(a + {offset}, rate * t, -{term} * rate**2 * a)
        samples = len(case.sweep.values)
        return Trajectory(points, np.ones(samples, bool), np.zeros(samples, int), residual=0.0)
"""


def engine(version="1", *, imports="", deed="", offset=0.0, term=1.0):
    """The text of a module with an engine of planar cranks."""
    return ENGINE.format(version=version, imports=imports, deed=deed, offset=offset, term=term)


def wheel(folder, version, text, *, package="wobble-sim", name="wobble", requires=(), tag="py3"):
    """Write the wheel of a release; its module offers the engine by an entry point."""
    base = package.replace("-", "_")
    info = f"{base}-{version}.dist-info"
    metadata = f"Metadata-Version: 2.1\nName: {package}\nVersion: {version}\n"
    files = {
        f"{base}.py": text,
        f"{info}/METADATA": metadata + "".join(f"Requires-Dist: {each}\n" for each in requires),
        f"{info}/WHEEL": f"Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\n"
        f"Tag: {tag}-none-any\n",
    }
    if name:
        files[f"{info}/entry_points.txt"] = f"[kincheck.engines]\n{name} = {base}:Wobble\n"
    with ZipFile(folder / f"{base}-{version}-{tag}-none-any.whl", "w") as file:
        for each, content in files.items():
            file.writestr(each, content)
        file.writestr(f"{info}/RECORD", "".join(f"{each},,\n" for each in files))


def twelve(folder):
    """Twelve releases: another interface before 4, an offset from 5 to 8, a term dropped at 7; the
    wheel of 10 is no zip file.
    """
    for release in range(1, 13):
        offset, term = 1e-6 * (5 <= release < 9), float(release < 7)
        imports = "from wobble_sim_core import turn" if release < 4 else ""
        text = engine(str(release), imports=imports, offset=offset, term=term)
        wheel(folder, f"{release}.0", text)
    (folder / "wobble_sim-10.0-py3-none-any.whl").write_bytes(b"no wheel")


CASE = """
schema = "kincheck-case/1"
name = "{name}"
source = "a crank of half a metre; its closed form"
truth = "{truth}"
[bodies.crank]
[joints.pivot]
type = "revolute"
bodies = ["ground", "crank"]
point = [0, 0, 0]
axis = [0, 0, 1]
[points.tip]
body = "crank"
position = [0.5, 0, 0]
[drivers.turn]
type = "joint_angle"
joint = "pivot"
[sweep]
driver = "turn"
start = 0
stop = 1
steps = 5
[outputs.x]
point = "tip"
component = "x"
atol = 1e-9
why = "round-off"
"""


HEADS = "turn,x,x.velocity,x.acceleration"


def case(folder, name="crank", truth="closed_form", columns=4):
    """Write the file of a crank; its table has so many columns, rates last."""
    text = CASE.format(name=name, truth=truth)
    if truth != "consensus_only":
        rows = [
            f"{t},{0.5 * cos(t)!r},{-0.5 * sin(t)!r},{-0.5 * cos(t)!r}"
            for t in (0.0, 0.25, 0.5, 0.75, 1.0)
        ]
        lines = [",".join(each.split(",")[:columns]) for each in (HEADS, *rows)]
        (folder / f"{name}.csv").write_text("\n".join(lines))
        text += f'[reference]\nfile = "{name}.csv"\n'
    path = folder / f"{name}.toml"
    path.write_text(text)
    return path
