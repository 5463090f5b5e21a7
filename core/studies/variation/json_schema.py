"""JSON Schema of variation files."""

from __future__ import annotations

from typing import Any

from ...case.io.json_schema import document_schema
from .variation_schema import (
    SCHEMA,
    CorrelationKeys,
    HardpointKeys,
    LimitKeys,
    LineKeys,
    VaryKeys,
    VaryUnits,
)


def variation_schema() -> dict[str, Any]:
    """Return the schema of variation files."""
    tables = {
        "hardpoints": HardpointKeys,
        "lines": LineKeys,
        "limits": LimitKeys,
        "correlations": CorrelationKeys,
    }
    return document_schema(SCHEMA, VaryKeys, tables, {"units": VaryUnits})
