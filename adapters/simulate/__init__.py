"""Simulate mode: engines that run a simulator's own solver or time stepping."""

from ...core.doors import Extension

EXTENSION = Extension(
    __name__,
    simulations={
        "mujoco": "mujoco_steps:stiff",
        "mujoco-default": "mujoco_steps:default",
        "mujoco-projecting": "mujoco_steps:projecting",
        "pinocchio": "pinocchio_dynamics:Dynamics",
        "exudyn": "exudyn_solvers:trapezoidal",
        "exudyn-alpha": "exudyn_solvers:alpha",
        "exudyn-static-modified": "exudyn_solvers:modified",
    },
)
