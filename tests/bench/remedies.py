"""Random designs that fail, and whether their printed remedy or what `pipeline suggest` finds makes them pass.

Run from the root of the repository: `python tests/bench/remedies.py [--count 30] [--first 0] [--seed 1] [--out docs]`.
Each design is run, its printed remedy is followed, and where that does not pass `pipeline suggest` is asked. It writes
remedies.md into a folder, prints it, and exits 1 when the goal is missed; Ctrl-C ends it with those that were run.
With `--kept FOLDER` outcomes are kept there and taken from there, so that it can go on, or be shared by processes.
"""

import argparse
import json
import random
import shlex
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from cad.design.parameters import Design  # noqa: E402
from cad.design.processes import PROCESSES  # noqa: E402
from cad.quantity import InputError  # noqa: E402
from mesh.session import MeshError  # noqa: E402
from pipeline import RunOptions, load_design, run  # noqa: E402
from pipeline.bench.bench import OUT  # noqa: E402
from pipeline.bench.table import Sheet, page, publish  # noqa: E402
from pipeline.study.suggest.suggestion import suggestion  # noqa: E402
from pipeline.verdicts.remedies.sentences import with_remedies  # noqa: E402
from pipeline.verdicts.remedies.trial import Trials  # noqa: E402
from solve.linear import SolveError  # noqa: E402

GOAL = 25 / 30
INTRODUCTION = """\
`tests/bench/remedies.py {flags}` writes this page. It draws designs at random that fail, of {kinds} kinds: a bruised
fruit, a tilted press, a round fruit under flat tips, round tips, springs that the process cannot make, targets out of
reach, given springs that miss the targets, readings that are too far off or too uncertain. Each is run; what is printed
as its remedy is followed and run; where that does not pass, `pipeline suggest` is asked, which proves what it finds by
a run. "none found" is what is printed where nothing that was tried passes.

Goal: at least 25 of 30 pass, and the others say that nothing was found."""


def _uniform(rng: random.Random, least: float, most: float) -> str:
    return f"{rng.uniform(least, most):.3g}"


def bruising(rng: random.Random) -> tuple[str, dict[str, str]]:
    return "paper", {
        "fruit.bruise_limit_MPa": _uniform(rng, 0.2, 0.6),
        "press.travel_mm": _uniform(rng, 0.3, 0.9),
        "targets.P_max": _uniform(rng, 3.0, 6.0),
    }


def tilted(rng: random.Random) -> tuple[str, dict[str, str]]:
    return "paper", {"press.tilt_deg": _uniform(rng, 0.3, 2.0), "press.travel_mm": _uniform(rng, 0.4, 0.8)}


def round_fruit(rng: random.Random) -> tuple[str, dict[str, str]]:
    return "paper", {
        "fruit.shape": "sphere",
        "fruit.radius_mm": _uniform(rng, 35.0, 90.0),
        "tips.spacing_mm": _uniform(rng, 3.0, 8.0),
    }


def round_tips(rng: random.Random) -> tuple[str, dict[str, str]]:
    shape = rng.choice(("sphere", "filleted", "hanging"))
    if shape == "filleted":
        return "paper", {"tips.fillet_mm": _uniform(rng, 0.1, 0.3), "tips.socket": "pin"}
    if shape == "hanging":
        return "paper", {"press.attitude": "down", "press.travel_mm": _uniform(rng, 0.2, 0.6)}
    return "paper", {"tips.shape": "sphere", "tips.side_mm": _uniform(rng, 1.0, 2.0), "tips.socket": "pin"}


def not_printable(rng: random.Random) -> tuple[str, dict[str, str]]:
    return "paper", {
        "print.process": rng.choice(tuple(PROCESSES)),
        "targets.P_max": _uniform(rng, 2.0, 20.0),
        "fruit.E_max_MPa": _uniform(rng, 2.0, 12.0),
        "press.travel_mm": _uniform(rng, 0.5, 2.5),
    }


def out_of_reach(rng: random.Random) -> tuple[str, dict[str, str]]:
    return "paper", {
        "targets.NL": f"{10.0 ** rng.uniform(-3.5, -2.2):.2g}",
        "targets.P_max": _uniform(rng, 4.0, 40.0),
    }


def given_springs(rng: random.Random) -> tuple[str, dict[str, str]]:
    return "paper", {
        "springs.K_l_N_per_m": _uniform(rng, 500.0, 1500.0),
        "springs.K_h_N_per_m": _uniform(rng, 9000.0, 25000.0),
    }


def reading(rng: random.Random) -> tuple[str, dict[str, str]]:
    changes = {
        "press.travel_mm": _uniform(rng, 0.3, 0.7),
        "springs.K_h_N_per_m": _uniform(rng, 1000.0, 3000.0),
        "tips.spacing_mm": _uniform(rng, 5.5, 8.0),
        "reading.noise_percent": _uniform(rng, 0.3, 1.0),
        "reading.uncertainty_limit": _uniform(rng, 0.08, 0.15),
    }
    return "mango", {key: value for key, value in changes.items() if rng.random() < 0.6}


def flat_reading(rng: random.Random) -> tuple[str, dict[str, str]]:
    return "paper-on-mango", {"reading.tilt_deg": _uniform(rng, 1.0, 4.0), "fruit.radius_mm": _uniform(rng, 33.0, 40.0)}


KINDS: tuple[Callable[[random.Random], tuple[str, dict[str, str]]], ...] = (
    bruising,
    tilted,
    round_fruit,
    round_tips,
    not_printable,
    out_of_reach,
    given_springs,
    reading,
    flat_reading,
    not_printable,
)


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What became of one design: its kind, the verdicts that failed, what mended it and how, or why nothing does."""

    number: int
    kind: str
    wrong: tuple[str, ...]
    passes: bool
    by: str
    said: str


def failing_design(seed: int, number: int) -> tuple[str, str, dict[str, str]]:
    """Return the kind, the preset and the settings of the first design drawn that can be run and does not pass."""
    rng = random.Random(f"{seed} {number}")
    kind = KINDS[number % len(KINDS)]
    while True:
        preset, settings = kind(rng)
        try:
            if not Trials(0)(load_design(preset, settings)).passes:
                return kind.__name__.replace("_", " "), preset, settings
        except (InputError, MeshError, SolveError):
            continue


def settings_in(remedy: str) -> dict[str, str]:
    """Return what a printed remedy sets; nothing where it sets nothing."""
    words = shlex.split(remedy[remedy.index("--set") :]) if "--set" in remedy else []
    return dict(word.split("=", 1) for word in words if word != "--set")


def outcome(number: int, kind: str, preset: str, settings: Mapping[str, str]) -> Outcome:
    """Run one design, follow its printed remedy, and where that does not pass ask for a suggestion."""
    design = load_design(preset, settings)
    wrong = [verdict for verdict in with_remedies(run(design)) if verdict.passed is not True]
    names = tuple(verdict.name for verdict in wrong)
    remedies = [verdict.remedy or "no remedy" for verdict in wrong]
    for remedy in dict.fromkeys(remedies):
        mended = settings_in(remedy)
        if mended and passes(preset, {**settings, **mended}):
            said = ", ".join(f"{key} {value or 'unset'}" for key, value in mended.items())
            return Outcome(number=number, kind=kind, wrong=names, passes=True, by="printed remedy", said=said)
    return suggested(number, kind, names, design)


def kept_outcome(folder: Path | None, seed: int, number: int) -> Outcome:
    """Return the outcome of a design, from its file where there is one."""
    path = None if folder is None else folder / f"{seed}-{number}.json"
    if path is not None and path.exists():
        data = json.loads(path.read_text(encoding="utf-8"))
        return Outcome(**{**data, "wrong": tuple(data["wrong"])})
    found = outcome(number, *failing_design(seed, number))
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(asdict(found)), encoding="utf-8")
    return found


def passes(preset: str, settings: Mapping[str, str]) -> bool:
    """Say whether a run of a preset with settings passes; one that is refused does not."""
    try:
        return run(load_design(preset, settings)).passed is True
    except (InputError, MeshError, SolveError):
        return False


def suggested(number: int, kind: str, names: tuple[str, ...], design: Design) -> Outcome:
    """Return what `pipeline suggest` makes of a design."""
    found = suggestion(design, RunOptions())
    if found.changes is None:
        return Outcome(number=number, kind=kind, wrong=names, passes=False, by="none found", said=found.reason)
    said = ", ".join(
        f"{key} {value:.4g}" if isinstance(value, float) else f"{key} {value or 'unset'}"
        for key, value in found.changes.items()
    )
    return Outcome(number=number, kind=kind, wrong=names, passes=True, by="suggest", said=said)


def sheet(outcomes: Sequence[Outcome]) -> Sheet:
    """Return the table of the designs."""
    count = sum(one.passes for one in outcomes)
    by = {way: sum(one.by == way for one in outcomes) for way in ("printed remedy", "suggest", "none found")}
    rows = tuple(
        (str(one.number), one.kind, ", ".join(one.wrong), one.by if one.passes else "none found", one.said)
        for one in outcomes
    )
    told = ", ".join(f"{way} {number}" for way, number in by.items())
    return Sheet(
        name="remedies",
        title="What mends them",
        heads=("design", "kind", "not passed", "mended by", "change, or why none"),
        rows=rows,
        notes=(f"{count} of the {len(outcomes)} designs that were run pass: {told}",),
    )


def reached(outcomes: Sequence[Outcome]) -> bool:
    """Say whether enough pass, and the others say that nothing was found."""
    told = all(one.passes or one.said.startswith("none found") for one in outcomes)
    return told and sum(one.passes for one in outcomes) >= GOAL * len(outcomes)


def main(arguments: Sequence[str]) -> int:
    """Draw, run and mend the designs, write and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=30, help="designs to mend")
    parser.add_argument("--first", type=int, default=0, help="number of the first one")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kept", type=Path, help="folder of outcomes, one file a design")
    parser.add_argument("--only-kept", action="store_true", help="run none, write those that are kept")
    parser.add_argument("--out", type=Path, default=OUT, help=f"folder of the page (default {OUT})")
    asked = parser.parse_args(arguments)
    outcomes: list[Outcome] = []
    with suppress(KeyboardInterrupt):
        for number in range(asked.first, asked.first + asked.count):
            if asked.only_kept and not (asked.kept / f"{asked.seed}-{number}.json").exists():
                continue
            started = time.process_time()
            outcomes.append(kept_outcome(asked.kept, asked.seed, number))
            one = outcomes[-1]
            cost = time.process_time() - started
            print(
                f"{number}: {one.kind}, {', '.join(one.wrong)}: {one.by}, {one.said} ({cost:.0f} CPU s)",
                file=sys.stderr,
                flush=True,
            )
    flags = f"--first {asked.first} --count {asked.count} --seed {asked.seed}"
    words = INTRODUCTION.format(flags=flags, kinds=len(set(KINDS)))
    publish(asked.out, {"remedies.md": page("Remedies", words, sheet(outcomes).markdown())}, as_json=False)
    return 0 if reached(outcomes) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
