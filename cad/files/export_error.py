"""The error for a file that was written incorrectly."""


class ExportError(ValueError):
    """The content of a file differs from what was written to it. The message is a single line."""
