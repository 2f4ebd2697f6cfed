"""Results of programs that are no longer here, full digits.

Each file says which program found them, of which commit, with which versions, and how to find them again.
"""

import json
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent


def stored(program: str) -> list[dict[str, Any]]:
    """Return the results of a program, each with what it was asked."""
    results: list[dict[str, Any]] = json.loads((HERE / f"{program}.json").read_text(encoding="utf-8"))["results"]
    return results
