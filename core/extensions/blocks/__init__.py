"""A mechanism as a list of blocks that are solved one after the other: components with compiled
programs, or one sparse system; both are followed by one walk.
"""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    needs=["llvm"],
    methods={
        "by size": "method:by_size",
        "component by component": "method:by_components",
        "one sparse system": "method:sparse",
    },
)
