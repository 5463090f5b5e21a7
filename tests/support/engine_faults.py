"""Faults of engines, one each: of the model that is built, of the trajectory that is returned, and
of the manners of an engine.

`FAULTS` must be found by check-engine. `HARMLESS` cannot be told from a sound engine, for the
reason that stands beside each.
"""

import math
from dataclasses import dataclass, replace

import kincheck.adapters
import numpy as np
from kincheck.core.mechanism.loads import Force, SpringDamper, Torque, TorsionSpringDamper
from kincheck.core.mechanism.motions import JointAngle, JointDisplacement, Sine
from kincheck.core.trajectory import QUANTITIES, Trajectory


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


def each_of(kind, changes):
    """A change of quantities of all points or bodies, by functions of their values (n, 3)."""

    def answer(found, case):
        moved = {
            name: replace(each, **{key: to(getattr(each, key)) for key, to in changes.items()})
            for name, each in getattr(found, kind).items()
        }
        return changed(found, **{kind: moved})

    return answer


def points(**changes):
    return each_of("points", changes)


def bodies(**changes):
    return each_of("bodies", changes)


def forces(change):
    """A change of the forces, by a function of them."""
    return lambda found, case: (
        found if found.forces is None else changed(found, forces=change(found.forces))
    )


def members(part, change):
    """A change of all reactions, efforts or element forces, by a function of each."""
    return forces(
        lambda given: replace(
            given, **{part: {name: change(x) for name, x in getattr(given, part).items()}}
        )
    )


def joints(change):
    """A change of every reaction, by a function of it."""
    return members("joints", change)


def of(part, change):
    """A change of force or moment of every reaction, by a function of its values."""
    return joints(lambda each: replace(each, **{part: change(getattr(each, part))}))


def part(**changes):
    """A change of parts of the trajectory, by functions of their values."""
    return lambda found, case: changed(
        found, **{key: change(getattr(found, key)) for key, change in changes.items()}
    )


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


def mechanism(change):
    """A change of the mechanism that is solved."""
    return lambda case: replace(case, mechanism=change(case.mechanism))


def each_body(**changes):
    """A change of every body with mass."""
    return mechanism(
        lambda given: replace(
            given,
            bodies=[
                replace(
                    body,
                    **{key: change(getattr(body, key)) for key, change in changes.items()},
                )
                if body.mass and not body.fixed
                else body
                for body in given.bodies
            ],
        )
    )


def each_element(kind, **changes):
    """A change of every force element of a kind."""
    return mechanism(
        lambda given: replace(
            given,
            forces=[
                replace(each, **{key: to(getattr(each, key)) for key, to in changes.items()})
                if isinstance(each, kind)
                else each
                for each in given.forces
            ],
        )
    )


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

    return model


def other_rate(change):
    return lambda case: (
        case
        if case.sweep.motions
        else replace(case, sweep=replace(case.sweep, rate=change(case.sweep.rate)))
    )


def frozen_beyond(found, case):
    """The last pose for all samples that cannot be reached."""
    if found.solved.all():
        return found
    moved = points(**dict.fromkeys(QUANTITIES, np.nan_to_num))(found, case)
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
    return points(position=lambda x: x + 1e-15 * random(x.shape))(found, case)


class Counting:
    """A state that outlives the case."""

    solved = 0

    def __call__(self, found, case):
        self.solved += 1
        return points(position=lambda x: x + 1e-15 * self.solved)(found, case)


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


def model(change):
    return {"model": change}


def answer(change):
    return {"answer": change}


OF_MOTION = {
    **{f"position {k}": answer(points(position=f)) for k, f in POSITIONS.items()},
    **{f"velocity {k}": answer(points(velocity=f)) for k, f in RATES.items()},
    **{f"acceleration {k}": answer(points(acceleration=f)) for k, f in RATES.items()},
    "velocity complex": answer(points(velocity=lambda x: x + 0j)),
    "velocity by driver unit": answer(
        lambda x, case: points(velocity=lambda v: v / case.sweep.rate)(x, case)
    ),
    "acceleration by driver unit": answer(
        lambda x, case: points(acceleration=lambda a: a / case.sweep.rate**2)(x, case)
    ),
    "points exchanged": answer(part(points=lambda x: exchanged(dict(x)))),
    "a point missing": answer(part(points=lambda x: fewer(dict(x)))),
    "residual of a thousandth": answer(part(residual=lambda x: 1e-3)),
    "solved nowhere": answer(part(solved=lambda x: x & False)),
    "last sample lost": answer(lost_last),
    "no message beyond a fold": answer(part(message=lambda x: "")),
    "frozen beyond a fold": answer(frozen_beyond),
    "an error": answer(raises),
    "a freedom more": answer(
        lambda x, case: changed(x, details={**x.details, "dof": x.details["dof"] + 1})
    ),
    "noise": answer(noise),
    "a state": answer(Counting()),
    "bodies shifted": answer(bodies(r=lambda x: x + 1e-6)) | {"bodies": True},
    "bodies of the sample before": answer(bodies(p=late)) | {"bodies": True},
    "bodies turned backwards": answer(bodies(p=lambda x: x * np.array([1.0, -1.0, -1.0, -1.0])))
    | {"bodies": True},
    "velocities of bodies negative": answer(bodies(v=lambda x: -x)) | {"bodies": True},
    "spins of bodies in global axes": answer(
        bodies(v=lambda x: np.hstack([x[:, :3], 1.01 * x[:, 3:]]))
    )
    | {"bodies": True},
    "accelerations of bodies zero": answer(bodies(a=lambda x: 0.0 * x)) | {"bodies": True},
    "axes reversed": model(mechanism(reversed_driven_axes)),
    "motions ramps": model(other_motions(without_accelerations_of_drives)),
    "motions without phase": model(
        other_motions(lambda x: replace(x, phase=0.0) if isinstance(x, Sine) else x)
    ),
    "rate one": model(other_rate(lambda x: 1.0)),
    "rate backwards": model(other_rate(lambda x: -x)),
}
"""Faults of motion and manners by name: the parts of `Wrapped`."""

OF_FORCES = {
    **{f"force {k}": answer(of("force", f)) for k, f in SERIES.items()},
    **{f"moment {k}": answer(of("moment", f)) for k, f in SERIES.items()},
    **{f"effort {k}": answer(members("drivers", f)) for k, f in SERIES.items()},
    **{f"element {k}": answer(members("elements", f)) for k, f in SERIES.items()},
    "reaction on the first body": answer(
        joints(lambda x: replace(x, force=-x.force, moment=-x.moment))
    ),
    "moment about the origin": answer(joints(about_origin)),
    "force axes exchanged": answer(of("force", lambda x: x[:, [1, 2, 0]])),
    "moment axes exchanged": answer(of("moment", lambda x: x[:, [1, 2, 0]])),
    "force for moment": answer(joints(lambda x: replace(x, moment=x.force))),
    "reactions exchanged": answer(forces(lambda x: replace(x, joints=exchanged(x.joints)))),
    "a reaction missing": answer(forces(lambda x: replace(x, joints=fewer(x.joints)))),
    "an effort missing": answer(forces(lambda x: replace(x, drivers=fewer(x.drivers)))),
    "efforts exchanged": answer(forces(lambda x: replace(x, drivers=exchanged(x.drivers)))),
    "an element missing": answer(forces(lambda x: replace(x, elements=fewer(x.elements)))),
    "elements exchanged": answer(forces(lambda x: replace(x, elements=exchanged(x.elements)))),
    "no forces": answer(part(forces=lambda x: None)),
    "all called determined": answer(
        joints(lambda x: replace(x, free=np.zeros((len(x.force), 6, 0))))
    ),
    "all called undetermined": answer(joints(undetermined)),
    "power off by 100 W": answer(forces(lambda x: replace(x, power=x.power + 100.0))),
    "power off at one sample": answer(forces(lambda x: replace(x, power=once(x.power)))),
    "power left out": answer(forces(lambda x: replace(x, power=x.power * math.nan))),
    "power of nothing": answer(
        forces(lambda x: replace(x, power=0.0 * x.power, largest_power=0.0 * x.power))
    ),
    "power of drivers alone": answer(
        forces(lambda x: replace(x, power=x.power + sum(x.drivers.values(), 0.0)))
    ),
    "largest power without limit": answer(
        forces(lambda x: replace(x, largest_power=x.power + math.inf))
    ),
    "no gravity": model(other_gravity(0.0)),
    "gravity upwards": model(other_gravity(-1.0)),
    "gravity of the Moon": model(other_gravity(0.165)),
    "half the mass": model(each_body(mass=lambda x: 0.5 * x)),
    "no inertia": model(each_body(inertia=lambda x: None)),
    "inertia without products": model(each_body(inertia=diagonal)),
    "products with the other sign": model(each_body(inertia=other_signs)),
    "moments of inertia exchanged": model(each_body(inertia=moments_exchanged)),
    "centre of mass at the origin": model(each_body(center_of_mass=lambda x: (0.0, 0.0, 0.0))),
    "springs without damping": model(each_element(SpringDamper, damping=lambda x: 0.0)),
    "springs too stiff": model(each_element(SpringDamper, stiffness=lambda x: 1.001 * x)),
    "springs without free length": model(each_element(SpringDamper, free_length=lambda x: 0.0)),
    "torsion without damping": model(each_element(TorsionSpringDamper, damping=lambda x: 0.0)),
    "torsion from zero": model(each_element(TorsionSpringDamper, free_angle=lambda x: 0.0)),
    "forces all global": model(each_element(Force, frame=lambda x: "global")),
    "forces all on bodies": model(each_element(Force, frame=lambda x: "body")),
    "torques all global": model(each_element(Torque, frame=lambda x: "global")),
    "torques all on bodies": model(each_element(Torque, frame=lambda x: "body")),
    "forces at the origin": model(each_element(Force, point=lambda x: (0.0, 0.0, 0.0))),
    "elements left out": model(mechanism(lambda x: replace(x, forces=x.forces[:1]))),
}
"""Faults of forces and loads."""

FAULTS = OF_MOTION | OF_FORCES

HARMLESS = {
    "velocity never given": (
        answer(points(velocity=lambda x: None, acceleration=lambda x: None)),
        "an engine may give positions alone; the rows of rates are skipped",
    ),
    "residual zero": (answer(part(residual=lambda x: 0.0)), "no outsider knows the residual"),
    "more iterations": (
        answer(part(iterations=lambda x: 2 * x)),
        "nor how many iterations it took",
    ),
    "another rank": (
        answer(lambda x, case: changed(x, details={**x.details, "rank": 1})),
        "the rank is that of the engine's own rows, which differ",
    ),
    "power zero": (
        answer(forces(lambda x: replace(x, power=0.0 * x.power))),
        "the power is zero but for round-off, with right efforts",
    ),
    "parameters of the other sign": (
        answer(bodies(p=lambda x: -x)) | {"bodies": True},
        "they mean the same attitude",
    ),
}

KNOWN = {
    "": {},
    "no fault, with bodies": {"bodies": True},
    **FAULTS,
    **{name: parts for name, (parts, _) in HARMLESS.items()},
}
"""All changes by name."""
