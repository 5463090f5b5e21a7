"""The page of the board, in the style of a benchmark: a table and a work-precision diagram by case,
and the settings.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby, pairwise

from ...errors import number_of
from ...harness.labels import number
from ...report.figures import Figure, Style, ticked_axis, with_error_axis
from ...report.page_model import Plot
from ...report.sections import Diagram, Report, Section
from .results import Board, Row, Run, TruthFacts

COLUMNS = (
    "stepper",
    "settings",
    "outcome",
    "error [m]",
    "gap [m]",
    "energy [J]",
    "reaction [N]",
    "order",
    "floor [m]",
    "step [s]",
    "cost [s/s]",
    "since",
)
LABELS = 3
OPEN = (
    "Redundant rows leave two directions of the force in each joint open: no forces are compared."
)
CAPTION = "Left is faster, down is more accurate; each point halves the step of the one before."
NOTES = (
    "Error: largest distance of a point of a joint or of the case from the truth, over the samples."
    " Gap: largest opening of a loop. Energy: of motion, weight and springs, minus the truth's at"
    " the same time; what loads and dampers take is in both.",
    "Reaction: largest error of the force in a joint, without directions that redundant rows leave"
    " open. Engines give those of closed loops (MuJoCo, Pinocchio, PyBullet), of the tree (Simbody;"
    " Drake, without balls), or of all joints but rods (Exudyn). Where a peak of force passes a"
    " sample too late, the error is as large as the peak, with any engine.",
    "Errors and costs are of the shortest step. Cost: wall time for a simulated second, in one"
    " run and process. The machine also does other things: costs within a factor of two are"
    " alike. Where the loop over the steps is in Python, its time is in the cost.",
    "Order: by least squares over the steps that lower the error. Floor: an error that the last"
    " halving does not lower, because constraints are soft or steps are still too long. Default:"
    " the engine's own settings; best: the best known ones.",
)


def report(board: Board) -> Report:
    """Return the page of the board."""
    return Report(
        "board",
        "How well time steppers hold a closed loop",
        [
            f"kincheck {board.kincheck}",
            board.started,
            board.processor,
            "on the CPU",
            *(sorted({f"{row.engine} {row.version}" for row in board.rows if row.version})),
        ],
        [
            *(_section(truth, rows) for truth in board.truths if (rows := _rows(board, truth))),
            *_history(board.rows),
            _settings(board.rows),
        ],
    )


def _history(rows: Sequence[Row]) -> list[Section]:
    cells = list[list[str]]()
    for row in rows:
        for old, new in pairwise([*row.past, row]):
            pairs = [
                ("version", old.version, new.version),
                ("outcome", old.state, new.state),
                *(
                    (name, *(each.settings.get(name, "default") for each in (old, new)))
                    for name in {**old.settings, **new.settings}
                ),
            ]
            found = [f"{name} {one} → {two}" for name, one, two in pairs if one != two]
            factor = f"{new.error / old.error:.3g}" if old.error and new.error else "–"
            errors = [number(each.error) for each in (old, new)]
            change = ", ".join(found) or "error alone"
            cells.append([new.since, row.case, row.name, change, *errors, factor])
    cells.sort(key=lambda each: each[0], reverse=True)
    verdict = [
        "Rows whose version, settings, outcome or error changed since the first board of this"
        " history: errors by more than a tenth, and by more than round-off."
    ]
    heads = ("date", "case", "stepper", "change", "error before [m]", "after [m]", "factor")
    return [Section("History", verdict, [], heads, 4, cells)] if cells else []


def _rows(board: Board, truth: TruthFacts) -> list[Row]:
    groups = [*dict.fromkeys(row.group for row in board.rows)]
    mine = [row for row in board.rows if row.case == truth.case]
    return sorted(mine, key=lambda row: groups.index(row.group))


def _section(truth: TruthFacts, rows: Sequence[Row]) -> Section:
    measured = [row for row in rows if row.measured]
    styles = [Style.number(k, row.name) for k, row in enumerate(measured)]
    verdict = [
        f"{truth.source}. {truth.duration:.6g} s, {truth.samples} samples, {truth.points} points,"
        f" {number_of(truth.freedoms, 'freedom')}, {number_of(truth.redundant, 'redundant row')}.",
        f"Truth: {truth.method}. Halving its steps moves a point by {number(truth.error)} m, and"
        f" changes energy minus work by {number(truth.energy)} J.",
        *([truth.message] if truth.message else []),
        *([] if truth.forces else [OPEN]),
        *_alike(rows),
    ]
    cells, links = list[list[str]](), list[str]()
    for group, each in groupby(rows, key=lambda row: row.group):
        both = [*each]
        cells += [[group], *(_cells(row, truth) for row in both)]
        links += ["", *(f"{row.folder}/run.py" if row.folder else "" for row in both)]
    plot = Plot(truth.case, f"{truth.case}: error against cost, both log axes", CAPTION)
    diagrams = [Diagram(plot, _figure(measured, styles), styles)] if measured else []
    notes = _messages(rows)
    return Section(truth.case, verdict, notes, COLUMNS, LABELS, cells, diagrams, links)


def _messages(rows: Sequence[Row]) -> list[str]:
    """Return what rows say, once each; the remedy stands once, with the settings."""
    found = dict[str, list[str]]()
    for row in rows:
        if row.message:
            text = f"{row.state}: {row.message.partition(';')[0]}"
            found.setdefault(text, []).append(row.name)
    return [f"{'; '.join(names)}: {text}." for text, names in found.items()]


def _alike(rows: Sequence[Row]) -> list[str]:
    found = list[str]()
    for group, each in groupby(rows, key=lambda row: row.group):
        # the best known settings of each stepper, which may be the defaults
        best = {(row.engine, row.integrator): row for row in each}.values()
        errors = [row.error for row in best if row.error]
        if len({row.engine for row in best if row.error}) > 1 and max(errors) < 1.1 * min(errors):
            found.append(
                f"{group}: {len(errors)} steppers share their error to"
                f" {100 * (max(errors) / min(errors) - 1):.1g} %: it is the integrator's, not the"
                " engine's."
            )
    return found


def _cells(row: Row, truth: TruthFacts) -> list[str]:
    last, reaction = (row.measured[-1] if row.measured else Run()), "–"
    if row.measured:
        missing = "not given" if truth.forces else "open"
        reaction = missing if last.reaction is None else number(last.reaction)
    return [
        f"{row.engine} {row.integrator}",
        row.column,
        row.state,
        *(number(each) for each in (last.error, last.gap, last.energy)),
        reaction,
        "–" if row.order is None else f"{row.order:.2f}",
        number(row.floor),
        number(last.step) if last.step else "own" if last.accuracy else "–",
        number(last.cost),
        row.since,
    ]


def _figure(rows: Sequence[Row], styles: Sequence[Style]) -> Figure:
    traces, costs = list[Figure](), list[float]()
    for row, style in zip(rows, styles, strict=True):
        drawn = [run for run in row.measured if run.cost]
        costs += [run.cost for run in drawn if run.cost]
        curve = style.curve([run.cost for run in drawn], [run.error for run in drawn])
        efforts = [f"{number(run.step or run.accuracy)} {'s' * bool(run.step)}" for run in drawn]
        hover = {"text": efforts, "hovertemplate": "%{text}: %{x:.3~g} s/s, %{customdata:.3~g} m"}
        traces.append(curve | hover)
    axis = ticked_axis("cost: wall time for a simulated second [s/s]", costs)
    layout = {"xaxis": axis, "hovermode": "closest"}
    return with_error_axis({"data": traces, "layout": layout}, "largest position error [m]")


def _settings(rows: Sequence[Row]) -> Section:
    # a row of the best settings that shows the defaults, because they are nearer, has no settings
    named = {f"{row.engine} {row.integrator}": row for row in rows}
    named |= {f"{row.engine} {row.integrator}": row for row in rows if row.settings}
    missing = {row.engine: row.message for row in rows if row.state == "unavailable"}
    heads = ("stepper", "version", "precision", "loop over steps", "closed loops", "best", "by")
    return Section(
        "Settings and measures",
        [
            "Default: nothing but integrator and step is set. Best: the best known settings, kept"
            " in settings.toml of the board; whoever knows better ones changes that file.",
            *(f"Not run: {engine}: {message}." for engine, message in missing.items()),
        ],
        NOTES,
        heads,
        len(heads),
        [
            [
                name,
                row.version,
                row.precision,
                row.loop,
                row.ties,
                ", ".join(f"{name} {value}" for name, value in row.settings.items()) or "default",
                f"{row.by} {row.on}".strip() or "–",
            ]
            for name, row in named.items()
        ],
    )
