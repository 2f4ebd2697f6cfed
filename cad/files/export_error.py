"""The error for a file that was written incorrectly."""


class ExportError(ValueError):
    """A file does not hold what was written to it; the message is one line."""
