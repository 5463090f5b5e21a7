"""The report of a fit: verdict, curves and residuals, combinations, predictions, moves."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ...errors import number_of, shortened
from ...report.figures import Figure, Style
from ...report.page_model import Plot
from ...report.sections import Diagram, Report, Section
from ...unit_text import with_unit
from . import pages
from .fit import ALPHA, NORMAL, Fitted, Verdict
from .goals import travel_of
from .identify import BETTER, Combination
from .rubber import PERCENT

TOLD = 0.999
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
    """Return the verdict, then combinations, predictions and coordinates, if anything fits."""
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
    curves = Section("Curves and residuals", [], [], [], 0, [], [*_curves(found)])
    moves = {} if found.rig.move is PERCENT else found.moves
    whole = replace(whole, sections=[first, curves, *others])
    return pages.page(whole, found.rig.case, moves)


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
        f"Noise of {goal.output}: {np.median(noise) / goal.unit.size:.2g} {goal.unit.name},"
        f" {source}."
        for goal, noise, source in zip(rig.goals, rig.noise, rig.sources, strict=True)
    ]
    return Section("Verdict", verdict, [*notes, *rig.notes], [], 0, [])


def _curves(found: Fitted) -> Iterator[Diagram]:
    rig, model = found.rig, found.rig.model(found.boxes)
    drawn, fitted = (model.values(u) for u in (np.zeros(len(found.boxes)), found.estimate.u))
    for k, (goal, noise) in enumerate(zip(rig.goals, rig.noise, strict=True)):
        old, new = (each[goal.output] for each in (drawn, fitted))
        measured, half = (
            pages.whole(goal, each, rig.case) for each in (goal.middle, NORMAL * noise)
        )
        curves = [(_DRAWING, old, "lines"), (_FIT, new, "lines"), (_RIG, measured, "markers")]
        band = measured - half, measured + half, "noise of the rig"
        yield pages.over_travel(2 * k, goal.output, goal.unit, rig.case, curves, band)
        rest = [(_RIG, measured - new, "markers")]
        what, around = f"{goal.output} less the fitted table", (-half, half, band[2])
        beside = pages.over_travel(2 * k + 1, what, goal.unit, rig.case, rest, around)
        yield replace(beside, styles=[_DRAWING, _FIT, _RIG])


def _combinations(found: Fitted) -> Section:
    """Return a bar for each combination: how many times better the rig tells it."""
    style = Style.number(0, "combination")
    every = found.combinations
    unit = found.rig.move
    gain = [each.drawing / each.deviation for each in every]
    told = [each for each in every if each.deviation < TOLD * each.drawing]
    bars: Figure = {
        "type": "bar",
        "x": [*range(1, len(every) + 1)],
        "y": [round(float(x), 4) for x in np.log10(gain)],
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
        verdict.append(f"Left out, nothing measured follows: {shortened(found.idle, 6)}.")
    heads = ["", "combination", f"moved [{unit.name}]", "±", "± by the drawing", "source"]
    title = "Combinations of moves"
    diagram = Diagram(plot, {"data": [bars], "layout": layout}, [style])
    return Section(title, verdict, [], heads, 2, rows, [diagram])


def _row(each: Combination, size: float) -> list[str]:
    numbers = each.value, NORMAL * each.deviation, NORMAL * each.drawing
    return [each.words, *(f"{0.0 + round(x / size, 3):.3f}" for x in numbers), each.source]


def _predictions(found: Fitted) -> Section:
    rows = list[list[str]]()
    case = found.rig.case
    _, along = travel_of(case)
    for name, each in found.predictions.items():
        unit, k = found.rig.unit_of(name), found.told_at(each)
        where = f"{case.sweep.values[k] / along.size:.4g} {along.name}"
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
    unit = found.rig.move
    rows = [
        _row(
            Combination({place: 1.0}, move, found.deviations[place], found.boxes[place]), unit.size
        )
        for place, move in found.moves.items()
    ]
    heads = ["coordinate", f"moved [{unit.name}]", "±", "± by the drawing", "source"]
    return Section("Coordinates", [], [], heads, 1, rows)
