"""Written models as their simulators read them: no adapter has a part in it."""

import importlib
import json
import runpy
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from ..oracles import naive


@dataclass(frozen=True)
class Reading:
    """What a simulator makes of a file.

    Attributes:
        residuals: of its own constraints, at the start.
        freedom: its coordinates less the rank of their Jacobian.
        bodies: origin and rotation matrix, by name.
        points: positions, by name.
    """

    residuals: Any
    freedom: int
    bodies: dict[str, tuple[Any, Any]]
    points: dict[str, Any]


def _rank(J, part):
    """Singular values of an exact Jacobian end at round-off, of a difference quotient at its error:
    parts of the largest.
    """
    return int(np.linalg.matrix_rank(J, tol=part * np.linalg.norm(J, 2))) if J.size else 0


def _mjcf(texts, mechanism, folder):
    mj = importlib.import_module("mujoco")
    model = mj.MjModel.from_xml_string(texts[".xml"])
    model.opt.jacobian = mj.mjtJacobian.mjJAC_DENSE
    data = mj.MjData(model)
    mj.mj_resetDataKeyframe(model, data, model.key("start").id)
    mj.mj_forward(model, data)
    J = data.efc_J.reshape(-1, model.nv)[: data.ne]
    return Reading(
        data.efc_pos[: data.ne].copy(),
        model.nv - _rank(J, 1e-10),
        {
            body.name: (data.body(body.name).xpos, data.body(body.name).xmat.reshape(3, 3))
            for body in mechanism.bodies
        },
        {point.name: data.site(point.name).xpos for point in mechanism.points},
    )


def _exudyn(texts, mechanism, folder):
    exu = importlib.import_module("exudyn")
    exu.config.printToConsole = False
    script = folder / "model.py"
    script.write_text(texts[".py"], encoding="utf-8")
    model = runpy.run_path(str(script))
    mbs = model["mbs"]
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    solver = exu.MainSolverStatic()
    assert solver.InitializeSolver(mbs, settings)
    solver.ComputeAlgebraicEquations(mbs)
    solver.ComputeNewtonJacobian(mbs, settings)
    n = solver.GetODE2size()
    kinds = exu.OutputVariableType
    bodies = {
        name: (
            mbs.GetNodeOutput(node, kinds.Position),
            mbs.GetNodeOutput(node, kinds.RotationMatrix).reshape(3, 3) @ naive.A(frame),
        )
        for (name, node), frame in zip(
            model["nodes"].items(), model["frames"].values(), strict=True
        )
    }
    points = {
        name: mbs.GetObjectOutputBody(body, kinds.Position, local)
        for name, (body, local) in model["points"].items()
    }
    return Reading(
        solver.GetSystemResidual()[n:].copy(),
        n - _rank(solver.GetSystemJacobian()[n:, :n], 1e-10),
        bodies,
        points,
    )


def _urdf(texts, mechanism, folder):
    """The tree is Pinocchio's; the equations are those that the JSON file says in words."""
    pin = importlib.import_module("pinocchio")
    model, beside = pin.buildModelFromXML(texts[".urdf"]), json.loads(texts[".constraints.json"])
    data, q = model.createData(), pin.neutral(model)
    assert model.nq == sum(map(len, beside["start"]["coordinates"].values()))
    for name, values in beside["start"]["coordinates"].items():
        joint = model.getJointId(name)
        q[model.idx_qs[joint] :][: model.nqs[joint]] = values

    def link(name):  # a joint may have the same name
        return data.oMf[model.getFrameId(name, pin.FrameType.BODY)]

    def point(end):
        return link(end["link"]).act(np.array(end["point"]))

    def axis(vector):
        return link(vector["link"]).rotation @ vector["direction"]

    def equation(each, q):
        match each["kind"]:
            case "coincident":
                return point(each["j"]) - point(each["i"])
            case "distance":
                return [np.linalg.norm(point(each["j"]) - point(each["i"])) - each["value"]]
            case "directions":
                return [axis(each["x"]) @ axis(each["y"]) - each["value"]]
            case "offset":
                return [axis(each["x"]) @ (point(each["j"]) - point(each["i"])) - each["value"]]
            case "linear":
                return [
                    sum(
                        weight * q[model.idx_qs[model.getJointId(name)]]
                        for name, weight in each["weights"].items()
                    )
                ]
            case "polynomial":
                driven, driving = (
                    q[model.idx_qs[model.getJointId(each[name])]] for name in ("driven", "driving")
                )
                return [driven - np.polynomial.Polynomial(each["coefficients"])(driving)]

    def residuals(q):
        pin.framesForwardKinematics(model, data, q)
        return np.array([r for each in beside["constraints"] for r in equation(each, q)])

    h = 1e-6
    J = np.array(
        [
            (residuals(pin.integrate(model, q, h * e)) - residuals(pin.integrate(model, q, -h * e)))
            / (2.0 * h)
            for e in np.eye(model.nv)
        ]
    )
    found = residuals(q)
    bodies = {}
    for name, frame in beside["bodies"].items():
        bodies[name] = (
            link(frame["link"]).act(np.array(frame["origin"])),
            link(frame["link"]).rotation @ naive.A(frame["euler_parameters"]),
        )
    points = {each.name: link(f"point.{each.name}").translation for each in mechanism.points}
    return Reading(found, model.nv - _rank(J, 1e-7), bodies, points)


READERS = {"mjcf": ("mujoco", _mjcf), "exudyn": ("exudyn", _exudyn), "urdf": ("pinocchio", _urdf)}


def read(name, texts, mechanism, folder):
    """What the simulator of a format makes of its files."""
    simulator, reader = READERS[name]
    pytest.importorskip(simulator, reason=f"{simulator} is not installed")
    return reader(texts, mechanism, folder)
