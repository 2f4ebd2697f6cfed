"""Files beside an output folder that a command writes where it is told to, and never over another one unasked."""

import os
from pathlib import Path

from cad.quantity import fault


def write_new(path: Path, text: str, flag: str, *, force: bool = False) -> None:
    """Write a text file whole or not at all; raises InputError where one is there, unless forced, or none can be."""
    if path.exists() and not force:
        raise fault(flag, str(path), "", "a file that is not there yet", "choose another name, or add --force")
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.write_text(text, encoding="utf-8", newline="\n")
        part.replace(path)
    except OSError as error:
        part.unlink(missing_ok=True)
        bound = f"a place that can be written ({error.strerror})"
        raise fault(flag, str(path), "", bound, "choose another place") from error
