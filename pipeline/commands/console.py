"""How every command speaks: exit codes, JSON, and what happens when the reader has left."""

import json
import os
import sys
from argparse import ArgumentParser

PASSED, FAILED, WRONG_INPUT, INTERRUPTED = 0, 1, 2, 130
EXIT_CODES = "exit code: 0 all verdicts pass, 1 a verdict failed or is undecided, 2 the input or environment is wrong"


def add_json_flag(parser: ArgumentParser) -> None:
    """Add --json."""
    parser.add_argument("--json", action="store_true", help="print JSON instead of tables")


def add_force_flag(parser: ArgumentParser) -> None:
    """Add --force."""
    words = "write where files are not of the last run or were changed since; they are kept as NAME.bak"
    parser.add_argument("--force", action="store_true", help=words)


def print_json(data: object) -> None:
    """Print data as JSON; raises ValueError when a number is not finite."""
    print(json.dumps(data, indent=2, allow_nan=False, ensure_ascii=False))


def drop_output() -> None:
    """Point stdout nowhere, so that Python's own flush at exit does not fail on the closed pipe again."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
