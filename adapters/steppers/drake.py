"""Drake as a stepper of free motion: a discrete MultibodyPlant with its SAP solver, and a ball
constraint for each tie; for a tree also a continuous one. A ball joint is a floating joint with
such a constraint.
"""

from importlib import import_module
from importlib.metadata import version as version_of
from typing import Any

import numpy as np

from .stepper_loop import state_of


def version() -> str:
    """Return the version of Drake."""
    import_module("pydrake.multibody.plant")
    return version_of("drake")


def stepper(model: Any, settings: Any, effort: Any, times: Any) -> Any:
    """Return functions to advance to a sample, and to read the bodies' states there."""
    parts: Any = import_module("pydrake.multibody.plant")
    tree: Any = import_module("pydrake.multibody.tree")
    shift: Any = import_module("pydrake.math").RigidTransform
    simulation: Any = import_module("pydrake.systems.analysis")
    plant = parts.MultibodyPlant(effort.get("step", 0.0))
    if "step" in effort:
        solver = getattr(parts.DiscreteContactApproximation, f"k{settings['integrator']}")
        plant.set_discrete_contact_approximation(solver)
    elif model["ties"] or "ball" in {m["kind"] for body in model["bodies"] for m in body["moves"]}:
        raise NotImplementedError("a continuous plant has no constraints for loops and balls")
    plant.mutable_gravity_field().set_gravity_vector(np.array(model["gravity"]))
    bodies = {"ground": plant.world_body()}
    origin, moves = {"ground": np.zeros(3)}, list[Any]()
    # a ball constraint on the world body ends the process
    unit = tree.SpatialInertia(1.0, np.zeros(3), tree.UnitInertia(1.0, 1.0, 1.0))
    anchor = plant.AddRigidBody("anchor", unit)
    plant.WeldFrames(plant.world_frame(), anchor.body_frame())
    balls, welds = list[Any](), dict[str, Any]()

    def inertia(body: Any, origin: Any) -> Any:
        c, own = np.array(body["center"]) - origin, np.array(body["inertia"])
        own = own / body["mass"] + (c @ c) * np.eye(3) - np.outer(c, c)
        six = own[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        return tree.SpatialInertia(body["mass"], c, tree.UnitInertia(*six))

    def frame(body: Any, at: Any) -> Any:
        name = f"frame {plant.num_frames()}"
        return plant.AddFrame(tree.FixedOffsetFrame(name, body.body_frame(), shift(at)))

    for body in model["bodies"]:
        parent, before, last = bodies[body["parent"]], origin[body["parent"]], len(body["moves"])
        for k, move in enumerate(body["moves"], 1):
            P, axis = np.array(move["point"]), np.array(move["axis"])
            own = inertia(body, P) if k == last else tree.SpatialInertia.Zero()
            child = plant.AddRigidBody(f"{body['name']} {k}", own)
            ends = f"joint {len(moves)}", frame(parent, P - before), child.body_frame()
            if move["kind"] == "ball":
                made = tree.QuaternionFloatingJoint(*ends)
                balls.append((parent, P - before, child, np.zeros(3)))
            else:
                kind = tree.RevoluteJoint if move["kind"] == "hinge" else tree.PrismaticJoint
                made = kind(*ends, axis)
            moves.append(plant.AddJoint(made))
            parent, before = child, P
        if not last:
            child = plant.AddRigidBody(body["name"], inertia(body, before))
            welds[body["name"]] = plant.WeldFrames(parent.body_frame(), child.body_frame())
            parent = child
        bodies[body["name"]], origin[body["name"]] = parent, before

    def ends_of(each: Any, ground: Any) -> list[Any]:
        found: list[Any] = []
        for name, point in zip(each["bodies"], each["points"], strict=True):
            body = ground if name == "ground" else bodies[name]
            found += [body, np.array(point) - origin[name]]
        return found

    for tie in model["ties"]:
        if tie["length"]:
            plant.AddDistanceConstraint(*ends_of(tie, anchor), tie["length"])
        else:
            balls.append(ends_of(tie, anchor))
    for first, at, second, there in balls:
        one, two = (anchor if each is bodies["ground"] else each for each in (first, second))
        plant.AddBallConstraint(one, at, two, there)
    for each in model["springs"]:
        given = each["free_length"], each["stiffness"], each["damping"]
        plant.AddForceElement(tree.LinearSpringDamper(*ends_of(each, bodies["ground"]), *given))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    rates = iter([rate for body in model["bodies"] for rate in body["rates"]])
    v = np.zeros(plant.num_velocities())
    for move in moves:
        count = 1 if move.num_velocities() == 1 else 3
        v[move.velocity_start() : move.velocity_start() + count] = [
            next(rates) for _ in range(count)
        ]
    plant.SetVelocities(context, v)
    external = list[Any]()
    for load in model["loads"]:
        force = parts.ExternallyAppliedSpatialForce()
        force.body_index = bodies[load["body"]].index()
        force.p_BoBq_B = np.array(load["point"]) - origin[load["body"]]
        spatial: Any = import_module("pydrake.multibody.math").SpatialForce
        force.F_Bq_W = spatial(tau=np.array(load["torque"]), f=np.array(load["force"]))
        external.append(force)
    value: Any = import_module("pydrake.common.value").Value[
        list[parts.ExternallyAppliedSpatialForce]
    ]
    plant.get_applied_spatial_force_input_port().FixValue(context, value(external))
    simulator = simulation.Simulator(plant, context)
    if "accuracy" in effort:
        simulation.ResetIntegratorFromFlags(simulator, settings["integrator"], times[1] - times[0])
        simulator.get_mutable_integrator().set_target_accuracy(effort["accuracy"])
    simulator.Initialize()

    def advance(sample: int) -> None:
        simulator.AdvanceTo(times[sample])

    def states(sample: int) -> Any:
        found: Any = {}
        for body in model["bodies"]:
            name, at = body["name"], bodies[body["name"]]
            pose = plant.EvalBodyPoseInWorld(simulator.get_context(), at)
            twist = plant.EvalBodySpatialVelocityInWorld(simulator.get_context(), at)
            turning = pose.rotation().matrix(), twist.rotational()
            at = origin[name], pose.translation()
            found[name] = state_of(*at, *turning, twist.translational())
        return found

    def reactions(sample: int) -> Any:
        port, found = plant.get_reaction_forces_output_port(), dict[str, Any]()
        if not sample and "step" in effort:  # forces are those of a step
            return found
        every, ends = port.Eval(simulator.get_context()), iter(moves)
        for body in model["bodies"]:
            joints = [next(ends) for _ in body["moves"]]
            last = joints[-1] if joints else welds[body["name"]]
            if joints and body["moves"][-1]["kind"] == "ball":  # Drake gives none of constraints
                continue
            frame = last.frame_on_child().CalcPoseInWorld(simulator.get_context())
            force = frame.rotation() @ every[int(last.index())].translational()
            found[body["joint"]] = force if body["second"] else -force
        return found

    return advance, states, reactions
