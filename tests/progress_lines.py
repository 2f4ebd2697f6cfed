"""The lines on what a command is at, which a process on a busy machine prints to stderr between its other lines."""

import re

_LINE = re.compile(r"^pipeline: [0-9.]+ (?:s|min|h)(?:, [^:\n]+)?: .*\n", flags=re.MULTILINE)


def without_progress(complaint):
    """Return what a process wrote on stderr without these lines."""
    return _LINE.sub("", complaint)
