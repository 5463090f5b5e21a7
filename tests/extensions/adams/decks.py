"""Decks of Project Chrono against the results of ADAMS beside them:

    python -m tests.extensions.adams.decks

Each recorded sample is judged as it stands: rows of the deck's joint at the recorded pose, velocity
and acceleration, the reaction of the joint, and the force that nothing holds. (d): over what the
six printed digits allow, and for rates the integrator of ADAMS.
"""

import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.extensions.adams.dataset import read_dataset
from kincheck.core.extensions.adams.model import read_markers, read_places, read_units
from kincheck.core.extensions.residuals.replay import needed_forces, residuals
from kincheck.core.trajectory import BodyMotion
from scipy.spatial.transform import Rotation

from ...oracles import naive

DATA = Path(__file__).parents[2] / "data"
DECKS = {
    file.stem.removeprefix("test_").replace("TransSpring", "TranSpring"): file
    for file in sorted((DATA / "adams").glob("test_*.adm"))
}
WITHOUT_RESULTS = ("RackPinion_Case01",)
BODY, CENTRE = "PART_2", 201
DIGITS = 6
# What ADAMS' integrator leaves of velocities and accelerations, as parts of the largest: measured,
# as in tests/kinematics/test_replay.py.
INTEGRATED = {(7, 13): 2e-5, (13, 19): 2e-4}


def results(name):
    """Columns t, pose, velocity, acceleration of the body, then force and torque on the ground."""
    further = json.loads((DATA / "adams" / "further_results.json").read_text())["cases"]
    if name in further:
        return np.array(further[name])
    motions = json.loads((DATA / "adams_single_joints.json").read_text())["cases"]
    forces = json.loads((DATA / "adams_joint_reactions.json").read_text())["cases"][name]
    reactions = [forces[f"reaction_{what}_on_ground"] for what in ("force", "torque")]
    return np.hstack([np.array(motions[name]["samples"]), *map(np.array, reactions)])


def half_digits(numbers):
    """Half a unit of the last of six digits."""
    size = np.abs(numbers)
    first = np.floor(np.log10(np.where(size > 0.0, size, 1.0)))
    return 0.5 * 10.0 ** (first - (DIGITS - 1)) * (size > 0.0)


def mechanism_of(file):
    """The deck's mechanism; its body's frame is that of the marker which was recorded."""
    found = load(file, Supplied(recorded=True)).mechanism
    data = read_dataset(file, file.read_text(), ())
    units = read_units(data)
    places, _ = read_places(data, units)
    marker = read_markers(data, units)[CENTRE]
    place = marker.place.relative_to(places[marker.part])
    x, y, z, w = Rotation.from_matrix(place.axes).as_quat()
    (body,) = found.bodies
    body = replace(body, origin=tuple(place.origin), euler_parameters=(w, x, y, z))
    return replace(found, bodies=[body], drivers=())


@dataclass(frozen=True)
class Judged:
    """Largest residual of each quantity and over its digits; reaction, torque and free force, off
    and largest. None where there is no joint, or a spring has the recorded force.
    """

    rows: dict[str, tuple[float, float]]
    force: tuple[float, float] | None
    torque: tuple[float, float] | None
    free: tuple[float, float]


def judged(name, file=None):
    """Judge a deck by its results."""
    mechanism = mechanism_of(file or DECKS[name])
    numbers = results(name)
    times, body, force, torque = np.split(numbers, [1, 20, 23], axis=1)
    half = half_digits(body)
    A = np.array([naive.A(p / np.linalg.norm(p)) for p in body[:, 3:7]])
    for ends, share in INTEGRATED.items():
        part = slice(*ends)
        largest = np.abs(body[:, part]).max(axis=0)
        half[:, part] += share * np.repeat([largest[:3].max(), largest[3:].max()], 3)
    for part in (slice(10, 13), slice(16, 19)):  # global there
        body[:, part] = np.einsum("nji,nj->ni", A, body[:, part])
        half[:, part] = np.einsum("nji,nj->ni", np.abs(A), half[:, part])
    parts = [{BODY: body[:, each]} for each in (slice(0, 7), slice(7, 13), slice(13, 19))]
    rows = {}
    if mechanism.joints:
        found = residuals(mechanism, *parts, digits={BODY: half})
        for quantity in ("position", "velocity", "acceleration"):
            # beside what is printed as zero there is round-off of numbers up to some hundred metres
            worst = found.worst(quantity, 1e-13)
            largest = float(np.abs(getattr(found, quantity)).max())
            rows[quantity] = largest, worst.value / worst.allowed
    p = body[:, 3:7] / np.linalg.norm(body[:, 3:7], axis=1)[:, None]
    motion = BodyMotion(body[:, :3], p, body[:, 7:13], body[:, 13:19])
    needed = needed_forces(mechanism, {BODY: motion}, times[:, 0])
    free = float(np.nanmax(np.abs(needed.free[BODY]))), needed.largest
    if not mechanism.joints or mechanism.forces:
        return Judged(rows, None, None, free)
    (joint,) = mechanism.joints
    reaction = needed.forces.joints[joint.name]
    # on the second body: the ground, but for distances, whose body is the second
    sign = 1.0 if joint.j == "ground" else -1.0
    off = float(np.abs(sign * reaction.force - force).max()), float(np.abs(force).max())
    off_torque = float(np.abs(sign * reaction.moment - torque).max()), float(np.abs(torque).max())
    return Judged(rows, off, off_torque if joint.type != "distance" else None, free)


def line(name):
    """A line of the table."""
    if name in WITHOUT_RESULTS:
        return f"| {name} | no results |" + " |" * 5
    found = judged(name)
    cells = [
        f"{found.rows[q][0]:.1e} ({found.rows[q][1]:.2g})" if q in found.rows else "-"
        for q in ("position", "velocity", "acceleration")
    ]
    cells += [
        f"{pair[0]:.1e} of {pair[1]:.3g}" if pair else "-"
        for pair in (found.force, found.torque, found.free)
    ]
    return f"| {name} | {' | '.join(cells)} |"


def main():
    """Print the table."""
    heads = "deck, position [m] (d), velocity [m/s] (d), acceleration [m/s^2] (d)"
    heads += ", reaction [N], torque [N m], free [N]"
    print(f"| {heads.replace(', ', ' | ')} |")
    print("|---" * 7 + "|")
    for name in DECKS:
        print(line(name))


if __name__ == "__main__":
    main()
