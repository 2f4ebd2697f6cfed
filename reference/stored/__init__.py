"""Results of programs that were removed from the repository, in full precision.

Each file names the program, the commit that has it, the versions, and how to compute the results again.
"""

import json
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent


def stored(program: str) -> list[dict[str, Any]]:
    """Return the results of a removed program, each with its inputs; `program` is its name without a suffix."""
    results: list[dict[str, Any]] = json.loads((HERE / f"{program}.json").read_text(encoding="utf-8"))["results"]
    return results
