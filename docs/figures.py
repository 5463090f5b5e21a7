"""Figures of the documentation, made by the code that they show: SVG by address."""

import contextlib
import csv
import io
import re
import tempfile
from itertools import combinations
from pathlib import Path
from typing import Any

import kincheck
import matplotlib
import numpy as np
from kincheck import adapters
from kincheck.core.cli.main import main
from matplotlib.figure import Figure

ROOT = Path(__file__).parent.parent
PAGES = Path(__file__).parent / "pages"
COLOURS = ("#4c72d9", "#e07b39", "#3a9d5d", "#b0529f", "#8a8a8a", "#c9a227", "#2aa5b8")
GREY = "#808080"
"""Text and axes: readable on light and dark pages."""

matplotlib.rcParams.update(
    {
        "svg.hashsalt": "kincheck",
        "svg.fonttype": "none",
        "font.family": "sans-serif",
        "font.size": 10,
        "axes.edgecolor": GREY,
        "axes.labelcolor": GREY,
        "axes.titlecolor": GREY,
        "text.color": GREY,
        "xtick.color": GREY,
        "ytick.color": GREY,
        "axes.grid": True,
        "grid.color": GREY,
        "grid.alpha": 0.25,
        "axes.prop_cycle": matplotlib.cycler(color=COLOURS),
        "figure.constrained_layout.use": True,
        "legend.frameon": False,
    }
)


def FIGURES() -> dict[str, str | bytes]:  # noqa: N802
    """Return the figures by address."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        car = _files("start/suspension.md")
        return {
            **{
                f"figures/{name}": (ROOT / ".github" / name).read_bytes()
                for name in ("report.png", "live.png", "tour.webp")
            },
            "figures/strut-errors.svg": strut_errors(),
            "examples/report.html": example_report(),
            "examples/live.html": example_live(),
            "figures/car-scene.svg": scene(car, "car", frames=(0, 16, 32)),
            "figures/car-curves.svg": car_curves(car),
            "figures/car-envelope.svg": car_envelope(),
            "figures/leg-scene.svg": leg_scene(),
            "figures/forces.svg": forces(),
        }


def _files(page: str) -> Any:
    """Write the files of a page here, and return the results of car.csv."""
    text = (PAGES / page).read_text("utf-8")
    for name, content in re.findall(r'^```\w+ title="(.+?)"\n(.*?)^```$', text, re.M | re.S):
        Path(name).write_text(content, "utf-8")
    with open("car.csv", "w") as table, contextlib.redirect_stdout(table):
        main(["templates", "mcpherson"])
    case = kincheck.load("car.csv", kincheck.Supplied(travel="0.08:33"))
    return kincheck.run(case, "native")


def example_live() -> str:
    """Return the live page of a double wishbone, with its solver in it."""
    with open("wishbone.csv", "w") as table, contextlib.redirect_stdout(table):
        main(["templates", "double_wishbone"])
    page = Path("live.html")
    assert main(["serve", "wishbone.csv", "--travel", "0.06:61", "--save", str(page)]) == 0
    return page.read_text("utf-8")


def svg(figure: Figure) -> str:
    """Return a figure as SVG with a transparent background."""
    text = io.StringIO()
    figure.savefig(text, format="svg", transparent=True, metadata={"Date": None})
    return text.getvalue()


def example_report() -> bytes:
    """Return the report of two cases with forces, as a page to try."""
    with contextlib.redirect_stdout(io.StringIO()):
        main(
            ["run", "mcpherson_suspension", "rssr", "--engine", "native", "mujoco"]
            + ["--out", "example"]
        )
    return Path("example/report.html").read_bytes()


def strut_errors() -> str:
    """Errors of the installed engines on the strut, against its reference."""
    engines = [name for name in adapters.ENGINES if adapters.engine(name).version()]
    case = kincheck.load("mcpherson_strut")
    results = kincheck.run(case, engines)
    figure = Figure(figsize=(7.5, 2.9))
    titles = ("position [m]", "velocity [m/s]", "acceleration [m/s²]")
    stroke = case.sweep.values * 1e3
    for axes, title, quantity in zip(
        figure.subplots(1, 3, sharex=True),
        titles,
        ("position", "velocity", "acceleration"),
        strict=True,
    ):
        for record in results.records:
            found = record.errors["half_track_change"]
            deviation = getattr(found, quantity)
            values = np.array(getattr(record.outputs["half_track_change"], quantity))
            true = np.array(getattr(case.reference["half_track_change"], quantity))
            label = f"{record.engine}, at most {deviation.max_abs:.0e}"
            error = np.where(values == true, np.nan, abs(values - true))
            axes.semilogy(stroke, error, ".", ms=3, label=label)
        axes.set_title(f"error of {title}", fontsize=10)
        axes.set_xlabel("stroke [mm]")
        axes.legend(fontsize=7, loc="lower left")
        bottom, top = axes.get_ylim()
        axes.set_ylim(bottom=bottom * (bottom / top) ** 0.6)
    return svg(figure)


def car_curves(results: Any) -> str:
    """Toe, camber and roll centre over wheel travel."""
    record = results.record("car", "native")
    travel = np.array(record.driver["stroke"]) * 1e3
    figure = Figure(figsize=(7.5, 2.6))
    shown = (("toe", "°", 180 / np.pi), ("camber", "°", 180 / np.pi))
    shown += (("roll_center_height", "mm", 1e3),)
    for axes, (name, unit, factor) in zip(figure.subplots(1, 3), shown, strict=True):
        axes.plot(np.array(record.outputs[name].position, float) * factor, travel)
        axes.set_xlabel(f"{name.replace('_', ' ')} [{unit}]")
        axes.axhline(0, color=GREY, lw=0.7)
    figure.axes[0].set_ylabel("wheel travel [mm]")
    return svg(figure)


def car_envelope() -> str:
    """Nominal, quantiles and extremes of toe over the variants."""
    with open("sweep.log", "w") as log, contextlib.redirect_stdout(log):
        command = "sweep car.csv --vary hardpoints.toml --samples 2000 --seed 1 --out study"
        main([*command.split(), "--output", "toe", "camber"])
    with open("study/envelope.csv", newline="") as file:
        rows = [*csv.DictReader(line for line in file if line[0] != "#")]
    figure = Figure(figsize=(7.5, 2.8))
    for axes, name in zip(figure.subplots(1, 2), ("toe", "camber"), strict=True):
        found = [row for row in rows if row["output"] == name]
        travel = np.array([float(row["stroke"]) for row in found]) * 1e3
        degrees = {
            key: np.degrees([float(row[key]) for row in found])
            for key in ("min", "max", "nominal", "quantile_0.05", "quantile_0.95")
        }
        axes.fill_betweenx(travel, degrees["min"], degrees["max"], alpha=0.2, label="all variants")
        bounds = degrees["quantile_0.05"], degrees["quantile_0.95"]
        axes.fill_betweenx(travel, *bounds, alpha=0.4, color=COLOURS[0], label="90 % of them")
        axes.plot(degrees["nominal"], travel, color=COLOURS[1], label="nominal")
        axes.set_xlabel(f"{name} [°]")
        axes.legend(fontsize=8)
    figure.axes[0].set_ylabel("wheel travel [mm]")
    return svg(figure)


def forces() -> str:
    """Forces of the loaded strut over the stroke."""
    _files("how-to/forces.md")
    record = kincheck.run("loaded.toml", "native").record("loaded_strut", "native")
    stroke = np.array(record.driver["stroke"]) * 1e3
    figure = Figure(figsize=(7.5, 2.8))
    axes = figure.subplots()
    for name in ("wheel_load", "spring_force", "ball_force"):
        axes.plot(stroke, np.array(record.outputs[name].position) / 1e3, label=name)
    axes.set_xlabel("stroke [mm]")
    axes.set_ylabel("force [kN]")
    axes.legend()
    return svg(figure)


def leg_scene() -> str:
    """The leg of the robotics tutorial at five angles, seen along its hinges."""
    text = (PAGES / "start" / "robotics.md").read_text("utf-8")
    Path("leg.xml").write_text(re.search(r'title="leg.xml"\n(.*?)```', text, re.S)[1], "utf-8")
    case = kincheck.load("leg.xml", kincheck.Supplied(drive=("crank:-0.5:0.5:41",)))
    results = kincheck.run(case, "native")
    figure = Figure(figsize=(7.5, 3.4))
    axes = figure.subplots()
    axes.set_aspect("equal")
    draw(axes, results.scenes["leg"], (0, 10, 20, 30, 40), plane=(0, 2))
    axes.set_xlabel("x [m]")
    axes.set_ylabel("z [m]")
    return svg(figure)


def scene(results: Any, name: str, frames: tuple[int, ...]) -> str:
    """A mechanism at some samples, from the front and from the side."""
    figure = Figure(figsize=(7.5, 5.0))
    views = ((1, 2, "front: y", "z"), (0, 2, "side: x", "z"))
    for axes, (across, up, one, two) in zip(figure.subplots(1, 2, sharey=True), views, strict=True):
        axes.set_aspect("equal")
        draw(axes, results.scenes[name], frames, plane=(across, up))
        axes.set_xlabel(f"{one} [m]")
        axes.set_ylabel(f"{two} [m]")
    figure.axes[1].get_legend().remove()
    return svg(figure)


def draw(axes: Any, shown: Any, frames: tuple[int, ...], plane: tuple[int, ...]) -> None:
    """Draw the bodies of a scene as lines between their joints, and the paths of its points."""
    places: dict[str, list[Any]] = {body.name: [] for body in shown.bodies}
    for joint in shown.joints:
        ends = joint.points if len(joint.points) == 2 else [*joint.points[:1]] * 2
        for body, place in zip(joint.bodies, ends, strict=False):
            places.setdefault(body, []).append(place)
        if joint.type == "distance":
            places[joint.name] = []
    for point in shown.points:
        places.setdefault(point.body, []).append(point.position)
    moving = {body.name: body for body in shown.bodies if body.r}
    middle = frames[len(frames) // 2]
    for colour, (name, body) in zip(COLOURS, moving.items(), strict=False):
        for k in frames:
            posed = np.array([pose(body, k, place) for place in places[name]])
            style = {"color": colour, "alpha": 1.0 if k == middle else 0.35, "lw": 2.0}
            for one, two in combinations(posed[:, plane], 2):
                axes.plot(*np.transpose([one, two]), **style)
        axes.plot([], [], color=colour, lw=2, label=name)
    for joint in shown.joints:
        if joint.type == "distance":
            for k in frames:
                ends = [
                    pose(moving[body], k, place) if body in moving else place
                    for body, place in zip(joint.bodies, joint.points, strict=True)
                ]
                alpha = 1.0 if k == middle else 0.35
                line = np.transpose(np.array(ends)[:, plane])
                axes.plot(*line, color=COLOURS[5], alpha=alpha, lw=2)
            axes.plot([], [], color=COLOURS[5], lw=2, label=joint.name)
    for joint in shown.joints:
        for body, place in zip(joint.bodies, [*joint.points] * 2, strict=False):
            if body not in moving:
                axes.plot(*np.array([place])[:, plane].T, "s", color=GREY, ms=5)
    for point in shown.points:
        if point.output and point.body in moving:
            body = moving[point.body]
            path = np.array([pose(body, k, point.position) for k in range(len(body.r))])
            axes.plot(*path[:, plane].T, ":", color=GREY, lw=1.2)
    axes.legend(fontsize=8, loc="upper left")


def pose(body: Any, k: int, place: Any) -> np.ndarray:
    """Return a point of a body, given at the design position, at a sample."""
    design, now = turn(body.euler_parameters), turn(body.p[k])
    return np.array(body.r[k]) + now @ design.T @ (np.array(place) - np.array(body.origin))


def turn(p: Any) -> np.ndarray:
    """Return the rotation matrix of Euler parameters."""
    e0, e = p[0], np.array(p[1:])
    cross = np.array([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
    return (2 * e0 * e0 - 1) * np.eye(3) + 2 * np.outer(e, e) + 2 * e0 * cross
