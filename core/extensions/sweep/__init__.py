"""Studies of a design: its hardpoints varied, its outputs reduced over all variants."""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    needs=["cluster", "designs"],
    commands={"sweep": "command:Sweep"},
    public={
        "DesignCurves": "curves:DesignCurves",
        "curves": "curves:curves",
        "curves_by_chunk": "curves:curves_by_chunk",
        "sweep": "command:Sweep",
    },
    schemas={"variation": "variation_schema:variation_schema"},
    keys={"variation": "variation_schema:__doc__"},
)
