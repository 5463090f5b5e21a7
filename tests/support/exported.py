"""Written models as their simulators read them: no adapter has a part in it."""

import importlib
import json
import re
import runpy
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from ..oracles import naive
from .splines import through


@dataclass(frozen=True)
class Reading:
    """What a simulator makes of a file.

    Attributes:
        residuals: of its own constraints, at the start.
        freedom: its coordinates less the rank of their Jacobian, where they are told.
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


def _mjcf(texts, mechanism, folder, values):
    mj = importlib.import_module("mujoco")
    model = mj.MjModel.from_xml_string(texts[".xml"])
    model.opt.jacobian = mj.mjtJacobian.mjJAC_DENSE
    data = mj.MjData(model)
    mj.mj_resetDataKeyframe(model, data, model.key("start").id)
    for name, value in values.items():
        data.joint(name).qpos[:] = value
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


def _exudyn(texts, mechanism, folder, values):
    exu = importlib.import_module("exudyn")
    exu.config.printToConsole = False
    script = folder / "model.py"
    script.write_text(texts[".py"], "utf-8")
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


def _urdf(texts, mechanism, folder, values):
    """The tree is Pinocchio's; the equations are those that the JSON file says in words."""
    pin = importlib.import_module("pinocchio")
    model, beside = pin.buildModelFromXML(texts[".urdf"]), json.loads(texts[".constraints.json"])
    data, q = model.createData(), pin.neutral(model)
    assert model.nq == sum(map(len, beside["start"]["coordinates"].values()))
    for name, value in (beside["start"]["coordinates"] | values).items():
        joint = model.getJointId(name)
        q[model.idx_qs[joint] :][: model.nqs[joint]] = value

    def link(name):  # a joint may have the same name
        return data.oMf[model.getFrameId(name, pin.FrameType.BODY)]

    def point(end):
        return link(end["link"]).act(np.array(end["point"]))

    def axis(vector):
        return link(vector["link"]).rotation @ vector["direction"]

    def coordinate(name, q):
        return q[model.idx_qs[model.getJointId(name)]]

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
                return [sum(x * coordinate(name, q) for name, x in each["weights"].items())]
            case "polynomial":
                law = np.polynomial.Polynomial(each["coefficients"])
                return [coordinate(each["driven"], q) - law(coordinate(each["driving"], q))]
            case "spline":
                law = through(each["points"])
                return [coordinate(each["driven"], q) - law(coordinate(each["driving"], q))[0]]

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
    bodies = {
        name: _of_link(link(frame["link"]).homogeneous, frame)
        for name, frame in beside["bodies"].items()
    }
    points = {each.name: point(beside["points"][each.name]) for each in mechanism.points}
    return Reading(found, model.nv - _rank(J, 1e-7), bodies, points)


def _of_link(place, frame):
    """A body's origin and rotation matrix, from the place of its link (4, 4)."""
    R = place[:3, :3]
    return R @ frame["origin"] + place[:3, 3], R @ naive.A(frame["euler_parameters"])


def _urdf_in_dart(texts, mechanism, folder, values):
    dart = importlib.import_module("dartpy")
    (file := folder / "model.urdf").write_text(texts[".urdf"])
    loaders = getattr(dart, "io", None) or dart.utils
    skeleton = loaders.DartLoader().parseSkeleton(str(file))
    for name, value in values.items():
        skeleton.getJoint(name).setPosition(0, value)
    frames = json.loads(texts[".constraints.json"])["bodies"]
    bodies = {
        name: _of_link(skeleton.getBodyNode(frame["link"]).getWorldTransform().matrix(), frame)
        for name, frame in frames.items()
    }
    return Reading(np.zeros(0), None, bodies, {})


DRAKE = "{http://drake.mit.edu}"


def _sdf(texts, mechanism, folder, values):
    """The tree is Drake's; its plant does not tell the residuals of its constraints, whose points
    are read from the file.
    """
    plants = importlib.import_module("pydrake.multibody.plant")
    kind = importlib.import_module("pydrake.multibody.tree").JacobianWrtVariable.kV
    plant = plants.MultibodyPlant(1e-3)
    parsing = importlib.import_module("pydrake.multibody.parsing")
    parsing.Parser(plant).AddModelsFromString(texts[".sdf"], "sdf")
    plant.Finalize()
    context, world = plant.CreateDefaultContext(), plant.world_frame()
    for name, value in values.items():
        joint = plant.GetJointByName(name)
        is_hinge = joint.type_name() == "revolute"
        (joint.set_angle if is_hinge else joint.set_translation)(context, value)
    root = ET.fromstring(texts[".sdf"])
    balls = [*root.iter(f"{DRAKE}ball_constraint")]
    mimics = {
        joint.get("name"): mimic
        for joint in root.iter("joint")
        for mimic in joint.iter(f"{DRAKE}mimic")
    }
    assert plant.num_constraints() == len(balls) + len(mimics)

    def end(ball, side):
        body, point = (
            ball.find(f"{DRAKE}ball_constraint_{what}").text
            for what in (f"body_{side[0]}", f"p_{side}")
        )
        frame, p = plant.GetFrameByName(body), np.array(list(map(float, point.split())))
        J = plant.CalcJacobianTranslationalVelocity(context, kind, frame, p, world, world)
        return frame.CalcPoseInWorld(context).multiply(p), J

    found, rows = [], []
    for ball in balls:
        (P, J_P), (Q, J_Q) = (end(ball, side) for side in ("AP", "BQ"))
        found.append(Q - P)
        rows.append(J_Q - J_P)
    q = plant.GetPositions(context)
    for name, mimic in mimics.items():
        one, other = map(plant.GetJointByName, (name, mimic.get("joint")))
        factor, row = float(mimic.get("multiplier")), np.zeros((1, plant.num_velocities()))
        row[0, one.velocity_start()], row[0, other.velocity_start()] = 1.0, -factor
        found.append([q[one.position_start()] - factor * q[other.position_start()]])
        rows.append(row)

    def pose(name):
        return plant.GetFrameByName(name).CalcPoseInWorld(context)

    n = plant.num_velocities()
    return Reading(
        np.concatenate([np.zeros(0), *found]),
        n - _rank(np.concatenate([np.zeros((0, n)), *rows]), 1e-10),
        {
            body.name: (pose(body.name).translation(), pose(body.name).rotation().matrix())
            for body in mechanism.bodies
        },
        {point.name: pose(f"point.{point.name}").translation() for point in mechanism.points},
    )


def _osim(texts, mechanism, folder, values):
    """OpenSim assembles a model that it reads, so its coordinates are set to the file's again."""
    o = importlib.import_module("opensim")
    o.Logger.setLevelString("Off")
    file = folder / "model.osim"
    file.write_text(texts[".osim"], "utf-8")
    model = o.Model(str(file))
    state = model.initSystem()
    for each in model.getCoordinateSet():
        value = values.get(each.getName(), each.getDefaultValue())
        each.setValue(state, value, False)
    model.realizePosition(state)
    G, bodies = o.Matrix(), model.getBodySet()
    model.getMatterSubsystem().calcG(state, G)

    def named(name):  # as OpenSim has it
        return re.sub(r"[^A-Za-z0-9_.-]", "_", name)

    def pose(body):
        place = bodies.get(named(body.name)).getTransformInGround(state)
        R = np.array([[place.R().get(i, j) for j in range(3)] for i in range(3)])
        return place.p().to_numpy(), R

    markers = model.getMarkerSet()
    return Reading(
        state.getQErr().to_numpy(),
        state.getNU() - _rank(G.to_numpy(), 1e-10),
        {body.name: pose(body) for body in mechanism.bodies},
        {
            point.name: markers.get(named(point.name)).getLocationInGround(state).to_numpy()
            for point in mechanism.points
        },
    )


READERS = {
    "mjcf": ("mujoco", _mjcf),
    "exudyn": ("exudyn", _exudyn),
    "urdf": ("pinocchio", _urdf),
    "sdf": ("pydrake", _sdf),
    "osim": ("opensim", _osim),
}


IN_TREES = {each: READERS[each] for each in ("mjcf", "urdf", "sdf", "osim")}
IN_TREES["urdf in dart"] = "dartpy", _urdf_in_dart


def read(name, texts, mechanism, folder, values=None):
    """What the simulator of a format makes of its files, at the start but for given coordinates."""
    simulator, reader = (READERS | IN_TREES)[name]
    pytest.importorskip(simulator, reason=f"{simulator} is not installed")
    return reader(texts, mechanism, folder, values or {})
