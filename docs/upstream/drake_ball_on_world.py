"""A ball constraint with a point of the world body ends the process at the first step."""

import subprocess
import sys

MODEL = """
import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import SpatialInertia, UnitInertia
from pydrake.systems.analysis import Simulator

plant, zero = MultibodyPlant(1e-3), np.zeros(3)
inertia = SpatialInertia(1.0, zero, UnitInertia(1.0, 1.0, 1.0))
body, world = plant.AddRigidBody("body", inertia), plant.world_body()
if ANCHOR:  # as the constraint needs it: a body that is welded to the world
    world = plant.AddRigidBody("anchor", inertia)
    plant.WeldFrames(plant.world_frame(), world.body_frame())
plant.AddBallConstraint(body, np.array([0.0, 0.0, 1.0]), world, np.array([0.0, 0.0, 1.0]))
plant.Finalize()
Simulator(plant, plant.CreateDefaultContext()).AdvanceTo(0.01)
"""
for anchor in (False, True):
    code = MODEL.replace("ANCHOR", str(anchor))
    status = subprocess.run([sys.executable, "-c", code], check=False).returncode
    print(f"{'anchor body' if anchor else 'world body'}: exit status {status}")
