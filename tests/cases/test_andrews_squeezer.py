"""Andrews' squeezer mechanism against its published start, accelerations and states."""

import mpmath as mp
import numpy as np
import pytest
from kincheck.adapters.native import Native
from kincheck.cases import Jet, andrews_squeezer, load
from kincheck.cases.vectors import Circle

from ..support.fakes import swept

# Andrews' squeezer: the equations and both states are those of the Bari test set for initial value
# problems, problem andrews

START = (
    "-0.0617138900142764496358948458001",
    "0",
    "0.455279819163070380255912382449",
    "0.222668390165885884674473185609",
    "0.487364979543842550225598953530",
    "-0.222668390165885884674473185609",
    "1.23054744454982119249735015568",
)


LATER = (
    (15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948),
    (0.5244099658805304, 1.048080741042263),
)


# of beta and gamma
LATER_RATES = (1139.920302151208, -24631.76316945196), (11.03291221937134, 324102.5686413781)


def closure(q, x_b):
    """The six published constraints [m]; q: beta, Theta, gamma, Phi, delta, Omega, epsilon."""
    beta, theta, gamma, phi, delta, omega, epsilon = map(mp.mpf, q)
    rr, d, ss, e, zt, zf, u = map(
        mp.mpf, ("7e-3", "28e-3", "35e-3", "2e-2", "4e-2", "2e-2", "4e-2")
    )
    xa, ya, xb, yb = map(mp.mpf, ("-.06934", "-.00227", x_b, ".03273"))
    x = rr * mp.cos(beta) - d * mp.cos(beta + theta)
    y = rr * mp.sin(beta) - d * mp.sin(beta + theta)
    return [
        x - ss * mp.sin(gamma) - xb,
        y + ss * mp.cos(gamma) - yb,
        x - e * mp.sin(phi + delta) - zt * mp.cos(delta) - xa,
        y + e * mp.cos(phi + delta) - zt * mp.sin(delta) - ya,
        x - zf * mp.cos(omega + epsilon) - u * mp.sin(epsilon) - xa,
        y - zf * mp.sin(omega + epsilon) + u * mp.cos(epsilon) - ya,
    ]


def test_andrews_published_start_closes():
    """In the published equations to 1e-30 m, in the case as it stands to 1e-17 m; with the misprint
    found of B it stays open.
    """
    with mp.workdps(40):
        assert max(map(abs, closure(START, "-.03635"))) < 1e-30
        assert max(map(abs, closure(START, ".03635"))) == pytest.approx(0.0727, abs=1e-12)
    case = load("andrews_squeezer")
    engine, still = Native(), swept(case, np.zeros(1))
    found = engine.solve(engine.build(still), still, 1e-12)
    assert max(found.residual, found.details["redundant_residual"]) <= 1e-17
    for point in case.mechanism.points:
        assert np.abs(found.points[point.name].position[0] - point.position).max() <= 1e-17


def test_andrews_published_start_acceleration():
    """The crank starts from rest with 14222.44 rad/s^2, the rod on it with -10666.83, and all else
    stays: E and D do not move.
    """
    rest, pull = np.zeros(1), np.array([14222.4439199541138705911625887])
    points = andrews_squeezer.motion(Jet(rest, rest, pull))
    x, y, _ = points["F"]
    beta = -0.0617138900142764496358948458001
    along = x.a * -np.sin(beta) + y.a * np.cos(beta)
    # E stays, so what F has turns the rod, 28 mm long; its angle Theta is counted from the crank's
    assert along / 0.028 - pull == pytest.approx([-10666.8329399655854029433719415], rel=1e-14)
    for name in "EDGH":
        assert max(np.abs(jet.a).max() for jet in points[name]) < 1e-8


def test_andrews_published_state_after_turns():
    """t = 0.03 s, computed by others to 1e-14: the constraints hold, and the crank alone leads to
    the rest, rates included.
    """
    (beta, theta, gamma, phi), (delta, epsilon) = LATER
    assert (
        max(map(abs, closure((beta, theta, gamma, phi, delta, -phi, epsilon), "-.03635"))) < 1e-16
    )
    crank, arm = LATER_RATES
    E = andrews_squeezer.motion(
        Jet(*(np.array([each]) for each in (beta - andrews_squeezer.START, *crank)))
    )["E"]
    angle = Jet(*(np.array([each]) for each in (gamma, *arm)))
    circle = Circle(
        andrews_squeezer.B, (0.0, -andrews_squeezer.SS, 0.0), (andrews_squeezer.SS, 0.0, 0.0)
    )
    for found, published in zip(E, circle.turned(angle), strict=True):
        assert found.x == pytest.approx(published.x, abs=1e-15)
        assert found.v == pytest.approx(published.v, abs=1e-8)
        # the integration that found it kept its accelerations to 1e-6
        assert found.a == pytest.approx(published.a, rel=1e-6, abs=1e-2)
