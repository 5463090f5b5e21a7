"""Random robots with loops, in every format that is read. A seed makes the same file anywhere.

Links are placed globally, joints and loops between them, so that loops close in the zero pose.
"""

import json
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from .usd_texts import EXCLUDED, body, joint, stage

BASE = "base"


@dataclass
class Link:
    """A link: where it is, the link it hangs on, and how."""

    name: str
    outer: str
    kind: str
    at: np.ndarray
    turn: np.ndarray
    axis: np.ndarray
    mass: float
    moments: np.ndarray
    center: np.ndarray
    law: np.ndarray


@dataclass
class RandomRobot:
    """A chain whose end is tied to a second, shorter chain at a point."""

    links: list[Link]
    ends: tuple[str, str]
    planar: bool
    point: np.ndarray
    loose: bool
    factor: float
    places: dict = field(default_factory=dict)

    def __post_init__(self):
        self.places = {BASE: (np.zeros(3), np.eye(3))}
        self.places |= {each.name: (each.at, each.turn) for each in self.links}

    def seen(self, link, at, turn=None):
        """A place, as a link sees it: position and rotation."""
        r, R = self.places[link]
        return R.T @ (at - r), R.T @ (np.eye(3) if turn is None else turn)


def random_robot(seed):
    """Return a planar robot with parallel hinges, or a spatial one with all kinds of joints."""
    rng = np.random.default_rng(seed)
    planar = bool(rng.random() < 0.4)
    links = []
    long, short = (int(rng.integers(3, 5)), 1) if planar else (int(rng.integers(4, 7)), 2)
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    for chain, count in (("a", long), ("b", short)):
        outer = BASE
        for k in range(count):
            kinds = ["hinge"] if planar else ["hinge", "hinge", "hinge", "slide"]
            axis = normal if planar else rng.normal(size=3)
            at = rng.normal(size=3)
            if planar:
                at -= (at @ normal) * normal
            links.append(
                Link(
                    *(
                        f"{chain}{k}",
                        outer,
                        str(rng.choice(kinds)),
                        at,
                        Rotation.from_quat(rng.normal(size=4), scalar_first=True).as_matrix(),
                    ),
                    axis / np.linalg.norm(axis),
                    *(float(rng.uniform(0.5, 2.0)), rng.uniform(1.0, 1.9, size=3)),
                    *(
                        0.1 * rng.normal(size=3),
                        rng.uniform(0.0, 5.0, size=3) * (rng.random() < 0.5),
                    ),
                )
            )
            outer = links[-1].name
    point = rng.normal(size=3)
    if planar:
        point -= (point @ normal) * normal
    return RandomRobot(
        links,
        (links[long - 1].name, links[-1].name),
        planar,
        point,
        bool(rng.random() < 0.5),
        float(rng.uniform(0.5, 2.0)),
    )


def text(*numbers):
    return " ".join(repr(float(x)) for x in np.ravel(numbers))


def rpy(R):
    return Rotation.from_matrix(R).as_euler("xyz")


def quaternion(R):
    return Rotation.from_matrix(R).as_quat(scalar_first=True).tolist()


def inertia(link, of):
    """Six moments, as attributes or as elements."""
    names = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    values = [*link.moments, 0.1, -0.05, 0.02]
    return "".join(of(name, text(value)) for name, value in zip(names, values, strict=True))


def urdf_tree(robot, frames=()):
    """Links and joints of a URDF; frames are links that are fixed at the point."""
    found = f'<robot name="random"><link name="{BASE}"/>'
    for each in robot.links:
        at, R = robot.seen(each.outer, each.at, each.turn)
        kind = {"hinge": "continuous", "slide": "prismatic"}[each.kind]
        attributes = inertia(each, lambda name, value: f' {name}="{value}"')
        found += (
            f'<link name="{each.name}"><inertial><mass value="{each.mass!r}"/>'
            f'<origin xyz="{text(each.center)}"/><inertia{attributes}/></inertial></link>'
            f'<joint name="j{each.name}" type="{kind}"><parent link="{each.outer}"/>'
            f'<child link="{each.name}"/><origin xyz="{text(at)}" rpy="{text(rpy(R))}"/>'
            f'<axis xyz="{text(each.turn.T @ each.axis)}"/>'
            f'<dynamics damping="{float(each.law[1])!r}"/>'
            "</joint>"
        )
    for name, link in frames:
        at, R = robot.seen(link, robot.point)
        found += (
            f'<link name="{name}"/><joint name="at {name}" type="fixed"><parent link="{link}"/>'
            f'<child link="{name}"/><origin xyz="{text(at)}" rpy="{text(rpy(R))}"/></joint>'
        )
    return found


def urdf(robot):
    """A loop as a <constraint>."""
    (i, j), axis = robot.ends, robot.links[0].axis
    ends = [robot.seen(link, robot.point) for link in (i, j)]
    of = [f'xyz="{text(at)}" rpy="{text(rpy(R))}"' for at, R in ends]
    kind = "continuous" if robot.planar else "spherical"
    # in the frame of the origin, whose axes are global
    along = f'<parent_axis xyz="{text(axis)}"/>' if robot.planar else ""
    loop = (
        f'<constraint name="loop" type="{kind}"><parent link="{i}"/><parent_origin {of[0]}/>{along}'
        f'<child link="{j}"/><child_origin {of[1]}/></constraint>'
    )
    return {"urdf": f"{urdf_tree(robot)}{loop}</robot>"}


def urdf_json(robot):
    """A loop as a point of two links, in a file beside."""
    ends = {
        key: {"link": link, "point": robot.seen(link, robot.point)[0].tolist()}
        for key, link in zip("ij", robot.ends, strict=True)
    }
    constraints = [{"joint": "loop", "kind": "coincident", **ends}]
    beside = {"schema": "kincheck-constraints/1", "constraints": constraints}
    return {"urdf": f"{urdf_tree(robot)}</robot>", "constraints.json": json.dumps(beside)}


def urdf_yaml(robot):
    """A loop as two frames, in a YAML file beside."""
    frames = (("here", robot.ends[0]), ("there", robot.ends[1]))
    pairs = "closed_loop: [[here, there]]\ntype: [3d]\nname_mot: [ja0]\n"
    return {"urdf": f"{urdf_tree(robot, frames)}</robot>", "yaml": pairs}


def sdf(robot):
    """A loop as one more joint."""
    found = '<sdf version="1.9"><model name="random">'
    for each in robot.links:
        found += (
            f'<link name="{each.name}"><pose>{text(*each.at, *rpy(each.turn))}</pose><inertial>'
            f"<pose>{text(*each.center, 0, 0, 0)}</pose><mass>{each.mass!r}</mass>"
            f"<inertia>{inertia(each, lambda name, value: f'<{name}>{value}</{name}>')}</inertia>"
            "</inertial></link>"
        )
        kind = {"hinge": "revolute", "slide": "prismatic"}[each.kind]
        outer = "world" if each.outer == BASE else each.outer
        stiffness, damping, rest = map(float, each.law)
        found += (
            f'<joint name="j{each.name}" type="{kind}"><parent>{outer}</parent>'
            f"<child>{each.name}</child><axis><xyz>{text(each.turn.T @ each.axis)}</xyz><dynamics>"
            f"<damping>{damping!r}</damping><spring_stiffness>{stiffness!r}</spring_stiffness>"
            f"<spring_reference>{rest!r}</spring_reference></dynamics></axis></joint>"
        )
    i, j = robot.ends
    at, R = robot.seen(j, robot.point)
    kind = "revolute" if robot.planar else "ball"
    axis = f"<axis><xyz>{text(robot.links[0].axis)}</xyz></axis>" if robot.planar else ""
    loop = (
        f'<joint name="loop" type="{kind}"><pose>{text(*at, *rpy(R))}</pose><parent>{i}</parent>'
        f"<child>{j}</child>{axis}</joint>"
    )
    return {"sdf": f"{found}{loop}</model></sdf>"}


def mjcf(robot):
    """A loop as a <connect>; references, springs, and a coupling where there are freedoms."""
    inside = {each.name: "" for each in robot.links} | {BASE: ""}
    for each in reversed(robot.links):
        at, R = robot.seen(each.outer, each.at, each.turn)
        stiffness, damping, rest = map(float, each.law)
        inside[each.outer] += (
            f'<body name="{each.name}" pos="{text(at)}" quat="{text(quaternion(R))}">'
            f'<joint name="j{each.name}" type="{each.kind}" axis="{text(each.turn.T @ each.axis)}"'
            f' ref="{rest!r}" stiffness="{stiffness!r}" damping="{damping!r}"/>'
            f'<inertial pos="{text(each.center)}" mass="{each.mass!r}"'
            f' diaginertia="{text(each.moments)}"/>'
            f'<site name="s{each.name}" pos="{text(each.center)}"/>'
            f"{inside[each.name]}</body>"
        )
    (i, j), coupling = robot.ends, ""
    anchor = text(robot.seen(i, robot.point)[0])
    if robot.loose and len(robot.links) > 6:
        curve = text(0.0, robot.factor, 0.1)
        coupling = f'<joint joint1="ja1" joint2="ja0" polycoef="{curve}"/>'
    return {
        "xml": f'<mujoco><compiler angle="radian"/><worldbody>{inside[BASE]}</worldbody><equality>'
        f'<connect body1="{i}" body2="{j}" anchor="{anchor}"/>{coupling}</equality></mujoco>'
    }


def usd(robot):
    """A loop as an excluded joint; the frames of joints are in single precision."""
    prims = [
        body(each.name, at=each.at, ops=f"quatd xformOp:orient = {tuple(quaternion(each.turn))}")
        for each in robot.links
    ]
    kinds = {"hinge": "Revolute", "slide": "Prismatic"}
    joints = [
        (kinds[each.kind], f"j{each.name}", each.outer, each.name, each.at, each.axis, "")
        for each in robot.links
    ]
    kind = "Revolute" if robot.planar else "Spherical"
    joints.append((kind, "loop", *robot.ends, robot.point, robot.links[0].axis, EXCLUDED))
    for kind, name, outer, inner, at, axis, more in joints:
        frame = Rotation.align_vectors([axis], [[0, 0, 1]])[0].as_matrix()
        (p, P), (q, Q) = (robot.seen(link, at, frame) for link in (outer, inner))
        turns = [
            f"quatf physics:localRot{k} = {tuple(quaternion(R))}" for k, R in enumerate((P, Q))
        ]
        first = "" if outer == BASE else outer
        prims.append(joint(kind, name, first, inner, more, *turns, p=p, q=q, axis="Z"))
    return {"usda": stage(*prims)}


FORMATS = {
    "MJCF": mjcf,
    "URDF with <constraint>": urdf,
    "URDF with constraints.json": urdf_json,
    "URDF with YAML": urdf_yaml,
    "SDF": sdf,
    "USD": usd,
}
