"""Cases from hardpoints: files of named points, as suspension engineers use them, and templates of
suspensions.
"""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    commands={"templates": "command:PrintTemplates"},
    completions={"template": "templates:TEMPLATES"},
)
