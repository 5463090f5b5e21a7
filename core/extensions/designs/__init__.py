"""Many designs of one mechanism at once: one program whose lanes are the variants of the geometry,
with outputs, their slopes and forces.
"""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    needs=["slopes"],
    public={"Designs": "design_batch:Designs", "solve_designs": "design_batch:solve_designs"},
)
