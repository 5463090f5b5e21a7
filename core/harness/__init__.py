"""The harness: cases, the engine protocol, running, comparing and reporting. It knows no simulator."""

from .joint_check.check_joint import check_joint

__all__ = ["check_joint"]
