"""Text of Exudyn scripts before the lines of a mechanism."""

from . import text


def beginning(loaded: bool) -> str:
    """Return the functions that the lines call; with masses and force elements if loaded."""
    masses, body = (text.LOADED, LOADED_BODY) if loaded else (text.PLAIN, PLAIN_BODY)
    return BEGINNING.replace("MASSES", masses).replace("BODY", body)


PLAIN_BODY = """
def body(name, position, initial, frame):
    frames[name], reference = frame, [*position, 1, 0, 0, 0]
    node = NodeRigidBodyEP(
        name=name, referenceCoordinates=reference, initialCoordinates=initial
    )
    nodes[name] = mbs.AddNode(node)
    rigid = ObjectRigidBody(name=name, mass=1, inertia=[1, 1, 1, 0, 0, 0], nodeNumber=nodes[name])
    bodies[name] = mbs.AddObject(rigid)
"""
LOADED_BODY = '''
forces = {}


def body(name, position, initial, frame, mass, center, inertia):
    """The centre of mass is from the origin; the inertia is about the origin."""
    frames[name], reference = frame, [*position, 1, 0, 0, 0]
    node = NodeRigidBodyEP(
        name=name, referenceCoordinates=reference, initialCoordinates=initial
    )
    nodes[name] = mbs.AddNode(node)
    rigid = ObjectRigidBody(
        name=name, mass=mass, inertia=inertia, centerOfMass=center, nodeNumber=nodes[name]
    )
    bodies[name] = mbs.AddObject(rigid)
    falling = mbs.AddMarker(MarkerBodyMass(bodyNumber=bodies[name]))
    mbs.AddLoad(LoadMassProportional(markerNumber=falling, loadVector=gravity))


def spring(name, first, second, **options):
    item = ObjectConnectorSpringDamper(
        name=name, markerNumbers=[marker(*first), marker(*second)], **options
    )
    forces[name] = mbs.AddObject(item)


def torsion(name, first, second, turn, **options):
    """A torsional spring-damper about the z axis of its markers, whose turn a node counts."""
    turns = mbs.AddNode(NodeGenericData(numberOfDataCoordinates=1, initialCoordinates=[turn]))
    item = ObjectConnectorTorsionalSpringDamper(
        name=name, markerNumbers=[marker(*first), marker(*second)], nodeNumber=turns, **options
    )
    forces[name] = mbs.AddObject(item)


def force(name, at, **options):
    item = LoadForceVector(markerNumber=marker(*at), **options)
    forces[name] = mbs.AddLoad(item)


def torque(name, at, **options):
    item = LoadTorqueVector(markerNumber=marker(*at), **options)
    forces[name] = mbs.AddLoad(item)
'''
BEGINNING = '''\
"""A mechanism in Exudyn, written by kincheck. Lengths are in m, angles in rad.

MASSES Drivers are not part of the model: the initial
coordinates are consistent with the driver values below. All bodies are parallel to the global axes
at design, in their reference coordinates, from which the state of Exudyn is measured; `frames` has
the Euler parameters of the bodies' own axes in these.
"""

import exudyn as exu
import numpy as np
from exudyn.itemInterface import *

SC = exu.SystemContainer()
mbs = SC.AddSystem()
ground = mbs.AddObject(ObjectGround())
nodes, bodies, frames, joints, coordinates, points = {}, {}, {}, {}, {}, {}

BODY

def marker(name, position, rotation=np.eye(3)):
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = rotation, position
    return mbs.AddMarker(MarkerBodyRigid(bodyNumber=bodies[name], localHT=frame))


def joint(name, kind, first, second, **options):
    item = kind(markerNumbers=[marker(*first), marker(*second)], **options)
    joints.setdefault(name, []).append(mbs.AddObject(item))


def translation(name, first, second, axis):
    """The displacement of the second point against the first along an axis of the first body."""
    (one, at), (two, there) = first, second
    points = dict(localPosition0=at, localPosition1=there)
    item = MarkerBodiesRelativeTranslationCoordinate(
        bodyNumbers=[bodies[one], bodies[two]], axis0=axis, **points
    )
    coordinates[name] = mbs.AddMarker(item)


def rotation(name, first, second, axis, initial):
    """The turn of the second body against the first; a node keeps it, and so counts the turns."""
    (one, at), (two, there) = first, second
    turns = mbs.AddNode(NodeGenericData(numberOfDataCoordinates=1, initialCoordinates=[initial]))
    points = dict(localPosition0=at, localPosition1=there)
    item = MarkerBodiesRelativeRotationCoordinate(
        nodeNumber=turns, bodyNumbers=[bodies[one], bodies[two]], axis0=axis, **points
    )
    coordinates[name] = mbs.AddMarker(item)


def relation(name, one, other, factor):
    """One coordinate is the factor times the other."""
    markers = [coordinates[one], coordinates[other]]
    item = ObjectConnectorCoordinate(markerNumbers=markers, factor1=factor)
    joints.setdefault(name, []).append(mbs.AddObject(item))


'''
END = "\nmbs.Assemble()\n"
