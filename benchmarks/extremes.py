"""Whole runs of random extreme designs: each must end in verdicts with finite numbers, or in an error of one line.

`python -m benchmarks.extremes [--count 200] [--seed 1]` writes docs/measurements.md, and exits with 1 if a run ends
otherwise. After Ctrl-C it reports the finished runs. `--rough` runs the designs to a tolerance of 0.1, prints how they
end, and writes no page.
"""

import argparse
import json
import random
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from benchmarks.harness import ROOT, section, write_section
from benchmarks.usage import ONE_THREAD, ResourceUsage, resource_usage
from pipeline.options import load_design
from sensor.design.processes import PROCESSES
from sensor.quantity import InputError

SECONDS = 300  # wall-clock time after which a run is killed
LARGEST_MIB = 4096  # memory limit of a run
OFTEN = 0.5  # probability that a design has an optional part
ROUGH_FLAGS = ("--tol", "0.1")
REFUSED = 2  # exit code of a run that rejects its design
OUTCOMES = {0: "every verdict passed", 1: "a verdict failed or undecided", REFUSED: "refused in one line"}
INTRODUCTION = """\
`python -m benchmarks.extremes {flags}` writes this section. It draws designs at random that a design file may hold, and
runs each by `pipeline run`. Force ratios go from 1.001 to 100, nonlinearities up to 0.5, lengths and moduli over
decades. Every process, fruit, tip shape, layout and mount occurs, with skins, relaxation, readings, read-outs
and tilt.

Goals:

- the exit code is 0, 1 or 2, and a refusal is one line;
- every number of report.json is finite;
- nothing but the output folder is left;
- no run takes more than {seconds} s or {memory} MiB."""


@dataclass(frozen=True)
class Outcome:
    """How the run of one design ended: exit code, wall time [s], peak memory, error message, and the goal it missed.

    `message` is empty unless the design was rejected, and `fault` is empty if the run met all goals.
    """

    number: int
    code: int
    wall: float
    peak_MiB: float
    message: str
    fault: str


def random_settings(rng: random.Random) -> dict[str, object]:
    """Return the random settings of a design file by key; the settings may contradict each other.

    Lengths are random multiples of the side of a tip. Quantities that span decades are uniform in their logarithm. The
    ranges are a judgement: they go far beyond practical designs, so that the bounds of the design file and the limits
    of the solvers are met. The order of the draws must not change, because docs/measurements.md states the results for
    a seed.
    """
    side = _log_uniform(rng, 0.03, 30.0)
    spacing = side * (1.0 + _log_uniform(rng, 0.01, 50.0))
    height = side * _log_uniform(rng, 0.3, 100.0)
    radius = side * _log_uniform(rng, 3.0, 300.0)
    E_max = _log_uniform(rng, 0.01, 100.0)
    settings = {
        **_target_settings(rng),
        **_common_fruit_settings(rng, E_max, side, spacing),
        **_common_tip_settings(rng, side, spacing),
        **_press_settings(rng, min(side, height)),
        **_print_settings(rng),
    }
    settings |= _fillet_settings(rng, settings, side)
    settings |= _fruit_size_settings(rng, settings, height, radius)
    settings |= _tip_settings(rng, settings, side)
    settings |= _flesh_settings(rng, E_max, side)
    settings |= _reading_settings(rng)
    return settings | _read_out_settings(rng, has_reading="reading.tilt_deg" in settings)


def _log_uniform(rng: random.Random, low: float, high: float) -> float:
    """Return a random number between two bounds, uniform in its logarithm."""
    return low * (high / low) ** rng.random()


def _sometimes(rng: random.Random, chance: float, value: float) -> float:
    """Return the value with a probability of `chance` [1], else 0."""
    return value if rng.random() < chance else 0.0


def _target_settings(rng: random.Random) -> dict[str, object]:
    """Return the random settings of the table `[targets]`."""
    return {
        "targets.P_max": 1.0 + _log_uniform(rng, 1e-3, 99.0),
        "targets.NL": rng.choice([rng.uniform(1e-4, 0.4999), _log_uniform(rng, 1e-4, 0.4999)]),
        "targets.NL_definition": rng.choice(["mid-range", "largest"]),
    }


def _common_fruit_settings(rng: random.Random, E_max: float, side: float, spacing: float) -> dict[str, object]:
    """Return the random settings that fruits of all shapes have.

    `E_max` is the largest modulus of the flesh [MPa]. `side` and `spacing` [mm] are the width and the spacing of the
    tips, for which the plan of the fruit has room.
    """
    return {
        "fruit.shape": rng.choice(["block", "sphere", "ellipsoid"]),
        "fruit.poisson": rng.choice([rng.uniform(-0.9, 0.4999), rng.uniform(0.0, 0.49)]),
        "fruit.E_max_MPa": E_max,
        "fruit.E_MPa": [0.1 * E_max, 0.4 * E_max, E_max],
        "fruit.length_mm": spacing + side * (1.0 + _log_uniform(rng, 1.0, 200.0)),
        "fruit.width_mm": side * (1.0 + _log_uniform(rng, 1.0, 200.0)),
    }


def _common_tip_settings(rng: random.Random, side: float, spacing: float) -> dict[str, object]:
    """Return the random settings that tips of all shapes have; `side` and `spacing` are in mm.

    Values that occur several times in a list are more probable.
    """
    return {
        "tips.shape": rng.choice(["cube", "cylinder", "sphere", "dome", "cone"]),
        "tips.layout": rng.choice(["pair", "pair", "line", "square"]),
        "tips.side_mm": side,
        "tips.spacing_mm": spacing,
        "tips.offset_mm": _sometimes(rng, 0.3, rng.uniform(-1.0, 1.0) * side),
        "tips.gap_mm": _log_uniform(rng, 0.01, 10.0),
        "tips.socket": rng.choice(["none"] * 9 + ["pin"]),
    }


def _press_settings(rng: random.Random, size: float) -> dict[str, object]:
    """Return the random settings of the table `[press]`, with a travel of at most half of `size` [mm]."""
    return {
        "press.travel_mm": _log_uniform(rng, 1e-4, 0.5) * size,
        "press.tilt_deg": _sometimes(rng, 0.5, rng.choice([-1, 1]) * _log_uniform(rng, 0.01, 30.0)),
        "press.roll_deg": _sometimes(rng, 0.3, rng.choice([-1, 1]) * _log_uniform(rng, 0.01, 30.0)),
        "press.attitude": rng.choice(["down", "side", "up"]),
    }


def _print_settings(rng: random.Random) -> dict[str, object]:
    """Return the random settings of the table `[print]`."""
    return {
        "print.process": rng.choice(sorted(PROCESSES)),
        "print.mount": rng.choice(["covers", "washers"]),
        "print.max_length_mm": _log_uniform(rng, 10.0, 1000.0),
    }


def _fillet_settings(rng: random.Random, settings: dict[str, object], side: float) -> dict[str, object]:
    """Return the random fillet of flat tips of width `side` [mm], and a socket for tips that no process prints.

    `settings` holds the shape of the tips.
    """
    values: dict[str, object] = {}
    if settings["tips.shape"] in ("cube", "cylinder"):
        values["tips.fillet_mm"] = _sometimes(rng, 0.3, rng.uniform(0.0, 0.5) * side)
    if settings["tips.shape"] != "cube" or values["tips.fillet_mm"]:
        values["tips.socket"] = "pin"  # no process prints such tips
    return values


def _fruit_size_settings(
    rng: random.Random, settings: dict[str, object], height: float, radius: float
) -> dict[str, object]:
    """Return the size of a fruit: the `height` [mm] of a block, or random sizes relative to the `radius` [mm].

    `settings` holds the shape of the fruit.
    """
    if settings["fruit.shape"] == "block":
        return {"fruit.height_mm": height}
    values: dict[str, object] = {"fruit.radius_mm": radius, "fruit.thickness_mm": radius * rng.uniform(0.1, 2.0)}
    if settings["fruit.shape"] == "ellipsoid":
        values["fruit.radius_across_mm"] = radius * _log_uniform(rng, 0.3, 3.0)
    return values


def _tip_settings(rng: random.Random, settings: dict[str, object], side: float) -> dict[str, object]:
    """Return the random settings that only cones, domes or lines of tips have.

    `settings` holds the shape and the layout of the tips, and `side` [mm] is their width.
    """
    values: dict[str, object] = {}
    if settings["tips.shape"] == "cone":
        values["tips.half_angle_deg"] = rng.uniform(45.0, 89.0)
        if rng.random() < OFTEN:
            values["tips.blunt_mm"] = _log_uniform(rng, 1e-3, 1.0) * side
    if settings["tips.shape"] == "dome":
        values["tips.dome_radius_mm"] = _log_uniform(rng, 0.5, 30.0) * side
        values["tips.socket"] = rng.choice(["none", "pin"])
    if settings["tips.layout"] == "line":
        values["tips.order"] = rng.choice(["LHL", "HLH"])
        values["tips.outer_mm"] = rng.choice([0.0, _log_uniform(rng, 1e-3, 0.3) * side])
    return values


def _flesh_settings(rng: random.Random, E_max: float, side: float) -> dict[str, object]:
    """Return random settings of a skin, of relaxing flesh and of given springs, each in half of the designs.

    `E_max` is the largest modulus of the flesh [MPa], and `side` the width of a tip [mm].
    """
    values: dict[str, object] = {}
    if rng.random() < OFTEN:
        values["fruit.skin_mm"] = _log_uniform(rng, 1e-3, 1.0) * side
        values["fruit.skin_E_MPa"] = _log_uniform(rng, 1.0, 3e4) * E_max
        if rng.random() < OFTEN:
            values["fruit.skin_poisson"] = rng.uniform(-0.9, 0.4999)
    if rng.random() < OFTEN:
        count = rng.randint(1, 3)
        values["fruit.relaxation"] = [
            [rng.uniform(0.01, 0.99) / count, _log_uniform(rng, 1e-3, 1e5)] for _ in range(count)
        ]
        values["press.speed_mm_per_s"] = _log_uniform(rng, 1e-3, 100.0)
        values["press.hold_s"] = _log_uniform(rng, 1e-2, 1e4)
    if rng.random() < OFTEN:
        K_l = _log_uniform(rng, 1.0, 1e5)
        values["springs.K_l_N_per_m"] = K_l
        values["springs.K_h_N_per_m"] = K_l * _log_uniform(rng, 1.01, 300.0)
    return values


def _reading_settings(rng: random.Random) -> dict[str, object]:
    """Return random settings of the table `[reading]` for half of the designs, and none for the others."""
    if rng.random() >= OFTEN:
        return {}
    values: dict[str, object] = {
        "reading.tilt_deg": rng.uniform(0.0, 15.0),
        "reading.tilt_change_deg": rng.choice([0.0, rng.uniform(0.0, 5.0)]),
        "reading.off_centre_mm": rng.choice([0.0, _log_uniform(rng, 1e-2, 10.0)]),
        "reading.radius_spread": rng.uniform(0.0, 0.5),
        "reading.stiffness_percent": rng.uniform(0.0, 50.0),
        "reading.gain_percent": rng.uniform(0.0, 50.0),
        "reading.bias_limit": _log_uniform(rng, 1e-3, 1.0),
        "reading.uncertainty_limit": _log_uniform(rng, 1e-3, 1.0),
    }
    if rng.random() < OFTEN:
        values["reading.calibrated_by"] = rng.choice(["weights", "plate"])
    return values


def _read_out_settings(rng: random.Random, *, has_reading: bool) -> dict[str, object]:
    """Return random settings of the table `[readout]` for half of the designs.

    If a design with the table `[reading]` has no read-out, the noise of its forces is set instead.
    """
    if rng.random() < OFTEN:
        return {
            "readout.bits": rng.randint(8, 32),
            "readout.rate_Hz": _log_uniform(rng, 0.1, 1e5),
            "readout.noise_nV": _log_uniform(rng, 1e-2, 1e6),
            "readout.drift_K": rng.uniform(0.0, 50.0),
            "readout.tare_K": rng.uniform(0.0, 50.0),
        }
    return {"reading.noise_percent": rng.uniform(0.0, 50.0)} if has_reading else {}


def random_design(seed: int, number: int) -> dict[str, str]:
    """Return the settings of a random design as text, as on the command line.

    Settings are drawn until they are within the bounds of a design file, so that a run reaches its solvers. The design
    depends only on `seed` and `number`.
    """
    rng = random.Random(f"{seed} {number}")
    while True:
        values = random_settings(rng)
        settings = {key: value if isinstance(value, str) else json.dumps(value) for key, value in values.items()}
        with suppress(InputError):
            load_design("paper", settings)
            return settings


def run_design(number: int, settings: dict[str, str], folder: Path, flags: Sequence[str] = ()) -> Outcome:
    """Run one design in its own process on one thread, and return its outcome.

    `number` is the number of the design, and the name of its subfolder in `folder`. `flags` are further arguments of
    the command. Temporary files of the run go to this subfolder too, so that leftovers are found.
    """
    subfolder = folder / str(number)
    temporary = subfolder / "tmp"
    temporary.mkdir(parents=True)
    out = subfolder / "out"
    command = [sys.executable, "-m", "twintip", "run", *flags, "--out", str(out)]
    for key, value in settings.items():
        command += ["--set", f"{key}={value}"]
    usage = resource_usage(command, ROOT, {**ONE_THREAD, "TMPDIR": str(temporary)}, deadline=SECONDS)
    leftovers = [path.name for path in (*subfolder.iterdir(), *temporary.iterdir()) if path not in (temporary, out)]
    # A run that rejects its design prints one line, which begins with the name of the command.
    message = usage.last_line.removeprefix("pipeline: ") if usage.exit_code == REFUSED else ""
    return Outcome(
        number=number,
        code=usage.exit_code,
        wall=usage.wall,
        peak_MiB=usage.peak_MiB,
        message=message,
        fault=find_fault(usage, out, leftovers),
    )


def find_fault(usage: ResourceUsage, out: Path, leftovers: Sequence[str]) -> str:
    """Return a text on the first goal that a run misses; it is empty if the run meets all goals.

    `usage` is the record of the process, `out` is its output folder, and `leftovers` are the names of files that it
    left outside this folder.
    """
    expected_lines = 1 if usage.exit_code == REFUSED else 0  # on stderr, where only error messages are written
    if usage.wall >= SECONDS:
        return f"took more than {SECONDS} s"
    if usage.exit_code not in OUTCOMES or "Traceback" in usage.err:
        return f"exit code {usage.exit_code}: {usage.last_line}"
    if usage.err.count("\n") != expected_lines:
        return f"stderr: {usage.err.strip()}"
    if leftovers:
        return f"left behind: {', '.join(leftovers)}"
    if usage.peak_MiB > LARGEST_MIB:
        return f"memory {usage.peak_MiB:.0f} MiB"
    if (out / "report.json").is_file():
        try:
            json.loads((out / "report.json").read_text(encoding="utf-8"), parse_constant=_refuse_constant)
        except ValueError as error:
            return str(error)
    return ""


def _refuse_constant(name: str) -> float:
    """Raise ValueError for NaN, Infinity or -Infinity, which Python's parser calls constants of JSON."""
    msg = f"report.json holds {name}"
    raise ValueError(msg)


def outcome_tables(outcomes: list[Outcome]) -> list[str]:
    """Return two tables: how the runs end, with time and memory, and how often the error messages name each key.

    The notes below the first table list the faults.
    """
    rows = []
    for code, meaning in OUTCOMES.items():
        runs = [run for run in outcomes if run.code == code and not run.fault]
        wall = max((run.wall for run in runs), default=0.0)
        peak = max((run.peak_MiB for run in runs), default=0.0)
        rows.append([meaning, str(len(runs)), f"{wall:.0f}", f"{peak:.0f}"])
    faults = [f"design {run.number}: {run.fault}" for run in outcomes if run.fault]
    rows.append(["with a fault", str(len(faults)), "-", "-"])
    # A message begins with "key = value" or "topic: text".
    names = Counter(run.message.partition(" = ")[0].partition(":")[0] for run in outcomes if run.message)
    refusals = [[f"`{name}`", str(count)] for name, count in names.most_common()]
    return [
        section("How the runs end", ["end of a run", "designs", "longest, s", "most memory, MiB"], rows, faults),
        section("What is refused", ["the message names", "designs"], refusals),
    ]


def main() -> int:
    """Run the designs, and write and print the tables. Return the exit code: 1 if a run has a fault, else 0.

    After Ctrl-C, the tables hold only the finished runs. Progress is printed to stderr.
    """
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=200, help="designs to run")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rough", action="store_true", help="run to a tolerance of 0.1 and write no page")
    options = parser.parse_args()
    rough = ROUGH_FLAGS if options.rough else ()
    outcomes: list[Outcome] = []
    with suppress(KeyboardInterrupt), tempfile.TemporaryDirectory() as folder:
        for number in range(options.count):
            run = run_design(number, random_design(options.seed, number), Path(folder), rough)
            outcomes.append(run)
            print(f"{number}: {run.wall:.1f} s, {run.fault or run.message or OUTCOMES[run.code]}", file=sys.stderr)
    fault_count = sum(bool(run.fault) for run in outcomes)
    if options.rough:
        print(f"{len(outcomes)} designs, {fault_count} with a fault")
        return 1 if fault_count else 0
    flags = f"--count {len(outcomes)} --seed {options.seed}"
    introduction = INTRODUCTION.format(flags=flags, seconds=SECONDS, memory=LARGEST_MIB)
    write_section("Extreme designs", introduction, outcome_tables(outcomes))
    return 1 if fault_count else 0


if __name__ == "__main__":
    sys.exit(main())
