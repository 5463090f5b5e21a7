"""The programs of a sweep, traced from the equations: predict, newton, motion and outputs share one block of lanes.

    predict   state, v, a, h             -> state           Taylor step of second order over the time h
    newton    state, drives              -> state, residual, pivot        one Newton-Raphson iteration; residual is that before it
    motion    state, drives' rates       -> v, a            one factorisation at the converged pose, solved for nu and gamma
    outputs   state, v, a                -> wanted motions, leftover, branch

Each is traced for what is asked: no acceleration, no gamma; no velocity, no factorisation after the last iteration.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

from ..algebra import Quat, Scalar, Vec3, cross, turned_by, vec
from ..mechanism import GROUND, Mechanism
from ..primitives.base import GROUND_MOTION, GROUND_POSE, Drive, Motion, Pose
from ..program import Elimination, Program, Tape, absolute, maximum, minimum, program, sqrt
from .equations import COLUMNS, Assembly, Frames, constraints
from .freedom import Selection


@dataclass(frozen=True)
class Request:
    """What a sweep is to give.

    Attributes:
        driver: the swept driver; the others hold their design value.
        points, bodies: names whose motion is wanted.
        order: 0 positions, 1 and velocities, 2 and accelerations.
    """

    driver: str
    points: tuple[str, ...]
    bodies: tuple[str, ...] = ()
    order: int = 2


STATE = ("u", "q")
"""The vectors that make up a pose: displacement and Euler parameters."""


class Layout:
    """Where everything stands in a lane: slots are numbered as they are first asked for."""

    def __init__(self) -> None:
        self.slots: dict[str, int] = {}
        self.vectors: dict[str, list[int]] = {}

    def scalar(self, name: str) -> int:
        """The slot of a scalar."""
        return self.slots.setdefault(name, len(self.slots))

    def vector(self, name: str, count: int = 3) -> list[int]:
        """The slots of a vector's components."""
        return self.vectors.setdefault(name, [self.scalar(f"{name}.{k}") for k in range(count)])


class Tracer:
    """One tape for all programs: what they share is written down once."""

    def __init__(self, mechanism: Mechanism, request: Request, selection: Selection, frame: Frames) -> None:
        self.mechanism, self.request, self.selection, self.frame = mechanism, request, selection, frame
        self.tape, self.layout = Tape(), Layout()
        self.names = [body.name for body in mechanism.moving]
        self.poses = {name: self._pose(name) for name in self.names}
        drive = Drive(self._in("c"), self._in("c_t"), 0.0, self._in("half_cos"), self._in("half_sin"))
        self.assembly = Assembly.of(constraints(mechanism, frame, {request.driver: drive}), self.names)
        self.rows = self.assembly.rows(self.poses)

    def _in(self, name: str) -> Scalar:
        return self.tape.input(self.layout.scalar(name))

    def _vector(self, name: str) -> Vec3:
        return vec([self.tape.input(slot) for slot in self.layout.vector(name)])

    def _pose(self, name: str) -> Pose:
        e0, *e = (self.tape.input(slot) for slot in self.layout.vector(f"q {name}", 4))
        return Pose.of(self._vector(f"u {name}"), Quat(e0, vec(e)))

    def _motion(self, name: str) -> Motion:
        return Motion(self._vector(f"v {name}"), self._vector(f"w {name}"))

    def _store(self, out: dict[int, Scalar], name: str, value: Vec3 | Quat) -> None:
        scalars = list(value)
        out.update(zip(self.layout.vector(name, len(scalars)), scalars, strict=True))

    def _store_pose(self, out: dict[int, Scalar], name: str, u: Vec3, q: Quat) -> None:
        self._store(out, f"u {name}", u)
        self._store(out, f"q {name}", q)

    def _kept(self, values: Sequence[Scalar]) -> list[Scalar]:
        return [values[k] for k in self.selection.kept]

    def newton(self) -> Program:
        phi = self._kept(self.assembly.phi(self.poses))
        factor = Elimination([self.rows[k] for k in self.selection.kept])
        step = factor.solve(phi)
        out: dict[int, Scalar] = {
            self.layout.scalar("residual"): _largest(phi),
            self.layout.scalar("pivot"): reduce(minimum, (absolute(x) for x in factor.pivots), 1.0),
        }
        for name, k in self.assembly.columns.items():
            dr, dpi = vec(step[k : k + 3]), vec(step[k + 3 : k + COLUMNS])
            pose = self.poses[name]
            self._store_pose(out, name, pose.u - dr, turned_by(pose.q, -0.5 * dpi, sqrt))
        return program("newton", self.tape, out)

    def motion(self, name: str, order: int) -> Program:
        factor = Elimination([self.rows[k] for k in self.selection.kept])
        out: dict[int, Scalar] = {}
        v = factor.solve(self._kept(self.assembly.nu()))
        motions = {body: Motion(vec(v[k : k + 3]), vec(v[k + 3 : k + 6])) for body, k in self.assembly.columns.items()}
        for body, motion in motions.items():
            self._store(out, f"v {body}", motion.v)
            self._store(out, f"w {body}", motion.w)
        if order == 2:
            a = factor.solve(self._kept(self.assembly.gamma(self.poses, motions)))
            for body, k in self.assembly.columns.items():
                self._store(out, f"v_t {body}", vec(a[k : k + 3]))
                self._store(out, f"w_t {body}", vec(a[k + 3 : k + COLUMNS]))
        return program(name, self.tape, out)

    def predict(self) -> Program:
        h = self._in("h")
        out: dict[int, Scalar] = {}
        for name, pose in self.poses.items():
            motion, v_t, w_t = self._motion(name), self._vector(f"v_t {name}"), self._vector(f"w_t {name}")
            half = (0.5 * h) * (motion.w + (0.5 * h) * w_t)
            # tan x = x + x^3 / 3: turned_by takes the tangent of half the angle
            tangent = (1.0 + (1.0 / 3.0) * (half @ half)) * half
            u = pose.u + h * (motion.v + (0.5 * h) * v_t)
            self._store_pose(out, name, u, turned_by(pose.q, tangent, sqrt))
        return program("predict", self.tape, out)

    def outputs(self) -> Program:
        phi = self.assembly.phi(self.poses)
        out: dict[int, Scalar] = {
            self.layout.scalar("closure"): _largest(self._kept(phi)),
            self.layout.scalar("leftover"): _largest([phi[k] for k in self.selection.dropped]),
            self.layout.scalar("branch"): reduce(minimum, self.assembly.branch(self.poses), 1.0),
        }
        for name in self.request.points:
            self._store_point(out, name)
        for name in self.request.bodies:
            self._store_body(out, name)
        return program("outputs", self.tape, out)

    def _store_point(self, out: dict[int, Scalar], name: str) -> None:
        """Position, velocity and acceleration of a point in metres; its displacement is formed first, and added once."""
        point = self.mechanism.point(name)
        pose, motion, v_t, w_t = self._state(point.body)
        arm, metres = self.frame.arm(point.body, point.position), self.frame.unit
        self._store(out, f"position {name}", vec(point.position) + metres * (pose.u + pose.swing(arm)))
        turned = pose.turn(arm)
        if self.request.order >= 1:
            self._store(out, f"velocity {name}", metres * motion.of(turned))
        if self.request.order == 2:
            acceleration = v_t + cross(w_t, turned) + motion.centripetal(turned)
            self._store(out, f"acceleration {name}", metres * acceleration)

    def _store_body(self, out: dict[int, Scalar], name: str) -> None:
        """r, p, [rdot, omega'] and [rddot, omega'dot]: the paper's variables of a body's own frame."""
        body = self.mechanism.body(name)
        pose, motion, v_t, w_t = self._state(name)
        arm, metres = self.frame.arm(name, body.origin), self.frame.unit
        e0, *e = body.euler_parameters
        p = pose.q * Quat(e0, vec(e))
        turned, to_body = pose.turn(arm), Pose.of(arm, p).D
        self._store(out, f"r {name}", vec(body.origin) + metres * (pose.u + pose.swing(arm)))
        self._store(out, f"p {name}", p)
        if self.request.order >= 1:
            self._store(out, f"rdot {name}", metres * motion.of(turned))
            self._store(out, f"omega {name}", motion.w + to_body.transposed_times(motion.w))
        if self.request.order == 2:
            acceleration = v_t + cross(w_t, turned) + motion.centripetal(turned)
            self._store(out, f"rddot {name}", metres * acceleration)
            self._store(out, f"omega_t {name}", w_t + to_body.transposed_times(w_t))

    def _state(self, name: str) -> tuple[Pose, Motion, Vec3, Vec3]:
        if name == GROUND or name not in self.poses:
            return GROUND_POSE, GROUND_MOTION, GROUND_MOTION.v, GROUND_MOTION.w
        return self.poses[name], self._motion(name), self._vector(f"v_t {name}"), self._vector(f"w_t {name}")


def _largest(values: Sequence[Scalar]) -> Scalar:
    return reduce(maximum, (absolute(value) for value in values), 0.0)
