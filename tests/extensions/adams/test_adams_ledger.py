"""What a dataset of Adams has is read, listed as left out, or stops the run by name."""

import random
import re

import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.errors import CaseError

from ...support.case_texts import write
from .decks import DECKS

NAME, PLACES = "zq_unknown", 12


@pytest.mark.parametrize("planted", [f"{NAME} = 1", "VX = 1"])
def test_planted_argument_is_named(planted, tmp_path):
    text = DECKS["Revolute_Case01"].read_text()
    heads = [*re.finditer(r"^(PART|MARKER|JOINT|UNITS)\b[^,\n]*", text, re.MULTILINE)]
    kinds = set()
    for found in random.Random(1).sample(heads, min(PLACES, len(heads))):
        changed = f"{text[: found.end()]}, {planted}{text[found.end() :]}"
        file = write(tmp_path, changed, "deck.adm")
        word = planted.split()[0]
        kinds.add(found[1])
        try:
            told = load(file, Supplied(recorded=True)).source
        except CaseError as error:
            told = str(error)
        assert word in told, found[0]
    assert len(kinds) > 2
