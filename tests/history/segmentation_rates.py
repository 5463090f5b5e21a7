"""Measure false alarms and detections of change points on random series.

    python -m tests.history.segmentation_rates --series 1000

Noise: the share of series without any step in which one is found, and in which one stands at the
end, for the worse. Steps: the share of series whose changes are found, all, at the right places and
no others; sizes are in standard deviations of the noise, a step is a factor of two in time. To
measure another rule, give a module that has a function `change_points`:

    python -m tests.history.segmentation_rates --rule MODULE
"""

import argparse
import importlib
import math
import sys

import numpy as np

SPREAD, RUNS = 0.1, 40
LEAST, LASTING = math.log(1.5), 3
STEP = math.log(2.0)


def normal(rng, n=RUNS):
    return SPREAD * rng.standard_normal(n)


def correlated(rng):
    values = normal(rng)
    for k in range(1, RUNS):
        values[k] += 0.8 * values[k - 1]
    return values


def outliers(share):
    return lambda rng: normal(rng) + (rng.random(RUNS) < share) * rng.uniform(0.0, 1.1, RUNS)


NOISE = {
    "normal": normal,
    "heavy tails (Student's t, 3)": lambda rng: SPREAD * rng.standard_t(3, RUNS),
    "heavier (Cauchy)": lambda rng: SPREAD / 2 * rng.standard_cauchy(RUNS),
    "one night in ten is slow": outliers(0.1),
    "one night in five is slow": outliers(0.2),
    "slow at weekends": lambda rng: normal(rng) + 0.5 * (np.arange(RUNS) % 7 >= 5),
    "two machines, 30 % the slow one": lambda rng: math.log(3.0) * (rng.random(RUNS) < 0.3),
    "two machines, 10 % the slow one": lambda rng: math.log(3.0) * (rng.random(RUNS) < 0.1),
    "noisier at the end": lambda rng: normal(rng) * np.where(np.arange(RUNS) >= 27, 5.0, 1.0),
    "load: correlated": correlated,
    "load: random walk": lambda rng: normal(rng) + np.cumsum(normal(rng) / 2),
    "load: waves": lambda rng: (
        normal(rng) + 0.4 * np.sin(2 * np.pi * (np.arange(RUNS) / 25 + rng.random()))
    ),
    "load: slowly grows": lambda rng: normal(rng) + np.linspace(0.0, math.log(4.0), RUNS),
}
STEPS = {
    "8 good, 8 bad, 8 good, 8 bad": [8, 8, 8, 8],
    "three slow runs amid": [20, 3, 17],
    "three slow runs at the end": [37, 3],
    "a late step": [32, 8],
    "came and was repaired": [16, 8, 16],
}
SIZES = (3, 5, 7, 10)


def main(argv):
    """Print both tables."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.history.segmentation_rates",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--series", type=int, default=1000)
    parser.add_argument("--rule", default="kincheck.core.history.steps")
    options = parser.parse_args(argv)
    rule = importlib.import_module(options.rule).change_points
    print(f"{'found in noise [%]':34}{'any':>8}{'stands':>8}")
    for name, make in NOISE.items():
        rng, found, standing = np.random.default_rng(1), 0, 0
        for _ in range(options.series):
            values = make(rng)
            places = [0, *rule(values, least=LEAST, lasting=LASTING)]
            found += len(places) > 1
            standing += len(places) > 1 and np.median(values[places[-1] :]) > np.median(
                values[places[-2] : places[-1]]
            )
        print(
            f"{name:34}{100 * found / options.series:8.1f}{100 * standing / options.series:8.1f}",
            flush=True,
        )
    print(f"\n{'found of steps [%]':34}" + "".join(f"{f'{size} sd':>8}" for size in SIZES))
    for name, lengths in STEPS.items():
        level = np.repeat([STEP * (k % 2) for k in range(len(lengths))], lengths)
        expected = np.cumsum(lengths)[:-1].tolist()
        line = f"{name:34}"
        for size in SIZES:
            rng, found = np.random.default_rng(2), 0
            for _ in range(options.series):
                values = level + STEP / size * rng.standard_normal(len(level))
                found += rule(values, least=LEAST, lasting=LASTING) == expected
            line += f"{100 * found / options.series:8.1f}"
        print(line, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
