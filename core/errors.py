"""The errors of kincheck. Each message says who, what was found, what was expected and what to do."""


class KincheckError(Exception):
    """Base of all errors that kincheck raises on purpose."""


class MechanismError(KincheckError, ValueError):
    """The description of a mechanism does not make sense."""


class CaseError(KincheckError, ValueError):
    """A case file cannot be read or does not follow the schema; the message names file and key."""


class SolveError(KincheckError, RuntimeError):
    """The mechanism cannot be solved as described: freedom left, contradiction, or no assembly at the design."""
