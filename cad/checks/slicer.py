"""What an installed slicer says of a file: its own text, for it ends well on an open mesh too."""

import re
import shutil
import subprocess
from pathlib import Path

from cad.verdict import Verdict, failed

NAME = "prusa-slicer"
_SECONDS = 120


def slicer_absence() -> str:
    """Return why the slicer is not asked, or an empty text where it is."""
    return "" if shutil.which(NAME) else f"{NAME} is not installed: its check is skipped"


def slicer_findings(path: Path) -> tuple[Verdict, ...]:
    """Return geometry.slicer on an STL, 3MF or STEP file; none where no slicer is installed."""
    program = shutil.which(NAME)
    if program is None:
        return ()
    limit = "manifold = yes, one part"
    try:
        said = subprocess.run(
            [program, "--info", str(path)], capture_output=True, text=True, timeout=_SECONDS, check=False
        ).stdout
    except subprocess.TimeoutExpired:
        return (failed("geometry.slicer", limit, unit="1", reference=f"{NAME} gave no answer in {_SECONDS} s"),)
    return (judged(said, limit),)


def judged(said: str, limit: str) -> Verdict:
    """Return the finding on what the slicer said: manifold, and one part for each object."""
    manifold = re.findall(r"^manifold\s*=\s*(\w+)", said, flags=re.MULTILINE)
    parts = [int(count) for count in re.findall(r"^number_of_parts\s*=\s*(\d+)", said, flags=re.MULTILINE)]
    told = f"{NAME} --info: manifold = {', '.join(manifold) or 'no answer'}, parts {parts or 'no answer'}"
    good = bool(manifold) and set(manifold) == {"yes"} and set(parts) == {1}
    return Verdict(
        name="geometry.slicer", value=float(max(parts, default=0)), unit="1", limit=limit, tolerance=0.0, passed=good,
        reference=told,
    )  # fmt: skip
