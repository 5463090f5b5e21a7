"""Formulas over time, in the notation of Adams: values and rates by closed forms."""

import numpy as np
import pytest
from kincheck import MechanismError
from kincheck.core.extensions.formulas.motion import Formula

T = np.linspace(0.11, 1.87, 13)
S, C = np.sin(2 * T), np.cos(2 * T)
PART = (T - 0.5) / 0.8
INSIDE = (PART > 0.0) & (PART < 1.0)
W = np.clip(PART, 0.0, 1.0)
FORMULAS = {
    "SIN(2*TIME)**2": (S**2, 4 * S * C, 8 * (C**2 - S**2)),
    "-2**2 + 3*TIME**2/6": (-4 + T**2 / 2, T, 1.0 + 0 * T),
    "(1+TIME)*COS(2*time)": ((1 + T) * C, C - 2 * (1 + T) * S, -4 * S - 4 * (1 + T) * C),
    "1/(1+TIME)": (1 / (1 + T), -1 / (1 + T) ** 2, 2 / (1 + T) ** 3),
    "SQRT(4*TIME)": (2 * T**0.5, T**-0.5, -0.5 * T**-1.5),
    "SHF(TIME, 0.1, 3, 2, 30D, 1)": (
        1 + 3 * np.sin(2 * (T - 0.1) - np.pi / 6),
        6 * np.cos(2 * (T - 0.1) - np.pi / 6),
        -12 * np.sin(2 * (T - 0.1) - np.pi / 6),
    ),
    "POLY(TIME, 1, 1D0, 2, -3)": (1 + 2 * (T - 1) - 3 * (T - 1) ** 2, 2 - 6 * (T - 1), -6 + 0 * T),
    "STEP(TIME, 0.5, 1, 1.3, 3)": (
        1 + 2 * W * W * (3 - 2 * W),
        2 * 6 * W * (1 - W) / 0.8,
        2 * (6 - 12 * W) * INSIDE / 0.64,
    ),
    "STEP(TIME, 0.5, 0, 1.3, TIME)": (
        T * W * W * (3 - 2 * W),
        W * W * (3 - 2 * W) + T * 6 * W * (1 - W) / 0.8,
        2 * 6 * W * (1 - W) / 0.8 + T * (6 - 12 * W) * INSIDE / 0.64,
    ),
    "PI*DTOR*RTOD": (np.pi + 0 * T, 0 * T, 0 * T),
}


@pytest.mark.parametrize("formula", FORMULAS)
def test_formula_has_exact_rates(formula):
    for found, expected in zip(Formula(formula).at(T), FORMULAS[formula], strict=True):
        assert found == pytest.approx(expected, rel=1e-12, abs=1e-13)


def test_formula_scales_value_and_time():
    found = Formula("TIME**2", 3.0, 0.5, 0.1).at(T)
    for one, expected in zip(found, (0.5 + 300 * T**2, 600 * T, 600 + 0 * T), strict=True):
        assert one == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize(
    "formula",
    ["", "TIME +", "(TIME", "TIME)", "2 TIME", "FOO(1)", "TIME(1)", "STEP(1,2)", "TIME**TIME"]
    + ["1/0", "9**9**9**9", "1E999", "STEP(TIME,1,0,1,1)", "SQRT(-1)", "(" * 60 + "1" + ")" * 60]
    + ["().__class__", "1;2", "a=3", "TIME if 1 else 2", "x" * 20_000, "2**" * 3000 + "2"],
    ids=lambda text: text[:20] or "empty",
)
def test_formula_in_bad_syntax_is_refused(formula):
    with pytest.raises(MechanismError, match="formula motion: "):
        Formula(formula)
