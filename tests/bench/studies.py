"""How many points a study solves: python tests/bench/studies.py 100 1000 10000, and 1000000 with time.

Each count is a study of its own over side, spacing, height, Poisson's ratio, P_max and NL at the level of contact. The
last column is the largest difference of K_m / E between a point by the polynomial and the same point solved in full.
"""

import resource
import sys
import tempfile
import time
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
HEAD = """| points | solved in full | CPU s | points per CPU s | minutes | largest difference | its bar |
|---|---|---|---|---|---|---|"""


def processor_seconds() -> float:
    """Return the processor seconds of this process and of those that it waited for."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def row(samples: int, audited: int) -> str:
    """Return the row of a study of so many points, of which about `audited` are solved in full beside a polynomial."""
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "many.toml"
        path.write_text(TEXT.format(samples=samples, audit=audited / samples), encoding="utf-8")
        start, used = time.perf_counter(), processor_seconds()
        with process_engine() as engine:
            summary = run_study(read_study(path), Path(name) / "out", engine)
        time.sleep(2.0)  # the processes end, and their seconds count
        seconds, minutes = processor_seconds() - used, (time.perf_counter() - start) / 60.0
        with stored_study(Path(name) / "out") as store:
            pairs = [(point.values[KEY], point.audit[KEY]) for point in store.rows() if point.audit]
    misses = [abs(float(str(one)) / float(str(other)) - 1.0) for one, other in pairs]
    model = summary.surrogate
    solved = samples if model is None else model.solves + len(pairs)
    worst, bar = ("", "") if model is None else (f"{max(misses):.1e}", f"{model.error:.1e}")
    return f"| {samples} | {solved} | {seconds:.0f} | {samples / seconds:.3g} | {minutes:.1f} | {worst} | {bar} |"


def main() -> None:
    """Print a row for each count of the command line."""
    print(HEAD)
    for word in sys.argv[1:]:
        print(row(int(word), audited=min(1000, int(word) // 10)), flush=True)


if __name__ == "__main__":
    main()
