"""What a variation file has is read, or stops the run by name."""

import pytest
from kincheck.core.case.models.files import load
from kincheck.core.errors import CaseError
from kincheck.core.extensions.sweep.variation_file import read_variation

from ...support.case_texts import BASE, INLINE, write

NAME = "zq_unknown"


def test_unknown_name_of_variation_is_named(tmp_path):
    case = load(write(tmp_path, BASE + INLINE))
    head = 'schema = "kincheck-vary/1"\nmode = "monte_carlo"\n'
    tip = '[hardpoints.tip]\nat = "tip"\n'
    for text in (f"{NAME} = 1\n{tip}", f"{tip}[{NAME}.tip]\nx = 1\n", f"{tip}{NAME} = 1\n"):
        with pytest.raises(CaseError, match=NAME):
            read_variation(write(tmp_path, head + text, "vary.toml"), case)
