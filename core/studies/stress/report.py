"""Report of a stress run: shares by family and engine, findings, proofs, contradictions."""

from __future__ import annotations

from collections.abc import Sequence

from ...report.sections import Report, Section
from ...report.table import escaped, row
from ...trajectory import QUANTITIES
from .results import Cell, Finding, Stress
from .verdicts import ELSEWHERE, SILENT, Verdict

NAME = "stress"
SHORT = {
    Verdict.RIGHT: "right",
    Verdict.REFUSED_RIGHTLY: "correctly refused",
    Verdict.REFUSED_WRONGLY: "wrongly refused",
    Verdict.SILENTLY_WRONG: "silently wrong",
    Verdict.WRONG_FORCE: "wrong force",
    Verdict.UNDETERMINED_FORCE: "undetermined force given",
    Verdict.MISSING_FORCE: "determined force missing",
    Verdict.UNJUDGED: "not judged",
    Verdict.UNSUPPORTED: "unsupported",
}
OF_FORCES = (Verdict.WRONG_FORCE, Verdict.UNDETERMINED_FORCE, Verdict.MISSING_FORCE)
"""Verdicts that have a column only if they occur."""
ERRORS = (*QUANTITIES, "force")
NOTES = (
    (
        "Right: within 1e-14 of size times condition, of the closed form or of the motion followed"
        " from the design in extended precision; forces of their balance there. Position, velocity,"
        " acceleration, force: the largest error of specimens without a silent wrong answer, over"
        " that."
    ),
    (
        "Correctly refused: no pose or a singular pose is there, and the message says so. Not"
        " judged: too near to the end of the motion for the truth, or behind a bifurcation."
        " Shares are of the samples that the engine supports."
    ),
)


def report(found: Stress) -> Report:
    """Return the tables of a run."""
    sections = [_shares(found), _families(found)]
    sections += [_findings(found.findings)] if found.findings else []
    sections += [_proofs(found)] if found.proofs else []
    sections += [_acceptances(found)] if found.acceptances else []
    spent = ", ".join(f"{what} {seconds:.1f} s" for what, seconds in found.seconds.items())
    return Report(
        NAME,
        headline(found.cells),
        [
            f"kincheck {found.kincheck}",
            f"seed {found.seed}",
            spent,
            *(f"not finished: {k}: {v}" for k, v in found.unfinished.items()),
        ],
        sections,
    )


def headline(cells: Sequence[Cell]) -> str:
    """Return a phrase with the numbers of silently wrong, examined and unexamined samples."""
    count = {verdict: sum(cell.samples.get(verdict, 0) for cell in cells) for verdict in Verdict}
    apart = [
        f"{count[verdict]} {SHORT[verdict]}"
        for verdict in (Verdict.UNJUDGED, Verdict.UNSUPPORTED)
        if count[verdict]
    ]
    wrong, examined = sum(count[each] for each in SILENT), sum(map(_examined, cells))
    sentence = (
        f"{wrong or 'None'} of {examined} samples silently wrong"
        if examined
        else "No sample was examined"
    )
    return ", ".join([sentence, *apart])


def _examined(cell: Cell) -> int:
    """Return the number of samples whose answer has a verdict."""
    return (
        sum(cell.samples.values())
        - cell.samples.get(Verdict.UNJUDGED, 0)
        - cell.samples.get(Verdict.UNSUPPORTED, 0)
    )


def idle(found: Stress) -> list[str]:
    """Return a line with the reason for each engine without an examined sample."""
    lines: list[str] = []
    for engine in dict.fromkeys(map(_engine, found.cells)):
        cells = [cell for cell in found.cells if _engine(cell) == engine]
        if cells[0].version is not None and any(map(_examined, cells)):
            continue
        why = (
            "it is not installed"
            if cells[0].version is None
            else "choose other families or another engine"
        )
        lines.append(f"{engine}: {headline(cells)[0].lower()}{headline(cells)[1:]}: {why}")
    return lines


def _shares(found: Stress) -> Section:
    shown = [
        verdict
        for verdict in SHORT
        if verdict not in OF_FORCES or any(cell.samples.get(verdict, 0) for cell in found.cells)
    ]
    rows = [
        [
            cell.family,
            _engine(cell),
            str(cell.specimens),
            *_counts(cell, shown),
            *map(_ratio, cell.worst),
        ]
        for cell in found.cells
    ]
    for engine in dict.fromkeys(map(_engine, found.cells)):
        cells = [cell for cell in found.cells if _engine(cell) == engine]
        whole = Cell(
            family="all",
            engine=cells[0].engine,
            mode=cells[0].mode,
            version=cells[0].version,
            settings=cells[0].settings,
            specimens=sum(cell.specimens for cell in cells),
            samples={name: sum(cell.samples[name] for cell in cells) for name in cells[0].samples},
            elsewhere=sum(cell.elsewhere for cell in cells),
            worst=[
                max((x for c in cells if (x := c.worst[k]) is not None), default=None)
                for k in range(len(ERRORS))
            ],
            bad=sum(cell.bad for cell in cells),
            seconds=sum(cell.seconds for cell in cells),
        )
        rows.append(
            ["all", engine, str(whole.specimens), *_counts(whole, shown), *map(_ratio, whole.worst)]
        )
    settings = {_engine(cell): cell for cell in found.cells}
    told = [
        f"{name} {cell.version}: "
        + "; ".join(f"{key}: {value}" for key, value in cell.settings.items())
        for name, cell in settings.items()
    ]
    columns = ["family", "engine", "specimens", *(SHORT[each] for each in shown), *ERRORS]
    return Section("Samples by outcome", [_verdict(found)], [*NOTES, *told], columns, 2, rows)


def _verdict(found: Stress) -> str:
    wrong = {_engine(cell): 0 for cell in found.cells}
    for cell in found.cells:
        wrong[_engine(cell)] += sum(cell.samples.get(each, 0) for each in SILENT)
    return (
        "Silently wrong: " + ", ".join(f"{engine} {count}" for engine, count in wrong.items()) + "."
    )


def _counts(cell: Cell, shown: Sequence[Verdict]) -> list[str]:
    """Return the number of samples by verdict, with the share of the supported samples."""
    supported = sum(cell.samples.values()) - cell.samples.get(Verdict.UNSUPPORTED, 0)
    texts: list[str] = []
    for verdict in shown:
        count = cell.samples.get(verdict, 0)
        share = (
            f" ({100 * count / supported:.3g} %)"
            if supported and count and verdict is not Verdict.UNSUPPORTED
            else ""
        )
        elsewhere = (
            f", {cell.elsewhere} in another assembly"
            if verdict is Verdict.SILENTLY_WRONG and cell.elsewhere
            else ""
        )
        texts.append(f"{count}{share}{elsewhere}")
    return texts


def _families(found: Stress) -> Section:
    rows = [[name, about] for name, about in found.abouts.items()]
    return Section(
        "Families",
        [],
        ["Random, from the seed; a specimen does not depend on the rest of the run."],
        ["family", "what"],
        2,
        rows,
    )


def _findings(findings: Sequence[Finding]) -> Section:
    rows = [
        [
            each.family,
            f"{each.engine} {each.mode}",
            each.verdict,
            f"{each.specimen} (number {each.number})",
            f"{each.value:.9g}",
            " ".join(map(_ratio, each.worst)),
            each.message[:300] or "no message",
            " ".join(filter(None, (each.file, *each.reduced))),
        ]
        for each in findings
    ]
    columns = ["family", "engine", "outcome", "specimen", "at", "errors", "message", "case file"]
    notes = [
        f"The smallest specimen of each; errors as above. An error beyond {ELSEWHERE:g} of the size"
        " counts as another assembly."
    ]
    return Section(
        "Findings",
        ["Replay a file by: kincheck stress --replay FILE --engine NAME --tol X."],
        notes,
        columns,
        4,
        rows,
    )


def _proofs(found: Stress) -> Section:
    rows = [
        [p.family, str(p.tried), str(p.proved), f"{p.worst:.1e}", "; ".join(p.reasons)[:300]]
        for p in found.proofs
    ]
    notes = [
        "Krawczyk's test in ball arithmetic on the engine's equations; the distance is relative"
        " to the round-off bound of an engine."
    ]
    columns = ["family", "samples", "proved", "distance of the truth", "not proved"]
    return Section("Proof of the truth at random samples", [], notes, columns, 1, rows)


def _acceptances(found: Stress) -> Section:
    rows: list[list[str]] = []
    for engine in dict.fromkeys(each.engine for each in found.acceptances):
        mine = [each for each in found.acceptances if each.engine == engine]
        accepted = sorted((each for each in mine if each.accepted), key=lambda each: each.tilt)
        refused = [each.tilt for each in mine if not each.accepted]
        told = [
            f"{each.told:.1e} of {each.unavoidable:.1e} m" for each in accepted if each.unavoidable
        ]
        rows.append(
            [
                engine,
                f"{accepted[-1].tilt:.1e} rad" if accepted else "never",
                f"{min(refused):.1e} rad" if refused else "never",
                told[-1] if told else "no residual",
            ]
        )
    columns = [
        "engine",
        "accepted up to",
        "refused from",
        "reported residual, at the largest accepted",
    ]
    return Section(
        "Contradictory hinges",
        [],
        ["Unavoidable residual: by least squares over all rows."],
        columns,
        1,
        rows,
    )


def _engine(cell: Cell) -> str:
    return f"{cell.engine} {cell.mode}"


def _ratio(value: float | None) -> str:
    return "–" if value is None else f"{value:.2g}"


def markdown(made: Report) -> str:
    """Return the tables in Markdown."""
    lines = [f"# {escaped(made.headline)}", "", escaped(" · ".join(made.facts))]
    for section in made.sections:
        lines += ["", f"## {section.title}", "", *(escaped(each) for each in section.verdict), ""]
        lines += [
            row(section.columns),
            row(["---"] * section.labels + ["---:"] * (len(section.columns) - section.labels)),
        ]
        lines += [row(map(escaped, each)) for each in section.rows]
        lines += ["", *(f"{escaped(note)}\n" for note in section.notes)]
    return "\n".join(lines) + "\n"
