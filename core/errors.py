"""The errors of kincheck. Each message says who, what was found, what was expected and what to do."""


class KincheckError(Exception):
    """Base of all errors that kincheck raises on purpose."""


class MechanismError(KincheckError, ValueError):
    """The description of a mechanism does not make sense.

    Attributes:
        key: of a case file, what is to blame there ("joints.pivot.bodies"); empty where that is not known.
    """

    def __init__(self, message: str, key: str = "") -> None:
        super().__init__(message)
        self.key = key


class CaseError(KincheckError, ValueError):
    """A case file cannot be read or does not follow the schema; the message names file and key."""


class SolveError(KincheckError, RuntimeError):
    """The mechanism cannot be solved as described: freedom left, contradiction, or no assembly at the design."""
