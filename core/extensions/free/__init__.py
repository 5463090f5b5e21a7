"""Free motion: a mechanism without its drivers, let go with given rates."""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    commands={"free": "command:MoveFreely"},
    public={"free": "command:MoveFreely"},
    sections={"free": "section:SECTION"},
)
