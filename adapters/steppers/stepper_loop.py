"""The loop of every stepper: run it at each effort, compare with the truth, write result.json.

This file stands behind an engine's part in run.py, which needs numpy and the engine alone.
"""

import json
import sys
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

# Frame of a body: position of its origin, rotation, angular velocity, velocity of the origin;
# global axes. At design the frame of every body is the global one.
State = tuple[Any, Any, Any, Any]
STILL: State = (np.zeros(3), np.eye(3), np.zeros(3), np.zeros(3))


def state_of(point: Any, x: Any, R: Any, w: Any, v: Any) -> State:
    """Return a body's state from those of a point of it, given globally at design."""
    arm = R @ np.array(point)
    return x - arm, R, w, v - np.cross(w, arm)


def rotation(w: float, *xyz: float) -> Any:
    """Return the rotation of a unit quaternion, its real part first."""
    x, y, z = xyz
    across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return (w * w - np.dot(xyz, xyz)) * np.eye(3) + 2 * np.outer(xyz, xyz) + 2 * w * across


def require(model: Any, engine: str, *, chains: bool = True, rods: bool = True) -> None:
    """Raise if an engine lacks a model's chains or rods."""
    if not chains and any(len(body["moves"]) != 1 for body in model["bodies"]):
        raise NotImplementedError(f"{engine} has no massless links between the joints of a chain")
    if not rods and any(tie["length"] for tie in model["ties"]):
        raise NotImplementedError(f"{engine} has no constraint of a distance")


def place(states: Mapping[str, State], body: str, point: Any) -> tuple[Any, Any]:
    """Return position and velocity of a point of a body, given globally at design."""
    x, R, w, v = states.get(body, STILL)
    arm = R @ np.array(point)
    return x + arm, v + np.cross(w, arm)


def spring(states: Mapping[str, State], each: Any) -> tuple[Any, float, float]:
    """Return the direction of a spring, its length, and its tension."""
    (P, V), (Q, U) = (
        place(states, *end) for end in zip(each["bodies"], each["points"], strict=True)
    )
    length = float(np.linalg.norm(Q - P))
    along = (Q - P) / length
    elastic = each["stiffness"] * (length - each["free_length"])
    return along, length, elastic + each["damping"] * float(along @ (U - V))


def loads(model: Any, states: Mapping[str, State]) -> Iterable[tuple[str, Any, Any, Any]]:
    """Yield body, point, force and torque of all springs and constant loads, global."""
    for each in model["springs"]:
        along, _, tension = spring(states, each)
        for body, point, sign in zip(each["bodies"], each["points"], (1.0, -1.0), strict=True):
            if body in states:
                yield body, place(states, body, point)[0], sign * tension * along, np.zeros(3)
    for each in model["loads"]:
        at, _ = place(states, each["body"], each["point"])
        yield each["body"], at, np.array(each["force"]), np.array(each["torque"])


def energy(model: Any, states: Mapping[str, State]) -> float:
    """Return the energy of motion, weight and springs [J]."""
    found = 0.0
    for body in model["bodies"]:
        _, R, w, _ = states[body["name"]]
        at, speed = place(states, body["name"], body["center"])
        I = R @ np.array(body["inertia"]) @ R.T  # noqa: E741
        found += 0.5 * (body["mass"] * speed @ speed + w @ I @ w)
        found -= body["mass"] * (np.array(model["gravity"]) @ at)
    for each in model["springs"]:
        _, length, _ = spring(states, each)
        found += 0.5 * each["stiffness"] * (length - each["free_length"]) ** 2
    return float(found)


def gap(model: Any, states: Mapping[str, State]) -> float:
    """Return the largest gap of ties, and of joints whose points coincide [m]."""
    meeting = [each for each in model["joints"] if all(each["rows"][:3]) and each["rows"]]
    found = 0.0
    for each in [*meeting, *model["ties"]]:
        P, Q = (place(states, *end)[0] for end in zip(each["bodies"], each["points"], strict=True))
        found = max(found, abs(float(np.linalg.norm(Q - P)) - each.get("length", 0.0)))
    return found


def reaction(model: Any, forces: Mapping[str, Any], truth: Any) -> float:
    """Return the largest error of joint forces, first body on second, where rows determine them."""
    found = 0.0
    for each, (*force, x, y, z) in zip(model["joints"], truth, strict=True):
        if each["name"] in forces and np.isfinite(x):
            off, open_way = forces[each["name"]] - np.array(force), np.array([x, y, z])
            found = max(found, float(np.linalg.norm(off - open_way * (off @ open_way))))
    return found


def run(stepper: Any, model: Any, settings: Any, effort: Any, truth: Any) -> dict[str, Any]:
    """Return the largest errors of a run, and its time by simulated second."""
    times, points, energies, reactions = truth
    advance, states, *given = stepper(model, settings, effort, times)
    largest, spent, message, k = np.zeros(4), 0.0, "", 0
    for k in range(len(times)):
        begin = time.perf_counter()
        if k:
            advance(k)
        spent += time.perf_counter() - begin
        found = states(k)
        at = [place(found, each["body"], each["position"])[0] for each in model["points"]]
        errors = np.array(
            [
                np.linalg.norm(np.array(at) - points[k], axis=1).max(),
                gap(model, found),
                abs(energy(model, found) - energies[k]),
                reaction(model, given[0](k) if given else {}, reactions[k]),
            ]
        )
        if not np.isfinite(errors).all():
            message = f"not finite at {times[k]:.6g} s"
            break
        largest = np.maximum(largest, errors)
    names, done = ("error", "gap", "energy", "reaction"), float(times[k] - times[0])
    measured: list[Any] = [None] * 4 if message else largest.tolist()
    # no joint has a determined force, or the engine gives none
    if not given or not np.isfinite(reactions).any():
        measured[3] = None
    cost = spent / done if done else None
    return {**effort, **dict(zip(names, measured, strict=True)), "cost": cost, "message": message}


def main(stepper: Callable[..., Any], version: Callable[[], str]) -> None:
    """Run all efforts; keep each finding in result.json."""
    folder = Path(sys.argv[0]).resolve().parent
    model, settings = (
        json.loads((folder / f"{name}.json").read_text("utf-8")) for name in ("model", "settings")
    )
    if "file" in model:
        model["file"] = str(folder / model["file"])
    table, forces = (
        np.loadtxt(folder / f"{name}.csv", delimiter=",", skiprows=1, ndmin=2)
        for name in ("truth", "reactions")
    )
    count = len(table)
    places, forces = table[:, 2:].reshape(count, -1, 3), forces.reshape(count, -1, 6)
    truth = table[:, 0], places, table[:, 1], forces
    found: dict[str, Any] = {"version": "", "message": "", "runs": []}
    try:
        found["version"] = version()
    except ImportError as error:
        found["message"] = f"unavailable: {error}"
    for effort in settings["efforts"] if found["version"] else ():
        try:
            done = run(stepper, model, settings, effort, truth)
        except NotImplementedError as error:
            found["message"] = f"unsupported: {error}"
            break
        except Exception as error:  # of the engine: it belongs to this run
            done = {**effort, "message": f"{type(error).__name__}: {error}"[:300]}
        found["runs"].append(done)
        (folder / "result.json").write_text(json.dumps(found, indent=1), "utf-8")
        said = [f"{name} {value}" for name, value in done.items() if value != ""]
        print(*said, sep="  ", flush=True)
    (folder / "result.json").write_text(json.dumps(found, indent=1), "utf-8")
    if found["message"]:
        print(found["message"])
