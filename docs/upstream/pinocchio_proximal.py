"""constraintDynamics on a loop whose rows are redundant only where it is closed: error over mu."""

import numpy as np
import pinocchio as pin

# Bricard's loop: six links along the edges of a cube and six hinges; the last one closes it.
points = np.array([(0, 0, 0), (1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1), (0, 0, 1.0)])
axes = np.array([(0, -1, 0), (0, 0, -1), (-1, 0, 0), (0, -1, 0), (0, 0, -1), (-1, 0, 0.0)])
model, last, before = pin.Model(), 0, np.zeros(3)
model.gravity.linear = np.array([0, 0, -9.80665])
for k in range(1, 6):
    hinge = pin.JointModelRevoluteUnaligned(axes[k])
    last = model.addJoint(last, hinge, pin.SE3(np.eye(3), points[k] - before), f"hinge {k}")
    before, middle = points[k], 0.5 * (points[(k + 1) % 6] - points[k])
    link = pin.Inertia(1.0 + 0.25 * k, middle, 0.12 * np.eye(3))
    model.appendBodyToJoint(last, link, pin.SE3.Identity())
ties, found = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
for s in (-0.25, 0.25):  # two points on the last axis
    P = np.array([0, s, 0.0])
    ends = 0, pin.SE3(np.eye(3), P), last, pin.SE3(np.eye(3), P - before)
    tie = pin.RigidConstraintModel(
        pin.ContactType.CONTACT_3D, model, *ends, pin.ReferenceFrame.LOCAL
    )
    ties.append(tie)
for tie in ties:
    found.append(tie.createData())
data, zero = model.createData(), np.zeros(5)
pin.initConstraintDynamics(model, data, ties, found)
q = pin.neutral(model) + 1e-8 * np.random.default_rng(0).standard_normal(5)  # some 1e-8 m of gap


def acceleration(mu):
    """Return the accelerations by Pinocchio."""
    settings = pin.ProximalSettings(1e-13, 1e-13, mu, 200)
    return np.array(pin.constraintDynamics(model, data, q, zero, zero, ties, found, settings))


# The motion of the one freedom: the independent rows alone, by singular values.
acceleration(0.1)
_, sizes, V = np.linalg.svd(pin.getConstraintsJacobian(model, data, ties, found))
free = V[(sizes > 1e-6).sum() :].T
M = np.triu(pin.crba(model, model.createData(), q))
M = M + np.triu(M, 1).T
bias = pin.rnea(model, model.createData(), q, zero, zero)
exact = free @ np.linalg.solve(free.T @ M @ free, -free.T @ bias)
print(f"Pinocchio {pin.__version__}; smallest singular values {sizes[-2]:.1e}, {sizes[-1]:.1e}")
for mu in (1e-1, 1e-2, 1e-4, 1e-6, 1e-8, 1e-10):
    error = np.abs(acceleration(mu) - exact).max()
    print(f"mu {mu:.0e}  error of the accelerations {error:.1e} rad/s^2")
