"""The page of a fit: what was measured and what is left of it, combinations, predictions, moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np

from ...errors import number_of, shortened
from ...harness.scene import scene
from ...report.axis import Axis
from ...report.drawing import Drawing, drawing
from ...report.figures import Figure, Style
from ...report.page_model import Plot
from ...report.sections import Diagram, Report, Section, environment, figure_parts
from ...trajectory import Array
from ...unit_text import with_unit
from .fit import ALPHA, NORMAL, Fitted, Verdict
from .goals import Goal
from .identify import BETTER, Combination

DIGITS, TOLD = 6, 0.999
# The longest drawn move, over the size of the mechanism.
_LONGEST = 0.12
_RIG, _FIT, _DRAWING = (
    Style.number(k, name) for k, name in enumerate(("rig", "fitted table", "drawing"))
)


def headline(found: Fitted) -> str:
    """Return the verdict in words."""
    if found.verdict is Verdict.OTHERS:
        others = [each.name for each in (*found.slips, *found.loose)]
        return f"fits, but so does {shortened(others, 3)}"
    if found.verdict is Verdict.OFF:
        where = [each.words for each in found.found] or [found.worst]
        return f"does not fit, off at {'; '.join(where)}"
    return str(found.verdict)


def report(found: Fitted) -> Report:
    """Return what the rig says: the verdict first, then what it determines, if anything fits."""
    rig, first = found.rig, found.first
    facts = [
        f"{rig.count} numbers of {', '.join(goal.output for goal in rig.goals)}",
        f"misfit {first.misfit:.1f}, p {first.probability:.2g}, {number_of(first.rounds, 'round')}",
        "± is 95 %",
    ]
    sections = [_verdict(found)]
    if found.estimate.probability >= ALPHA:
        sections += [_combinations(found), _predictions(found), _offsets(found)]
        sections.append(_coordinates(found))
    return Report("fit", f"{rig.case.name}: {headline(found)}", facts, sections)


def page(found: Fitted) -> str:
    """Return the page as one HTML file: the report, with pictures."""
    whole = report(found)
    first, *others = whole.sections
    curves = Section("Curves and residuals", [], [], [], 0, [], _curves(found))
    drawn, times = _moves(found)
    whole = replace(whole, sections=[first, curves, *others])
    figures = {
        diagram.plot.figure: diagram.figure
        for section in whole.sections
        for diagram in section.diagrams
    }
    known = environment(Path(__file__).parent)
    parts = figure_parts(figures, scenes={"moves": msgspec.to_builtins(drawn)})
    text = known.get_template("bench.html").render(report=whole, scripted=True, **parts)
    moves = known.get_template("fit_scene.html").render(times=times)
    return text.replace("</main>", f"{moves}</main>", 1)


def _verdict(found: Fitted) -> Section:
    rig, verdict = found.rig, list[str]()
    if found.found:
        verdict.append(
            f"Fits without {'; '.join(each.words for each in found.found)}, p"
            f" {found.estimate.probability:.2g}. Correct the file, or say --free"
            f' "{found.found[0].name}" for a zero or scale. Below, they are taken out.'
        )
    what = "Fits with" if found.verdict is Verdict.OFF and not found.found else "Also fits:"
    verdict += [f"{what} {each.name}, p {each.chance:.2g}." for each in found.slips]
    verdict += [f"{what} {each.words}; moved points do the same." for each in found.loose]
    if found.estimate.probability < ALPHA:
        verdict.append("Nothing is estimated, since the table does not fit.")
    notes = [
        f"Noise of {goal.output}: {np.median(noise) / unit.size:.2g} {unit.name}, {source}."
        for goal, noise, source in zip(rig.goals, rig.noise, rig.sources, strict=True)
        for unit in [rig.unit(goal)]
    ]
    return Section("Verdict", verdict, [*notes, *rig.notes], [], 0, [])


def _curves(found: Fitted) -> list[Diagram]:
    rig, model = found.rig, found.rig.model(found.boxes)
    fitted = model.search.values(found.estimate.u)
    drawn = model.search.values(np.zeros(len(found.boxes)))
    along = found.along
    diagrams = list[Diagram]()
    for goal, noise in zip(rig.goals, rig.noise, strict=True):
        order = np.argsort(rig.case.sweep.values[goal.at], kind="stable")
        travel, unit = rig.case.sweep.values[goal.at][order] / along.size, rig.unit(goal).size

        def line(style: Style, values: Array, x: Array = travel) -> Figure:
            return style.curve(_short(x), _short(values), size=6)

        def of(values: Array, goal: Goal = goal, order: Array = order, unit: float = unit) -> Array:
            return values[goal.at][order] / unit

        measured = goal.middle[order] / unit
        curves = [
            line(_DRAWING, of(drawn[goal.output])),
            line(_FIT, of(fitted[goal.output])),
            line(_RIG, measured) | {"mode": "markers"},
        ]
        half = NORMAL * noise[order] / unit
        band: Figure = {
            "type": "scatter",
            "mode": "lines",
            "x": _short(np.concatenate([travel, travel[::-1]])),
            "y": _short(np.concatenate([half, -half[::-1]])),
            "fill": "toself",
            "fillcolor": "rgba(128,128,128,0.18)",
            "line": {"width": 0},
            "hoverinfo": "skip",
            "uid": _RIG.key,
            "name": "noise of the rig",
        }
        rest = line(_RIG, measured - of(fitted[goal.output])) | {"mode": "markers"}
        for what, data in (("", curves), (" less the fitted table", [band, rest])):
            title = with_unit(goal.output + what, rig.unit(goal).name)
            layout: Figure = {
                "xaxis": {"title": {"text": with_unit(rig.case.sweep.driver, along.name)}},
                "yaxis": {"title": {"text": title}, "zeroline": True},
                "hovermode": "x unified",
            }
            plot = Plot(f"curve-{len(diagrams)}", title, "Band: noise of the rig." if what else "")
            diagrams.append(Diagram(plot, {"data": data, "layout": layout}, [_RIG, _FIT, _DRAWING]))
    return diagrams


def _combinations(found: Fitted) -> Section:
    """Return a bar for each combination: how many times better the rig tells it."""
    style = Style.number(0, "combination")
    every = found.combinations
    unit = found.length
    gain = [each.drawing / each.deviation for each in every]
    told = [each for each in every if each.deviation < TOLD * each.drawing]
    bars: Figure = {
        "type": "bar",
        "x": [*range(1, len(every) + 1)],
        "y": _short(np.log10(gain)),
        "width": [0.8] * len(every),
        "name": "power of ten",
        "marker": {"color": style.colour},
        "uid": "gain",
        "hovertemplate": "%{y:.3~g}",
    }
    layout: Figure = {
        "xaxis": {"title": {"text": "combination"}},
        "yaxis": {"title": {"text": "times better known by the rig [powers of ten]"}},
    }
    plot = Plot("combinations", "how much better the rig tells each combination", "")
    rows = [[str(k), *_row(each, unit.size)] for k, each in enumerate(told, 1)]
    known = sum(each.deviation < BETTER * each.drawing for each in every)
    verdict = [f"{known} of {len(every)} are known better by the rig than by the drawing."]
    verdict += [f"{len(every) - len(told)} are known by the drawing alone, and not listed."]
    verdict += [f"No effect on what was measured: {each}." for each in found.null]
    if found.idle:
        verdict.append(f"Left out, nothing measured follows: {shortened([*found.idle], 6)}.")
    heads = ["", "combination", f"moved [{unit.name}]", "±", "± by the drawing", "source"]
    title = "Combinations of moves"
    diagram = Diagram(plot, {"data": [bars], "layout": layout}, [style])
    return Section(title, verdict, [], heads, 2, rows, [diagram])


def _row(each: Combination, size: float) -> list[str]:
    numbers = each.value, NORMAL * each.deviation, NORMAL * each.drawing
    return [each.words, *(f"{0.0 + round(x / size, 3):.3f}" for x in numbers), each.source]


def _predictions(found: Fitted) -> Section:
    rows = list[list[str]]()
    for name, each in found.predictions.items():
        unit, k = found.unit_of(name), found.told_at(each)
        where = f"{found.rig.case.sweep.values[k] / found.along.size:.4g} {found.along.name}"
        value, half, drawn = (x[k] / unit.size for x in (each.values, each.spread, each.drawing))
        texts = [f"{value:.5g}", f"{NORMAL * half:.2g}", f"{NORMAL * drawn:.2g}"]
        rows.append([with_unit(name, unit.name), where, *texts, each.source])
    heads = ["output", "at", "value", "±", "± by the drawing", "source"]
    return Section("Predictions, not measured", [], [], heads, 2, rows)


def _offsets(found: Fitted) -> Section:
    rows = [
        [each.name, *(f"{x / each.unit.size:.3g}" for x in numbers), each.unit.name]
        for each in found.shifts
        if np.isfinite(each.deviation)
        for numbers in [(each.size, NORMAL * each.deviation)]
    ]
    heads = ["what the rig reads too much", "size", "±", "unit"]
    return Section("Offsets of the rig, beside moved points", [], [], heads, 1, rows)


def _coordinates(found: Fitted) -> Section:
    unit = found.length
    rows = [
        _row(
            Combination({place: 1.0}, move, found.deviations[place], found.boxes[place]), unit.size
        )
        for place, move in found.moves.items()
    ]
    heads = ["coordinate", f"moved [{unit.name}]", "±", "± by the drawing", "source"]
    return Section("Coordinates", [], [], heads, 1, rows)


def _moves(found: Fitted) -> tuple[Drawing, str]:
    """Return the drawing with a bar along the move of each point, and how many times too long."""
    case, moves = found.rig.case, found.moves
    axis = Axis("travel", "", 1.0, [], "", [], 0, [])
    drawn = drawing(scene(case, poses=False), axis)
    at = {each.name: np.array(each.position) for each in case.hardpoints}
    ways = {
        each.name: sum(
            (
                sign * moves.get(f"{each.name} {name}", 0.0) * np.eye(3)[k]
                for name, (k, sign) in zip("xyz", each.axes, strict=True)
            ),
            np.zeros(3),
        )
        for each in case.hardpoints
    }
    size = float(np.ptp(np.array([*at.values()]), axis=0).max())
    longest = max((float(np.linalg.norm(each)) for each in ways.values()), default=0.0)
    times = float(f"{_LONGEST * size / longest:.1g}") if longest > 0.0 else 1.0
    for name, way in ways.items():
        if way.any():
            first = len(drawn.nodes)
            for place in (at[name], at[name] + times * way):
                drawn.nodes.append((0, *place.tolist()))
            drawn.rods.append((first, first + 1))
            length = np.linalg.norm(way) / found.length.size
            text = f"{name} {length:.2g} {found.length.name}"
            drawn.labels.append((first + 1, first + 1, text))
    return drawn, f"{times:g}"


def _short(values: Sequence[float] | Array) -> list[float]:
    return [float(f"{x:.{DIGITS}g}") for x in values]
