"""kincheck same: random robots in five formats, cut at any joint, in any order and direction.

For many more:

    KINCHECK_ROBOTS=30 pytest -m "" tests/extensions/same/test_same_robots.py
"""

import os
import re
from dataclasses import replace
from itertools import combinations, permutations

import numpy as np
import pytest
from kincheck.core.extensions.same.undriven import undriven_file
from kincheck.core.extensions.same.verdict import compare

from ...support.cut_models import FORMATS, LAWS, random_closed, written
from ...support.examples import examples

(CHANGES,) = examples(__file__, "changes")

SEEDS = range(int(os.environ.get("KINCHECK_ROBOTS", "8")))
LOST = re.compile(r"lost in (\S+): (.+) of ([^()]+?)( \(\w+ cannot say it\))?")


def files_of(robot, folder, seed):
    """The robot in all formats, and what is said in each, by format."""
    found = {}
    for k, form in enumerate(FORMATS):
        file, said = written(form, robot, folder, np.random.default_rng([seed, k]))
        found[form] = undriven_file(file), said
    return found


def lost(found):
    """Facts that are lost: file, fact and joint; other texts as they are."""
    facts = set()
    for text in found.lost:
        match = LOST.fullmatch(text)
        names = match[3].split(", ") if match else []
        facts |= {(match[1], match[2], name) for name in names} if match else {text}
    return facts


def require_same(seed, folder, pairs):
    """Nothing but what only one of two formats says is lost, and all of that."""
    robot = random_closed(seed, LAWS)
    files = files_of(robot, folder, seed)
    for (a, own), (b, theirs) in pairs(files.values(), 2):
        found = compare(a, b, {})
        if found.reason == "nothing moves in either file":
            continue
        assert found.verdict == "same", (a.name, b.name, found.reason)
        expected = set()
        for pair in robot.pairs:
            x, y = (said.get(pair.name, set()) for said in (own, theirs))
            expected |= {(b.name, law, pair.name) for law in x - y}
            expected |= {(a.name, law, pair.name) for law in y - x}
        assert lost(found) == expected, (a.name, b.name)


def test_robot_is_same_in_all_formats(tmp_path):
    require_same(2, tmp_path, combinations)


@pytest.mark.nightly
@pytest.mark.parametrize("seed", SEEDS)
def test_robots_are_same_in_all_pairs(seed, tmp_path):
    require_same(seed, tmp_path, permutations)


@pytest.mark.parametrize("form", FORMATS)
def test_moved_joint_differs_in_all_formats(form, tmp_path):
    robot = random_closed(2)
    first = robot.pairs[0]
    moved = replace(robot, pairs=[replace(first, at=first.at + 0.01), *robot.pairs[1:]])
    one, _ = written("SDF", robot, tmp_path, np.random.default_rng(1), name="one")
    other, _ = written(form, moved, tmp_path, np.random.default_rng(2), name="other")
    assert compare(undriven_file(one), undriven_file(other), {}).verdict == "differs"


@pytest.mark.by_day(4)
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.by_day(4)
@pytest.mark.parametrize("form", FORMATS)
def test_changed_law_is_listed(form, law, tmp_path):
    """A fact of one joint is three times as large."""
    robot = random_closed(2, LAWS)
    k = next(k for k, pair in enumerate(robot.pairs) if pair.laws)
    pair = robot.pairs[k]
    more = replace(pair, laws=pair.laws | {law: 3.0 * pair.laws[law]})
    changed = replace(robot, pairs=[*robot.pairs[:k], more, *robot.pairs[k + 1 :]])
    rngs = [np.random.default_rng(3) for _ in "ab"]
    (a, said), (b, _) = (
        written(form, each, tmp_path, rng, name=name)
        for each, rng, name in zip((robot, changed), rngs, "ab", strict=True)
    )
    found = compare(undriven_file(a), undriven_file(b), {})
    assert found.verdict == "same"
    fact = {"reference": "spring reference", "lower": "limits", "upper": "limits"}.get(law, law)
    assert len(found.lost) == (fact in said.get(pair.name, ()))
    assert all(text.startswith(f"{fact} of {pair.name}: ") for text in found.lost)


TENDONS = """<mujoco><compiler angle="degree"/><worldbody>
<body name="a"><joint name="first" type="ball" range="0 40" stiffness="2"/><geom size="0.1"/>
<site name="s" pos="0.1 0 0"/></body>
<body name="b" pos="1 0 0"><joint name="second" axis="0 1 0"/><geom size="0.1"/>
<site name="t" pos="0 0 0.1"/></body></worldbody><tendon>
<spatial name="rope" stiffness="7" damping="1" springlength="0.5" range="0 2">
<site site="s"/><site site="t"/></spatial>
<fixed name="sum" stiffness="3"><joint joint="second" coef="1"/></fixed></tendon></mujoco>"""


@pytest.mark.parametrize(("old", "new", "text"), CHANGES.values(), ids=CHANGES)
def test_tendons_and_balls_are_compared(old, new, text, tmp_path):
    assert TENDONS.count(old) == 1
    for name, content in (("a", TENDONS), ("b", TENDONS.replace(old, new))):
        (tmp_path / f"{name}.xml").write_text(content)
    a, b = (undriven_file(tmp_path / f"{name}.xml") for name in "ab")
    assert compare(a, a, {}).lost == []
    (found,) = compare(a, b, {}).lost
    assert text in found


def test_rest_without_spring_is_no_law(tmp_path):
    """A damper has no place of rest."""
    text = (
        '<mujoco><worldbody><body name="a"><joint name="J" damping="1"/><geom size="0.1"/></body>'
    )
    for name, rest in (("a", ""), ("b", ' springref="20"')):
        changed = text.replace(' damping="1"', ' damping="1"' + rest)
        (tmp_path / f"{name}.xml").write_text(f"{changed}</worldbody></mujoco>")
    found = compare(*(undriven_file(tmp_path / f"{name}.xml") for name in "ab"), {})
    assert (found.verdict, found.lost) == ("same", [])


@pytest.mark.needs("osim")
def test_format_without_words_is_named(tmp_path):
    robot = random_closed(2, LAWS)
    files = files_of(robot, tmp_path, 2)
    found = compare(files["MJCF"][0], files["URDF"][0], {})
    assert any("armature of" in text and "(URDF cannot say it)" in text for text in found.lost)
