"""What an installed slicer says of a file: its own text, for it ends well on an open mesh too."""

import re
import shutil
import subprocess
from pathlib import Path

from cad.verdict import Verdict, failed, judged

NAME = "prusa-slicer"
_SECONDS = 120
_LIMIT = "manifold = yes, one part"


def slicer_absence() -> str:
    """Return why the slicer is not asked, or an empty text where it is."""
    return "" if shutil.which(NAME) else f"{NAME} is not installed: its check is skipped"


def slicer_verdicts(path: Path) -> tuple[Verdict, ...]:
    """Return geometry.slicer on an STL, 3MF or STEP file; none where no slicer is installed."""
    program = shutil.which(NAME)
    if program is None:
        return ()
    command = [program, "--info", str(path)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=_SECONDS, check=False)
    except subprocess.TimeoutExpired:
        return (failed("geometry.slicer", _LIMIT, unit="1", reference=f"{NAME} gave no answer in {_SECONDS} s"),)
    return (slicer_verdict(done.stdout),)


def slicer_verdict(output: str) -> Verdict:
    """Return the verdict on the slicer's output: manifold, and one part for each object."""
    manifold = re.findall(r"^manifold\s*=\s*(\w+)", output, flags=re.MULTILINE)
    parts = [int(count) for count in re.findall(r"^number_of_parts\s*=\s*(\d+)", output, flags=re.MULTILINE)]
    passed = bool(manifold) and set(manifold) == {"yes"} and set(parts) == {1}
    answer = f"{NAME} --info: manifold = {', '.join(manifold) or 'no answer'}, parts {parts or 'no answer'}"
    count = float(max(parts, default=0))
    return judged("geometry.slicer", count, passed=passed, limit=_LIMIT, unit="1", reference=answer)
