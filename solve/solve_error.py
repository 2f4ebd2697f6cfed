"""The error of a solve, which loads no solver."""


class SolveError(RuntimeError):
    """A solve that must not be believed; the message says why."""
