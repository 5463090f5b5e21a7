"""Names and numbers of reports in words."""

import pytest
from kincheck.core.errors import number_of, with_article
from kincheck.core.harness.labels import number, output_label

from ..support.examples import examples

(NOUNS,) = examples(__file__, "nouns")


def test_output_labels():
    assert output_label("half_track_change") == "half-track change"
    assert output_label("half_track_change.per_travel") == "half-track change per travel"
    assert output_label("kingpin_inclination.per_travel") == "kingpin inclination per travel"
    assert output_label("tip.x") == "tip.x"


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "–"),
        (0.0, "0"),
        (1.25e-16, "1.25e-16"),
        (1e-9, "1e-9"),
        (12.345, "12.3"),
        (1543.2, "1543"),
        (2e7, "2e7"),
    ],
)
def test_number_text(value, text):
    assert number(value) == text


@pytest.mark.parametrize(
    ("noun", "text"),
    NOUNS,
)
def test_noun_with_article(noun, text):
    assert with_article(noun) == text


def test_count_with_noun():
    assert [number_of(k, "case") for k in (0, 1, 2)] == ["0 cases", "1 case", "2 cases"]
    assert number_of(2, "assembly", "assemblies") == "2 assemblies"
