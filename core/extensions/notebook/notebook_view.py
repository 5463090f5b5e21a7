"""Results and mechanisms in a notebook: tables, curves and views in three dimensions as HTML and
SVG, without scripts, so that they are seen offline, in notebooks that are not trusted and in
exports.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterator, Mapping, Sequence
from html import escape
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...algebra import quat, rotation_less_identity, vec
from ...dataset import Dataset
from ...harness.scene_record import Scene
from ...mechanism.mechanism import GROUND, MARKER, Mechanism
from ...report.figures import COLOURS, Figure
from ...trajectory import Array
from ...unit_text import with_unit
from ..reports.svg import svg
from .tables import columns_of, curves_of, table_of

MOST_ROWS, MOST_COLUMNS, MOST_LINES, MOST_DIAGRAMS = 10, 10, 24, 9
"""Rows and columns of a table, lines of a diagram, and diagrams; the rest is left out, and said."""
SIZE = 320, 170
"""Of a diagram [px]."""
VIEW, MARGIN = 300.0, 28.0
"""Larger side of a mechanism, and the room around it [px]."""
_TURN, _TILT = math.radians(-55.0), math.radians(20.0)
_CAMERA = np.array(
    [
        [-math.sin(_TURN), math.cos(_TURN), 0.0],
        [
            math.sin(_TILT) * math.cos(_TURN),
            math.sin(_TILT) * math.sin(_TURN),
            -math.cos(_TILT),
        ],
    ]
)
"""Directions to the right and downwards on the screen."""
CELL = "text-align:right;padding:2px 8px;white-space:nowrap"


def to_html(title: str, data: Dataset) -> str:
    """Return the title, the curves and the table of a result."""
    drawn = "".join(_diagrams(data)) if data.x else ""
    return f"<div><b>{escape(title)}</b><div>{drawn}</div>{_table(data)}</div>"


def _table(data: Dataset) -> str:
    columns, units = table_of(data), {name: each.unit for name, each in columns_of(data).items()}
    count = len(next(iter(columns.values()), ()))
    half = MOST_ROWS // 2
    rows = [*range(count)] if count <= MOST_ROWS else [*range(half), *range(count - half, count)]
    shown = [*columns][:MOST_COLUMNS]
    heads = (with_unit(name, units.get(name, "")) for name in shown)
    lines = [f"<tr>{''.join(f'<th style={CELL!r}>{escape(head)}</th>' for head in heads)}</tr>"]
    for k, row in enumerate(rows):
        if k == half and count > MOST_ROWS:
            lines.append(f"<tr><td style={CELL!r} colspan='{len(shown)}'>…</td></tr>")
        cells = (escape(_number(columns[name][row])) for name in shown)
        lines.append(f"<tr>{''.join(f'<td style={CELL!r}>{cell}</td>' for cell in cells)}</tr>")
    more = len(columns) - len(shown)
    left = f"<div>{count} rows, {more} further columns</div>" if more or count > MOST_ROWS else ""
    return f"<div style='overflow-x:auto'><table>{''.join(lines)}</table></div>{left}"


def _number(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}" if math.isfinite(value) else "–"
    return str(value)


def _diagrams(data: Dataset) -> Iterator[str]:
    """Yield a diagram for each variable with curves."""
    across = data.coords[data.x]
    curves = curves_of(data)
    shown = data.shown or [*curves][:MOST_DIAGRAMS]
    for name in shown:
        columns = curves[name]
        label = with_unit(name, data.variables[name].unit)
        below = with_unit(data.x, across.unit)
        short = {column.removeprefix(f"{name}."): lines for column, lines in columns.items()}
        yield _diagram(label, below, across.values, short)
    if len(curves) > len(shown):
        yield f"<div>{len(curves) - len(shown)} further curves</div>"


def _diagram(label: str, below: str, x: NDArray[Any], columns: Mapping[str, NDArray[Any]]) -> str:
    """Return one diagram, with gaps for missing numbers."""
    lines = [
        (name, line)
        for name, values in columns.items()
        for line in values.reshape(len(values), math.prod(values.shape[1:])).T
    ]
    drawn, names = lines[:MOST_LINES], [*columns]
    traces = list[Figure]()
    for name, line in drawn:
        again, colour = divmod(names.index(name), len(COLOURS))
        look = {"color": COLOURS[colour], "dash": "dash" if again else "solid"}
        values = [y if math.isfinite(y) else None for y in map(float, line)]
        traces.append({"x": x.tolist(), "y": values, "line": look, "meta": name})
    figure = {"data": traces, "layout": {"xaxis": {"title": {"text": below}}}}
    legend = (
        ""
        if len(names) == 1
        else " ".join(
            f"<span style='color:{COLOURS[k % len(COLOURS)]}"
            f"{';border-bottom:1px dashed' if k >= len(COLOURS) else ''}'>{escape(name)}</span>"
            for k, name in enumerate(dict.fromkeys(name for name, _ in drawn))
        )
    )
    more = f" and {len(lines) - len(drawn)} more" if len(lines) > len(drawn) else ""
    return (
        "<div style='display:inline-block;margin:4px 12px 4px 0;vertical-align:top;font-size:11px'>"
        f"<div>{escape(label)}</div>{svg(figure, SIZE)}"
        f"<div style='max-width:{SIZE[0]}px'>{legend}{more}</div></div>"
    )


def view(
    title: str,
    spots: Sequence[tuple[str, ArrayLike]],
    rods: Sequence[tuple[ArrayLike, ArrayLike]],
    fixed: Container[str],
) -> str:
    """Return a mechanism in parallel projection, z up; it moves there and back over its frames.

    Args:
        spots: points with their bodies, global in each frame, shape (frames, 3) [m].
        rods: both ends of links between two bodies.
        fixed: bodies that do not move; their points are squares.
    """
    ends = np.array([*(at for _, at in spots), *(at for rod in rods for at in rod)], np.float64)
    if not ends.size:
        return f"<div><b>{escape(title)}</b></div>"
    seen = ends @ _CAMERA.T
    low, high = seen.min(axis=(0, 1)), seen.max(axis=(0, 1))
    scale = VIEW / max(float((high - low).max()), 1e-9)
    seen = MARGIN + scale * (seen - low)
    at, of_rods = seen[: len(spots)], seen[len(spots) :].reshape(-1, 2, *seen.shape[1:])
    names = [*dict.fromkeys(name for name, _ in spots)]
    parts = [_moving_line(rod, "#777", " stroke-dasharray='7 4'") for rod in of_rods]
    moving = [name for name in names if name not in fixed]
    for name in names:
        own = at[[k for k, (body, _) in enumerate(spots) if body == name]]
        mine = np.unique(own.round(1), axis=0)
        if name in fixed:
            parts += [
                f"<rect x='{x - 4:.1f}' y='{y - 4:.1f}' width='8' height='8' fill='none'"
                " stroke='#777'/>"
                for x, y in mine[:, 0]
            ]
            continue
        colour = COLOURS[moving.index(name) % len(COLOURS)]
        hub = mine.mean(axis=0)
        parts += [_moving_line(np.array([hub, end]), colour, " stroke-width='2.5'") for end in mine]
        x, y = hub[0]
        parts.append(f"<text x='{x + 6:.1f}' y='{y - 6:.1f}' fill='{colour}'>{escape(name)}</text>")
    width, height = (2 * MARGIN + scale * (high - low)).round().astype(int).tolist()
    return (
        "<div style='display:inline-block;margin:4px 24px 4px 0;vertical-align:top'>"
        f"<b>{escape(title)}</b><div><svg width='{width}' height='{height}' font-size='11'"
        f" font-family='sans-serif' overflow='visible'>{''.join(parts)}</svg></div></div>"
    )


def _moving_line(ends: NDArray[np.float64], colour: str, look: str) -> str:
    """Return a line between two ends, shape (2, frames, 2) [px]."""
    drawn = [f"M{a:.1f} {b:.1f}L{c:.1f} {d:.1f}" for (a, b), (c, d) in ends.swapaxes(0, 1)]
    there_and_back = ";".join([*drawn, *drawn[::-1]])
    motion = (
        f"<animate attributeName='d' values='{there_and_back}' dur='4s' repeatCount='indefinite'/>"
        if len(drawn) > 1
        else ""
    )
    return f"<path d='{drawn[0]}' stroke='{colour}'{look}>{motion}</path>"


def mechanism_view(title: str, mechanism: Mechanism) -> str:
    """Return the design position as HTML, below a title."""
    placed = [
        (body, P)
        for joint in mechanism.joints
        for body in joint.bodies
        for P in joint.points_on(body)
    ]
    placed += [
        (point.body, point.position)
        for point in mechanism.points
        if not point.name.startswith(MARKER)
    ]
    spots = [(body, [P]) for body, P in placed]
    pairs = [joint.points_on() for joint in mechanism.joints if len(joint.points_on()) == 2]
    rods = [([a], [b]) for a, b in pairs]
    fixed = {each.name for each in mechanism.bodies if each.fixed} | {GROUND}
    return view(title, spots, rods, fixed)


def scene_view(title: str, scene: Scene) -> str:
    """Return the motion for a notebook, in at most `MOST_FRAMES` frames."""
    bodies = {body.name: body for body in scene.bodies}
    spots: list[tuple[str, Array]] = []
    rods: list[tuple[Array, Array]] = []
    count = max(1, len(scene.frames))
    some = np.unique(np.linspace(0, count - 1, min(count, MOST_FRAMES)).round().astype(int))

    def at(name: str, place: Sequence[float]) -> Array:
        body = bodies.get(name)
        if body is None or not body.r:
            return np.tile(place, (len(some), 1))
        first = quat(body.euler_parameters).conjugate()
        arm = vec(np.subtract(place, body.origin).tolist())
        turned = rotation_less_identity(quat(np.array(body.p)[some].T) * first) @ arm + arm
        return np.array(body.r)[some] + np.stack([*turned], axis=1)

    for joint in scene.joints:
        places = 2 * joint.points if len(joint.points) == 1 else joint.points
        ends = [at(*each) for each in zip(joint.bodies, places, strict=False)]
        spots += zip(joint.bodies, ends, strict=False)
        rods += [(ends[0], ends[1])] if len(joint.points) == 2 else []
    spots += [(point.body, at(point.body, point.position)) for point in scene.points]
    return view(title, spots, rods, {b.name for b in scene.bodies if b.fixed} | {GROUND})


MOST_FRAMES = 25
"""Frames of a view in a notebook."""
