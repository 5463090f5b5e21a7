"""What a case file has is read, or stops the run by name."""

import re

import pytest
from kincheck import CaseError
from kincheck.core.case.models.files import load

from ..support.case_texts import BASE, INLINE, write

NAME = "zq_unknown"
HEADINGS = re.findall(r"\[([\w.]+)\]", BASE + INLINE)


@pytest.mark.parametrize("heading", ["", *HEADINGS])
def test_planted_key_of_case_is_named(heading, tmp_path):
    text = BASE + INLINE
    line = f"{NAME} = 1\n"
    text = text.replace(f"[{heading}]\n", f"[{heading}]\n{line}", 1) if heading else line + text
    with pytest.raises(CaseError, match=NAME):
        load(write(tmp_path, text))


@pytest.mark.parametrize("kind", ["bodie", "joint", "point", "driver", "output", "force"])
def test_singular_table_is_named(kind, tmp_path):
    for text in (f"[{kind}.a]\nb = 1\n", f"[{kind}]\nb = 1\n"):
        with pytest.raises(CaseError, match=f"{kind}: "):
            load(write(tmp_path, BASE + INLINE + text))
