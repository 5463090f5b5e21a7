"""Exudyn as a stepper of free motion: one node with Euler parameters a body, GenericJoints with the
independent rows, and its own time integration from start to end.
"""

from importlib import import_module
from typing import Any

import numpy as np

from .stepper_loop import state_of


def version() -> str:
    """Return the version of Exudyn."""
    return str(import_module("exudyn").__version__)


def stepper(model: Any, settings: Any, effort: Any, times: Any) -> Any:
    """Return functions to advance to a sample, and to read the bodies' states there."""
    exu: Any = import_module("exudyn")
    items: Any = import_module("exudyn.itemInterface")
    exu.config.printToConsole = False
    system = exu.SystemContainer().AddSystem()
    number = {"ground": system.AddObject(items.ObjectGround())}
    center = {"ground": np.zeros(3)}
    for body in model["bodies"]:
        c, twist, I = (np.array(body[name]) for name in ("center", "twist", "inertia"))  # noqa: E741
        w, v = twist[:3], twist[3:] + np.cross(twist[:3], c)
        node = items.NodeRigidBodyEP(
            referenceCoordinates=[*c, 1, 0, 0, 0], initialVelocities=[*v, 0, *(0.5 * w)]
        )
        six = I[[0, 1, 2, 1, 0, 0], [0, 1, 2, 2, 2, 1]]
        number[body["name"]] = system.AddObject(
            items.ObjectRigidBody(mass=body["mass"], inertia=six, nodeNumber=system.AddNode(node))
        )
        center[body["name"]] = c
        mass = system.AddMarker(items.MarkerBodyMass(bodyNumber=number[body["name"]]))
        system.AddLoad(items.LoadMassProportional(markerNumber=mass, loadVector=model["gravity"]))

    def marker(body: str, point: Any, turn: Any = None) -> Any:
        frame = np.eye(4)
        frame[:3, 3] = np.array(point) - center[body]
        if turn is not None:
            frame[:3, :3] = turn
        return system.AddMarker(items.MarkerBodyRigid(bodyNumber=number[body], localHT=frame))

    def ends(each: Any, turn: Any = None) -> list[Any]:
        return [marker(*end, turn) for end in zip(each["bodies"], each["points"], strict=True)]

    connectors: dict[str, Any] = {}
    for joint in model["joints"]:
        if joint["type"] == "distance":
            P, Q = map(np.array, joint["points"])
            rod = items.ObjectConnectorDistance(
                markerNumbers=ends(joint), distance=float(np.linalg.norm(Q - P))
            )
            system.AddObject(rod)
            continue
        if not joint["rows"]:
            raise NotImplementedError(f"GenericJoint cannot be {joint['type']} ({joint['name']})")
        made = items.GenericJoint(
            markerNumbers=ends(joint, np.array(joint["frame"]).T), constrainedAxes=joint["rows"]
        )
        connectors[joint["name"]] = system.AddObject(made)
    for each in model["springs"]:
        made = items.SpringDamper(
            markerNumbers=ends(each),
            stiffness=each["stiffness"],
            damping=each["damping"],
            referenceLength=each["free_length"],
        )
        system.AddObject(made)
    for load in model["loads"]:
        at = marker(load["body"], load["point"])
        system.AddLoad(items.LoadForceVector(markerNumber=at, loadVector=load["force"]))
        system.AddLoad(items.LoadTorqueVector(markerNumber=at, loadVector=load["torque"]))
    kinds, wanted = (
        exu.OutputVariableType,
        ("Position", "RotationMatrix", "AngularVelocity", "Velocity"),
    )
    sensors: dict[Any, Any] = {
        (name, what): system.AddSensor(
            items.SensorBody(
                bodyNumber=number[name],
                outputVariableType=getattr(kinds, what),
                storeInternal=True,
                writeToFile=False,
            )
        )
        for name in center
        if name != "ground"
        for what in wanted
    }
    sensors |= {
        joint["name"]: system.AddSensor(
            items.SensorObject(
                objectNumber=connectors[joint["name"]],
                outputVariableType=kinds.ForceLocal,
                storeInternal=True,
                writeToFile=False,
            )
        )
        for joint in model["joints"]
        if joint["rows"]
    }
    system.Assemble()
    asked = exu.SimulationSettings()
    asked.solution.file.write = False
    asked.solution.sensors.writePeriod = times[1] - times[0]
    asked.timeIntegration.numberOfSteps = effort["steps"] * (len(times) - 1)
    asked.timeIntegration.endTime = times[-1]
    newton = asked.timeIntegration.newton
    newton.useModifiedNewton = settings.get("modified_newton", newton.useModifiedNewton)
    newton.relativeTolerance = settings.get("relative_tolerance", newton.relativeTolerance)
    newton.absoluteTolerance = settings.get("absolute_tolerance", newton.absoluteTolerance)
    solver = getattr(exu.DynamicSolverType, settings["integrator"])
    tables: dict[Any, Any] = {}

    def advance(sample: int) -> None:
        if sample == 1:  # all samples in one call; sensors keep them
            system.SolveDynamic(asked, solverType=solver)

    def states(sample: int) -> Any:
        if sample and not tables:
            tables.update({key: system.GetSensorStoredData(each) for key, each in sensors.items()})
        found: Any = {}
        for name, c in center.items():
            if name == "ground":
                continue
            if not sample:
                twist = np.array(next(b["twist"] for b in model["bodies"] if b["name"] == name))
                found[name] = np.zeros(3), np.eye(3), twist[:3], twist[3:]
                continue
            rows = [tables[name, what] for what in wanted]
            near = int(np.abs(rows[0][:, 0] - times[sample]).argmin())
            if abs(rows[0][near, 0] - times[sample]) > 0.5 * effort["step"]:
                raise RuntimeError(f"Exudyn ends at {rows[0][-1, 0]:.6g} s")
            x, turned, w, v = (each[near, 1:] for each in rows)
            found[name] = state_of(c, x, turned.reshape(3, 3), w, v)
        return found

    def reactions(sample: int) -> Any:
        found: Any = {}
        for joint in model["joints"] if sample else ():
            if not joint["rows"]:
                continue
            rows = tables[joint["name"]]
            near = int(np.abs(rows[:, 0] - times[sample]).argmin())
            first = joint["bodies"][0]
            R = np.eye(3) if first == "ground" else states(sample)[first][1]
            found[joint["name"]] = -R @ np.array(joint["frame"]).T @ rows[near, 1:]
        return found

    return advance, states, reactions
