"""The spanning tree of a robot's links: each link hangs on one joint, the other joints close
loops.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator

from .robot import Connection, Loop, Robot


def spanned(robot: Robot) -> tuple[list[Connection], list[Loop]]:
    """Return the joints of the tree, outer ones first, and the loops.

    The tree begins at the fixed links, then at links without a joint above them. It takes the
    joints of a link in the order of the file. A joint from its second link to its first is
    reversed.
    """
    of_link: dict[str, list[Connection]] = {name: [] for name in robot.links}
    for joint in robot.joints:
        for name in joint.links:
            of_link[name].append(joint)
    tree: list[Connection] = []
    used, reached = set[int](), set[str]()

    def grow(starts: Iterable[str]) -> None:
        waiting = deque(name for name in starts if name not in reached)
        reached.update(waiting)
        while waiting:
            here = waiting.popleft()
            for joint in of_link[here]:
                there = joint.links[joint.links[0] == here]
                if id(joint) in used or there in reached:
                    continue
                used.add(id(joint))
                tree.append(joint if joint.links[0] == here else joint.reversed)
                reached.add(there)
                waiting.append(there)

    grow(name for name in robot.links if name in robot.fixed)
    seconds = {joint.links[1] for joint in robot.joints}
    for name in _free_ends(robot, seconds):
        grow([name])
    loops = [Loop(joint) for joint in robot.joints if id(joint) not in used]
    return tree, [*loops, *robot.loops]


def _free_ends(robot: Robot, seconds: set[str]) -> Iterator[str]:
    """Yield the links to begin at: those on no joint first, then all, for rings of joints."""
    yield from (name for name in robot.links if name not in seconds)
    yield from robot.links
