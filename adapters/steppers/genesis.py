"""Genesis as a stepper of free motion: `Scene.step` of model.xml in float64 on the CPU. Its closed
loops are connects; it has none with the world, so that they end on a body fixed to it.
"""

from importlib import import_module
from typing import Any

import numpy as np

from .stepper_loop import rotation


def version() -> str:
    """Return the version of Genesis."""
    genesis: Any = import_module("genesis")
    genesis.init(backend=genesis.cpu, precision="64", logging_level="error")
    return str(genesis.__version__)


def stepper(model: Any, settings: Any, effort: Any, times: Any) -> Any:
    """Return functions to advance to a sample, and to read the bodies' states there."""
    genesis: Any = import_module("genesis")
    if model["springs"] or model["loads"] or any(tie["length"] for tie in model["ties"]):
        raise NotImplementedError("Genesis reads no tendons, for springs or rods")
    options = genesis.options
    rigid = {
        "constraint_timeconst": settings.get("time_constant", 0.0) * effort["step"],
        "iterations": settings.get("iterations"),
        "tolerance": settings.get("tolerance"),
    }
    scene = genesis.Scene(
        show_viewer=False,
        sim_options=options.SimOptions(dt=effort["step"], gravity=tuple(model["gravity"])),
        rigid_options=options.RigidOptions(
            enable_collision=False,
            enable_joint_limit=False,
            integrator=getattr(genesis.integrator, settings["integrator"]),
            **{name: value for name, value in rigid.items() if value},
        ),
    )
    entity = scene.add_entity(genesis.morphs.MJCF(file=model["file"]))
    scene.build()
    entity.set_dofs_armature(np.zeros(entity.n_dofs))
    rates = {body["name"]: body["rates"] for body in model["bodies"]}
    order = [link.name for link in entity.links if link.name in rates]
    scene.step()  # it compiles
    scene.reset()
    entity.set_dofs_velocity(np.concatenate([rates[name] for name in order]))

    def advance(sample: int) -> None:
        for _ in range(effort["steps"]):
            scene.step()

    def states(sample: int) -> Any:
        found: Any = {}
        for name in order:
            link = entity.get_link(name)
            R = rotation(*map(float, link.get_quat()))
            place, v, spin = (
                np.array(each.cpu(), float)
                for each in (link.get_pos(), link.get_vel(), link.get_ang())
            )
            found[name] = place, R, spin, v
        return found

    return advance, states
