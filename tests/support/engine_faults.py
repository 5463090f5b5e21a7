"""Faults of engines, one each: of the model that is built, of the trajectory that is returned, and
of the manners of an engine.

`FAULTS` must be found by check-engine. `HARMLESS` cannot be told from a sound engine, for the
reason that stands beside each.
"""

import math
from dataclasses import dataclass, replace

import kincheck.adapters
import numpy as np
from kincheck import JointAngle, JointDisplacement, Sine, Trajectory
from kincheck.core.mechanism.loads import Force, SpringDamper, Torque, TorsionSpringDamper
from kincheck.core.trajectory import QUANTITIES


@dataclass
class Wrapped:
    """The native engine by another name, with one fault by its name; none if it is empty."""

    fault: str = ""
    name = "wrapped"
    mode = "projection"
    loop = "python"
    in_process = True

    def __post_init__(self):
        self.settings = {}
        every_body = "bodies" in self.parts
        self.native = replace(kincheck.adapters.engine("native"), every_body=every_body)

    @property
    def parts(self):
        """What is changed: the case that is solved (model), the trajectory (answer)."""
        return KNOWN[self.fault]

    def version(self):
        return "1.0"

    def unsupported(self, case):
        known = all(joint.type != "unknown_to_engines" for joint in case.mechanism.joints)
        return None if known else "joint 'tested' is of an unknown type"

    def build(self, case):
        change = self.parts.get("model")
        return self.native.build(change(case) if change else case)

    def solve(self, model, case, tol):
        found, change = self.native.solve(model, case, tol), self.parts.get("answer")
        return change(found, case) if change else found


def changed(found, **parts):
    """The trajectory with other parts."""
    other = object.__new__(Trajectory)
    other.__dict__.update(found.__dict__, **parts)
    return other


def values_of(kind, changes):
    """A function that changes quantities of all points or bodies by functions of them (n, 3)."""

    def answer(found, case):
        moved = {
            name: replace(each, **{key: to(getattr(each, key)) for key, to in changes.items()})
            for name, each in getattr(found, kind).items()
        }
        return changed(found, **{kind: moved})

    return answer


# Of the answer


def points(**changes):
    return {"answer": values_of("points", changes)}


def bodies(**changes):
    return {"answer": values_of("bodies", changes), "bodies": True}


def part(**changes):
    """A change of parts of the trajectory, by functions of their values."""
    return {
        "answer": lambda found, case: changed(
            found, **{key: change(getattr(found, key)) for key, change in changes.items()}
        )
    }


def forces(**changes):
    """A change of parts of the forces, by functions of them."""

    def change(given):
        parts = {key: to(getattr(given, key)) for key, to in changes.items()}
        return replace(given, **parts)

    return all_forces(change)


def all_forces(change):
    """A change of the forces, by a function of them all."""
    return part(forces=lambda given: given and change(given))


def members(kind, change):
    """A change of all reactions, efforts or element forces, by a function of each."""
    return forces(**{kind: lambda given: {name: change(x) for name, x in given.items()}})


def of(part, change):
    """A change of force or moment of every reaction, by a function of its values."""
    return members("joints", lambda each: replace(each, **{part: change(getattr(each, part))}))


def late(x):
    """Values of the sample before."""
    return np.roll(x, 1, axis=0)


def once(x):
    """One sample that is wrong."""
    other = np.array(x)
    other[len(other) // 2] += 1e-6 + 1e-3 * np.abs(other[len(other) // 2])
    return other


def exchanged(given):
    """Values by name, with the first two names exchanged."""
    names, values = [*given], [*given.values()]
    order = [1, 0, *range(2, len(names))] if len(names) > 1 else [0]
    return {name: values[k] for name, k in zip(names, order, strict=False)}


def fewer(given):
    """Without the last name."""
    return dict([*given.items()][:-1])


def about_origin(each):
    """A moment about the global origin at design."""
    arm = np.array([0.2, -0.1, 0.2])
    return replace(each, moment=each.moment + np.cross(arm, each.force))


# Of the model


def mechanism(change):
    """A change of the mechanism that is solved."""
    return {"model": lambda case: replace(case, mechanism=change(case.mechanism))}


def some_members(kind, is_chosen, changes):
    """A change of some bodies or force elements, by functions of their attributes."""

    def change(given):
        members = [
            replace(x, **{key: to(getattr(x, key)) for key, to in changes.items()})
            if is_chosen(x)
            else x
            for x in getattr(given, kind)
        ]
        return replace(given, **{kind: members})

    return mechanism(change)


def each_body(**changes):
    """A change of every body with mass."""
    return some_members("bodies", lambda body: body.mass and not body.fixed, changes)


def each_element(kind, **changes):
    """A change of every force element of a kind."""
    return some_members("forces", lambda each: isinstance(each, kind), changes)


def other_gravity(factor):
    return mechanism(lambda given: replace(given, gravity=tuple(factor * x for x in given.gravity)))


def diagonal(inertia):
    return (*inertia[:3], 0.0, 0.0, 0.0) if inertia else inertia


def other_signs(inertia):
    return (*inertia[:3], *(-x for x in inertia[3:])) if inertia else inertia


def moments_exchanged(inertia):
    return (inertia[1], inertia[0], *inertia[2:]) if inertia else inertia


def reversed_driven_axes(given):
    """Driven joints about the opposite axis."""
    driven = {
        each.joint for each in given.drivers if isinstance(each, JointAngle | JointDisplacement)
    }
    return replace(
        given,
        joints=[
            replace(joint, axis=tuple(-x for x in joint.axis)) if joint.name in driven else joint
            for joint in given.joints
        ],
    )


def other_motions(change):
    def model(case):
        sweep = case.sweep
        moved = {name: change(each) for name, each in sweep.motions.items()}
        return replace(case, sweep=replace(sweep, motions=moved))

    return {"model": model}


def other_rate(change):
    def model(case):
        sweep = case.sweep
        return (
            case if sweep.motions else replace(case, sweep=replace(sweep, rate=change(sweep.rate)))
        )

    return {"model": model}


def frozen_beyond(found, case):
    """The last pose for all samples that cannot be reached."""
    if found.solved.all():
        return found
    moved = values_of("points", dict.fromkeys(QUANTITIES, np.nan_to_num))(found, case)
    return changed(moved, solved=np.ones_like(found.solved), message="")


def lost_last(found, case):
    solved = found.solved.copy()
    solved[-1] = False
    return changed(found, solved=solved, message="")


def without_accelerations_of_drives(given):
    """A sine taken as its tangent at time zero: position and rate are then wrong too, later."""
    from kincheck.core.mechanism.motions import Ramp

    if not isinstance(given, Sine):
        return given
    return Ramp(given.amplitude * 2.0 * math.pi * given.frequency * math.cos(given.phase))


def raises(found, case):
    raise FloatingPointError("overflow")


def noise(found, case):
    random = np.random.default_rng().random
    return values_of("points", {"position": lambda x: x + 1e-15 * random(x.shape)})(found, case)


class Counting:
    """A state that outlives the case."""

    solved = 0

    def __call__(self, found, case):
        self.solved += 1
        later = {"position": lambda x: x + 1e-15 * self.solved}
        return values_of("points", later)(found, case)


def undetermined(given):
    n = len(given.force)
    return replace(given, free=np.broadcast_to(np.eye(6), (n, 6, 6)).copy())


POSITIONS = {
    "shifted": lambda x: x + 1e-6,
    "too long by a ten-millionth": lambda x: x * (1.0 + 1e-7),
    "one axis negative": lambda x: x * np.array([1.0, -1.0, 1.0]),
    "axes exchanged": lambda x: x[:, [1, 0, 2]],
    "of the sample before": late,
    "reversed": lambda x: x[::-1].copy(),
    "one sample wrong": once,
    "still": lambda x: np.tile(x[:1], (len(x), 1)),
    "in millimetres": lambda x: 1e3 * x,
    "displacements": lambda x: x - x[len(x) // 2],
    "in single precision": lambda x: x.astype(np.float32),
    "rounded to eight digits": lambda x: np.round(x, 8),
}
RATES = {
    "negative": lambda x: -x,
    "zero": lambda x: 0.0 * x,
    "off by a thousandth": lambda x: 1.001 * x,
    "off by ten millionths": lambda x: (1.0 + 1e-5) * x,
    "of the sample before": late,
    "one axis zero": lambda x: x * np.array([1.0, 1.0, 0.0]),
    "one sample wrong": once,
    "in degrees": lambda x: np.degrees(x),
}
SERIES = {
    "negative": lambda x: -x,
    "zero": lambda x: 0.0 * x,
    "off by a millionth": lambda x: (1.0 + 1e-6) * x,
    "of the sample before": late,
    "reversed": lambda x: x[::-1].copy(),
    "one sample wrong": once,
    "missing": lambda x: x * math.nan,
    "in thousands": lambda x: 1e-3 * x,
    "of the first sample": lambda x: np.repeat(x[:1], len(x), axis=0),
}


def answer(change):
    return {"answer": change}


OF_MOTION = {
    **{f"position {k}": points(position=f) for k, f in POSITIONS.items()},
    **{f"velocity {k}": points(velocity=f) for k, f in RATES.items()},
    **{f"acceleration {k}": points(acceleration=f) for k, f in RATES.items()},
    "velocity complex": points(velocity=lambda x: x + 0j),
    **{
        f"{quantity} by driver unit": answer(
            lambda x, case, quantity=quantity, order=order: values_of(
                "points", {quantity: lambda each: each / case.sweep.rate**order}
            )(x, case)
        )
        for order, quantity in enumerate(QUANTITIES[1:], 1)
    },
    "points exchanged": part(points=lambda x: exchanged(dict(x))),
    "a point missing": part(points=lambda x: fewer(dict(x))),
    "residual of a thousandth": part(residual=lambda x: 1e-3),
    "solved nowhere": part(solved=lambda x: x & False),
    "last sample lost": answer(lost_last),
    "no message beyond a fold": part(message=lambda x: ""),
    "frozen beyond a fold": answer(frozen_beyond),
    "an error": answer(raises),
    "a freedom more": answer(
        lambda x, case: changed(x, details={**x.details, "dof": x.details["dof"] + 1})
    ),
    "noise": answer(noise),
    "a state": answer(Counting()),
    "bodies shifted": bodies(r=lambda x: x + 1e-6),
    "bodies of the sample before": bodies(p=late),
    "bodies turned backwards": bodies(p=lambda x: x * np.array([1.0, -1.0, -1.0, -1.0])),
    "velocities of bodies negative": bodies(v=lambda x: -x),
    "spins of bodies in global axes": bodies(v=lambda x: np.hstack([x[:, :3], 1.01 * x[:, 3:]])),
    "accelerations of bodies zero": bodies(a=lambda x: 0.0 * x),
    "axes reversed": mechanism(reversed_driven_axes),
    "motions ramps": other_motions(without_accelerations_of_drives),
    "motions without phase": other_motions(
        lambda x: replace(x, phase=0.0) if isinstance(x, Sine) else x
    ),
    "rate one": other_rate(lambda x: 1.0),
    "rate backwards": other_rate(lambda x: -x),
}
"""Faults of motion and manners by name: the parts of `Wrapped`."""

OF_FORCES = {
    **{f"force {k}": of("force", f) for k, f in SERIES.items()},
    **{f"moment {k}": of("moment", f) for k, f in SERIES.items()},
    **{f"effort {k}": members("drivers", f) for k, f in SERIES.items()},
    **{f"element {k}": members("elements", f) for k, f in SERIES.items()},
    "reaction on the first body": members(
        "joints", lambda x: replace(x, force=-x.force, moment=-x.moment)
    ),
    "moment about the origin": members("joints", about_origin),
    "force axes exchanged": of("force", lambda x: x[:, [1, 2, 0]]),
    "moment axes exchanged": of("moment", lambda x: x[:, [1, 2, 0]]),
    "force for moment": members("joints", lambda x: replace(x, moment=x.force)),
    "reactions exchanged": forces(joints=exchanged),
    "a reaction missing": forces(joints=fewer),
    "an effort missing": forces(drivers=fewer),
    "efforts exchanged": forces(drivers=exchanged),
    "an element missing": forces(elements=fewer),
    "elements exchanged": forces(elements=exchanged),
    "no forces": part(forces=lambda x: None),
    "all called determined": members(
        "joints", lambda x: replace(x, free=np.zeros((len(x.force), 6, 0)))
    ),
    "all called undetermined": members("joints", undetermined),
    "power off by 100 W": forces(power=lambda x: x + 100.0),
    "power off at one sample": forces(power=once),
    "power left out": forces(power=lambda x: x * math.nan),
    "power of nothing": forces(power=lambda x: 0.0 * x, largest_power=lambda x: 0.0 * x),
    "power of drivers alone": all_forces(
        lambda x: replace(x, power=x.power + sum(x.drivers.values(), 0.0))
    ),
    "largest power without limit": forces(largest_power=lambda x: x + math.inf),
    "no gravity": other_gravity(0.0),
    "gravity upwards": other_gravity(-1.0),
    "gravity of the Moon": other_gravity(0.165),
    "half the mass": each_body(mass=lambda x: 0.5 * x),
    "no inertia": each_body(inertia=lambda x: None),
    "inertia without products": each_body(inertia=diagonal),
    "products with the other sign": each_body(inertia=other_signs),
    "moments of inertia exchanged": each_body(inertia=moments_exchanged),
    "centre of mass at the origin": each_body(center_of_mass=lambda x: (0.0, 0.0, 0.0)),
    "springs without damping": each_element(SpringDamper, damping=lambda x: 0.0),
    "springs too stiff": each_element(SpringDamper, stiffness=lambda x: 1.001 * x),
    "springs without free length": each_element(SpringDamper, free_length=lambda x: 0.0),
    "torsion without damping": each_element(TorsionSpringDamper, damping=lambda x: 0.0),
    "torsion from zero": each_element(TorsionSpringDamper, free_angle=lambda x: 0.0),
    "forces all global": each_element(Force, frame=lambda x: "global"),
    "forces all on bodies": each_element(Force, frame=lambda x: "body"),
    "torques all global": each_element(Torque, frame=lambda x: "global"),
    "torques all on bodies": each_element(Torque, frame=lambda x: "body"),
    "forces at the origin": each_element(Force, point=lambda x: (0.0, 0.0, 0.0)),
    "elements left out": mechanism(lambda x: replace(x, forces=x.forces[:1])),
}
"""Faults of forces and loads."""

FAULTS = OF_MOTION | OF_FORCES

HARMLESS = {
    "velocity never given": (
        points(velocity=lambda x: None, acceleration=lambda x: None),
        "an engine may give positions alone; the rows of rates are skipped",
    ),
    "residual zero": (part(residual=lambda x: 0.0), "no outsider knows the residual"),
    "more iterations": (part(iterations=lambda x: 2 * x), "nor how many iterations it took"),
    "another rank": (
        answer(lambda x, case: changed(x, details={**x.details, "rank": 1})),
        "the rank is that of the engine's own rows, which differ",
    ),
    "power zero": (
        forces(power=lambda x: 0.0 * x),
        "the power is zero but for round-off, with right efforts",
    ),
    "parameters of the other sign": (bodies(p=lambda x: -x), "they mean the same attitude"),
}

KNOWN = {
    "": {},
    "no fault, with bodies": {"bodies": True},
    **FAULTS,
    **{name: parts for name, (parts, _) in HARMLESS.items()},
}
"""All changes by name."""
