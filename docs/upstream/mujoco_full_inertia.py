"""What a compiled `fullinertia` says of a body: R diag(body_inertia) R^T against the file."""

import mujoco
import numpy as np

MODEL = """
<mujoco><worldbody><body>
  <freejoint/>
  <inertial pos="0 0 0" mass="1" fullinertia="{}"/>
</body></worldbody></mujoco>
"""


def compiled(tensor):
    """Return the tensor of the compiled model, in the axes of the body [kg m^2]."""
    x, y, z = tensor.diagonal()
    numbers = x, y, z, tensor[0, 1], tensor[0, 2], tensor[1, 2]
    m = mujoco.MjModel.from_xml_string(MODEL.format(" ".join(repr(float(n)) for n in numbers)))
    axes = np.empty(9)
    mujoco.mju_quat2Mat(axes, m.body_iquat[1] / np.linalg.norm(m.body_iquat[1]))
    axes = axes.reshape(3, 3)
    return axes @ np.diag(m.body_inertia[1]) @ axes.T


rng = np.random.default_rng(1)
errors = []
for _ in range(400):
    points = rng.normal(size=(8, 3))  # unit masses: a tensor that a body can have
    tensor = (points**2).sum() * np.eye(3) - points.T @ points
    errors.append(np.abs(compiled(tensor) - tensor).max() / np.abs(tensor).max())
print(f"MuJoCo {mujoco.__version__}")
print(
    f"400 tensors: error relative to the largest entry: median {np.median(errors):.1e}, largest"
    f" {max(errors):.1e}; above 1e-12: {sum(each > 1e-12 for each in errors)}"
)
