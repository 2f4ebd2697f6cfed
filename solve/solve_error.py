"""The error of a solve, which loads no solver."""


class SolveError(RuntimeError):
    """A solve whose result must not be used; the message gives the reason."""
