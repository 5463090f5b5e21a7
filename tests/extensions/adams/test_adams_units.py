"""Units of Adams datasets, by their definitions in SI."""

import re

import pytest
from kincheck.core.extensions.adams.dataset import read_dataset
from kincheck.core.extensions.adams.model import read_units

from ...support.adams_texts import UNITS
from ...support.case_texts import rows

INCH, POUND, G = 0.0254, 0.45359237, 9.80665
SIZES = """
LENGTH KILOMETER | 1e3
LENGTH CENTIMETER | 1e-2
LENGTH MICROMETER | 1e-6
LENGTH NANOMETER | 1e-9
LENGTH ANGSTROM | 1e-10
LENGTH INCH | INCH
LENGTH MICROINCH | 1e-6 * INCH
LENGTH MILS | INCH / 1000
LENGTH FOOT | 12 * INCH
LENGTH YARD | 36 * INCH
LENGTH MILE | 1760 * 36 * INCH
MASS GRAM | 1e-3
MASS MILLIGRAM | 1e-6
MASS MICROGRAM | 1e-9
MASS NANOGRAM | 1e-12
MASS TONNE | 1e3
MASS US_TON | 2000 * POUND
MASS POUND_MASS | POUND
MASS KPOUND_MASS | 1000 * POUND
MASS OUNCE_MASS | POUND / 16
MASS SLUG | POUND * G / (12 * INCH)
MASS SLINCH | POUND * G / INCH
TIME MILLISECOND | 1e-3
TIME MICROSECOND | 1e-6
TIME NANOSECOND | 1e-9
TIME MINUTE | 60
TIME HOUR | 60 * 60
TIME DAY | 24 * 60 * 60
FORCE CENTINEWTON | 1e-2
FORCE MILLINEWTON | 1e-3
FORCE MICRONEWTON | 1e-6
FORCE NANONEWTON | 1e-9
FORCE KNEWTON | 1e3
FORCE MEGANEWTON | 1e6
FORCE DYNE | 1e-5
FORCE KILOGRAM_FORCE | G
FORCE POUND_FORCE | POUND * G
FORCE KPOUND_FORCE | 1000 * POUND * G
FORCE OUNCE_FORCE | POUND * G / 16
FORCE POUNDAL | POUND * 12 * INCH
"""


@pytest.mark.parametrize(("unit", "size"), rows(SIZES, named=False))
def test_adams_unit_size_by_definition(tmp_path, unit, size):
    kind, unit = unit.split()
    text = re.sub(rf"{kind} = \w+", f"{kind} = {unit}", UNITS)
    units = read_units(read_dataset(tmp_path / "deck.adm", f"title\n{text}END\n", ()))
    assert getattr(units, kind.lower()) == pytest.approx(eval(size), rel=1e-15)
