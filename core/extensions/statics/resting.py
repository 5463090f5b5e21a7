"""Cases at the resting pose of their mechanism, the table [equilibrium]."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...algebra import Vec3
from ...case.case import TIME, Case, Sweep, pace, size
from ...case.io.outputs import default, largest_load
from ...case.measures import DriverEffort, coordinate_of
from ...case.quantity import point_jets, still_jets, with_markers
from ...errors import CaseError, MechanismError
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Motion, Ramp, Table
from ...trajectory import Array, PointMotion
from .equations import with_free_coordinates
from .equilibrium import Equilibria, StaticModel


def at_rest(case: Case, held_names: Sequence[str]) -> Case:
    """Return the case at rest: its free drivers follow the equilibrium with gravity and springs.

    The native engine finds the poses, at each value of a held driver that is swept, else one. All
    engines then have the same poses and find the efforts, which vanish for free drivers.

    Raises:
        CaseError: a driver that moves is free.
        SolveError: there is no equilibrium near the design, or nothing holds a body.
    """
    mechanism, sweep = with_free_coordinates(case.mechanism), case.sweep
    moving = {*sweep.motions, sweep.driver} - {TIME}
    if loose := sorted(moving - {*held_names}):
        raise CaseError(
            f"case {case.name!r}: driver {loose[0]!r} moves, and [equilibrium] leaves it free; name"
            " it in held, or take its motion and sweep out"
        )
    held = [each for each in mechanism.drivers if each.name in held_names]
    free = [each for each in mechanism.drivers if each.name not in held_names]
    path = replace(sweep, rate=sweep.rate or 1.0).path
    travel = {
        name: motion.at(path.times)[0] for name, motion in path.motions.items() if name != TIME
    }
    model = StaticModel(replace(mechanism, drivers=held))
    found = model.solve({}, travel or {})
    found.require_reached(lambda k, share: f"sample {k}, {share:.6g} of its travel")
    values = {each.name: _values(mechanism, each, found) for each in free}
    unstable = [
        f"the resting pose is unstable: {way}" for way in dict.fromkeys(found.unstable) if way
    ]
    motions = dict[str, Motion]()
    if not travel:
        motions = {name: Ramp(float(x[0])) for name, x in values.items()}
        at = Sweep(TIME, np.ones(1), 0.0, motions=motions)
    else:
        motions = {name: _through(path.times, x) for name, x in values.items()}
        at = replace(sweep, rate=0.0, motions={**sweep.motions, **motions})
    added = [each.name for each in mechanism.drivers[len(case.mechanism.drivers) :]]
    notes = [f"the resting pose is held by drivers of {', '.join(added)}"] if added else []
    assembly = (*case.assembly, *notes, *unstable)
    return replace(case, mechanism=mechanism, sweep=at, assembly=assembly)


def with_efforts(case: Case, held_names: Sequence[str]) -> Case:
    """Return the case with the efforts of its free drivers as outputs: they vanish where a
    simulator's own forces are in equilibrium.
    """
    mechanism, known = case.mechanism, {output.name for output in case.outputs}
    known |= {
        f"{x.driver}.effort" for x in case.outputs if isinstance(x, DriverEffort) and not x.at
    }
    load = largest_load(mechanism, size(case), pace(case))
    scales = {False: default(load, "N"), True: default(load * size(case), "N m")}
    efforts = [
        DriverEffort(f"{each.name}.effort", *scales[each.turns], driver=each.name).bound(mechanism)
        for each in mechanism.drivers
        if each.name not in held_names and f"{each.name}.effort" not in known
    ]
    outputs = (*case.outputs, *efforts)
    return replace(case, mechanism=with_markers(mechanism, outputs), outputs=outputs)


def _through(times: Array, values: Array) -> Motion:
    order = np.argsort(times)
    known, first = np.unique(times[order], return_index=True)
    if len(known) < 2:
        raise MechanismError("a swept equilibrium needs two samples or more; give more, or none")
    return Table(tuple(known.tolist()), tuple(values[order][first].tolist()))


def _values(mechanism: Mechanism, driver: Any, found: Equilibria) -> Array:
    """Return a driver's values from design at equilibria [m or rad], shape (n,)."""
    measure = coordinate_of(driver)
    marked = with_markers(mechanism, [measure])
    at, design = dict[str, Vec3](), dict[str, Vec3]()
    for name in measure.points:
        point = marked.point(name)
        place = found.place(point.body, point.position)
        still = np.zeros_like(place)
        at[name] = point_jets(PointMotion(place, still, still))
        design[name] = still_jets(point.position)
    return np.asarray(measure.of(at, design).x)
