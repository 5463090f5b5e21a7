"""Tables of a sweep."""

import json

import numpy as np
import pytest
from kincheck.core.cli.main import main

from .test_vary import HEAD


def test_stored_hardpoint_named_like_output(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    file, stored = tmp_path / "hardpoints.json", tmp_path / "all.parquet"
    for name in ("rocker_tip_y", "variant"):
        varied = {name: {"at": "joints.rod.length", "half_width": 1.0}}
        file.write_text(json.dumps({**HEAD, "mode": "monte_carlo", "hardpoints": varied}))
        assert main(f"sweep rssr --vary {file} --samples 20 --store {stored}".split()) == 0
        table = parquet.read_table(stored)
        assert table.column_names[:2] == ["variant", f"{name}.offset"]
        assert table.column_names.count("rocker_tip_y") == 1
        offsets, values = (
            table[f"{name}.offset"].to_numpy(),
            np.array(table["rocker_tip_y"].to_pylist()),
        )
        assert 0.0 < np.abs(offsets).max() <= 1e-3
        assert values.shape == (20, 181)
        units = json.loads(table.schema.metadata[b"kincheck"])["units"]
        assert (units[f"{name}.offset"], units["rocker_tip_y"]) == ("m", "m")
