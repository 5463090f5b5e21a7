"""Names and numbers of reports in words."""

import pytest
from kincheck.core.harness.labels import number, output_label


def test_outputs_are_labelled_in_words() -> None:
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
def test_numbers_are_short_and_a_dash_is_no_zero(value: float | None, text: str) -> None:
    assert number(value) == text
