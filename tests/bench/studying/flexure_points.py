"""What a point with flexures costs beside a cold run: python tests/bench/studying/flexure_points.py 100.

The points are Sobol points over P_max, NL and the side of a tip around the paper's sensor, solved from an empty cache;
the cold run is `pipeline run` with an empty cache, its imports included. CPU seconds, of all processes.
"""

import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

TEXT = """
base = "paper"
samples = {samples}
seed = 3
wanted = ["flexures.low.stiffness_N_per_m", "flexures.high.stiffness_N_per_m", "verdicts.K_l.value"]
[vary]
"targets.P_max" = {{ from = 4.5, to = 5.5 }}
"targets.NL" = {{ from = 0.04, to = 0.06 }}
"tips.side_mm" = {{ from = 0.95, to = 1.05 }}
"""
HEAD = """| what | CPU s | over the cold run |
|---|---|---|"""


def processor_seconds(words: list[str], cache: Path) -> float:
    """Return the processor seconds of a command and of all that it started, with a cache of its own."""
    before = _of_children()
    environment = {**os.environ, "XDG_CACHE_HOME": str(cache)}
    done = subprocess.run([sys.executable, "-m", "pipeline", *words], env=environment, capture_output=True, check=False)
    if done.returncode:
        raise SystemExit(done.stderr.decode())
    return _of_children() - before


def _of_children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    """Print the cost of a cold run, and that of a point of a study of so many, with one process and with two."""
    samples = int(sys.argv[1])
    print(HEAD)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        study = folder / "flexures.toml"
        study.write_text(TEXT.format(samples=samples), encoding="utf-8")
        cold = processor_seconds(["run", "--out", str(folder / "run")], folder / "cache")
        print(f"| `pipeline run`, empty cache | {cold:.2f} | 1 |", flush=True)
        tables = []
        for processes in ("1", "2"):
            table = folder / f"{processes}.csv"
            flags = ["--out", str(folder / processes), "--processes", processes, "--export", str(table)]
            point = processor_seconds(["study", str(study), *flags], folder / f"cache-{processes}") / samples
            words = f"a point of {samples} with flexures, {processes} process{'es' * (processes != '1')}"
            print(f"| {words} | {point:.2f} | {point / cold:.2f} |", flush=True)
            tables.append(table.read_bytes())
    print("equal to the bit" if tables[0] == tables[1] else "the tables differ")


if __name__ == "__main__":
    main()
