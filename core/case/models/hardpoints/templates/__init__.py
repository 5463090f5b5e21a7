"""Templates of suspensions. Each file has the roles of its hardpoints, and a function from their
places to joints.
"""

from .base import Role, Template
from .double_wishbone import DOUBLE_WISHBONE, REDUCED_DOUBLE_WISHBONE
from .five_link import FIVE_LINK
from .mcpherson import MCPHERSON
from .pushrod import PUSHROD_KNUCKLE, PUSHROD_LOWER_ARM, PUSHROD_UPPER_ARM
from .semi_trailing_arm import SEMI_TRAILING_ARM
from .three_link import THREE_LINK

TEMPLATES = {
    template.name: template
    for template in (
        MCPHERSON,
        DOUBLE_WISHBONE,
        REDUCED_DOUBLE_WISHBONE,
        PUSHROD_LOWER_ARM,
        PUSHROD_UPPER_ARM,
        PUSHROD_KNUCKLE,
        FIVE_LINK,
        THREE_LINK,
        SEMI_TRAILING_ARM,
    )
}
"""Templates by name, as for --template."""

ROLES = frozenset(
    name
    for template in TEMPLATES.values()
    for role in (*template.roles, *template.optional)
    for name in role.names
)
"""All names of all roles, in their compact form."""

__all__ = ["ROLES", "TEMPLATES", "Role", "Template"]
