"""One closed robot as files of several formats, its loops cut at any joint, its joints in any order
and direction.

Bodies and joints are given globally, at a closed pose. What a format says of a loop differs: a
joint like others (SDF, USD, OpenSim), a constraint (URDF), halves of a body or points (MJCF).
"""

import importlib.util
import json
from dataclasses import dataclass, field, replace

import numpy as np
from kincheck.core.doors import extensions
from scipy.spatial.transform import Rotation

from .osim_texts import axis as osim_axis
from .osim_texts import coordinate, line, model, tagged, texts
from .osim_texts import joint as osim_joint
from .usd_texts import EXCLUDED, body, joint, stage

BASE = "base"
LAWS = ("stiffness", "reference", "damping", "armature", "friction", "lower", "upper")
"""Numbers of a joint, beside its motion."""
NAMES = {"reference": "spring reference", "lower": "limits", "upper": "limits"}
"""What `kincheck same` calls them, unless it is the same."""


@dataclass(frozen=True)
class Solid:
    """A body: its frame, mass, centre and moments of inertia about it, in its frame."""

    at: np.ndarray
    turn: np.ndarray
    mass: float = 1.0
    center: np.ndarray = field(default_factory=lambda: np.zeros(3))
    moments: np.ndarray = field(default_factory=lambda: np.ones(3))


@dataclass(frozen=True)
class Pair:
    """A joint: its second body moves on the first."""

    name: str
    bodies: tuple[str, str]
    kind: str
    at: np.ndarray
    axis: np.ndarray
    laws: dict = field(default_factory=dict)

    @property
    def turned(self):
        """The bodies exchanged; the coordinate keeps its value."""
        return replace(self, bodies=self.bodies[::-1], axis=-self.axis)


@dataclass(frozen=True)
class Closed:
    """A robot with loops."""

    solids: dict
    pairs: list

    def place(self, name):
        if name == BASE:
            return np.zeros(3), np.eye(3)
        return self.solids[name].at, self.solids[name].turn

    def seen(self, name, at):
        r, R = self.place(name)
        return R.T @ (at - r)

    def cut(self, rng):
        """Return the joints of a random tree, outer ones first, and those that close its loops."""
        left = [self.pairs[k] for k in rng.permutation(len(self.pairs))]
        reached, tree = {BASE}, []
        while more := [x for x in left if len({*x.bodies} & reached) == 1]:
            chosen = more[rng.integers(len(more))]
            left.remove(chosen)
            tree.append(chosen if chosen.bodies[0] in reached else chosen.turned)
            reached |= {*chosen.bodies}
        assert len(tree) == len(self.solids)
        return tree, left


def closed_chain(loop):
    """The robot of a loop of hinges, its links framed like the base."""
    count = len(loop.points)
    names = [BASE, *(f"l{k}" for k in range(1, count)), BASE]
    return Closed(
        {name: Solid(np.zeros(3), np.eye(3)) for name in names[1:-1]},
        [
            Pair(f"j{k}", (names[k], names[k + 1]), "hinge", loop.points[k], loop.axes[k])
            for k in range(count)
        ],
    )


def random_closed(seed, laws=()):
    """Return a random robot of one or two loops, planar or with balls and slides.

    Args:
        laws: numbers that some of its joints have.
    """
    rng = np.random.default_rng(seed)
    planar = bool(rng.random() < 0.4)
    solids, pairs = {}, []
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)

    def point():
        at = rng.normal(size=3)
        return at - (at @ normal) * normal if planar else at

    def add_pair(first, second, kind=None):
        kinds = ["hinge"] * 4 if planar else ["hinge", "hinge", "slide", "ball"]
        axis = normal if planar else rng.normal(size=3)
        axis = axis / np.linalg.norm(axis)
        kind = kind or str(rng.choice(kinds))
        found = {}
        if kind != "ball" and rng.random() < 0.6:
            all_laws = dict(zip(LAWS, rng.uniform(0.1, 5.0, len(LAWS)), strict=True))
            found = {key: float(all_laws[key]) for key in laws}
            found |= {"lower": -2.0 - found["lower"]} if "lower" in found else {}
            found |= {"upper": 2.0 + found["upper"]} if "upper" in found else {}
        pairs.append(Pair(f"j{len(pairs)}", (first, second), kind, point(), axis, found))

    def add_solid():
        name = f"part{len(solids)}"
        solids[name] = Solid(
            point(),
            Rotation.from_quat(rng.normal(size=4)).as_matrix(),
            *(float(rng.uniform(0.5, 2.0)), 0.1 * rng.normal(size=3), rng.uniform(1.0, 1.9, 3)),
        )
        return name

    for _ in range(int(rng.integers(1, 3))):
        length = int(rng.integers(3, 5)) if planar else int(rng.integers(5, 7))
        before = str(rng.choice([BASE, *solids]))
        last = str(rng.choice([BASE, *solids]))
        for _ in range(length):
            after = add_solid()
            add_pair(before, after, "hinge" if before == BASE else None)
            before = after
        add_pair(before, last, None if last != before else "hinge")
    return Closed(solids, pairs)


@dataclass(frozen=True)
class Writer:
    """Numbers as texts, and the choices of a file.

    Attributes:
        said: names of the laws that the file has, by joint.
    """

    rng: np.random.Generator
    digits: int | None = None
    said: dict = field(default_factory=dict)

    def say(self, pair, *laws):
        """Note that the file has such laws of a joint, as far as the joint has them."""
        found = {*laws} & {*pair.laws}
        found -= {"reference"} if "stiffness" not in found else set()
        self.said[pair.name] = {NAMES.get(law, law) for law in found}

    def __call__(self, *numbers):
        flat = np.ravel(np.concatenate([np.ravel(x) for x in numbers])).tolist()
        return " ".join(repr(x if self.digits is None else round(x, self.digits)) for x in flat)

    def rpy(self, R):
        return Rotation.from_matrix(R).as_euler("xyz")

    def rpy_body(self, R):
        """Angles about the axes x, y, z as they turn, of OpenSim."""
        return Rotation.from_matrix(R).as_euler("XYZ")

    def any_way(self, pair):
        return pair.turned if self.rng.random() < 0.5 else pair

    def shuffled(self, items):
        items = [*items]
        return [items[k] for k in self.rng.permutation(len(items))]


def _inertia(solid, of):
    names = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    return "".join(
        of(name, repr(float(x)))
        for name, x in zip(names, [*solid.moments, 0.0, 0.0, 0.0], strict=True)
    )


def mjcf(robot, write):
    """Loops as halves of bodies that are welded, or as common points."""
    tree, loops = robot.cut(write.rng)
    halves, equalities, parts = {}, [], dict.fromkeys(robot.solids, 1)
    hung = {name: [] for name in (BASE, *robot.solids)}
    for pair in tree:
        hung[pair.bodies[0]].append((pair.bodies[1], pair))
    for raw in loops:
        pair = write.any_way(raw)
        i, j = pair.bodies
        if BASE in (i, j) or pair.kind == "slide" or write.rng.random() < 0.5:
            if j == BASE:
                pair, i, j = pair.turned, j, i
            if pair.kind != "ball":
                half = f"{j}_half"
                while half in halves:
                    half += "_"
                halves[half] = j
                parts[j] += 1
                hung[i].append((half, pair))
                equalities.append(f'<weld body1="{half}" body2="{j}"/>')
                continue
        points = [pair.at] if pair.kind == "ball" else [pair.at, pair.at + 0.7 * pair.axis]
        first, second = (i, j) if i != BASE else (j, i)
        ends = f'body1="{first}"' + f' body2="{second}"' * (second != BASE)
        equalities += [
            f'<connect {ends} anchor="{write(robot.seen(first, at))}"/>' for at in points
        ]

    def inside(name):
        found = ""
        for child, pair in write.shuffled(hung.get(name, [])):
            whole = halves.get(child, child)
            solid = robot.solids[whole]
            r, R = robot.place(halves.get(name, name))
            turn = R.T @ solid.turn
            share = 1.0 / parts[whole]
            write.say(pair, *LAWS)
            spring = {
                "stiffness": pair.laws.get("stiffness", 0.0),
                "springref": pair.laws.get("reference", 0.0),
                "damping": pair.laws.get("damping", 0.0),
                "armature": pair.laws.get("armature", 0.0),
                "frictionloss": pair.laws.get("friction", 0.0),
            }
            more = "".join(f' {key}="{value!r}"' for key, value in spring.items() if value)
            if "lower" in pair.laws:
                more += f' range="{pair.laws["lower"]!r} {pair.laws["upper"]!r}"'
            along = "" if pair.kind == "ball" else f' axis="{write(solid.turn.T @ pair.axis)}"'
            quat = Rotation.from_matrix(turn).as_quat(scalar_first=True)
            turned = f' quat="{write(quat)}"' if not np.array_equal(turn, np.eye(3)) else ""
            found += (
                f'<body name="{child}" pos="{write(R.T @ (solid.at - r))}"{turned}>'
                f'<joint name="{pair.name}" type="{pair.kind}" '
                f'pos="{write(robot.seen(whole, pair.at))}"{along}{more}/>'
                f'<inertial pos="{write(solid.center)}" mass="{share * solid.mass!r}"'
                f' diaginertia="{" ".join(repr(float(share * x)) for x in solid.moments)}"/>'
                f"{inside(child) if child == whole else ''}</body>"
            )
        return found

    return (
        '<mujoco><compiler angle="radian"/><worldbody>'
        f"{inside(BASE)}</worldbody><equality>{''.join(write.shuffled(equalities))}</equality>"
        "</mujoco>"
    )


def urdf(robot, write):
    """Loops as <constraint>; the frame of a link is that of its joint."""
    tree, loops = robot.cut(write.rng)
    frames, parts = {BASE: (np.zeros(3), np.eye(3))}, []
    for pair in tree:
        i, j = pair.bodies
        (r, R), solid = frames[i], robot.solids[j]
        Q = solid.turn
        frames[j] = pair.at, Q
        # a link is placed by its joint: the mass is where the body has it
        center = Q.T @ (solid.at + Q @ solid.center - pair.at)
        attributes = _inertia(solid, lambda name, value: f' {name}="{value}"')
        turned = R.T @ Q
        angles = "" if np.array_equal(turned, np.eye(3)) else f' rpy="{write(write.rpy(turned))}"'
        limit = kind = ""
        if "lower" in pair.laws:
            limit = f'<limit lower="{pair.laws["lower"]!r}" upper="{pair.laws["upper"]!r}"/>'
        kind = {"slide": "prismatic", "ball": "spherical"}.get(
            pair.kind, "revolute" if limit else "continuous"
        )
        if kind == "prismatic" and not limit:
            limit = '<limit lower="-1e20" upper="1e20"/>'
        laws = {key: pair.laws[key] for key in ("damping", "friction") if key in pair.laws}
        write.say(pair, *laws, "lower", "upper")
        more = "".join(f' {key}="{value!r}"' for key, value in laws.items())
        parts.append(
            f'<link name="{j}"><inertial><mass value="{solid.mass!r}"/>'
            f'<origin xyz="{write(center)}"/><inertia{attributes}/></inertial></link>'
        )
        along = "" if pair.kind == "ball" else f'<axis xyz="{write(Q.T @ pair.axis)}"/>'
        parts.append(
            f'<joint name="{pair.name}" type="{kind}"><parent link="{i}"/><child link="{j}"/>'
            f'<origin xyz="{write(R.T @ (pair.at - r))}"{angles}/>{along}{limit}'
            f"{f'<dynamics{more}/>' if more else ''}</joint>"
        )
    for raw in loops:
        pair = write.any_way(raw)
        ends = []
        for name in pair.bodies:
            r, R = frames[name]
            angles = "" if np.array_equal(R, np.eye(3)) else f' rpy="{write(write.rpy(R.T))}"'
            ends.append(f'xyz="{write(R.T @ (pair.at - r))}"{angles}')
        kind = {"hinge": "continuous", "slide": "prismatic", "ball": "spherical"}[pair.kind]
        along = "" if pair.kind == "ball" else f'<parent_axis xyz="{write(pair.axis)}"/>'
        i, j = pair.bodies
        parts.append(
            f'<constraint name="{pair.name}" type="{kind}"><parent link="{i}"/>'
            f'<parent_origin {ends[0]}/>{along}<child link="{j}"/><child_origin {ends[1]}/>'
            "</constraint>"
        )
    return f'<robot name="random"><link name="{BASE}"/>{"".join(write.shuffled(parts))}</robot>'


def sdf(robot, write):
    """Every joint alike."""
    parts = []
    for name, solid in robot.solids.items():
        parts.append(
            f'<link name="{name}"><pose>{write(solid.at, write.rpy(solid.turn))}</pose><inertial>'
            f"<pose>{write(solid.center)} 0 0 0</pose><mass>{solid.mass!r}</mass>"
            f"<inertia>{_inertia(solid, lambda key, value: f'<{key}>{value}</{key}>')}</inertia>"
            "</inertial></link>"
        )
    for raw in robot.pairs:
        pair = write.any_way(raw)
        if pair.bodies[1] == BASE:
            pair = pair.turned
        i, j = pair.bodies
        kind = {"hinge": "revolute", "slide": "prismatic", "ball": "ball"}[pair.kind]
        keys = ("damping", "friction", "stiffness", "reference")
        write.say(pair, *keys, "lower", "upper")
        tags = ("damping", "friction", "spring_stiffness", "spring_reference")
        inside = "".join(
            f"<{tag}>{pair.laws[key]!r}</{tag}>"
            for key, tag in zip(keys, tags, strict=True)
            if key in pair.laws
        )
        inside = f"<dynamics>{inside}</dynamics>" if inside else ""
        if "lower" in pair.laws:
            lower, upper = pair.laws["lower"], pair.laws["upper"]
            inside += f"<limit><lower>{lower!r}</lower><upper>{upper!r}</upper></limit>"
        along = robot.solids[j].turn.T @ pair.axis
        axis = "" if pair.kind == "ball" else f"<axis><xyz>{write(along)}</xyz>{inside}</axis>"
        parts.append(
            f'<joint name="{pair.name}" type="{kind}">'
            f"<pose>{write(robot.seen(j, pair.at))} 0 0 0</pose>"
            f"<parent>{'world' if i == BASE else i}</parent><child>{j}</child>{axis}</joint>"
        )
    inside = "".join(write.shuffled(parts))
    return f'<sdf version="1.9"><model name="random">{inside}</model></sdf>'


def _frames(robot, pair):
    """Return the place of a joint in both bodies, and rotations with z along its axis."""
    frame = np.eye(3)
    if pair.kind != "ball":
        frame = Rotation.align_vectors([pair.axis], [[0, 0, 1]])[0].as_matrix()
    return [(robot.seen(name, pair.at), robot.place(name)[1].T @ frame) for name in pair.bodies]


def usd(robot, write):
    """Joints between frames; numbers of joints are in single precision."""
    prims, degrees = [], 180.0 / np.pi
    for name, solid in robot.solids.items():
        quat = Rotation.from_matrix(solid.turn).as_quat(scalar_first=True)
        center = tuple(map(float, solid.center))
        moments = tuple(map(float, solid.moments))
        prims.append(
            body(
                name,
                f"float physics:mass = {solid.mass!r}",
                f"point3f physics:centerOfMass = {center}",
                f"float3 physics:diagonalInertia = {moments}",
                at=solid.at,
                ops=f"quatd xformOp:orient = {tuple(map(float, quat))}",
                apis="RigidBody Mass",
            )
        )
    _, loops = robot.cut(write.rng)
    closing = {pair.name for pair in loops}
    for raw in robot.pairs:
        pair = write.any_way(raw)
        (p, P), (q, Q) = _frames(robot, pair)
        lines = [
            f"quatf physics:localRot{k} = "
            f"{tuple(map(float, Rotation.from_matrix(R).as_quat(scalar_first=True)))}"
            for k, R in enumerate((P, Q))
        ]
        if pair.name in closing and write.rng.random() < 0.7:
            lines.append(EXCLUDED)
        write.say(pair, *LAWS)
        apis, per, laws = "", 1.0 if pair.kind == "slide" else degrees, pair.laws
        if "lower" in laws:
            lines += [f"float physics:{k}Limit = {per * laws[k]!r}" for k in ("lower", "upper")]
        key = "linear" if pair.kind == "slide" else "angular"
        gains = {"stiffness": 1.0 / per, "damping": 1.0 / per, "reference": per}
        if {"stiffness", "damping"} & {*laws}:
            apis += f" PhysicsDriveAPI:{key}"
            write.said[pair.name].add("motor")
            names = {"reference": "targetPosition"}
            lines += [
                f"float drive:{key}:physics:{names.get(k, k)} = {factor * laws[k]!r}"
                for k, factor in gains.items()
                if k in laws
            ]
        if {"armature", "friction"} & {*laws}:
            apis += " PhysxJointAPI"
            tags = {"armature": "armature", "friction": "jointFriction"}
            lines += [f"float physxJoint:{t} = {laws[k]!r}" for k, t in tags.items() if k in laws]
        kind = {"hinge": "Revolute", "slide": "Prismatic", "ball": "Spherical"}[pair.kind]
        ends = ["" if name == BASE else name for name in pair.bodies]
        prims.append(joint(kind, pair.name, *ends, *lines, p=p, q=q, axis="Z", apis=apis))
    return stage(*write.shuffled(prims))


def osim(robot, write):
    """Joints between frames, OpenSim's own or custom ones."""
    bodies = []
    for name, solid in robot.solids.items():
        inside = texts(mass=repr(solid.mass), mass_center=tuple(map(float, solid.center)))
        inside += texts(inertia=tuple(map(float, [*solid.moments, 0.0, 0.0, 0.0])))
        bodies.append(tagged("Body", inside, name))
    joints, forces = [], ""
    for raw in robot.pairs:
        pair = write.any_way(raw)
        i, j = ("" if name == BASE else name for name in pair.bodies)
        laws, more = pair.laws, ""
        write.say(pair, "stiffness", "reference", "damping", "lower", "upper")
        if "lower" in laws:
            more = texts(range=(laws["lower"], laws["upper"]), clamped="true")
        own = coordinate(pair.name, inside=more)
        straight = all(np.array_equal(robot.place(name)[1], np.eye(3)) for name in pair.bodies)
        if pair.kind == "ball":
            own = "".join(coordinate(f"{pair.name}_{k}") for k in range(3))
            ends = [
                (robot.seen(name, pair.at), write.rpy_body(robot.place(name)[1].T))
                for name in pair.bodies
            ]
            joints.append(osim_joint("BallJoint", pair.name, i, j, own, *map(_plain, ends)))
        elif straight:  # no angles: numbers of the axis alone have the digits
            along = [float(x) for x in write(pair.axis).split()]
            name = "rotation1" if pair.kind == "hinge" else "translation1"
            space = tagged("SpatialTransform", osim_axis(name, along, line(1.0, 0.0), pair.name))
            at = [[float(x) for x in write(pair.at).split()]]
            joints.append(osim_joint("CustomJoint", pair.name, i, j, own, p=at, c=at, inside=space))
        else:
            kind = "PinJoint"
            frames = _frames(robot, pair)
            if pair.kind == "slide":  # along x
                kind, x = "SliderJoint", Rotation.from_euler("y", -90, degrees=True).as_matrix()
                frames = [(p, P @ x) for p, P in frames]
            ends = [(p, write.rpy_body(P)) for p, P in frames]
            joints.append(osim_joint(kind, pair.name, i, j, own, *map(_plain, ends)))
        if {"stiffness", "damping"} & {*laws}:
            forces += tagged(
                "SpringGeneralizedForce",
                texts(
                    coordinate=pair.name,
                    stiffness=repr(laws.get("stiffness", 0.0)),
                    rest_length=repr(laws.get("reference", 0.0)),
                    viscosity=repr(laws.get("damping", 0.0)),
                ),
                f"spring {pair.name}",
            )
    gravity = texts(gravity=(0.0, 0.0, -9.81))
    return model(write.shuffled(bodies), write.shuffled(joints), forces=forces, more=gravity)


def _plain(end):
    return [tuple(map(float, each)) for each in end]


def adams(robot, write):
    """A dataset of Adams: markers by points, whose z axis is the joint's."""
    numbers = {name: 2 + k for k, name in enumerate(robot.solids)} | {BASE: 1}
    lines = [
        "a closed chain",
        "UNITS/FORCE = NEWTON, MASS = KILOGRAM, LENGTH = METER, TIME = SECOND",
    ]
    lines.append("PART/1, GROUND")
    for name in robot.solids:
        k = numbers[name]
        lines += [f"PART/{k}, MASS = 1, CM = {100 * k}, IP = 0.01, 0.01, 0.01"]
        lines += [f"MARKER/{100 * k}, PART = {k}"]
    for k, pair in enumerate(robot.pairs):
        i, j = pair.bodies
        at = write(pair.at).replace(" ", ", ")
        along = write(pair.at + pair.axis).replace(" ", ", ")
        for marker, name in ((10 * k + 1, i), (10 * k + 2, j)):
            lines.append(f"MARKER/{marker}, PART = {numbers[name]}, QP = {at}, ZP = {along}")
        lines.append(f"JOINT/{k}, REVOLUTE, I = {10 * k + 2}, J = {10 * k + 1}")
    return "\n".join([*lines, "ACCGRAV/KGRAV = -9.80665", "END", ""])


def case_file(robot, write):
    """A case whose first joint is driven."""

    def numbers(x):
        return [float(each) for each in write(x).split()]

    def named(name):
        return "ground" if name == BASE else name

    joints = {
        pair.name: {
            "type": "revolute",
            "bodies": [*map(named, pair.bodies)],
            "point": numbers(pair.at),
            "axis": numbers(pair.axis),
        }
        for pair in robot.pairs
    }
    last = [*robot.solids][-1]
    return json.dumps(
        {
            "schema": "kincheck-case/1",
            "name": "chain",
            "source": "made up",
            "bodies": {name: {} for name in robot.solids},
            "joints": joints,
            "points": {"tip": {"body": last, "position": [0.1, 0.2, 0.3]}},
            "drivers": {"turn": {"type": "joint_angle", "joint": robot.pairs[0].name}},
            "sweep": {"driver": "turn", "start": 0.0, "stop": 0.6, "steps": 7},
        }
    )


FORMATS = {
    "MJCF": (mjcf, "xml"),
    "URDF": (urdf, "urdf"),
    "SDF": (sdf, "sdf"),
    "USD": (usd, "usda"),
    "OpenSim": (osim, "osim"),
}
"""Of models that `kincheck same` compares, those that are read here."""
CHAINS = FORMATS | {"Adams": (adams, "adm"), "case": (case_file, "json")}
"""Of chains of hinges."""
for form, reader in (("USD", "usd"), ("OpenSim", "osim"), ("Adams", "adams")):
    if reader not in extensions() or (form == "USD" and importlib.util.find_spec("pxr") is None):
        FORMATS.pop(form, None)
        CHAINS.pop(form)


def written(form, robot, folder, rng, digits=None, name="model"):
    """Write a robot in a format by choices of a generator; return its file and what is in it."""
    write, ending = CHAINS[form]
    file, writer = folder / f"{name}.{ending}", Writer(rng, digits)
    file.write_text(write(robot, writer))
    return file, writer.said
