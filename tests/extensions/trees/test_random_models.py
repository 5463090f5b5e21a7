"""Random models and tables of every format: what `kincheck import` writes is the same case.

For many more of each:

    KINCHECK_MODELS=500 pytest tests/extensions/trees/test_random_models.py
"""

import importlib.util
import json
import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.errors import CaseError
from kincheck.core.extensions.hardpoints.programs import without_comments
from kincheck.core.extensions.hardpoints.templates import TEMPLATES, sample_table
from kincheck.core.extensions.same.undriven import undriven_file
from kincheck.core.extensions.same.verdict import compare
from kincheck.core.kinematics import NativeSolver

from ...support.model_files import driven
from ...support.random_models import FORMATS, random_robot
from ...support.written_again import GRID, written_again

if importlib.util.find_spec("pxr") is None:
    FORMATS = {kind: write for kind, write in FORMATS.items() if kind != "USD"}
MODELS = int(os.environ.get("KINCHECK_MODELS", "2"))
DATA = Path(__file__).parents[2] / "data" / "hardpoints"
ADAMS = (DATA / "adams_front_suspension.sub").read_text()
CHRONO = sorted(DATA.glob("chrono_*.json"))


def poses(case):
    """Return positions and Euler parameters of all bodies, shape (bodies, samples, 7)."""
    names = tuple(body.name for body in case.mechanism.moving)
    solver = NativeSolver(order=0, compiled=False)
    found = solver.prepare(case.mechanism, case.sweep.path, bodies=names)(1e-12)
    return np.array([np.hstack([each.r, each.p]) for each in found.bodies.values()])


def same_numbers(case, folder):
    """Compare a case with what is written and read back, bit for bit.

    The sweep of a model is computed once in the model's coordinates and once from the design: its
    last digit, not that of any other number, may differ, and moves the poses by as much.
    """
    again = written_again(case, folder)
    one, other = poses(case), poses(again)
    assert one.shape == other.shape
    if np.array_equal(case.sweep.change, again.sweep.change):
        assert np.array_equal(one, other, equal_nan=True)
    else:
        assert np.allclose(one, other, rtol=0, atol=1e3 * GRID, equal_nan=True)


def model_file(kind, robot, folder):
    """Write a robot in a format, and return its file."""
    texts = FORMATS[kind](robot)
    for ending, text in texts.items():
        (folder / f"model.{ending}").write_text(text)
    return folder / f"model.{next(iter(texts))}"


def random_case(kind, seed, folder):
    """Return the case of a random model; None of one that does not move."""
    robot = random_robot(seed)
    start = float(robot.links[0].law[2]) if kind == "MJCF" else 0.0  # its reference
    drive = f"ja0:{start - 0.02!r}:{start + 0.05!r}:3"
    try:
        return load(model_file(kind, robot, folder), driven(drive, hold_rest=True))
    except CaseError as error:
        if "freedom" in str(error):
            return None
        raise


@pytest.mark.by_day(2)
@pytest.mark.parametrize("kind", FORMATS)
def test_random_model_round_trip(kind, tmp_path):
    found = [random_case(kind, seed, tmp_path) for seed in range(1, MODELS + 1)]
    moving = [case for case in found if case is not None]
    assert len(moving) >= 0.9 * MODELS
    for case in moving:
        assert len(case.mechanism.joints) > len(case.mechanism.moving)  # a loop
        same_numbers(case, tmp_path)


@pytest.mark.parametrize("kind", [kind for kind in FORMATS if kind != "MJCF"])
@pytest.mark.parametrize("seed", range(2, MODELS + 1))
def test_random_robot_agrees_with_mjcf(kind, seed, tmp_path):
    """The robot without what only MJCF can say."""
    robot = replace(random_robot(seed), loose=False)
    mjcf, other = (undriven_file(model_file(each, robot, tmp_path)) for each in ("MJCF", kind))
    found = compare(mjcf, other, {})
    assert found.verdict == "same", found.reason


def moved(rng, text):
    """Return a text with each decimal number moved by up to 2."""
    return re.sub(
        r"-?\d+\.\d+", lambda number: f"{float(number[0]) + rng.uniform(-2, 2):.6f}", text
    )


def plain(rng, seed):
    head, rows = sample_table(TEMPLATES[[*TEMPLATES][seed % len(TEMPLATES)]]).split("meaning\n")
    rows = re.sub(r",(-?\d+)(?=,)", r",\1.0", re.sub(r",(-?\d+)(?=,)", r",\1.0", rows))
    return "car.csv", f"{head}meaning\n{moved(rng, rows)}", Supplied(travel="0.01:3")


def adams(rng, seed):
    head, blocks = ADAMS.split("z_value}", 1)
    options = Supplied("double_wishbone", travel="0.01:3")
    return "car.sub", f"{head}z_value}}{moved(rng, blocks)}", options


def chrono(rng, seed):
    data = json.loads(without_comments(CHRONO[seed % len(CHRONO)].read_text()))

    def walk(value):
        if isinstance(value, dict):
            return {key: walk(each) for key, each in value.items()}
        if isinstance(value, list) and len(value) == 3:
            return [x + 1e-3 * rng.uniform(-1, 1) for x in value]
        return value

    return "car.json", json.dumps(walk(data)), Supplied(travel="0.01:3")


@pytest.mark.parametrize("table", [plain, adams, chrono])
def test_random_table_round_trip(table, tmp_path):
    for seed in range(MODELS):
        name, content, options = table(np.random.default_rng(seed), seed)
        file = tmp_path / name
        file.write_text(content)
        same_numbers(load(file, options), tmp_path)
