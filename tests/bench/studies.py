"""How many points a study solves: python tests/bench/studies.py 100 1000 10000 1000000.

Each count is a study of its own over side, spacing, height, Poisson's ratio, P_max and NL at the level of contact. The
last column is the largest difference of K_m / E between a point by the polynomial and the same point solved in full.
"""

import resource
import tempfile
import time
from argparse import ArgumentParser
from pathlib import Path

from pipeline.study import process_engine, read_study, run_study
from pipeline.study.store import stored_study

KEY = "contact.K_m_over_E_mm"
TEXT = """
base = "paper"
samples = {samples}
seed = 1
audit = {audit}
wanted = ["springs.K_l_N_per_m", "springs.K_h_N_per_m", "contact.K_m_over_E_mm", "contact.error_percent"]
[vary]
"tips.side_mm" = {{ from = 0.8, to = 1.6 }}
"tips.spacing_mm" = {{ from = 4, to = 10 }}
"fruit.height_mm" = {{ from = 8, to = 20 }}
"fruit.poisson" = {{ from = 0.2, to = 0.45 }}
"targets.P_max" = {{ from = 3, to = 8 }}
"targets.NL" = {{ from = 0.02, to = 0.1 }}
"""
HEAD = """| points | solved in full | CPU s | points per CPU s | minutes | memory MB | largest difference | its bar |
|---|---|---|---|---|---|---|---|"""
MOST_AUDITS = 1_000
USAGE = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)


def processor_seconds() -> float:
    """Return the processor seconds of this process and of those that it waited for."""
    used = [resource.getrusage(who) for who in USAGE]
    return sum(one.ru_utime + one.ru_stime for one in used)


def largest_memory() -> float:
    """Return the most memory that this process, or one that it waited for, has held so far [MB]."""
    return max(resource.getrusage(who).ru_maxrss for who in USAGE) / 1024.0


def row(samples: int, folder: Path) -> str:
    """Return the row of a study of so many points, solved in a folder."""
    path = folder / f"points-{samples}.toml"
    audit = min(0.01, MOST_AUDITS / samples)
    path.write_text(TEXT.format(samples=samples, audit=audit), encoding="utf-8")
    start, used = time.perf_counter(), processor_seconds()
    with process_engine() as engine:
        summary = run_study(read_study(path), folder / path.stem, engine)
    time.sleep(2.0)  # the processes end, and their seconds count
    seconds, minutes = processor_seconds() - used, (time.perf_counter() - start) / 60.0
    with stored_study(folder / path.stem) as store:
        pairs = [(point.values[KEY], point.audit[KEY]) for point in store.rows() if point.audit]
    misses = [abs(float(str(one)) / float(str(other)) - 1.0) for one, other in pairs]
    model = summary.surrogate
    solved = samples if model is None else model.solves + len(pairs)
    worst, bar = ("", "") if model is None else (f"{max(misses):.1e}", f"{model.error:.1e}")
    cost = f"{seconds:.0f} | {samples / seconds:.3g} | {minutes:.1f} | {largest_memory():.0f}"
    return f"| {samples} | {solved} | {cost} | {worst} | {bar} |"


def main() -> None:
    """Print a row for each count of the command line, the studies kept in the folder of --keep."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("counts", nargs="+", type=int)
    parser.add_argument("--keep", metavar="DIR", type=Path)
    arguments = parser.parse_args()
    print(HEAD)
    with tempfile.TemporaryDirectory() as name:
        folder = arguments.keep or Path(name)
        folder.mkdir(parents=True, exist_ok=True)
        for count in arguments.counts:
            print(row(count, folder), flush=True)


if __name__ == "__main__":
    main()
