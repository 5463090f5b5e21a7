"""Cases from hardpoints: files of named points, as suspension engineers use them, and templates of
suspensions.
"""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    needs=["slopes", "yaml"],
    commands={"templates": "command:PrintTemplates"},
    completions={"template": "templates:TEMPLATES"},
    sections={"suspension": "suspension_section:SECTION"},
    readers={
        "chrono": "reader:CHRONO",
        "adams_car": "reader:ADAMS",
        "assetto": "reader:ASSETTO",
        "table": "reader:TABLE",
        "tree": "reader:TREE",
        "workbook": "reader:WORKBOOK",
    },
)
