"""Programs in processes of their own, as a user runs them."""

import os
import subprocess
import sys
from pathlib import Path

from deadline import DEADLINE_S

ROOT = Path(__file__).parents[1]
PYTHON = sys.executable


def ended(*words: object, cwd: Path = ROOT, **variables: str) -> "subprocess.CompletedProcess[str]":
    """Return a program that has ended, its exit code and what it printed, with more variables of the environment."""
    environment = {**os.environ, **variables}
    command = [str(word) for word in words]
    return subprocess.run(
        command, cwd=cwd, env=environment, capture_output=True, encoding="utf-8", timeout=DEADLINE_S, check=False
    )
