"""Templates of suspensions: each file the roles of its hardpoints and a function from their places
to joints.
"""

from .base import Role, Template
from .double_wishbone import DOUBLE_WISHBONE
from .five_link import FIVE_LINK
from .mcpherson import MCPHERSON

TEMPLATES = {template.name: template for template in (MCPHERSON, DOUBLE_WISHBONE, FIVE_LINK)}
"""By the name that --template takes."""

__all__ = ["TEMPLATES", "Role", "Template"]
