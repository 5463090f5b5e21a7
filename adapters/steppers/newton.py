"""Newton as a stepper of free motion: its solvers in float32 on the CPU, with a ball joint outside
the tree for each tie.
"""

from importlib import import_module
from importlib.metadata import version as version_of
from typing import Any

import numpy as np

from .stepper_loop import loads, require, rotation


def version() -> str:
    """Return the version of Newton."""
    import_module("warp").config.quiet = True
    import_module("newton")
    return version_of("newton")


def stepper(model: Any, settings: Any, effort: Any, times: Any) -> Any:
    """Return functions to advance to a sample, and to read the bodies' states there."""
    newton, warp = import_module("newton"), import_module("warp")
    require(model, "Newton", chains=False)
    builder = newton.ModelBuilder(gravity=tuple(model["gravity"]))
    links, still = {"ground": -1}, warp.quat_identity()
    center = {body["name"]: np.array(body["center"]) for body in model["bodies"]}
    kinds = {"hinge": builder.add_joint_revolute, "slide": builder.add_joint_prismatic}
    joints = list[Any]()
    for body in model["bodies"]:
        (move,) = body["moves"]
        links[body["name"]] = builder.add_link(
            mass=body["mass"],
            com=warp.vec3(*body["center"]),
            inertia=warp.mat33(*np.ravel(body["inertia"]).tolist()),
            lock_inertia=True,
        )
        at = warp.transform(warp.vec3(*move["point"]), still)
        ends = links[body["parent"]], links[body["name"]]
        given = {"parent_xform": at, "child_xform": at, "armature": 0.0}
        if move["kind"] == "ball":
            joints.append(builder.add_joint_ball(*ends, **given))
        else:
            axis = warp.vec3(*move["axis"])
            joints.append(kinds[move["kind"]](*ends, axis=axis, **given))
    builder.add_articulation(joints)
    for tie in model["ties"]:
        one, two = (links[name] for name in tie["bodies"])
        ends = [warp.transform(warp.vec3(*point), still) for point in tie["points"]]
        one, two, ends = (one, two, ends) if two >= 0 else (two, one, ends[::-1])
        given = {"parent_xform": ends[0], "child_xform": ends[1]}
        if tie["length"]:
            span = {"min_distance": tie["length"], "max_distance": tie["length"]}
            builder.add_joint_distance(one, two, **span, **given)
        else:
            builder.add_joint_ball(one, two, armature=0.0, **given)
    with warp.ScopedDevice("cpu"):
        m = builder.finalize(device="cpu")
        rates = m.joint_qd.numpy()
        starts = m.joint_qd_start.numpy()
        for joint, body in zip(joints, model["bodies"], strict=True):
            rates[starts[joint] : starts[joint] + len(body["rates"])] = body["rates"]
        m.joint_qd.assign(rates)
        solver = getattr(newton.solvers, f"Solver{settings['integrator']}")
        names = ("iterations", "tolerance")
        solve = solver(m, **{name: settings[name] for name in names if name in settings})
        control = m.control()

        def start() -> list[Any]:
            both = [m.state(), m.state()]
            newton.eval_fk(m, m.joint_q, m.joint_qd, both[0])
            return both

        both = start()
        solve.step(*both, control, None, effort["step"])  # it compiles
        solve = solver(m, **{name: settings[name] for name in names if name in settings})
        both = start()

    def states(sample: int) -> Any:
        q, qd = (np.array(each.numpy(), float) for each in (both[0].body_q, both[0].body_qd))
        found: Any = {}
        for name, link in links.items():
            if link < 0:
                continue
            x, y, z, w = q[link, 3:]
            R = rotation(w, x, y, z)
            v, spin = qd[link, :3], qd[link, 3:]
            found[name] = q[link, :3], R, spin, v - np.cross(spin, R @ center[name])
        return found

    def advance(sample: int) -> None:
        with warp.ScopedDevice("cpu"):
            for _ in range(effort["steps"]):
                both[0].clear_forces()
                if model["springs"] or model["loads"]:
                    given, now = np.zeros((len(model["bodies"]), 6)), states(sample)
                    for name, point, force, torque in loads(model, now):
                        x, R, _, _ = now[name]
                        arm = point - x - R @ center[name]
                        given[links[name]] += [*force, *(torque + np.cross(arm, force))]
                    both[0].body_f.assign(given.astype(np.float32))
                solve.step(*both, control, None, effort["step"])
                both.reverse()

    return advance, states
