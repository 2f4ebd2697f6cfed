"""The error that all solvers raise, in a module that does not load any solver."""


class SolveError(RuntimeError):
    """A solve failed, or its result is not accurate enough to be used; the message gives the reason."""
