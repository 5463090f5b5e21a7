"""Bodies fixed to one another as one: a file closes a loop at any joint, or between halves of a
body, and is the same mechanism.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np

from ...algebra import triple, vec
from ...joints import Fixed
from ...mechanism.body import Body, Inertia, inertia_matrix
from ...mechanism.mechanism import GROUND, Mechanism
from .tree import COPY, Mass, sum_of_masses


def glue(mechanism: Mechanism, links: Collection[str]) -> tuple[Mechanism, Mapping[str, list[str]]]:
    """Return the mechanism with each set of bodies fixed to one another as one, and the names in
    each such set, by its own name.

    A joint between two of them is left out with its freedoms, unless it is coupled: then they stay
    apart. Points, drivers and forces are left out.

    Args:
        links: bodies whose names are taken first.
    """
    fixed = {GROUND, *(body.name for body in mechanism.bodies if body.fixed)}
    coupled = {name for each in mechanism.couplers for name in each.joints}
    order = {body.name: k for k, body in enumerate(mechanism.bodies)}
    owner = {name: name for name in (GROUND, *order)}
    sets = {name: {name} for name in owner}
    for joint in mechanism.joints:
        one, other = sorted(
            (owner[name] for name in joint.bodies),
            key=lambda name: (
                *(name not in fixed, COPY in name, name not in links),
                *(len(name), order.get(name, 0)),
            ),
        )
        if not isinstance(joint, Fixed) or one == other:
            continue
        whole = sets[one] | sets[other]
        if not any({*mechanism.joint(name).bodies} <= whole for name in coupled):
            sets[one] = whole
            owner |= dict.fromkeys(sets.pop(other), one)
    joints = [
        joint.changed(i=owner[joint.i], j=owner[joint.j])
        for joint in mechanism.joints
        if owner[joint.i] != owner[joint.j]
    ]
    bodies = [
        _whole(body, [mechanism.body(name) for name in sets[body.name] if name != GROUND])
        for body in mechanism.bodies
        if owner[body.name] == body.name
    ]
    whole = replace(
        mechanism, bodies=bodies, joints=joints, reduced=(), points=(), drivers=(), forces=()
    )
    return whole, {
        name: sorted(each, key=lambda part: (part != name, order[part]))
        for name, each in sets.items()
        if name not in fixed
    }


def _whole(body: Body, parts: list[Body]) -> Body:
    """Return a body with the masses of its parts."""
    heavy = [each for each in parts if each.mass]
    if body.fixed or len(parts) == 1 or not heavy:
        return body
    masses = [
        Mass(
            each.mass,
            vec(each.center),
            inertia_matrix(each.inertia),
        )
        for each in heavy
    ]
    whole = sum_of_masses(masses)
    xx, yy, zz, xy, xz, yz = whole.inertia[np.triu_indices(3)][[0, 3, 5, 1, 2, 4]].tolist()
    six: Inertia | None = (xx, yy, zz, xy, yz, xz) if whole.inertia.any() else None
    return replace(body, mass=whole.mass, center_of_mass=triple(whole.center), inertia=six)
