"""Check an engine of one's own: joints, topologies, rates, refusals and repeated answers."""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    commands={"check-engine": "command:CheckEngine"},
    public={"check_engine": "command:CheckEngine"},
)
