"""The harness: cases, the engine protocol, running, comparing and reporting. It knows no simulator."""

from .check_joint import check_joint

__all__ = ["check_joint"]
