"""Solved cases as code against truths: limits of cranks, random loops, balls of forty digits."""

import ctypes
from dataclasses import replace

import kincheck
import numpy as np
import pytest
from kincheck import cases
from kincheck.core.extensions.code import c
from kincheck.core.extensions.proofs.verified_reference import prove_case

from ...support.cut_models import closed_chain, written
from ...support.overconstrained_loops import FAMILIES, random_loop
from .test_code import LOCKS, MOTIONS, assert_equal, compiled, library, native, solve, write

PLACES = [
    f"joints.rod.points.{end} {axis}" for end, axis in ((0, "x"), (0, "y"), (1, "x"), (1, "y"))
]
PROVED = ("four_bar", "rssr", "mcpherson_strut", "bennett", "delta_robot")
DIGITS = 40


@pytest.fixture(scope="module")
def crank(tmp_path_factory):
    """The code of a crank and a slide, whose points are parameters."""
    folder = tmp_path_factory.mktemp("crank")
    (folder / "locks.toml").write_text(LOCKS)
    write(folder, c.files(kincheck.load(folder / "locks.toml"), PLACES))
    return library(folder, "locks")


def assert_locks(call, rng, count):
    """Beyond the ends of a slide, known by the triangle of crank and rod, there are no numbers."""
    state = (ctypes.c_double * (call("size") // 8))()
    out = (ctypes.c_double * 3)()
    for _ in range(count):
        arm, rod = rng.uniform(1.0, 2.0), rng.uniform(0.8, 1.6)
        at = rng.uniform(0.3, 1.2)  # of the pin
        pin = arm * np.array([np.cos(at), np.sin(at)])
        way = rng.uniform(-0.4, 0.4)  # of the rod, that leaves both ends in reach
        end = pin + rod * np.array([np.sin(way), -np.cos(way)])
        call("start", state)
        for k, value in enumerate((*pin, *end)):
            call("set", state, k, float(value))
        reach = np.sqrt((arm + rod) ** 2 - end[0] ** 2)
        inner = np.sqrt(max(0.0, (arm - rod) ** 2 - end[0] ** 2))  # nothing is nearer to the pivot
        ends = (inner, reach) if end[1] > inner > 0.0 else (-reach, -inner or reach)
        for limit in (each - end[1] for each in ends):
            assert call("move", state, 0.0, 1.0, out) == 0
            assert call("move", state, limit * (1.0 - 1e-6), 1.0, out) == 0
            before, told = bytes(state), bytes(out)
            for beyond in (limit * (1.0 + 1e-6), limit + np.sign(limit), 1e3 * limit):
                assert call("move", state, float(beyond), 1.0, out) == 2
            assert (bytes(state), bytes(out)) == (before, told)


@compiled
def test_ends_of_cranks_are_kept(crank):
    assert_locks(crank, np.random.default_rng(1), 10)


@compiled
@pytest.mark.nightly
def test_ends_of_two_hundred_cranks(crank):
    assert_locks(crank, np.random.default_rng(2), 200)


def loop_case(family, seed, folder):
    loop = closed_chain(random_loop(family, seed))
    file, _ = written("case", loop, folder, np.random.default_rng(seed), 12, f"{family}{seed}")
    return kincheck.load(file, kincheck.Supplied(closure=1e-9))


def assert_equals_native(family, seed, folder):
    case = replace(loop_case(family, seed, folder), name="loop")
    write(folder, c.files(case, ()))
    assert_equal(solve(library(folder, "loop", "-O1"), case), native(case))


@compiled
def test_random_loop_equals_native(tmp_path):
    """Its rows are redundant, and their choice is made by the export."""
    assert_equals_native("bennett", 1, tmp_path)


@compiled
@pytest.mark.nightly
@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("seed", [2, 3, 4])
def test_random_loops_equal_native(family, seed, tmp_path):
    assert_equals_native(family, seed, tmp_path)


def assert_proved(name, samples, folder):
    """Compare with enclosures of so many digits at some samples."""
    pytest.importorskip("flint")
    case = kincheck.load(name)
    few = np.linspace(0, len(case.sweep.values) - 1, samples).astype(int)
    case = replace(case, sweep=replace(case.sweep, values=case.sweep.values[few]), reference={})
    proved, _ = prove_case(case, digits=DIGITS, numbers="double", tol=1e-12)
    write(folder, c.files(case, ()))
    found = solve(library(folder, name, "-O2"), case)
    expected = np.full(found.shape, np.nan)
    for j, each in enumerate(each for each in case.outputs if not each.forces):
        for order, motion in enumerate(MOTIONS):
            texts = getattr(proved.outputs[each.name], motion)
            expected[:, j, order] = [np.nan if x is None else float(x) for x in texts]
    assert_equal(found, expected)


@compiled
def test_code_equals_forty_digits(tmp_path):
    assert_proved("four_bar", 3, tmp_path)


@compiled
@pytest.mark.nightly
@pytest.mark.parametrize("name", PROVED)
def test_code_of_five_equals_forty_digits(name, tmp_path):
    assert name in cases.names()
    assert_proved(name, 9, tmp_path)
