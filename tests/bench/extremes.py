"""Whole runs of random extreme designs: each ends in verdicts or in one line, with finite numbers that agree.

Run from the root of the repository: `python tests/bench/extremes.py [--count 200] [--first 0] [--seed 1]
[--out docs]`. Each design is run and its folder is checked, in processes of their own on one thread. It writes
extremes.md into a folder, prints it, and exits 1 when a goal is missed; Ctrl-C ends it with those that were run.
"""

import argparse
import json
import math
import random
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from cad.design.processes import PROCESSES  # noqa: E402
from cad.quantity import InputError  # noqa: E402
from cad.theory.strain_gauge import GAUGES  # noqa: E402
from pipeline.bench.bench import OUT  # noqa: E402
from pipeline.bench.resources import ONE_THREAD, ResourceUsage, resource_usage  # noqa: E402
from pipeline.bench.table import Sheet, page, publish  # noqa: E402
from pipeline.options import load_design  # noqa: E402

SECONDS = 300  # of wall time, until a run is ended and counts as hung
MOST_MIB = 4096  # of memory of a run
ENDED = (124, 137)  # exit codes of timeout(1): by its first signal, by its second
OUTCOMES = {0: "every verdict passed", 1: "a verdict failed or undecided", 2: "refused in one line"}
INTRODUCTION = """\
`tests/bench/extremes.py {flags}` writes this page. It draws designs at random that a design file may hold: force ratios
from 1.001 to 100, nonlinearities up to 0.5, every process, fruit and tip shape, tilt, mount and gauge, lengths and
moduli over decades. Each is run by `pipeline run`, and its outputs are judged by `pipeline check`.

Goals: exit code 0, 1 or 2; a refusal is one line; every number of report.json is finite; every number and verdict of it
follows from the rest; no run takes more than {seconds} s or {memory} MiB."""


@dataclass(frozen=True)
class Outcome:
    """What became of one design: how its run ended, what it used, and what is wrong with it."""

    number: int
    code: int
    wall: float
    peak_MiB: float
    refused: str
    faults: tuple[str, ...]


def log_uniform(rng: random.Random, least: float, most: float) -> float:
    return least * (most / least) ** rng.random()


def either(rng: random.Random, share: float, value: float) -> float:
    """Return the value in a share of the cases, else 0."""
    return value if rng.random() < share else 0.0


def drawn(rng: random.Random) -> dict[str, object]:
    """Return settings of a design file, which may contradict each other."""
    shape, side = rng.choice(("block", "sphere", "ellipsoid")), log_uniform(rng, 0.03, 30.0)
    spacing = side * (1.0 + log_uniform(rng, 0.01, 50.0))
    E_max, height = log_uniform(rng, 0.01, 100.0), side * log_uniform(rng, 0.3, 100.0)
    room = [side * log_uniform(rng, 0.5, 100.0) for _ in range(2)]
    nl = rng.uniform(0.0001, 0.4999) if rng.random() < 0.3 else log_uniform(rng, 1e-4, 0.4999)
    chosen: dict[str, object] = {
        "targets.P_max": 1.0 + log_uniform(rng, 1e-3, 99.0),
        "targets.NL": nl,
        "targets.NL_definition": rng.choice(("mid-range", "largest")),
        "fruit.shape": shape,
        "fruit.poisson": rng.uniform(-0.9, 0.4999) if rng.random() < 0.3 else rng.uniform(0.0, 0.49),
        "fruit.E_max_MPa": E_max,
        "fruit.E_MPa": [0.1 * E_max, 0.4 * E_max, E_max],
        "tips.shape": rng.choice(("cube", "cylinder", "sphere")),
        "tips.side_mm": side,
        "tips.spacing_mm": spacing,
        "tips.offset_mm": either(rng, 0.3, rng.uniform(-1.0, 1.0) * side),
        "tips.gap_mm": log_uniform(rng, 0.01, 10.0),
        "press.travel_mm": log_uniform(rng, 1e-4, 0.5) * min(side, height),
        "press.tilt_deg": either(rng, 0.5, rng.choice((-1, 1)) * log_uniform(rng, 0.01, 30.0)),
        "press.roll_deg": either(rng, 0.3, rng.choice((-1, 1)) * log_uniform(rng, 0.01, 30.0)),
        "press.attitude": rng.choice(("down", "side", "up")),
        "print.process": rng.choice(tuple(PROCESSES)),
        "print.mount": rng.choice(("covers", "washers")),
        "print.max_length_mm": log_uniform(rng, 10.0, 1000.0),
    }
    if rng.random() < 0.1:
        chosen["print.gauges"] = rng.choice(tuple(GAUGES))
    if rng.random() < 0.1:
        chosen["tips.socket"] = "pin"
    if chosen["tips.shape"] != "sphere":
        chosen["tips.fillet_mm"] = either(rng, 0.3, rng.uniform(0.0, 0.5) * side)
    if shape == "block" or rng.random() < 0.5:
        chosen["fruit.length_mm"], chosen["fruit.width_mm"] = spacing + side + 2.0 * room[0], side + 2.0 * room[1]
    if shape == "block":
        chosen["fruit.height_mm"] = height
        return chosen
    radius = side * log_uniform(rng, 3.0, 300.0)
    chosen |= {"fruit.radius_mm": radius, "fruit.thickness_mm": radius * rng.uniform(0.1, 2.0)}
    if shape == "ellipsoid":
        chosen["fruit.radius_across_mm"] = radius * log_uniform(rng, 0.3, 3.0)
    return chosen


def random_design(seed: int, number: int) -> dict[str, str]:
    """Return settings of the first design that the bounds of a design file allow, as the command line takes them."""
    rng = random.Random(f"{seed} {number}")
    while True:
        settings = {key: value if isinstance(value, str) else json.dumps(value) for key, value in drawn(rng).items()}
        try:
            load_design("paper", settings)
        except InputError:
            continue
        return settings


def limited(words: Sequence[str]) -> ResourceUsage:
    """Run a command of the pipeline in a process of its own, which is ended after its time."""
    command = ["timeout", "--kill-after=10", str(SECONDS), sys.executable, "-m", "pipeline", *words]
    return resource_usage(command, ROOT, ONE_THREAD)


def outcome(number: int, settings: Mapping[str, str], folder: Path) -> Outcome:
    """Run one design, look at what it left, and check that."""
    out = folder / str(number)
    sets = [word for key, value in settings.items() for word in ("--set", f"{key}={value}")]
    used = limited(["run", *sets, "--out", str(out)])
    faults, refused = list(run_faults(used)), ""
    if used.exit_code in (0, 1) and not faults:
        faults += folder_faults(out)
    elif used.exit_code == 2:
        refused = used.last_line.removeprefix("pipeline: ")
    return Outcome(number, used.exit_code, used.wall, used.peak_MiB, refused, tuple(faults))


def run_faults(used: ResourceUsage) -> Iterator[str]:
    """Yield what is wrong with how a run ended."""
    if used.exit_code in ENDED:
        yield f"took more than {SECONDS} s"
    elif used.exit_code not in OUTCOMES:
        yield f"exit code {used.exit_code}: {used.last_line}"
    elif "Traceback" in used.err + used.out:
        yield f"traceback: {used.last_line}"
    elif used.err.count("\n") != (1 if used.exit_code == 2 else 0):
        yield f"stderr: {used.err.strip()}"
    if used.peak_MiB > MOST_MIB:
        yield f"memory {used.peak_MiB:.0f} MiB"


def folder_faults(out: Path) -> Iterator[str]:
    """Yield the numbers of a report that are not finite, and the verdicts of a check that say that it disagrees."""
    report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    yield from (f"{place} is not finite" for place in not_finite(report))
    checked = limited(["check", str(out), "--json"])
    if checked.exit_code not in (0, 1):
        yield f"check, exit code {checked.exit_code}: {checked.last_line}"
        return
    for verdict in json.loads(checked.out):
        if verdict["name"].startswith(("report.", "files.")) and verdict["passed"] is not True:
            yield f"check, {verdict['name']}: {verdict['reference']}"


def not_finite(value: object, place: str = "report") -> Iterator[str]:
    """Yield the places of numbers that are infinite or none, at any depth."""
    if isinstance(value, dict):
        for key, one in value.items():
            yield from not_finite(one, f"{place}.{key}")
    elif isinstance(value, list):
        for index, one in enumerate(value):
            yield from not_finite(one, f"{place}[{index}]")
    elif isinstance(value, float) and not math.isfinite(value):
        yield place


def named(message: str) -> str:
    """Return what a refusal is about: the name before its value, or the stage before its reason."""
    return message.partition(" = ")[0] if " = " in message else message.partition(":")[0]


def sheets(outcomes: Sequence[Outcome]) -> tuple[Sheet, Sheet]:
    """Return the table of how runs ended with what they used, and that of the refusals by their name."""
    ends = []
    for code, words in OUTCOMES.items():
        those = [one for one in outcomes if one.code == code and not one.faults]
        most = [max((getattr(one, key) for one in those), default=0.0) for key in ("wall", "peak_MiB")]
        ends.append((words, str(len(those)), f"{most[0]:.0f}", f"{most[1]:.0f}"))
    wrong = [f"design {one.number}: {'; '.join(one.faults)}" for one in outcomes if one.faults]
    ends.append(("with a fault", str(len(wrong)), "-", "-"))
    counted = Counter(named(one.refused) for one in outcomes if one.refused)
    heads = ("end of a run", "designs", "longest, s", "most memory, MiB")
    return (
        Sheet(name="ends", title="How the runs end", heads=heads, rows=tuple(ends), notes=tuple(wrong)),
        Sheet(
            name="refusals",
            title="What is refused",
            heads=("the message names", "designs"),
            rows=tuple((f"`{name}`", str(count)) for name, count in counted.most_common()),
        ),
    )


def main(arguments: Sequence[str]) -> int:
    """Run the designs, write and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=200, help="designs to run")
    parser.add_argument("--first", type=int, default=0, help="number of the first one")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=OUT, help=f"folder of the page (default {OUT})")
    asked = parser.parse_args(arguments)
    outcomes: list[Outcome] = []
    with suppress(KeyboardInterrupt), tempfile.TemporaryDirectory() as name:
        for number in range(asked.first, asked.first + asked.count):
            outcomes.append(outcome(number, random_design(asked.seed, number), Path(name)))
            one = outcomes[-1]
            words = "; ".join(one.faults) or one.refused or OUTCOMES[one.code]
            cost = f"{one.wall:.1f} s, {one.peak_MiB:.0f} MiB"
            print(f"{number}: {cost}, {'FAULT ' if one.faults else ''}{words}", file=sys.stderr, flush=True)
    flags = f"--first {asked.first} --count {len(outcomes)} --seed {asked.seed}"
    words = INTRODUCTION.format(flags=flags, seconds=SECONDS, memory=MOST_MIB)
    tables = [sheet.markdown() for sheet in sheets(outcomes)]
    publish(asked.out, {"extremes.md": page("Extreme designs", words, *tables)}, as_json=False)
    return 1 if any(one.faults for one in outcomes) else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
