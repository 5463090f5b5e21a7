"""From a tree of links to a case: its moves and ties as joints of a mechanism, one of them driven,
others held.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from ...algebra import X, Y, vec
from ...case.case import Case, Sweep, Truth
from ...case.io.document import SMALLEST, explained, usable
from ...case.io.readers import LEFT_OUT
from ...errors import WARNING, CaseError, MechanismError, shortened
from ...joints import (
    Coupler,
    Distance,
    Fixed,
    Joint,
    Polynomial,
    Revolute,
    Spherical,
    Spline,
    Translational,
)
from ...kinematics import degrees_of_freedom
from ...mechanism.body import Body, Inertia, checked_inertia
from ...mechanism.loads import Bushing, ForceElement, SpringDamper, TorsionSpringDamper
from ...mechanism.mechanism import GROUND, Mechanism, Point
from ...mechanism.motions import Absolute, Driver, JointAngle, JointDisplacement, Motion, Table
from ..closing.digits import within_digits
from ..closing.reduction import reduce_rows
from ..xml.element import Names
from .assembly import Assembled, assemble
from .driving import (
    KEYFRAME,
    MOST_HELD,
    Driving,
    UndrivenMotions,
    choose_held,
    driving_of_motors,
    read_driving,
    read_start,
)
from .gluing import glue
from .linear_relation import linear_relation
from .options import ModelOptions
from .outputs import with_all_motions
from .place import Place, coordinates, rotation_vector
from .spins import Spin, find_spins
from .tree import Closure, Coupling, Mass, Move, Spring, Strut, Tree, sum_of_masses

FREEDOMS = {"hinge": "rotation", "slide": "translation"}
NO_GRAVITY = (0.0, 0.0, 0.0)
MOST_NAMED = 8
# Of a rod's length, what the digits of a file leave between its centre of mass and its end.
AT_END = 1e-5
# Turns of frames against each other that rounding leaves [rad].
PARALLEL = 1e-9
# The spring of a slide acts on a point of its line so far behind it, in sizes of the model, that
# the slide never gets there: the distance less this is the displacement.
BEHIND = 100.0


def case_of(tree: Tree, supplied: ModelOptions) -> Case:
    """Return the case of a tree; outputs are the coordinates of the origins of links and of sites,
    those of joints, and the rotations of links.

    Raises:
        CaseError: the options do not say how it moves, its start does not close, or there is no
            joint for one of its ties.
    """
    return _Parts(*model_of(tree, supplied)).case()


def undriven_mechanism(
    tree: Tree,
) -> tuple[Mechanism, Tree, set[str], Mapping[str, Sequence[str]]]:
    """Return the mechanism of a tree without drivers, its loops closed and its halves glued, the
    tree in its closed start, its links with a free turn about themselves, and the names of the
    parts of each link.

    Raises:
        CaseError: its start does not close, or there is no joint for one of its ties.
    """
    model = assemble(read_start(tree, ()), None)
    spins = find_spins(model.tree, ())
    whole, parts = glue(_Parts(model, Driving({}, (), ()), spins).mechanism(), tree.places)
    if not model.is_exact:
        whole = reduce_rows(whole, model.closing.tolerance, [*tree.joints]).mechanism
    return whole, model.tree, {spin.move.inner for spin in spins.values()}, parts


def model_of(tree: Tree, supplied: ModelOptions) -> tuple[Assembled, Driving, Mapping[str, Spin]]:
    """Return a tree in its closed start, its driven and held moves, and its links that spin.

    Raises:
        CaseError: see `case_of`.
    """
    driving = read_driving(tree, supplied)
    start = read_start(tree, supplied.start)
    model = assemble(start, supplied.closure, driving.moves)
    spins = find_spins(model.tree, driving.fixed)
    axes = {name: spin.axis for name, spin in spins.items()}
    used = Counter({"keyframe: key": any(each.startswith(KEYFRAME) for each in supplied.start)})
    if not (driving.moves or driving.fixed or supplied.hold_rest):
        own, note = driving_of_motors(tree, supplied)
        if own.driven and len(own.driven) == UndrivenMotions(model, axes).dof:
            driving, used = own, used + tree.motors
            model = replace(model, notes=(*model.notes, note))
    model = replace(model, tree=replace(model.tree, left_out=tree.left_out - used))
    chosen, spins = _choose_held(model, driving, spins, hold_rest=supplied.hold_rest)
    rest = [name for name in chosen.held + chosen.fixed if name not in supplied.hold]
    if passive := [name for name in rest if name not in model.tree.actuated]:
        note = (
            f"{WARNING}held by --hold-rest, without a motor:"
            f" {shortened(passive, MOST_NAMED)}; a loop that the file lacks would move them"
        )
        model = replace(model, notes=(*model.notes, note))
    return model, chosen, spins


def _choose_held(
    model: Assembled, driving: Driving, spins: Mapping[str, Spin], *, hold_rest: bool
) -> tuple[Driving, Mapping[str, Spin]]:
    """Return the driven and held moves, and the links with a spin beside them.

    A link between two balls is a rod, whose spin is no freedom. If --hold-rest cannot hold the rest
    so, it holds the ball of such a link too, which is then no rod.

    Raises:
        CaseError: see `choose_held`.
    """
    axes = {name: spin.axis for name, spin in spins.items()}
    try:
        return choose_held(model, driving, axes, hold_rest=hold_rest), spins
    except CaseError:
        balls = [name for name, spin in spins.items() if spin.move.kind == "ball"]
        if not (hold_rest and 0 < len(balls) <= MOST_HELD):
            raise
        tried = replace(driving, fixed=(*driving.fixed, balls[0]))
        with suppress(CaseError):
            left = find_spins(model.tree, tried.fixed)
            return _choose_held(model, tried, left, hold_rest=True)
        raise


class _Parts:
    """The parts of a mechanism, during its making.

    Attributes:
        bodies: places of its moving and held bodies.
        fixed: names of the held ones.
        left_out: omitted bodies and freedoms, in words.
    """

    def __init__(self, model: Assembled, driving: Driving, spins: Mapping[str, Spin]) -> None:
        self.model, self.driving, self.spins = model, driving, spins
        self.tree = tree = model.tree
        self.bodies: dict[str, Place] = dict(tree.moving)
        fixed = {tree.free.get(name, name) for name in driving.fixed}
        self.fixed = fixed & tree.moving.keys()
        self.joints: dict[str, Joint] = {}
        self.couplers: dict[str, Coupler] = {}
        self.left_out: list[str] = []
        self._join()

    def case(self) -> Case:
        """Return the case, without rows that are redundant within the digits."""
        tree, model, closing = self.tree, self.model, self.model.closing
        with explained(tree.file):
            drivers = [
                (JointAngle if isinstance(self.joints[name], Revolute) else JointDisplacement)(
                    name, name
                )
                for name in self.driving.moves
            ]
        mechanism = self.mechanism(drivers)
        weighed = any(body.mass for body in mechanism.bodies)
        left_out = [*self.left_out, *(f"{what} ({n})" for what, n in tree.left_out.items())]
        heavy = ", with the masses of its bodies" * weighed
        others = ", ".join(left_out) or "nothing"
        source = f"{tree.described}, from {model.start}{heavy}{LEFT_OUT}{others}"
        digits = {"hinge": closing.tolerance / closing.size, "slide": closing.tolerance}
        axial = {
            name: move
            for name, move in tree.joints.items()
            if isinstance(self.joints.get(name), Revolute | Translational)
        }
        zeros = {x: move.value for x, move in axial.items() if abs(move.value) > digits[move.kind]}
        sweep, notes = self._sweep(), [*tree.notes, *model.notes]
        if zeros:
            values = [f"{name} {value:.9g}" for name, value in zeros.items()]
            notes.append(
                "angles and displacements of joints count from the start; JOINT.qpos, --drive and"
                f" --start count from the model's zero, and are at the start"
                f" {shortened(values, MOST_NAMED)}"
            )
        ranges = {
            (name, FREEDOMS[move.kind]): (move.limit.lower, move.limit.upper)
            for name, move in axial.items()
            if move.limit.is_range
        }
        notes += self.driving.beyond_limits(tree, digits)
        name, truth = tree.file.stem, Truth.CONSENSUS_ONLY
        case = Case(name, source, truth, mechanism, sweep, (), assembly=(*notes,), ranges=ranges)
        dof = degrees_of_freedom(mechanism)
        if dof != len(drivers) or not model.is_exact:
            with explained(tree.file):
                case = within_digits(case, closing.tolerance, closing.why, [*tree.joints])
            dof = degrees_of_freedom(case.mechanism)
        if dof != len(drivers):
            raise tree.fault(
                "",
                f"its joints and equalities leave {len(drivers)} freedoms within"
                f" {closing.tolerance:.2g} m ({closing.why}), but {dof} as exact ones, expected as"
                " many; start farther from a singular pose by --start, or give another tolerance by"
                " --closure",
            )
        return with_all_motions(case, zeros)

    def mechanism(self, drivers: Sequence[Driver] = ()) -> Mechanism:
        """Return the mechanism with all its rows."""
        tree, bodies = self.tree, [*self._bodies()]
        weighed = any(body.mass for body in bodies)
        with explained(tree.file):
            return Mechanism(
                *(tree.file.stem, bodies, [*self.joints.values()], [*self._points()], drivers),
                [*self.couplers.values()],
                gravity=tree.gravity if weighed else NO_GRAVITY,
                forces=[*self._springs()],
            )

    def _free_name(self, wanted: str) -> str:
        """Return an unused name: ties, moves and links of a model may share names."""
        while wanted in self.joints or wanted in self.couplers or wanted in self.bodies:
            wanted += "'"
        return wanted

    def _join(self) -> None:
        """Add the joints of moves, ties and rods."""
        rods = {name: spin for name, spin in self.spins.items() if spin.is_rod}
        replaced = {id(end.by) for spin in rods.values() for end in spin.ends}
        for name, spin in rods.items():
            del self.bodies[spin.move.inner]
            first, second = spin.ends
            points = coordinates(first.point), coordinates(second.point)
            self.joints[name] = Distance(name, first.other, second.other, points)
            self.left_out.append(
                f"body {spin.move.inner!r} and its turn about itself: it is a rod of constant"
                " length"
            )
        still = {*_locked_moves(self.tree), *self.driving.fixed}
        for name, move in self.tree.joints.items():
            if id(move) in replaced:
                continue
            ends = name, move.outer, move.inner
            point, axis = coordinates(move.point), coordinates(move.axis)
            if name in still:
                self.joints[name] = Fixed(*ends)
            elif move.kind == "hinge":
                self.joints[name] = Revolute(*ends, point, axis)
            elif move.kind == "slide":
                self.joints[name] = Translational(*ends, point, axis)
            else:
                self.joints[name] = Spherical(*ends, point)
        for each in self.tree.ties:
            if isinstance(each, Coupling):
                self._couple(each)
            elif id(each) not in replaced:
                name = self._free_name(each.name)
                self.joints[name] = _joint_of(each, name)
        for spin in self.spins.values():
            if not spin.is_rod:
                name = self._free_name(f"{spin.move.inner}: no spin")
                self.joints[name] = spin.lock(name, _beside(spin, rods.values()))
                self.left_out.append(
                    f"turn of body {spin.move.inner!r} about itself: it is a rod between balls"
                )

    def _couple(self, coupling: Coupling) -> None:
        free = [x for x in coupling.moves if not isinstance(self.joints[x], Fixed)]
        if len(coupling.moves) < 2 or not free:  # one is locked, none says nothing
            return
        name = self._free_name(coupling.name)
        if not coupling.is_linear:
            self.couplers[name] = self._follower(coupling, name)
            return
        # the weighted sum of the changes of coordinates is zero
        weights = {x: weight for x, weight in coupling.weights.items() if x in free}
        freedoms = [FREEDOMS[self.tree.joints[x].kind] for x in weights]
        self.couplers[name] = linear_relation(name, weights, freedoms)

    def _follower(self, coupling: Coupling, name: str) -> Polynomial | Spline:
        """Return a curve between two moves, by their changes since the pose of the tree."""
        ((driven, a),), ((driving, b),) = coupling.driven.items(), coupling.driving.items()
        first, second = (FREEDOMS[self.tree.joints[each].kind] for each in (driven, driving))
        at = b * self.tree.joints[driving].moved
        if coupling.points:
            spline = Spline(name, (driven, driving), coupling.points, freedoms=(first, second))
            return spline.counted_from(coupling.function.at(at)[0], at)
        curve = np.polynomial.Polynomial(coupling.coefficients)
        # a (x0 + x) = p(b (y0 + y)), which holds at x = y = 0
        shifted = (curve(np.polynomial.Polynomial([at, b])) / a).coef.tolist()
        return Polynomial(name, (driven, driving), (0.0, *shifted[1:]), freedoms=(first, second))

    def _points(self) -> Iterator[Point]:
        """Yield the origins of the moving bodies of the file, and the sites on them."""
        moving = [name for name in self.bodies if name not in self.fixed]
        named = [name for name in moving if name in self.tree.places]
        for name in named:
            yield Point(name, name, coordinates(self.bodies[name].at))
        for site, (body, place) in self.tree.sites.items():
            if body in moving:
                yield Point(f"site {site}" if site in named else site, body, coordinates(place.at))

    def _bodies(self) -> Iterator[Body]:
        """Yield the bodies with their masses.

        A rod that is a distance has its mass at its ends, which is right for its weight and not for
        its inertia.
        """
        tree = self.tree
        masses = {
            name: [each.in_frame(place) for each in tree.masses.get(name, ())]
            for name, place in self.bodies.items()
        }
        unknown = tree.unweighed - self.fixed
        lumped: list[str] = []
        for spin in self.spins.values():
            link = spin.move.inner
            if spin.is_rod and (rod := tree.masses.get(link)):
                whole = sum_of_masses(rod).in_frame(tree.moving[link])
                if _lump(whole, spin, masses):
                    lumped.append(link)
                else:
                    unknown.add(link)
        for name, place in self.bodies.items():
            e0, e1, e2, e3 = (float(x) if abs(x) >= SMALLEST else 0.0 for x in place.turn)
            body = Body(name, coordinates(place.at), (e0, e1, e2, e3), name in self.fixed)
            if masses[name] and not body.fixed:
                heavy = _with_mass(body, sum_of_masses(masses[name]))
                if heavy is None:
                    unknown.add(name)
                body = heavy or body
            yield body
        self.left_out += [
            f"{what} {shortened(sorted(names), MOST_NAMED)}"
            for what, names in (
                ("masses that cannot be read, of", unknown),
                ("moments of inertia of rods, whose masses are at their ends:", lumped),
            )
            if names
        ]

    def _springs(self) -> Iterator[ForceElement]:
        """Yield the springs and dampers; those that are no force elements are counted."""
        names = Names()
        for name, move in self.tree.moves.items():
            if (spring := self.tree.springs.get(name)) is None:
                continue
            law = {"stiffness": spring.stiffness, "damping": spring.damping}
            try:
                if element := self._spring_of(move, spring, law):
                    names.add(name)
                    yield element
            except MechanismError:
                for key, what in (("stiffness", "springs"), ("damping", "damping")):
                    if law[key]:
                        self.tree.count(f"{what} of joints")
        for strut in self.tree.struts:
            try:
                if len({*strut.links} & {GROUND, *self.bodies}) < 2:
                    raise MechanismError("it joins no two bodies of the mechanism")
                if turned := _turn_of_bushing(strut):
                    self.tree.notes.append(
                        f"{strut.element} is left out of the forces: its frames are turned against"
                        f" each other by {turned:.3g} rad in the start, and there is no preload of"
                        " its torques"
                    )
                    raise MechanismError("it has a preload of torques")
                yield _force_element(strut, names.new(strut.name))
            except MechanismError:
                self.tree.count(strut.described)

    def _spring_of(self, move: Move, spring: Spring, law: Mapping[str, Any]) -> ForceElement | None:
        """Return the force element of a move; None of a locked one, whose spring does nothing."""
        if not move.is_axial:
            raise MechanismError("a spring of three turns, expected one of an axis")
        change = spring.rest - move.value
        match self.joints.get(move.name):
            case Revolute():
                return TorsionSpringDamper(move.name, move.name, **law, free_angle=change)
            case Translational():
                swept = self.driving.driven.get(move.name, 0.0)
                travel = float(np.abs(np.subtract(swept, move.value)).max())
                behind = BEHIND * max(self.model.closing.size, abs(change), travel)
                if not usable(behind):
                    raise MechanismError("springref is beyond all numbers, expected a length")
                points = coordinates(move.point - behind * move.axis), coordinates(move.point)
                return SpringDamper(
                    *(move.name, move.outer, move.inner, points),
                    **law,
                    free_length=behind + change,
                )
            case _:
                return None

    def _sweep(self) -> Sweep:
        """Return the sweep of the first driven move; the others move with it, straight."""
        (swept, values), *following = self.driving.driven.items()
        design = self.tree.joints[swept].value
        first, last = values[0] - design, values[-1] - design  # times, at a rate of one
        motions: dict[str, Motion] = {}
        for name, each in following:
            ends = [(first, each[0]), (last, each[-1])]
            times, others = zip(*sorted((float(t), float(x)) for t, x in ends), strict=True)
            motions[name] = Absolute(Table(times, others), self.tree.joints[name].value)
        return Sweep(swept, values, design=design, motions=motions)


def _force_element(strut: Strut, name: str) -> ForceElement:
    """Return the force element between two links."""
    law, (first, second) = strut.spring, strut.places
    p, q = coordinates(first.at), coordinates(second.at)
    if isinstance(law, Spring):
        stiffness = law.stiffness, law.damping
        return SpringDamper(name, *strut.links, (p, q), *stiffness, free_length=law.rest)
    apart = second.relative_to(first)
    x, y = (coordinates(first.direction(axis)) for axis in (X, Y))
    preload = coordinates(vec([k * r for k, r in zip(law.stiffness, apart.at, strict=True)]))
    return Bushing(name, *strut.links, q, (x, y), **vars(law), preload=preload)


def _turn_of_bushing(strut: Strut) -> float:
    """Return the angle between the frames of a bushing with a torque [rad]; zero of others."""
    law, (first, second) = strut.spring, strut.places
    if isinstance(law, Spring) or not any((*law.turning_stiffness, *law.turning_damping)):
        return 0.0
    turned = float(np.linalg.norm([*rotation_vector(second.relative_to(first).turn)]))
    return turned if turned > PARALLEL else 0.0


def _locked_moves(tree: Tree) -> set[str]:
    """Return the moves locked by couplings, alone or by other locked ones."""
    couplings = [each.moves for each in tree.ties if isinstance(each, Coupling)]
    found: set[str] = set()
    while new := {name for each in couplings for name in each - found if len(each - found) == 1}:
        found |= new
    return found


def _beside(spin: Spin, rods: Iterable[Spin]) -> str:
    """Return a link beside another one that is no rod: if both are, the one behind the first."""
    behind = {
        rod.move.inner: next(end.other for end in rod.ends if end.other != spin.move.inner)
        for rod in rods
    }
    others = [end.other for end in spin.ends]
    return next((each for each in others if each not in behind), "") or behind[others[0]]


def _joint_of(closure: Closure, name: str) -> Joint:
    """Return the joint of a closure; a remaining gap is divided."""
    p, q = (place.at for place in closure.places)
    if closure.holds == "distance":
        return Distance(name, *closure.links, (coordinates(p), coordinates(q)))
    kind = Spherical if closure.holds == "point" else Fixed
    return kind(name, *closure.links, coordinates(0.5 * (p + q) if p != q else p))


def _lump(rod: Mass, spin: Spin, masses: Mapping[str, list[Mass]]) -> bool:
    """Add a rod's mass to the bodies at its ends; return whether its centre is between them."""
    first, second = spin.ends
    arm = second.point - first.point
    share = float(((rod.center - first.point) @ arm) / (arm @ arm))
    if not -AT_END <= share <= 1.0 + AT_END:
        return False
    share = min(1.0, max(0.0, share))
    for end, part in ((first, 1.0 - share), (second, share)):
        if end.other in masses and part > 0.0:
            masses[end.other].append(Mass(part * rod.mass, end.point, np.zeros((3, 3))))
    return True


def _with_mass(body: Body, mass: Mass) -> Body | None:
    """Return a body with a mass given in global axes; None if no rigid body has it, as no one has a
    moment of inertia alone.
    """
    if mass.mass == 0.0:
        return None if mass.inertia.any() else body
    center = coordinates(mass.center)
    matrix = 0.5 * (mass.inertia + mass.inertia.T)
    xx, yy, zz = np.diag(matrix).tolist()
    products = (float(matrix[pair]) for pair in ((0, 1), (1, 2), (0, 2)))
    xy, yz, xz = (x if abs(x) >= SMALLEST else 0.0 for x in products)
    six: Inertia = (xx, yy, zz, xy, yz, xz)
    if not all(map(usable, (mass.mass, *center, *six))):
        return None
    try:
        inertia = checked_inertia(body.name, six) if matrix.any() else None
    except MechanismError:
        return None
    return replace(body, mass=mass.mass, center_of_mass=center, inertia=inertia)
