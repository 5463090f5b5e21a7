"""Weights of the polynomial through earlier samples, by Lagrange's formula, for predictions."""

from __future__ import annotations

import numpy as np

from ...program import NODES, groups_behind, place_of
from ...trajectory import Array


def weights_of_groups(times: Array, lanes: int) -> Array:
    """Return the weights of `NODES` lanes of the previous groups, for samples in groups of so many
    lanes.

    Args:
        times: of the samples in the order of the walk, shape (n,).

    Returns:
        Shape (NODES, n): zero for the first groups, not finite if two nodes share a time.
    """
    behind = groups_behind(lanes) * lanes
    found, wanted = np.zeros((NODES, len(times))), np.arange(behind, len(times))
    nodes = [[group * lanes + lane] for group, lane in (place_of(k, lanes) for k in range(NODES))]
    found[:, wanted] = lagrange(times[wanted], times[wanted // lanes * lanes - behind + nodes])
    return found


def weights_of_samples(times: Array) -> Array:
    """Weights of the `NODES` samples before each, by the places at which they are kept
    (`Plan.past`); otherwise as above.
    """
    found, wanted = np.zeros((NODES, len(times))), np.arange(NODES, len(times))
    # the last sample that was kept at each place
    nodes = wanted - 1 - (wanted - 1 - np.arange(NODES)[:, None]) % NODES
    found[:, wanted] = lagrange(times[wanted], times[nodes])
    return found


def lagrange(times: Array, nodes: Array) -> Array:
    """Lagrange's weights for the times, shape (n,), of nodes for each; nodes and weights have shape
    (nodes, n).
    """
    found, ahead = np.empty_like(nodes), times - nodes
    with np.errstate(all="ignore"):
        for k, node in enumerate(nodes):  # one after the other: there may be millions of samples
            factors = ahead / (node - nodes)
            factors[k] = 1.0
            found[k] = factors.prod(axis=0)
    return found
