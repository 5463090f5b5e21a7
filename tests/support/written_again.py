"""A case, written as a case file and read back."""

import numpy as np
from kincheck.core.case.io.case_file import case_text, load_case

# The grid is computed once in the model's coordinates, and once from the design.
GRID = 4.0 * np.finfo(float).eps


def written_again(case, folder):
    """Return the case that is read from what is written; it has the same parts."""
    file = folder / "written_again.toml"
    file.write_text(case_text(case), "utf-8")
    again = load_case(file)
    assert again.name == case.name
    assert again.mechanism == case.mechanism
    assert again.outputs == case.outputs
    assert again.assembly == case.assembly
    assert again.sweep.driver == case.sweep.driver
    assert again.sweep.rate == case.sweep.rate
    off = np.abs(again.sweep.change - case.sweep.change).max()
    assert off <= GRID * np.abs([case.sweep.values, case.sweep.change]).max()
    assert again.sweep.motions.keys() == case.sweep.motions.keys()
    return again
