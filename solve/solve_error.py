"""The error that all solvers raise, in a module that does not load any solver."""


class SolveError(RuntimeError):
    """The result of a solve must not be used; the message gives the reason."""
