"""Decks of Project Chrono against the results of ADAMS beside them;
`python -m tests.extensions.adams.decks` prints the table.
"""

import re
from pathlib import Path

import pytest
from kincheck import CaseError
from kincheck.core.case.models.files import load

from .decks import DECKS, WITHOUT_RESULTS, judged, line

# Springs whose results are of other numbers: the free force gives them away.
OTHER_SPRINGS = ("RotSpring_Case01", "TranSpring_Case01")
# Of the largest, what accelerations of six digits leave.
FORCES = 5e-6
RIGHT = [name for name in DECKS if name not in (*WITHOUT_RESULTS, *OTHER_SPRINGS)]


def test_chrono_decks_are_complete():
    assert len(DECKS) == 19
    assert len(RIGHT) == 16


@pytest.mark.parametrize("name", RIGHT)
def test_chrono_deck_has_adams_motion(name):
    found = judged(name)
    for quantity, (_, ratio) in found.rows.items():
        assert ratio <= 1.0, quantity
    free, largest = found.free
    assert free <= FORCES * largest + 1e-12


@pytest.mark.parametrize("name", RIGHT)
def test_chrono_deck_has_adams_reactions(name):
    found = judged(name)
    # torques are about the joint: forces at arms of two metres
    arm = 2.0 * found.force[1]
    for pair, beside in ((found.force, 0.0), (found.torque, arm)):
        if pair:
            assert pair[0] <= FORCES * max(pair[1], beside) + 1e-12


@pytest.mark.parametrize("name", OTHER_SPRINGS)
def test_chrono_deck_wrong_spring_is_found(name):
    free, largest = judged(name).free
    assert free > 0.1 * largest


def test_chrono_deck_corrected_spring_passes(tmp_path):
    """200 N m/rad and 10 N m s/rad, which the results are of."""
    text = DECKS["RotSpring_Case01"].read_text()
    changed = text.replace("- 1.0*RTOD*", "- 200.0*").replace("- 5.0E-002*RTOD*", "- 10.0*")
    assert changed != text
    file = tmp_path / "deck.adm"
    file.write_text(changed)
    free, largest = judged("RotSpring_Case01", file).free
    assert free <= FORCES * largest


def test_rack_through_pinion_axis_is_refused():
    with pytest.raises(CaseError, match=r"line 111: JOINT/3: the line of the rack's marker"):
        load(DECKS["RackPinion_Case01"])


PAGE = Path(__file__).parents[3] / "core/extensions/adams/docs/how-to/decks.md"
NUMBER = re.compile(r"\d[\d.]*(?:e[-+]\d+)?")


@pytest.mark.parametrize("name", DECKS)
def test_deck_page_table_matches_command(name):
    """Above rounding, which differs from machine to machine."""
    (shown,) = (x for x in PAGE.read_text("utf-8").split("\n") if x.startswith(f"| {name} |"))
    pairs = zip(NUMBER.findall(shown), NUMBER.findall(line(name)), strict=True)
    for one, other in ((float(a), float(b)) for a, b in pairs):
        assert other == pytest.approx(one, rel=0.2, abs=1e-6)
