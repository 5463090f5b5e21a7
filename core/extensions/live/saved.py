"""The live page as one file, with its solver in it: no server, no Python, no request."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, TypeAlias, cast

import msgspec
import numpy as np

from ...case.case import HELD_BUT, SLOW, TIME, Case, Sweep, without_forces
from ...case.measures import JointForce
from ...errors import KincheckError
from ...harness.native_engine import NativeEngine
from ...harness.provenance import case_facts
from ...harness.run import run
from ...harness.table_units import DRIVER_UNITS, in_table_units
from ...kinematics import places
from ...mechanism.motions import Ramp
from ...report.progress import complain
from ...studies.reactions import with_reactions
from ...unit_text import with_unit
from ..code.js import source
from ..code.solved import TOL, SolvedCase, loose_forces, solved_case
from ..hardpoints.saving import new_text
from ..hardpoints.table import unit_of
from .model import LiveModel
from .protocol import Reach, Solve
from .server import file_of, page_files, page_script
from .table import LiveTable, drawn, geometry_of, live_outputs, structure_of

POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline';"
    " img-src data: blob:; base-uri 'none'; form-action 'none'"
)
"""A saved page asks nobody for anything."""
MOVED = 1e-3
"""Move by which the scene's derivatives are found [m]: places follow linearly, round-off is small,
and readers take a design that is so near.
"""
LINEAR = 1e-12
"""Largest distance of a place from where the solver moves it [m], of directions without unit."""

SOLVER = "return { Mechanism, DESIGN, HALVINGS };"
COLUMNS = "name,x,y,z\n"
Leaf: TypeAlias = tuple[str | int, ...]


def saved_page(live: LiveTable | LiveModel) -> str:
    """Return the page of a file, with its solver.

    Raises:
        KincheckError: the case has a part that code cannot have, does not follow its table
            linearly, or does not close.
    """
    if isinstance(live, LiveTable):
        (saved, solved), answerer = _table(live), "solver.js"
    else:
        (saved, solved), answerer = _model(live), "mover.js"
    known = msgspec.json.encode(saved).decode()
    scripts = [
        f"const SAVED = {known};",
        f"const solver = (() => {{\n{source(solved)}\n{SOLVER}\n}})();",
        page_script(answerer),
    ]
    # no text in a script may end it
    script = "\n".join(scripts).replace("</", "<\\/").replace("<!--", "<\\!--")
    page, style = (page_files()[name][0] for name in ("/", "/live.css"))
    policy = f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
    parts = {
        '<link rel="stylesheet" href="/live.css">': f"{policy}\n<style>\n{style}</style>",
        '<script src="/live.js" defer></script>\n': "",
        "</body>": f"<script>\n{script}\n</script>\n</body>",
    }
    for old, new in parts.items():
        assert page.count(old) == 1, old
        page = page.replace(old, new)
    return page


def _table(live: LiveTable) -> tuple[dict[str, Any], SolvedCase]:
    """Return what a page of a table knows, and its solver."""
    case = without_forces(live.case)
    rows = [each.name for each in case.hardpoints if each.moves]
    coordinates = [(live.names.index(name), axis) for name in rows for axis in range(3)]
    names = [f"{name} {axis}" for name in rows for axis in "xyz"]
    solved = solved_case(case, names, [body.name for body in case.mechanism.moving])
    opening = msgspec.structs.replace(
        live.opening(()), outputs=live_outputs(case), varied=False, save=f"{live.file.stem}_2.csv"
    )
    table = new_text(live.table, live.supplied, live.positions).decode()
    head = table[: table.index(COLUMNS) + len(COLUMNS)]
    saved = {
        "opening": opening,
        "coordinates": coordinates,
        "metres": unit_of(live.table, live.supplied.units).size,
        "outputs": [each.name for each in case.outputs],
        "columns": [*_columns(case)],
        "head": head,
        **_scene(live, coordinates, solved),
    }
    return saved, solved


def _model(live: LiveModel) -> tuple[dict[str, Any], SolvedCase]:
    """Return what a page of a mechanism knows, and the solver that moves its drivers."""
    answer = live.solve(Solve(points=[]))
    if not any(answer.solved):
        raise KincheckError(f"--save: {live.file} has no pose to move from: {answer.message}")
    case, solved = _steered(live)
    numbers = {each.quantity.name: k for k, each in enumerate(solved.outputs)}
    own = {each.name for each in live.case.outputs}
    reactions = {
        joint.name: [numbers.get(f"{joint.name}.force_{axis}", -1) for axis in "xyz"]
        for joint in case.mechanism.given_joints
    }
    curves = run([live.case], [NativeEngine()], tol=TOL)
    name = f"{live.file.stem}.csv"
    saved = {
        "opening": live.opening(()),
        "answer": answer,
        "reaches": [live.reach(Reach(driver=driver)) for driver in live.drivers],
        "outputs": [(name, k) for name, k in numbers.items() if name in own],
        "reactions": [each for each in reactions.items() if max(each[1]) >= 0],
        "poses": [*solved.poses.items()],
        "slow": SLOW,
        "csv": {"name": name, "content": file_of(curves, live.case, name)},
    }
    return saved, solved


def _steered(live: LiveModel) -> tuple[Case, SolvedCase]:
    """Return the case of a page whose drivers are moved by hand, with its solver; with reactions
    where code can have them.
    """
    moving = {each.name: Ramp(0.0) for each in live.case.mechanism.drivers}
    sweep = Sweep(TIME, np.array([0.0, 1.0]), motions=moving)
    motion = tuple(each for each in live.case.outputs if HELD_BUT not in each.facts)
    case, bodies = replace(live.case, outputs=motion), [*live.bodies]
    ways = [way for driver in live.drivers.values() for way in live.ways(driver)]
    if any(each.forces for each in motion) or case.mechanism.has_loads:
        try:
            loaded = with_reactions(case, TOL) if case.mechanism.has_loads else case
            loose, own = loose_forces(loaded), {each.name for each in motion}
            kept = tuple(
                each
                for each in loaded.outputs
                if each.name not in loose and (each.name in own or isinstance(each, JointForce))
            )
            loaded = replace(loaded, outputs=kept, sweep=sweep)
            return loaded, solved_case(loaded, (), bodies, forces=True, steered=ways)
        except KincheckError as error:
            complain([f"the page has no forces: {error}"])
    case = replace(case, sweep=sweep)
    return case, solved_case(case, (), bodies, steered=ways)


def _columns(case: Case) -> Iterator[dict[str, Any]]:
    """Yield the columns of the curves as `kincheck run --csv` writes them: head, size of the unit
    [SI], and the values of drivers [SI] or the name of the output.
    """
    about = case_facts(case)
    drivers = {about["driver"]["name"]: about["driver"], **about["motions"]}
    moved = [
        (name, DRIVER_UNITS.get(drivers.get(name, {}).get("type", ""), ""), values.tolist())
        for name, values in case.sweep.moved.items()
    ]
    for name, unit, values in [*moved, *((each.name, each.unit, None) for each in case.outputs)]:
        text, size = in_table_units(unit, about)
        head = with_unit(name, "" if text == "1" else text)
        yield {"name": name, "head": head, "size": size, "values": values}


def _scene(
    live: LiveTable, coordinates: Sequence[tuple[int, int]], solved: SolvedCase
) -> dict[str, Any]:
    """Return the scene of the table, how its numbers change with the coordinates, the captions of
    all samples, and the slots of poses by body of the scene.

    Raises:
        KincheckError: the mechanism does not follow a coordinate as the solver of the page does.
    """
    drawing = live.solve(Solve(points=live.positions)).drawing
    numbers = {body["name"]: k for k, body in enumerate(drawing["bodies"])}
    at_design = dict(_leaves(_design(live, live.case)))
    unit = unit_of(live.table, live.supplied.units).size
    changes, structure = dict[Leaf, list[tuple[int, float]]](), structure_of(live.case)
    nominal = {name: np.array(value) for name, value in places(live.case.mechanism).items()}
    moves = {each.name: each.moves for each in live.case.hardpoints}
    for k, (row, axis) in enumerate(coordinates):
        points = [[*each] for each in live.positions]
        points[row][axis] += MOVED / unit
        case = live.edited_case([(x, y, z) for x, y, z in points])
        moved = dict(_leaves(_design(live, case)))
        own = moves[live.names[row]]
        expected = {
            name: value + MOVED * np.asarray(own[name])[:, axis] if name in own else value
            for name, value in nominal.items()
        }
        off = geometry_of(case)[:, 0] - np.concatenate([*expected.values()])
        is_linear = structure_of(case) == structure and np.abs(off).max() <= LINEAR
        if not is_linear or {*moved} != {*at_design}:
            raise KincheckError(
                f"--save: {live.names[row]} {'xyz'[axis]} changes more than places of the"
                " mechanism, and a saved page cannot follow. Leave --save out: a served page can."
            )
        for leaf, value in at_design.items():
            if moved[leaf] != value:
                changes.setdefault(leaf, []).append((k, (moved[leaf] - value) / MOVED))
    return {
        "drawing": drawing,
        "changes": [*changes.items()],
        "steps": [f"sample {k} · {live.axis.at(k)}" for k in range(len(live.axis.values))],
        "poses": [(numbers[name], slots) for name, slots in solved.poses.items()],
    }


def _design(live: LiveTable, case: Case) -> dict[str, Any]:
    """Return the scene at the design position, without poses, which the solver gives."""
    found = drawn(case, live.axis, [], {}, {})
    bodies = [{"frame": each["frame"]} for each in found["bodies"]]
    return {name: found[name] for name in ("nodes", "marks", "wheels")} | {"bodies": bodies}


def _leaves(part: Any, at: Leaf = ()) -> Iterator[tuple[Leaf, float]]:
    """Yield the floating-point numbers of a part of a scene, with their places in it."""
    if isinstance(part, float):
        yield at, part
    elif isinstance(part, dict):
        for key, each in cast("dict[str, Any]", part).items():
            yield from _leaves(each, (*at, key))
    elif isinstance(part, list | tuple):
        for k, each in enumerate(cast("Sequence[Any]", part)):
            yield from _leaves(each, (*at, k))
