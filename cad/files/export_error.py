"""The error of a file that was written wrong."""


class ExportError(ValueError):
    """A file that does not hold what was written; the message is one line."""
