"""One mechanism solved again and again is made ready once."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
import pytest
from kincheck.core import Spherical, solve, solve_designs
from kincheck.core.analysis import model

from .mechanisms import mcpherson

STROKES = np.linspace(-0.05, 0.05, 21)


@pytest.fixture
def made(monkeypatch):
    """The requests that models were made for."""
    requests, make = [], model.compile_model
    monkeypatch.setattr(model, "compile_model", lambda *given: (requests.append(given[1]), make(*given))[1])
    return requests


def test_the_same_mechanism_and_request_need_one_model(made):
    first = solve(mcpherson(), "stroke", STROKES).points["wheel"]
    was = first.position.copy()
    other = solve(mcpherson(), "stroke", STROKES[::-1] / 2.0).points["wheel"]
    again = solve(mcpherson(), "stroke", STROKES).points["wheel"]
    assert len(made) == 1
    np.testing.assert_array_equal(first.position, was)
    np.testing.assert_array_equal(again.position, was)
    assert np.abs(other.position - was[::-1]).max() > 1e-3
    solve(mcpherson(), "stroke", STROKES, order=0)
    wheel = mcpherson().point("wheel").position
    higher = replace(mcpherson().point("wheel"), position=(*wheel[:2], wheel[2] + 0.01))
    moved = solve(replace(mcpherson(), points=[higher]), "stroke", STROKES).points["wheel"]
    assert len(made) == 3
    assert np.abs(moved.position - was).max() > 1e-3


def test_designs_too(made):
    place = "points.wheel.position"
    values = {place: np.array([mcpherson().point("wheel").position, (0.1, 0.7, 0.3)])}
    first, again = (solve_designs(mcpherson(), "stroke", STROKES, values).points["wheel"].position for _ in range(2))
    assert len(made) == 1
    np.testing.assert_array_equal(first, again)


def test_threads_share_it():
    alone = solve(mcpherson(), "stroke", STROKES).points["wheel"].acceleration.copy()
    with ThreadPoolExecutor(4) as threads:
        for found in threads.map(lambda _: solve(mcpherson(), "stroke", STROKES), range(24)):
            np.testing.assert_array_equal(found.points["wheel"].acceleration, alone)


@pytest.mark.usefixtures("own_joint_types")
def test_joints_of_a_users_own_are_made_anew(made):
    """They may be equal, and yet not mean the same."""

    @dataclass(frozen=True)
    class Ball(Spherical):
        type = "ball_of_mine"

    joints = [Ball(j.name, j.i, j.j, j.point) if type(j) is Spherical else j for j in mcpherson().joints]
    assert any(type(j) is Ball for j in joints)
    for _ in range(2):
        assert solve(replace(mcpherson(), joints=joints), "stroke", STROKES).solved.all()
    assert len(made) == 2
