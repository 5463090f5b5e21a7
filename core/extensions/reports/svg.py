"""Figures as SVG without a browser: what `plot.js` draws of a report's figures, in the colours of
paper, with a legend.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any, TypeAlias

from ...report.figures import RAISED, Figure

Place: TypeAlias = tuple[float, float]
Tick: TypeAlias = tuple[Any, str]

WIDTH, HEIGHT = 520, 340
"""Size of a figure [px], with a line of its legend."""
INK, SOFT, LINE, AXIS = "#16191d", "#59616b", "#dfe3e7", "#aab2bb"
FONT = "system-ui, 'Segoe UI', Roboto, 'Helvetica Neue', 'Liberation Sans', sans-serif"
CHARACTER = 6.6
"""Mean width of a character of 12 px [px]."""
DASHES = {"solid": "", "dot": "2,3", "dash": "8,4"}
PLUS, CROSS = "M0 {-r}V{r}M{-r} 0H{r}", "M{-r} {-r}L{r} {r}M{r} {-r}L{-r} {r}"
SYMBOLS = {
    "square": "M{-r} {-r}H{r}V{r}H{-r}Z",
    "diamond": "M0 {-s}L{s} 0L0 {s}L{-s} 0Z",
    "triangle-up": "M0 {-s}L{s} {r}H{-s}Z",
    "x": CROSS,
    "cross": PLUS,
    "asterisk": PLUS + CROSS,
    "circle": "M{-r} 0a{r} {r} 0 1 0 {2r} 0a{r} {r} 0 1 0 {-2r} 0Z",
}
"""Outlines around 0, 0, of radius r, and s = 1.25 r."""


@dataclass(frozen=True)
class _Scale:
    """The scale from values of an axis to pixels, and its ticks with their texts."""

    place: Callable[[Any], float]
    ticks: Sequence[Tick]


def svg(figure: Figure, size: tuple[int, int] = (0, 0)) -> str:
    """Return a figure as the text of an SVG file.

    Args:
        figure: of `report.figures`: traces of type scatter, and axes of any type.
        size: width and height [px]; by default `WIDTH` and `HEIGHT`.
    """
    width, height = size if size[0] else (WIDTH, HEIGHT)
    layout: Figure = figure["layout"]
    traces: list[Figure] = figure["data"]
    floor = layout.get("meta", {}).get("floor")
    legend, top = _legend(traces, width)
    sides = {way: layout.get(f"{way}axis", {}) for way in "xy"}
    values = {
        way: [v for each in traces for v in each[way] if v is not None and (v or not floor)]
        for way in "xy"
    }
    slanted = _is_category(sides["x"], values["x"])
    names = CHARACTER * max((len(str(v)) for v in values["x"]), default=0) if slanted else 0.0
    bottom = height - (14 + min(90.0, 0.55 * names) if slanted else 42)
    rows = max(2, int((bottom - top) / 42))
    texts = _scale(sides["y"], values["y"], bottom, top, rows).ticks
    left = 32 + CHARACTER * max((len(text) for _, text in texts), default=0)
    right = width - 14.0
    columns = max(2, int((right - left) / (40 if slanted else 72)))
    x = _scale(sides["x"], values["x"], left, right, columns)
    y = _scale(sides["y"], values["y"], bottom, top, rows)
    edges = left, right, top, bottom
    parts = [
        *_grid(x, y, sides, edges, slanted=slanted),
        *_titles(sides, edges, height),
        # clipped without an identifier, which pages with several figures would repeat
        f'<svg x="{left}" y="{top}" width="{right - left}" height="{bottom - top}"'
        f' viewBox="{left} {top} {right - left} {bottom - top}">',
        *_shapes(layout.get("shapes", ()), x, y, edges),
        *(part for each in traces for part in _trace(each, x, y, floor)),
        "</svg>",
        *legend,
    ]
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}"'
        f' height="{height}" font-size="12" font-family="{FONT}">'
        f'<rect width="{width}" height="{height}" fill="#fff"/>{"".join(parts)}</svg>'
    )


def _legend(traces: Sequence[Figure], width: float) -> tuple[list[str], float]:
    """Return the names of the traces, in lines, and where the frame begins below them [px]."""
    parts, x, y = list[str](), 10.0, 14.0
    for trace in traces:
        if not (name := trace.get("name")):
            continue
        room = 48 + CHARACTER * len(name)
        if x > 10.0 and x + room > width:
            x, y = 10.0, y + 18
        marked = next((each for each in traces if _belongs(each, trace)), trace)
        if "lines" in trace.get("mode", "lines"):
            parts.append(_path(f"M{x} {y - 4}h30", trace.get("line", {})))
        parts += _symbol((x + 15, y - 4), marked) if "marker" in marked else []
        parts.append(f'<text x="{x + 36}" y="{y}" fill="{INK}">{escape(name)}</text>')
        x += room
    return parts, y + 12 if parts else 12.0


def _belongs(marks: Figure, curve: Figure) -> bool:
    """Return whether a trace without a name has the markers of a curve."""
    return "marker" in marks and marks.get("meta") == curve.get("meta")


def _is_category(side: Figure, values: Sequence[Any]) -> bool:
    return side.get("type") == "category" or any(isinstance(v, str) for v in values)


def _scale(side: Figure, values: Sequence[Any], start: float, end: float, count: int) -> _Scale:
    if side.get("autorange") == "reversed":
        start, end = end, start
    if _is_category(side, values):
        names = [*dict.fromkeys(values)]
        wide = (end - start) / max(1, len(names))
        step = math.ceil(len(names) / min(count, side.get("nticks", count))) or 1
        return _Scale(
            lambda name: start + (names.index(name) + 0.5) * wide,
            [(name, str(name)) for name in names[::-step][::-1]],
        )
    is_log = side.get("type") == "log"

    def ahead(value: float) -> float:
        return math.log10(value) if is_log else value

    known = [ahead(v) for v in values if v > 0 or not is_log]
    low, high = side.get("range") or _around(known, is_log=is_log)

    def place(value: float) -> float:
        return start + (ahead(value) - low) / (high - low) * (end - start)

    if "tickvals" in side:
        ticks = [*zip(side["tickvals"], side["ticktext"], strict=True)]
    elif is_log:
        ticks = _log_ticks(low, high, count)
    else:
        ticks = _ticks(low, high, count, side.get("dtick"))
    margin, kept = 1e-9 * (high - low), list[Tick]()
    for tick in ticks:
        inside = low - margin <= ahead(tick[0]) <= high + margin
        if inside and (not kept or abs(place(tick[0]) - place(kept[-1][0])) >= 13):
            kept.append(tick)
    return _Scale(place, kept)


def _around(values: Sequence[float], *, is_log: bool) -> tuple[float, float]:
    """Return the range around values, with room at both ends."""
    low, high = min(values, default=0.0), max(values, default=1.0)
    if high - low <= 1e-14 * max(abs(low), abs(high)):
        half = 0.5 if is_log else 0.1 * abs(low) or 1.0
        return low - half, high + half
    room = 0.05 * (high - low)
    return low - room, high + room


def _ticks(low: float, high: float, count: int, given: float | None) -> list[Tick]:
    """Return ticks at multiples of 1, 2 or 5 times a power of ten, or of a given step."""
    least = 0.75 * (high - low) / count
    power = 10.0 ** math.floor(math.log10(least))
    step = given or next(each * power for each in (1, 2, 5, 10) if each * power >= 0.999 * least)
    while (high - low) / step > 2 * count:
        step *= 2
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [(k * step, _text(k * step)) for k in range(first, last + 1)]


def _log_ticks(low: float, high: float, count: int) -> list[Tick]:
    """Return powers of ten; within few decades also 2 and 5 times them."""
    if high - low < 0.3:
        return _ticks(10.0**low, 10.0**high, count, None)
    stride = max(1, math.ceil((high - low) / count))
    factors = (1, 2, 5) if 3 * (high - low) <= count + 1 else (1,)
    powers = (p for p in range(math.ceil(low) - 1, math.floor(high) + 1) if p % stride == 0)
    return [(f * 10.0**p, _power(f, p)) for p in powers for f in factors]


def _power(factor: int, power: int) -> str:
    raised = f"10{str(power).translate(RAISED)}"
    return (
        _text(factor * 10.0**power) if abs(power) < 4 else f"{factor}·{raised}".removeprefix("1·")
    )


def _text(value: float) -> str:
    return f"{value:.6g}".replace("-", "\N{MINUS SIGN}")


def _grid(
    x: _Scale,
    y: _Scale,
    sides: Mapping[str, Figure],
    edges: tuple[float, float, float, float],
    *,
    slanted: bool,
) -> Iterator[str]:
    left, right, top, bottom = edges

    def line(side: Figure, at: Any, d: str) -> str:
        zero = at == 0 and side.get("zeroline") is not False
        return f'<path d="{d}" stroke="{AXIS if zero else LINE}"/>'

    for at, text in x.ticks:
        p = round(x.place(at), 1)
        aslant = f'transform="translate({p} {bottom + 12})rotate(-30)" text-anchor="end"'
        where = aslant if slanted else f'x="{p}" y="{bottom + 16}" text-anchor="middle"'
        yield line(sides["x"], at, f"M{p} {top}V{bottom}")
        yield f'<text {where} fill="{SOFT}">{escape(text)}</text>'
    for at, text in y.ticks:
        p = round(y.place(at), 1)
        yield line(sides["y"], at, f"M{left} {p}H{right}")
        where = f'x="{left - 6}" y="{p + 4}" text-anchor="end"'
        yield f'<text {where} fill="{SOFT}">{escape(text)}</text>'


def _titles(
    sides: Mapping[str, Figure], edges: tuple[float, float, float, float], height: float
) -> Iterator[str]:
    left, right, top, bottom = edges
    below = f'x="{(left + right) / 2}" y="{height - 6}"'
    beside = f'transform="translate(13 {(top + bottom) / 2})rotate(-90)"'
    for way, where in (("x", below), ("y", beside)):
        text = escape(sides[way].get("title", {}).get("text", ""))
        yield f'<text {where} text-anchor="middle" fill="{INK}">{text}</text>'


def _shapes(
    shapes: Sequence[Figure], x: _Scale, y: _Scale, edges: tuple[float, float, float, float]
) -> Iterator[str]:
    """Yield boxes and lines across the whole figure, or between values."""
    left, right, top, bottom = edges
    for shape in shapes:
        whole = {"x": (left, right), "y": (bottom, top)}
        (x0, x1), (y0, y1) = (
            [
                whole[way][int(shape[f"{way}{k}"])]
                if shape.get(f"{way}ref") == "paper"
                else scale.place(shape[f"{way}{k}"])
                for k in (0, 1)
            ]
            for way, scale in (("x", x), ("y", y))
        )
        if shape["type"] == "rect":
            yield (
                f'<rect x="{min(x0, x1):.1f}" y="{min(y0, y1):.1f}" width="{abs(x1 - x0):.1f}"'
                f' height="{abs(y1 - y0):.1f}" fill="{shape["fillcolor"]}"/>'
            )
        else:
            yield _path(f"M{x0:.1f} {y0:.1f}L{x1:.1f} {y1:.1f}", shape.get("line", {}))


def _trace(trace: Figure, x: _Scale, y: _Scale, floor: float | None) -> Iterator[str]:
    """Yield a trace: a curve, a closed band or markers; zeros stand on the floor of a log axis."""
    places: list[Place | None] = []
    for a, b in zip(trace["x"], trace["y"], strict=False):
        on_floor = floor if floor and b == 0 else b
        missing = a is None or on_floor is None
        places.append(None if missing else (x.place(a), y.place(on_floor)))
    mode = trace.get("mode", "lines")
    if trace.get("fill"):
        yield f'<path d="{_line(places)}Z" fill="{trace["fillcolor"]}"/>' if any(places) else ""
        return
    if "lines" in mode:
        yield _path(_line(places), trace.get("line", {}), trace.get("meta", ""))
    if "markers" in mode:
        most = trace.get("marker", {}).get("maxdisplayed", len(places))
        step = math.ceil(len(places) / most) if most else 1
        for at in places[::step]:
            yield from _symbol(at, trace) if at else ()


def _line(places: Sequence[Place | None]) -> str:
    """Return a path, with gaps for missing places."""
    pairs = zip([None, *places], places, strict=False)
    return "".join(f"{'L' if before else 'M'}{at[0]:.1f} {at[1]:.1f}" for before, at in pairs if at)


def _path(d: str, look: Figure, name: str = "") -> str:
    dash: str = look.get("dash") or "solid"
    dashes = DASHES.get(dash, dash).replace("px", "")
    dashed = f' stroke-dasharray="{dashes}"' if dashes else ""
    colour, width = look.get("color", AXIS), look.get("width", 1.5)
    style = f'stroke="{colour}" stroke-width="{width}"{dashed} stroke-linejoin="round"'
    title = f"<title>{escape(name)}</title>" if name else ""
    return f'<path d="{d}" fill="none" {style}>{title}</path>'


def _symbol(at: Place, trace: Figure) -> Iterator[str]:
    marker: Figure = trace["marker"]
    r = marker.get("size", 6) / 2
    name = marker.get("symbol", "circle-open").replace("-open", "").replace("-thin", "")
    sizes = {"{-r}": -r, "{r}": r, "{2r}": 2 * r, "{-2r}": -2 * r, "{s}": 1.25 * r}
    outline = SYMBOLS.get(name, SYMBOLS["circle"])
    for word, value in (sizes | {"{-s}": -1.25 * r}).items():
        outline = outline.replace(word, f"{value:g}")
    colour, width = marker.get("color", AXIS), marker.get("line", {}).get("width", 1.2)
    where = f'transform="translate({at[0]:.1f} {at[1]:.1f})"'
    yield f'<path {where} d="{outline}" fill="none" stroke="{colour}" stroke-width="{width}"/>'
