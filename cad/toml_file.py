"""Reading of TOML files that people write."""

import tomllib
from pathlib import Path
from typing import Any

from cad.quantity import InputError

LARGEST_BYTES = 10_000_000  # no design has a thousandth of it; a file without end has more


def read_toml(path: Path, label: str) -> dict[str, Any]:
    """Return the tables of a TOML file, which messages name by a label.

    Raises InputError when it is missing, unreadable, too large or not TOML.
    """
    try:
        with path.open("rb") as file:
            raw = file.read(LARGEST_BYTES + 1)
        text = raw.decode("utf-8-sig")
    except FileNotFoundError as error:
        msg = f"{label}: not found; must be an existing TOML file; check the path"
        raise InputError(msg) from error
    except (OSError, UnicodeDecodeError) as error:
        msg = f"{label}: cannot be read ({type(error).__name__}); must be a TOML text file; check the file"
        raise InputError(msg) from error
    if len(raw) > LARGEST_BYTES:
        msg = f"{label}: more than {LARGEST_BYTES} bytes; must be a TOML text file; check the file"
        raise InputError(msg)
    try:
        return tomllib.loads(text)
    except RecursionError as error:
        msg = f"{label}: nested too deep; must be tables of keys and values; mend the file"
        raise InputError(msg) from error
    except ValueError as error:  # TOMLDecodeError, or a number with more digits than Python reads
        reason = str(error).splitlines()[0]
        msg = f"{label}: {reason}; must be valid TOML; mend that line"
        raise InputError(msg) from error
