"""The board: how well time steppers hold the free motion of closed loops."""

from ...doors import Extension

EXTENSION = Extension(
    __name__,
    needs=["environments", "free", "reports", "steppers"],
    commands={"board": "command:CompareSteppers"},
    schemas={"board": "results:Board"},
)
