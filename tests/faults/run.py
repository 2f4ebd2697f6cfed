"""Plant each fault in a copy of the checkout and run the quick tests that must fail for it.

`python tests/faults/run.py` tries all faults, `python tests/faults/run.py NAME...` some of them. A fault is caught if
each of its tests fails, and survives if one passes. The exit code is 1 unless all are caught. The checkout itself is
not touched, and its cache is not used.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from faults.patches import ROOT, Fault, faults, planted

TIME_S = 300.0
"""Of each test: one that takes longer has hung, which is how it fails."""
PASSED, FAILED = 0, 1  # exit codes of pytest


def copied_checkout(folder: Path) -> Path:
    """Return a copy of the files of the checkout that git knows or would add."""
    listed = ("git", "ls-files", "-z", "--cached", "--others", "--exclude-standard")
    names = subprocess.run(listed, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    for name in filter(None, names.split("\0")):
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
    return folder


def outcome_of(tests: Sequence[str], copy: Path, expected: Sequence[int] = (PASSED, FAILED)) -> int | None:
    """Return the exit code of pytest for some tests in a copy of the checkout; None if they take too long.

    What it prints is shown on stderr if the code is none of the expected ones.
    """
    quick = ["-m", "not slow and not study", "-p", "no:cacheprovider"]
    words = [sys.executable, "-m", "pytest", "-q", "-x", "--no-header", *quick, *tests]
    environment = {**os.environ, "PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": ""}
    try:
        done = subprocess.run(
            words, cwd=copy, env=environment, capture_output=True, text=True, timeout=TIME_S * len(tests), check=False
        )
    except subprocess.TimeoutExpired:
        return None
    if done.returncode not in expected:
        print(done.stdout[-2000:], done.stderr[-2000:], file=sys.stderr)
    return done.returncode


def verdict_on(fault: Fault, copy: Path) -> str:
    """Return whether each test of a fault fails in a copy that has the fault, which is then taken out again."""
    try:
        texts = planted(fault, copy)
    except ValueError as error:
        return f"does not apply: {error}"
    before: Mapping[Path, bytes] = {path: path.read_bytes() for path in texts}
    try:
        for path, text in texts.items():
            path.write_text(text, encoding="utf-8")
        for test in fault.tests:
            outcome = outcome_of([test], copy)
            if outcome == PASSED:
                return f"survives {test}"
            if outcome not in (FAILED, None):
                return f"cannot be tried: pytest ends with {outcome}"
    finally:
        for path, content in before.items():
            path.write_bytes(content)
    return "caught"


def main() -> int:
    """Try faults, print a line for each, and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", metavar="NAME", nargs="*", help="a fault, the name of its patch; all without a name")
    names = parser.parse_args().names
    chosen = [fault for fault in faults() if fault.name in names or not names]
    if len(chosen) < len(names):
        parser.error(f"a name is none of the faults: {', '.join(fault.name for fault in faults())}")
    with tempfile.TemporaryDirectory(prefix="twintip-faults-") as folder:
        copy = copied_checkout(Path(folder))
        tests = sorted({test for fault in chosen for test in fault.tests})
        if outcome_of(tests, copy, (PASSED,)) != PASSED:
            print("without a fault, a test of the faults fails: mend it first", file=sys.stderr)
            return 1
        caught = 0
        for fault in chosen:
            start = time.monotonic()
            verdict = verdict_on(fault, copy)
            caught += verdict == "caught"
            print(f"{fault.name}: {verdict} ({time.monotonic() - start:.0f} s)", flush=True)
    print(f"{caught} of {len(chosen)} faults are caught")
    return 0 if caught == len(chosen) else 1


if __name__ == "__main__":
    sys.exit(main())
