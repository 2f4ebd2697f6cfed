"""Recompute fitted constants: `python tests/fits NAME...`, each the name of a script in this folder."""

import sys
from importlib import import_module
from pathlib import Path

TESTS = Path(__file__).parents[1]
sys.path[:0] = [str(TESTS.parent), str(TESTS)]

for name in sys.argv[1:]:
    script = import_module(f"fits.{name}")
    for row in script.compared():
        print(row, flush=True)
    for line in script.details() if hasattr(script, "details") else ():
        print(line, flush=True)
