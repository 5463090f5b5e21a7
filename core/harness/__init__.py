"""The harness: cases, the engine protocol, running, comparing and reporting. It knows no simulator."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .joint_check.check_joint import check_joint

__all__ = ["check_joint"]


def __getattr__(name: str) -> Any:
    """Import `check_joint` when it is asked for: every module of the harness would wait for it otherwise."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from .joint_check.check_joint import check_joint

    return check_joint
