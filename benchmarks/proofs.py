"""Designs tested by simulated presses of random units: `pipeline simulate OUT --prove N` for several folders.

`python -m benchmarks.proofs outputs/mango outputs/apple ... [--count 60] [--seed 1]` writes a section of
docs/measurements.md, in a minute or two for each folder.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

from benchmarks.harness import section, write_section
from instrument.proof import ProvedDesign, prove
from pipeline.report.report import read_report
from sensor.quantity import COVERAGE

TITLE = "Proofs of the presets"
HEADS = ["preset", "inside", "outside", "flagged", "farthest", "rms error", "rms bar", "error over bar"]
INTRODUCTION = """\
`python -m benchmarks.proofs` writes this table, of {count} presses each with the seed {seed}. Every press is of another
unit on another fruit ([how they are drawn](simulate.md#prove-a-design)). "Outside" counts the readings without a flag
that are beyond their 95 % bar; at most {most} are allowed. "Farthest" is the largest error over its bar. The last
column is the root mean square of the error over the standard deviation that its bar represents. It is 1 if the bars are
as wide as the errors, and less if they are wider."""


def proof_row(proof: ProvedDesign) -> list[str]:
    """Return the table row of a design.

    The errors and the error bars in the row are root mean squares over the readings without a flag. The last cell
    divides each error by the standard deviation that its error bar represents, which is the bar divided by `COVERAGE`.
    """
    unflagged = [reading for reading in proof.readings if reading.error is not None and not reading.is_flagged]
    errors = np.array([reading.error for reading in unflagged])  # relative [1]
    bars = np.array([reading.u for reading in unflagged])
    return [
        f"`{proof.design}`",
        str(proof.presses - proof.outside - proof.flagged),
        str(proof.outside),
        str(proof.flagged),
        f"{proof.farthest:.2f}",
        f"{100.0 * np.sqrt(np.square(errors).mean()):.1f} %",
        f"{100.0 * np.sqrt(np.square(bars).mean()):.1f} %",
        f"{COVERAGE * np.sqrt(np.square(errors / bars).mean()):.2f}",
    ]


def main() -> int:
    """Write and print the table; the exit code is 1 if a design is not proved."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    proofs = []
    for folder in options.folders:
        proofs.append(prove(read_report(folder), options.count, options.seed))
        print(proof_row(proofs[-1]), file=sys.stderr, flush=True)
    introduction = INTRODUCTION.format(count=options.count, seed=options.seed, most=proofs[0].most_outside)
    write_section(TITLE, introduction, [section("Presets for fruit", HEADS, map(proof_row, proofs))])
    return 0 if all(proof.passed for proof in proofs) else 1


if __name__ == "__main__":
    sys.exit(main())
