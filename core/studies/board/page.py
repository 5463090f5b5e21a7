"""The page of the board, in the style of a benchmark: a table and a work-precision diagram by case,
and the settings.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import groupby

from ...errors import number_of
from ...harness.labels import number
from ...report.figures import Figure, Style, floored, ticked_axis
from ...report.page_model import Plot
from ...report.sections import Diagram, Report, Section
from .results import Board, Row, Run, TruthFacts

COLUMNS = (
    "integrator",
    "engine",
    "settings",
    "outcome",
    "step [s]",
    "error [m]",
    "gap [m]",
    "energy [J]",
    "reaction [N]",
    "cost [s/s]",
    "order",
    "floor [m]",
    "since",
)
LABELS = 4
NOTES = (
    "Error: largest distance of a point of a joint or of the case from the truth, over the samples."
    " Gap: largest opening of a loop. Energy: of motion, weight and springs, minus the truth's at"
    " the same time; what loads and dampers take is in both.",
    "Reaction: largest error of the force in a joint, without directions that redundant rows leave"
    " open. Engines give those of closed loops (MuJoCo, Pinocchio, PyBullet), of the tree (Drake,"
    " Simbody), or of all joints but rods (Exudyn).",
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
    """Return the section on rows that changed, if any did."""
    cells, changed = list[list[str]](), [row for row in rows if row.past]
    for row in changed:
        ends = [(each.until, each) for each in row.past]
        for until, each in [*ends, ("now", row)]:
            error = number(each.error) if each.error is not None else each.state
            settings = ", ".join(f"{name} {value}" for name, value in each.settings.items())
            cells.append([row.case, row.name, each.since, until, each.version, settings, error])
    verdict = [
        "Rows whose version, settings, outcome or error changed since the first board of this"
        " history: errors by more than a tenth, and by more than round-off."
    ]
    heads = ("case", "row", "since", "until", "version", "settings", "error [m]")
    return [Section("History", verdict, [], heads, 6, cells)] if changed else []


def _rows(board: Board, truth: TruthFacts) -> list[Row]:
    """Return the rows of a case, those of one kind of integrator together."""
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
        *_alike(rows),
    ]
    diagram = [Diagram(_plot(truth.case), _figure(measured, styles), styles)] if measured else []
    return Section(
        truth.case,
        verdict,
        [],
        COLUMNS,
        LABELS,
        [_cells(row) for row in rows],
        diagram,
        [f"{row.folder}/run.py" if row.folder else "" for row in rows],
    )


def _alike(rows: Sequence[Row]) -> list[str]:
    """Return a sentence on each kind of integrator whose engines share their error."""
    found = list[str]()
    for group, each in groupby(rows, key=lambda row: row.group):
        best = _best(each)
        errors = [row.error for row in best if row.error]
        if len({row.engine for row in best if row.error}) > 1 and max(errors) < 1.1 * min(errors):
            found.append(
                f"{group}: {len(errors)} steppers share their error to"
                f" {100 * (max(errors) / min(errors) - 1):.1g} %: it is the integrator's, not the"
                " engine's."
            )
    return found


def _best(rows: Iterable[Row]) -> list[Row]:
    """Return the rows with the best known settings of each stepper, which may be the defaults."""
    found = {(row.engine, row.integrator): row for row in rows}
    return [*found.values()]


def _cells(row: Row) -> list[str]:
    last = row.measured[-1] if row.measured else Run()
    return [
        row.group,
        f"{row.engine} {row.integrator}",
        row.column,
        # the remedy stands once, below
        f"{row.state}: {row.message.partition(';')[0]}" if row.message else row.state,
        number(last.step) if last.step else "own" if last.accuracy else "–",
        *(number(each) for each in (last.error, last.gap, last.energy)),
        "not given" if row.measured and last.reaction is None else number(last.reaction),
        number(last.cost),
        "–" if row.order is None else f"{row.order:.2f}",
        number(row.floor),
        row.since,
    ]


def _plot(case: str) -> Plot:
    caption = "Left is faster, down is more accurate; each point halves the step of the one before."
    return Plot(case, f"{case}: error against cost, both log axes", caption)


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
    return floored({"data": traces, "layout": layout}, "largest position error [m]")


def _missing(rows: Sequence[Row]) -> list[str]:
    """Return why engines are not run, a sentence each."""
    messages = {row.engine: row.message for row in rows if row.state == "unavailable"}
    return [f"Not run: {engine}: {message}." for engine, message in messages.items()]


def _settings(rows: Sequence[Row]) -> Section:
    named = {(row.engine, row.integrator, row.column): row for row in rows}
    return Section(
        "Settings and measures",
        [
            "Default: nothing but integrator and step is set. Best: the best known settings, kept"
            " in settings.toml of the board; whoever knows better ones changes that file.",
            *_missing(rows),
        ],
        NOTES,
        (
            "engine",
            "version",
            "integrator",
            "precision",
            "settings",
            "loop over steps",
            "closed loops",
            "values",
            "by",
            "on",
        ),
        10,
        [
            [
                row.engine,
                row.version,
                row.integrator,
                row.precision,
                row.column,
                row.loop,
                row.ties,
                ", ".join(f"{name} {value}" for name, value in row.settings.items()) or "–",
                row.by or "–",
                row.on or "–",
            ]
            for row in named.values()
        ],
    )
