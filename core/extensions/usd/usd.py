"""USD: rigid bodies and joints of UsdPhysics, mimic joints of PhysX and Newton, and equalities of
MuJoCo.

Joints have a frame in each body, and bodies their own places. The frames decide: along a tree of
joints each body is placed by its joint, whose coordinates are those nearest to its own place. Other
joints, and those that are excluded from articulations, close loops.

Conventions: UsdPhysics of OpenUSD; mimic joints of PhysX by its PxArticulationMimicJoint, angles in
degrees.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from ...algebra import cross, quat, vec
from ...case.io.element import LEFT, ZEROS, Apart, Element, words
from ...errors import remedy, shortened, similar
from ...mechanism.mechanism import Vector
from ..trees.graph import FramedFreedom, FramedJoint, Graph, global_frames, join
from ..trees.masses import COLLIDER, StageMasses
from ..trees.place import Place, coordinates, rotation_vector, turn_of_axes, unit_quaternion
from ..trees.robot_elements import mimic
from ..trees.tree import (
    INFINITE,
    NO_LIMIT,
    UNKNOWNS,
    Closure,
    Kind,
    Limit,
    Move,
    Tree,
    limit_of,
)
from .freedoms import AXES, GENERIC, TYPES, bounds_of, equality, freedoms_of, short_names
from .usd_stage import UNITS

ROD = "PhysicsDistanceJoint"
BODY, DRIVE = "PhysicsRigidBodyAPI", "PhysicsDriveAPI"
PHYSX_MIMIC, NEWTON_MIMIC = "PhysxMimicJointAPI", "NewtonMimicAPI"
MUJOCO_MIMIC = "MjcEqualityJointAPI"
FOLLOWS = PHYSX_MIMIC, NEWTON_MIMIC, MUJOCO_MIMIC
CLOSES = {"MjcEqualityConnectAPI", "MjcEqualityWeldAPI"}
"""Schemas of MuJoCo for joints that close loops."""
GAINS = ("stiffness", "damping")
COUPLING = words("Tendon EqualityJoint MimicJoint Gear Rack")
"""In names of schemas that couple joints."""
IN_JOINT = (
    *words("body0 body1 localPos0 localRot0 localPos1 localRot1 jointEnabled collisionEnabled"),
    *words("excludeFromArticulation breakForce breakTorque axis lowerLimit upperLimit"),
    *words("coneAngle0Limit coneAngle1Limit minDistance maxDistance"),
)
IN_BODY = words(
    "rigidBodyEnabled kinematicEnabled simulationOwner startsAsleep velocity angularVelocity"
    " linearVelocity mass density centerOfMass diagonalInertia principalAxes collisionEnabled"
    " filteredPairs"
)
APART = (
    *words("velocity angularVelocity startsAsleep simulationOwner filteredPairs approximation"),
    *words("dynamicFriction staticFriction restitution filteredGroups invertFilteredGroups"),
    *words("mergeGroup collisionEnabled maxForce targetVelocity type stiffness damping position"),
    *words("targetPosition high low mass density centerOfMass diagonalInertia principalAxes"),
    *words("axis lowerLimit upperLimit coneAngle0Limit coneAngle1Limit gravityDirection"),
    *words("gravityMagnitude minDistance maxDistance breakForce breakTorque"),
)
"""Properties of UsdPhysics without meaning for kinematics, or for some prims with them."""
PHYSICS = (*TYPES, GENERIC, ROD, "PhysicsScene", "PhysicsCollisionGroup")
SCHEMAS = words(
    "PhysicsRigidBodyAPI PhysicsMassAPI PhysicsCollisionAPI PhysicsMeshCollisionAPI"
    " PhysicsMaterialAPI PhysicsArticulationRootAPI PhysicsFilteredPairsAPI PhysicsLimitAPI"
    " PhysicsDriveAPI PhysicsJointStateAPI"
)
"""Types and schemas of UsdPhysics."""
# Their schemas have names like those of UsdPhysics.
_VENDORS = ("Physx", "Newton", "Mjc")
_PLAIN = ("def", "Xform", "Scope")
_OF_READER = words("name path apis matrix variants")
# Of whatever may be drawn.
_SEEN = words("visibility purpose extent proxyPrim")
# These name bodies that they do not join.
_APART = words(
    "collection material proxyPrim skel isaac physics:filteredPairs physics:filteredGroups"
    " physics:simulationOwner"
)
_ENDS = "physics:body0", "physics:body1", ":referenceJoint"
_TARGETS = "newton:mimicJoint", "mjc:target"
DEGREE = math.radians(1.0)
EARTH = 9.81
"""Gravity of a scene unless given [m/s^2]."""
# Axes of a frame in single precision are square to each other within this; more is a shear.
SQUARE = 1e-5
# Two names are alike if a letter or two tell them apart.
CLOSE = 0.86
MOST_NAMED = 8


def read_usd(root: Element) -> Tree:
    """Return the tree of a stage, in its pose.

    Raises:
        CaseError: a joint of no known kind, an unknown body, or numbers that make no sense.
    """
    return _Reader(root).read()


class _Reader:
    """A stage during its reading.

    Attributes:
        prims: by path.
        names: of bodies, by path.
        rods: with frames in their links.
        moves: by joint.
    """

    def __init__(self, root: Element) -> None:
        self.root, self.graph = root, Graph.of(root, f"USD stage of {root.file.name}")
        self.graph.tree.zero = "its pose"
        self.metre, self.kilogram = (root.number(each) for each in UNITS[:2])
        self.prims = {each.attributes["path"]: each for each in root.descendants()}
        bodies = [path for path, each in self.prims.items() if _is_body(each)]
        self.names = short_names(bodies)
        self.joints: dict[str, FramedJoint] = {}
        self.rods: list[Closure] = []
        self.moves: dict[str, list[Move]] = {}

    def read(self) -> Tree:
        """Return the tree."""
        root, graph, tree = self.root, self.graph, self.graph.tree
        if not (self.metre > 0.0 and self.kilogram > 0.0):
            raise root.fault(
                "metersPerUnit, kilogramsPerUnit: expected positive numbers; correct them"
            )
        if "metersPerUnit" not in root.attributes["said"].split():
            tree.notes.append(f"metersPerUnit is not given: lengths are in {self.metre:g} m")
        for path, name in self.names.items():
            self._add_body(name, self.prims[path])
        joints = [each for each in root.descendants() if each.tag in (*TYPES, GENERIC, ROD)]
        self.joint_names = short_names([each.attributes["path"] for each in joints])
        self._require_apart()
        for element in joints:
            self._add_joint(element)
        self._hang()
        self._couple()
        tree.gravity = self._gravity()
        bodies = {name: self.prims[path] for path, name in self.names.items()}
        colliders: dict[str, list[Element]] = {}
        for path, element in self.prims.items():
            on = element.flag("physics:collisionEnabled", default=True)
            if COLLIDER in element.attributes["apis"].split() and on:
                colliders.setdefault(self._body_of(path), []).append(element)
        masses = StageMasses(self.prims, self._frame, self.metre, self.kilogram)
        graph.masses |= masses.of_bodies(bodies, colliders)
        graph.hang()
        self._keyframes()
        for each in filter(None, (each.attributes["variants"] for each in root.descendants())):
            tree.notes.append(f"variants that are read: {each}")
        if off := root.attributes["off"].split():
            tree.notes.append(f"not active: {shortened(off, MOST_NAMED)}")
        root.take(*UNITS, "said")
        return tree.settled(root, Apart("USD", {"": self._unread()}))

    def _unread(self) -> set[str]:
        """Return the unread properties without meaning for kinematics; count prims, and
        properties and schemas of other programs on bodies and joints.

        Raises:
            CaseError: a type, schema or property of UsdPhysics is unknown.
        """
        found, tree = set[str](), self.graph.tree
        bodies, read = {*self.names}, {*self.joint_names}
        for path, element in self.prims.items():
            element.take(*_OF_READER)
            if LEFT in element.marks:
                continue
            moves = path in bodies or path in read
            if element.tag not in (*_PLAIN, *PHYSICS):
                _require_of_physics(element, element.tag, PHYSICS)
                if not moves:
                    tree.count(element.tag)
            for api in element.attributes["apis"].split():
                name = api.partition(":")[0]
                if name not in (*SCHEMAS, *FOLLOWS, *CLOSES):
                    _require_of_physics(element, name, SCHEMAS)
                    tree.left_out[name] += moves
            for name in element.unasked:
                last = name.rpartition("physics:")[2]
                if last != name and last not in APART:
                    known = {*IN_JOINT, *IN_BODY, *APART}
                    raise element.unknown_attribute(name, sorted(known), "USD")
                other = ":" in name or (element.tag in (*_PLAIN, *PHYSICS) and name not in _SEEN)
                if last == name and other:
                    tree.left_out[f"{name} of {element.tag}"] += moves
                found.add(name)
        tree.left_out = +tree.left_out
        return found

    def _add_body(self, name: str, element: Element) -> None:
        graph, (place, _) = self.graph, self._frame(element)
        graph.places[name], graph.elements[name] = place, element
        if element.flag("physics:kinematicEnabled", default=False):
            graph.fixed.add(name)
            graph.tree.count("kinematic bodies, which stand still")
        if element.attributes.get("physxRigidBody:disableGravity") == "true":
            graph.tree.count("gravity compensation of bodies")

    def _frame(self, element: Element) -> tuple[Place, Sequence[float]]:
        """Return the global place of a prim [m], and its scales along its axes.

        Raises:
            CaseError: it is flat, sheared or mirrored.
        """
        numbers = element.numbers("matrix", 16)
        *axes, at = (vec(numbers[k : k + 3]) for k in (0, 4, 8, 12))
        sizes = [math.sqrt(axis @ axis) for axis in axes]
        if min(sizes) <= 1e-9 * max(sizes):
            raise element.fault("is scaled to nothing, expected a frame; correct its scale")
        x, y, z = ((1.0 / size) * axis for size, axis in zip(sizes, axes, strict=True))
        if max(abs(x @ y), abs(y @ z), abs(z @ x)) > SQUARE:
            raise element.fault(
                "is sheared by scales around its turn, in which a joint has no meaning; scale"
                " evenly, or in the prim itself"
            )
        if cross(x, y) @ z < 0.0:
            raise element.fault("is mirrored by its scale, expected a right-handed frame; turn it")
        return Place(self.metre * at, turn_of_axes(x, y, z)), sizes

    def _require_apart(self) -> None:
        """Refuse unread prims, schemas and relationships by which bodies may be joined, or joints
        coupled.
        """
        advice = "a joint of UsdPhysics; write it so, or leave it out by --without"
        for path, element in self.prims.items():
            apis = element.attributes["apis"].split()
            coupling = [
                api
                for api in apis
                if api.partition(":")[0] not in FOLLOWS and any(word in api for word in COUPLING)
            ]
            if coupling or any(word in element.tag for word in COUPLING):
                what = coupling[0] if coupling else element.tag
                raise element.fault(
                    f"is {what}, which may couple joints and is not read, expected {advice}"
                    f" {element.attributes['name']}"
                )
            known = path in self.joint_names
            schemas = {api.partition(":")[0] for api in apis}
            read = _ENDS if known else ()
            read += _TARGETS if not schemas.isdisjoint((*FOLLOWS, *CLOSES)) else ()
            named = {
                target: key
                for key, text in element.attributes.items()
                if text.startswith("/") and key != "path" and not key.startswith(_APART)
                if not key.endswith(read)
                for target in text.split()
            }
            joints = {self.joint_names[each] for each in named if each in self.joint_names}
            bodies = {self._body_of(each) for each in named if each not in self.joint_names}
            bodies |= {self._body_of(path)} if bodies - {""} and not known else set()
            bodies -= {""}
            odd = element.tag.endswith("Joint") and not known
            if odd or max(len(joints), len(bodies)) > 1 - known:
                what = "couple joints" if len(joints) > len(bodies) else "join bodies"
                names = shortened(sorted(joints | bodies), MOST_NAMED)
                by = f" by {', '.join(sorted({*named.values()}))}" if named else ""
                raise element.fault(
                    f"of type {element.tag} may {what}{' ' if names else ''}{names}{by} and is not"
                    f" read, expected {advice} {element.attributes['name']}"
                )

    def _body_of(self, path: str) -> str:
        """Return the name of the body around a prim; empty for the world."""
        while path not in self.names and path.count("/") > 1:
            path = path.rpartition("/")[0]
        return self.names.get(path, "")

    def _add_joint(self, element: Element) -> None:
        graph = self.graph
        if not element.flag("physics:jointEnabled", default=True):
            element.leave()
            graph.tree.notes.append(f"{element} is switched off and joins nothing (jointEnabled)")
            return
        (first, f), (second, g) = self._end_of_joint(element, 0), self._end_of_joint(element, 1)
        element.require_two(first or "the world", second or "the world")
        links = first or graph.add_world(), second or graph.add_world()
        if {*links} <= graph.fixed:
            graph.tree.leave(element, "joints of what stands still")
            return
        for key in ("physics:breakForce", "physics:breakTorque"):
            given = element.attributes.get(key, "inf") != "inf"
            if given and element.number(key) < INFINITE:
                graph.tree.count("forces at which joints break")
        name = self.joint_names[element.attributes["path"]]
        if element.tag == ROD:
            self._add_rod(name, element, links, (f, g))
            return
        freedoms = freedoms_of(element, name)
        if sum(UNKNOWNS[each.kind] for each in freedoms) == 6:
            graph.tree.notes.append(f"{element} holds nothing: none of its axes is locked")
            return
        apis = element.attributes["apis"]
        open_ = [x.key for x in freedoms if x.key and f"LimitAPI:{x.key}" not in apis]
        if element.tag == GENERIC and open_:
            graph.tree.notes.append(
                f"{element} leaves {', '.join(open_)} free, which have no PhysicsLimitAPI; Newton"
                " locks them"
            )
        if len(turns := [each.key for each in freedoms if each.kind == "hinge"]) == 2:
            graph.tree.notes.append(
                f"{element} turns about {' and then '.join(turns)}, a universal joint as in Newton;"
                " in PhysX no axis comes first, which is another joint for large turns"
            )
        closes = element.flag("physics:excludeFromArticulation", default=False)
        closes = closes or not CLOSES.isdisjoint(apis.split())
        freedoms = [replace(each, limit=self._limit(element, each)) for each in freedoms]
        self.joints[name] = FramedJoint(name, element, links, (f, g), freedoms, closes)

    def _end_of_joint(self, element: Element, side: int) -> tuple[str, Place]:
        """Return the body of a joint, empty for the world, and the joint's frame in it [m]."""
        at = element.numbers(f"physics:localPos{side}", 3, default=ZEROS)
        numbers = element.numbers(f"physics:localRot{side}", 4, default=(1.0, 0.0, 0.0, 0.0))
        if not any(numbers):
            raise element.fault(f"physics:localRot{side}: is zero, expected a turn; correct it")
        turn = unit_quaternion(quat(numbers))
        key = f"physics:body{side}"
        paths = element.attributes.get(key, "").split()
        if not paths:
            return "", Place(self.metre * vec(at), turn)
        if len(paths) > 1:
            raise element.fault(f"{key}: found {len(paths)} bodies, expected one; correct it")
        if paths[0] not in self.prims:
            raise element.unknown_name(key, paths[0], self.names, "a prim of the stage")
        prim = self.prims[paths[0]]
        place, scales = self._frame(prim)
        frame = Place(self.metre * vec([s * x for s, x in zip(scales, at, strict=True)]), turn)
        name = self._body_of(paths[0])
        if self.names.get(paths[0]):
            return name, frame
        frame = place * frame
        return name, frame.relative_to(self.graph.places[name]) if name else frame

    def _add_rod(
        self, name: str, element: Element, links: tuple[str, str], frames: tuple[Place, Place]
    ) -> None:
        least, most = (
            element.number(f"physics:{each}Distance", -1.0) * self.metre for each in ("min", "max")
        )
        if least < 0.0 and most < 0.0:
            self.graph.tree.notes.append(f"{element} holds nothing: it has no distance")
        elif least == most:
            self.rods.append(Closure(name, links, frames, element, "distance", most))
        else:
            raise element.fault(
                "physics:minDistance, physics:maxDistance: found a range, which acts at its ends"
                " alone, expected one length as both; correct them, or leave the joint out by"
                f" --without {element.attributes['name']}"
            )

    def _hang(self) -> None:
        """Place the bodies, and add joints and rods to the graph."""
        graph, own = self.graph, dict(self.graph.places)
        self.moves = join(graph, self.joints.values())
        self._note_moved_bodies(own)
        for rod in self.rods:
            places = global_frames(graph.places, rod.links, rod.places)
            graph.rods.append(replace(rod, places=places))

    def _unit(self, kind: Kind) -> float:
        """Return the unit of a coordinate [rad or m]."""
        return DEGREE if kind == "hinge" else self.metre

    def _limit(self, element: Element, freedom: FramedFreedom) -> Limit:
        if freedom.kind == "ball":
            return NO_LIMIT
        lower, upper = bounds_of(freedom.key)
        keys = {
            "lower": lower,
            "upper": upper,
            "velocity": "physxJoint:maxJointVelocity",
            "effort": f"drive:{freedom.key}:physics:maxForce",
        }
        unit = self._unit(freedom.kind)
        force = self.kilogram * self.metre ** (2 if freedom.kind == "hinge" else 1)
        said: dict[str, str] = {}
        for name, key in keys.items():
            said[name] = element.attributes.get(key, "-inf" if name == "lower" else "inf")
            if said[name] not in ("inf", "-inf"):
                said[name] = repr(element.number(key) * (force if name == "effort" else unit))
        if float(said["lower"]) > float(said["upper"]):
            raise element.fault(
                f"{lower}: is above {upper}, expected the lower one;"
                " exchange them, or write a PhysicsFixedJoint if it is locked"
            )
        return limit_of(element, said)

    def _couple(self) -> None:
        """Add mimic joints, and find the motors."""
        followers = set[str]()
        for joint in self.joints.values():
            for lead, powers in self._mimics(joint):
                move = self._one_move(joint.element, joint.name).name
                self.graph.couplings.append(mimic(move, lead.name, powers, joint.element))
                followers.add(move)
        for joint, move, axis in self._axes():
            said = joint.element.attributes
            gains = [said.get(f"drive:{axis.key}:physics:{each}") for each in GAINS]
            if f"{DRIVE}:{axis.key}" in said["apis"].split() and gains != ["0.0", "0.0"]:
                self.graph.tree.actuated.add(move.name)
        self.graph.tree.actuated -= followers

    def _axes(self) -> Iterator[tuple[FramedJoint, Move, FramedFreedom]]:
        for joint in self.joints.values():
            for move, axis in zip(self.moves[joint.name], joint.freedoms, strict=True):
                yield joint, move, axis

    def _mimics(self, joint: FramedJoint) -> Iterator[tuple[Move, Sequence[float]]]:
        """Yield the leader of a joint, and the coefficients by which it follows the leader's change
        since the pose of the stage [rad, m].
        """
        element = joint.element
        said, apis = element.attributes, element.attributes["apis"].split()
        ours = [key for key in said if key.endswith(":referenceJoint")]
        for key in ours:
            instance = key.split(":")[1]
            if f"{PHYSX_MIMIC}:{instance}" not in apis:
                raise element.fault(
                    f"{key}: found without the schema {PHYSX_MIMIC}:{instance}, so that PhysX does"
                    " not read it; apply the schema, or remove the relationship"
                )
        for api in apis:
            name, _, instance = api.partition(":")
            start = f"physxMimicJoint:{instance}:"
            if name == PHYSX_MIMIC:
                lead, unit, other = self._leader(joint, f"{start}referenceJoint")
                if unit != other:
                    raise element.fault(
                        f"{start}referenceJoint: joins a hinge with a slide, expected two alike;"
                        " correct it"
                    )
                if element.number(f"{start}naturalFrequency", 0.0) > 0.0:
                    self.graph.tree.notes.append(
                        f"{element} follows its joint by a spring in PhysX (naturalFrequency), and"
                        " exactly here"
                    )
                factor = -element.number(f"{start}gearing", 0.0)
                offset = -element.number(f"{start}offset", 0.0) * unit
            elif name == MUJOCO_MIMIC:
                key = "mjc:target" if said.get("mjc:target") else "newton:mimicJoint"
                lead, unit, other = self._leader(joint, key, angle=1.0)
                # both coordinates count from the stage's pose
                own = self._one_move(element, joint.name)
                offset = self._unit(own.kind) / unit  # Newton's is in degrees
                powers = enumerate(equality(element, offset))
                yield lead, [c * unit / other**k for k, c in powers]
                continue
            elif (
                name == NEWTON_MIMIC
                and MUJOCO_MIMIC not in apis
                and element.flag("newton:mimicEnabled", default=True)
            ):
                # a slope of coordinates in radians, and an offset in degrees
                lead, unit, other = self._leader(joint, "newton:mimicJoint", angle=1.0)
                factor = element.number("newton:mimicCoef1", 1.0) * unit / other
                follower = self._one_move(element, joint.name)
                offset = element.number("newton:mimicCoef0", 0.0) * self._unit(follower.kind)
            else:
                continue
            move = self._one_move(element, joint.name)
            yield lead, (offset + factor * lead.reference - move.reference, factor)

    def _leader(
        self, joint: FramedJoint, key: str, angle: float = DEGREE
    ) -> tuple[Move, float, float]:
        """Return the leader of a joint, and the units of both coordinates, of angles as given."""
        element = joint.element
        found = element.attributes.get(key, "").split()
        name = self.joint_names.get(found[0], "") if len(found) == 1 else ""
        if name not in self.joints:
            raise element.unknown_name(key, " ".join(found), self.joint_names, "a joint")
        lead, move = self._one_move(element, name), self._one_move(element, joint.name)
        unit, other = (angle if x.kind == "hinge" else self.metre for x in (move, lead))
        return lead, unit, other

    def _one_move(self, element: Element, name: str) -> Move:
        moves = self.moves[name]
        if len(moves) != 1 or not moves[0].is_axial:
            raise element.fault(
                f"couples {name!r}, expected joints with one coordinate; correct it"
            )
        return moves[0]

    def _gravity(self) -> Vector:
        """Return the gravity of the scene [m/s^2]."""
        scenes = [each for each in self.root.descendants() if each.tag == "PhysicsScene"]
        if len(scenes) > 1:
            self.graph.tree.notes.append(f"gravity is that of {scenes[0]}, the first scene")
        size, down = EARTH, ZEROS
        for scene in scenes[:1]:
            if scene.attributes.get("physics:gravityMagnitude", "-inf") != "-inf":
                given = scene.number("physics:gravityMagnitude")
                size = given * self.metre if given >= 0.0 else EARTH
            x, y, z = scene.numbers("physics:gravityDirection", 3, default=down)
            down = x, y, z
        if not any(down):
            down = coordinates(-AXES[self.root.choice("upAxis", (*AXES,), "Y")])
        return coordinates(size / math.hypot(*down) * vec(down))

    def _keyframes(self) -> None:
        """Add the targets of drives and the states of joints as keyframes."""
        tree, key = self.graph.tree, "{}:{}:physics:{}"
        for name, start, end in (
            ("target", "drive", "targetPosition"),
            ("state", "state", "position"),
        ):
            for joint, move, axis in self._axes():
                own = key.format(start, axis.key, end)
                if move.is_axial and own in joint.element.attributes:
                    value = joint.element.number(own) * self._unit(move.kind)
                    tree.starts.setdefault(name, []).append(f"{move.name}={value!r}")

    def _note_moved_bodies(self, own: Mapping[str, Place]) -> None:
        """Note bodies with a transform beside the place given by their joints."""
        graph = self.graph
        places = [each.at for each in graph.places.values()]
        size = max((math.dist([*a], [*b]) for a in places[:1] for b in places), default=0.0) or 1.0
        near = 10.0 ** (1 - graph.tree.digits)
        moved: list[str] = []
        for name, place in graph.places.items():
            apart = place.at - own[name].at
            turned = rotation_vector(place.turn * own[name].turn.conjugate())
            far, turn = math.sqrt(apart @ apart), math.sqrt(turned @ turned)
            if far > near * size or turn > near:
                moved.append(f"{name} by {far:.3g} m and {turn:.3g} rad")
        if moved:
            graph.tree.notes.append(
                "frames of joints place bodies elsewhere than their transforms:"
                f" {shortened(moved, MOST_NAMED)}"
            )


def _require_of_physics(element: Element, name: str, known: Sequence[str]) -> None:
    """Refuse a type or schema with almost a name of UsdPhysics."""
    alike = similar(name, known, CLOSE)
    if name.startswith("Physics") or (alike and not name.startswith(_VENDORS)):
        raise element.fault(f"found {name}, which UsdPhysics does not have; {remedy(name, known)}")


def _is_body(element: Element) -> bool:
    enabled = BODY in element.attributes["apis"].split()
    return enabled and element.flag("physics:rigidBodyEnabled", default=True)
