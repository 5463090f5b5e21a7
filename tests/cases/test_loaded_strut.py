"""The strut with masses: its forces in the file are those of an independent solution."""

import csv
from dataclasses import replace

from kincheck import cases
from kincheck.core.studies.truth.forces import known_forces
from kincheck.core.studies.truth.motion import followed


def test_loaded_strut_file_equals_force_truth():
    case = cases.load("mcpherson_strut_loaded")
    case = replace(case, sweep=replace(case.sweep, values=case.sweep.values[::8]))
    known = known_forces(case, followed(case))
    assert len(known) == 7
    for name, each in known.items():
        printed = case.reference[name].position[::8]
        assert each.determined.all()
        assert abs(printed - each.values).max() <= 1e-12 * abs(printed).max()


def test_loaded_strut_moves_as_strut():
    def rows(name):
        lines = (cases.FOLDER / f"{name}.csv").read_text().splitlines()
        return [*csv.DictReader(line for line in lines if not line.startswith("#"))]

    for plain, loaded in zip(rows("mcpherson_strut"), rows("mcpherson_strut_loaded"), strict=True):
        assert plain.items() <= loaded.items()
