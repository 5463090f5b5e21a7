"""Files of variations, what they give, and what their offsets move."""

import json

import numpy as np
from kincheck.core.extensions.sweep.variation_file import read_variation

HEAD = {"schema": "kincheck-vary/1", "units": {"length": "mm", "angle": "deg"}}


def vary_file(folder, hardpoints, mode="monte_carlo", **tables):
    """A file of these hardpoints, in millimetres and degrees."""
    path = folder / "vary.json"
    path.write_text(json.dumps({**HEAD, "mode": mode, "hardpoints": hardpoints, **tables}))
    return path


def vary(tmp_path, case, mode="monte_carlo", tables=None, **hardpoints):
    """The variation that a file of these hardpoints and tables gives."""
    return read_variation(vary_file(tmp_path, hardpoints, mode, **(tables or {})), case)


def moved(variation, **offsets):
    """Values of the places that move, with these offsets of coordinates [SI]; dots are written as
    two underscores.
    """
    names = [each.name.replace(".", "__") for each in variation.coordinates]
    column = np.array([offsets.pop(name, 0.0) for name in names])
    assert not offsets
    before = variation.values(np.zeros(len(names)))
    return {
        place: np.subtract(value, before[place])
        for place, value in variation.values(column).items()
    }
