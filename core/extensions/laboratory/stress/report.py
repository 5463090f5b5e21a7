"""Report of a stress run: shares by family and engine, findings, proofs, contradictions."""

from __future__ import annotations

from collections.abc import Sequence

from ....report.sections import Report, Section
from ....report.table import escape_markdown, row
from ....trajectory import QUANTITIES
from .run import Cell, Finding, Stress, largest
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
    families = Section(
        "Families",
        [],
        ["Random, from the seed; a specimen does not depend on the rest of the run."],
        ["family", "what"],
        2,
        [*found.abouts.items()],
    )
    sections = [_shares(found), families]
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
    wrong, examined = _count(cells, *SILENT), _examined(cells)
    sentence = (
        f"{wrong or 'None'} of {examined} samples silently wrong"
        if examined
        else "No sample was judged"
    )
    apart = (Verdict.UNJUDGED, Verdict.UNSUPPORTED)
    counts = [f"{count} {SHORT[each]}" for each in apart if (count := _count(cells, each))]
    return ", ".join([sentence, *counts])


def _examined(cells: Sequence[Cell]) -> int:
    """Return the number of samples whose answer has a verdict."""
    unexamined = _count(cells, Verdict.UNJUDGED, Verdict.UNSUPPORTED)
    return sum(sum(cell.samples.values()) for cell in cells) - unexamined


def idle(found: Stress) -> list[str]:
    """Return a line with the reason for each engine without an examined sample."""
    lines: list[str] = []
    for engine, cells in _by_engine(found.cells).items():
        if cells[0].version is None:
            why = "it is not installed"
        elif not _examined(cells):
            why = "choose other families or another engine"
        else:
            continue
        lines.append(f"{engine}: {headline(cells)[0].lower()}{headline(cells)[1:]}: {why}")
    return lines


def _shares(found: Stress) -> Section:
    shown = [
        verdict
        for verdict in SHORT
        if verdict not in OF_FORCES or any(cell.samples.get(verdict, 0) for cell in found.cells)
    ]
    rows = [_row(cell.family, [cell], shown) for cell in found.cells]
    engines = _by_engine(found.cells)
    rows += [_row("all", cells, shown) for cells in engines.values()]
    wrong = [f"{name} {_count(cells, *SILENT)}" for name, cells in engines.items()]
    settings = [
        f"{name} {cells[-1].version}: "
        + "; ".join(f"{key}: {value}" for key, value in cells[-1].settings.items())
        for name, cells in engines.items()
    ]
    columns = ["family", "engine", "specimens", *(SHORT[each] for each in shown), *ERRORS]
    verdict = f"Silently wrong: {', '.join(wrong)}."
    return Section("Samples by outcome", [verdict], [*NOTES, *settings], columns, 2, rows)


def _row(family: str, cells: Sequence[Cell], shown: Sequence[Verdict]) -> list[str]:
    """Return the number of samples by verdict, with the share of the supported samples."""
    supported = sum(sum(cell.samples.values()) for cell in cells)
    supported -= _count(cells, Verdict.UNSUPPORTED)
    elsewhere = sum(cell.elsewhere for cell in cells)
    texts = [family, _engine(cells[0]), str(sum(cell.specimens for cell in cells))]
    for verdict in shown:
        text = str(count := _count(cells, verdict))
        if supported and count and verdict is not Verdict.UNSUPPORTED:
            text += f" ({100 * count / supported:.3g} %)"
        if verdict is Verdict.SILENTLY_WRONG and elsewhere:
            text += f", {elsewhere} in another assembly"
        texts.append(text)
    return [*texts, *map(_ratio, largest(cell.worst for cell in cells))]


def _by_engine(cells: Sequence[Cell]) -> dict[str, list[Cell]]:
    found: dict[str, list[Cell]] = {}
    for cell in cells:
        found.setdefault(_engine(cell), []).append(cell)
    return found


def _count(cells: Sequence[Cell], *verdicts: Verdict) -> int:
    return sum(cell.samples.get(verdict, 0) for cell in cells for verdict in verdicts)


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
    return Section(
        "Findings",
        ["Replay a file by: kincheck stress --replay FILE --engine NAME --tol X."],
        [
            f"The smallest specimen of each; errors as above. An error beyond {ELSEWHERE:g} of the"
            " size counts as another assembly."
        ],
        ["family", "engine", "outcome", "specimen", "at", "errors", "message", "case file"],
        4,
        rows,
    )


def _proofs(found: Stress) -> Section:
    rows = [
        [p.family, str(p.tried), str(p.proved), f"{p.worst:.1e}", "; ".join(p.reasons)[:300]]
        for p in found.proofs
    ]
    return Section(
        "Proof of the truth at random samples",
        [],
        [
            "Krawczyk's test in ball arithmetic on the engine's equations; the distance is relative"
            " to the round-off bound of an engine."
        ],
        ["family", "samples", "proved", "distance of the truth", "not proved"],
        1,
        rows,
    )


def _acceptances(found: Stress) -> Section:
    rows: list[list[str]] = []
    for engine in dict.fromkeys(each.engine for each in found.acceptances):
        mine = sorted(
            (each for each in found.acceptances if each.engine == engine), key=lambda a: a.tilt
        )
        accepted = [each for each in mine if each.accepted]
        refused = [each for each in mine if not each.accepted]
        told = [
            f"{each.told:.1e} of {each.unavoidable:.1e} m" for each in accepted if each.unavoidable
        ]
        rows.append(
            [
                engine,
                f"{accepted[-1].tilt:.1e} rad" if accepted else "never",
                f"{refused[0].tilt:.1e} rad" if refused else "never",
                told[-1] if told else "no residual",
            ]
        )
    return Section(
        "Contradictory hinges",
        [],
        ["Unavoidable residual: by least squares over all rows."],
        [
            "engine",
            "accepted up to",
            "refused from",
            "reported residual, at the largest accepted",
        ],
        1,
        rows,
    )


def _engine(cell: Cell) -> str:
    return f"{cell.engine} {cell.mode}"


def _ratio(value: float | None) -> str:
    return "–" if value is None else f"{value:.2g}"


def markdown(made: Report) -> str:
    """Return the tables in Markdown."""
    lines = [f"# {escape_markdown(made.headline)}", "", escape_markdown(" · ".join(made.facts))]
    for section in made.sections:
        numbers = len(section.columns) - section.labels
        lines += ["", f"## {section.title}", "", *map(escape_markdown, section.verdict), ""]
        lines += [row(section.columns), row(["---"] * section.labels + ["---:"] * numbers)]
        lines += [row(map(escape_markdown, each)) for each in section.rows]
        lines += ["", *(f"{escape_markdown(note)}\n" for note in section.notes)]
    return "\n".join(lines) + "\n"
