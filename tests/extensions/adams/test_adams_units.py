"""Units of Adams datasets, by their definitions in SI."""

import re

import pytest
from kincheck.core.extensions.adams.dataset import read_dataset
from kincheck.core.extensions.adams.model import read_units

from ...support.adams_texts import UNITS

INCH, POUND, G = 0.0254, 0.45359237, 9.80665
SIZES = {
    "LENGTH": {
        "KILOMETER": 1e3,
        "CENTIMETER": 1e-2,
        "MICROMETER": 1e-6,
        "NANOMETER": 1e-9,
        "ANGSTROM": 1e-10,
        "INCH": INCH,
        "MICROINCH": 1e-6 * INCH,
        "MILS": INCH / 1000,
        "FOOT": 12 * INCH,
        "YARD": 36 * INCH,
        "MILE": 1760 * 36 * INCH,
    },
    "MASS": {
        "GRAM": 1e-3,
        "MILLIGRAM": 1e-6,
        "MICROGRAM": 1e-9,
        "NANOGRAM": 1e-12,
        "TONNE": 1e3,
        "US_TON": 2000 * POUND,
        "POUND_MASS": POUND,
        "KPOUND_MASS": 1000 * POUND,
        "OUNCE_MASS": POUND / 16,
        "SLUG": POUND * G / (12 * INCH),
        "SLINCH": POUND * G / INCH,
    },
    "TIME": {
        "MILLISECOND": 1e-3,
        "MICROSECOND": 1e-6,
        "NANOSECOND": 1e-9,
        "MINUTE": 60,
        "HOUR": 60 * 60,
        "DAY": 24 * 60 * 60,
    },
    "FORCE": {
        "CENTINEWTON": 1e-2,
        "MILLINEWTON": 1e-3,
        "MICRONEWTON": 1e-6,
        "NANONEWTON": 1e-9,
        "KNEWTON": 1e3,
        "MEGANEWTON": 1e6,
        "DYNE": 1e-5,
        "KILOGRAM_FORCE": G,
        "POUND_FORCE": POUND * G,
        "KPOUND_FORCE": 1000 * POUND * G,
        "OUNCE_FORCE": POUND * G / 16,
        "POUNDAL": POUND * 12 * INCH,
    },
}


@pytest.mark.parametrize(
    ("kind", "unit"), [(kind, unit) for kind, sizes in SIZES.items() for unit in sizes]
)
def test_adams_unit_size_by_definition(tmp_path, kind, unit):
    text = re.sub(rf"{kind} = \w+", f"{kind} = {unit}", UNITS)
    units = read_units(read_dataset(tmp_path / "deck.adm", f"title\n{text}END\n", ()))
    assert getattr(units, kind.lower()) == pytest.approx(SIZES[kind][unit], rel=1e-15)
