"""Do the error bars hold: random contact scenes and random flexures against four times the dofs or another method.

Run from the root of the repository: `python tests/bench/coverage.py [--contact 200] [--curved 0] [--tilted 0]
[--squares 0] [--flexures 30] [--seed 1] [--direct 0.1] [--tolerance 2.5e-4] [--out docs]`, one thread:
OMP_NUM_THREADS=1. It writes coverage.md into a folder, prints it, and exits 1 when a goal is missed.
"""

import argparse
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from bench.beam_guess import beam_guess  # noqa: E402
from bench.square_scenes import square_scenes  # noqa: E402
from bench.tilted_scenes import tilted_scenes  # noqa: E402
from reference.curved_fruit import sizes, solid_change  # noqa: E402

from cad.design.parameters import Design, Fruit, Print, Targets, Tips  # noqa: E402
from cad.design.processes import PROCESSES  # noqa: E402
from pipeline.bench.bench import OUT  # noqa: E402
from pipeline.bench.contact import pair_and_own  # noqa: E402
from pipeline.bench.hard.contact import TOLERANCE, compliance_checks  # noqa: E402
from pipeline.bench.hard.flexure import stiffness_checks  # noqa: E402
from pipeline.bench.hard.reference_check import REFUSALS, ReferenceCheck  # noqa: E402
from pipeline.bench.hard.reference_check import checks as reference_checks  # noqa: E402
from pipeline.bench.harness import Reference  # noqa: E402
from pipeline.bench.table import Sheet, page, percent, publish  # noqa: E402
from pipeline.response.contact import contact_compliance  # noqa: E402
from pipeline.springs.mesh_pairs import DEFAULT, MESH_PAIRS, MeshPair  # noqa: E402

SOLID_ERROR = 3e-4  # relative, of tetrahedra on a solid less those on its block: scatter of unstructured meshes
SHARE, EXCESS, WIDTH = 0.95, 2.0, 5.0  # goals: inside, largest error over bar, median bar over error
HEADS = (
    "number", "checks", "refused", "no reference", "inside", "largest error / bar", "median bar / error", "median bar",
    "widest bar", "median error of the reference",
)  # fmt: skip
INTRODUCTION = """\
`tests/bench/coverage.py {flags}` writes this table. It draws random scenes and designs and compares each number with a
reference: the same solve with four times the unknowns, or the other method. Inside means that the difference is at
most the error bar and the reference's own error together.

Goals: a share of {share:g} inside, none beyond {excess:g} times its bar, bars at most {width:g} times the true error
in the median.
"""
NOTES = (
    "an error of the reference of 0 %: at least four times the dofs, to which no error is granted",
    "no reference: the computation that should judge refused; these numbers count neither way",
    "refused scenes of contact lie where an answer is promised and count as outside",
)


@dataclass(frozen=True)
class Covered:
    """One kind of number: its checks, and the scenes that were refused with a reason.

    `promised` says that these scenes lie where the product promises an answer: refusals then count as outside.
    """

    name: str
    checks: tuple[ReferenceCheck, ...]
    refused: tuple[str, ...]
    promised: bool = False

    @property
    def judged(self) -> list[ReferenceCheck]:
        """The checks that have a reference."""
        return [check for check in self.checks if check.reference is not None]

    @property
    def excesses(self) -> np.ndarray:
        """Error over bar; a zero bar is an infinite excess."""
        return np.array([check.excess if check.error > 0.0 else np.inf for check in self.judged])

    @property
    def inside(self) -> float:
        return float((self.excesses <= 1.0).mean())

    @property
    def width(self) -> float:
        """Median of bar over true error."""
        return float(np.median(1.0 / np.maximum(self.excesses, 1e-300)))

    @property
    def holds(self) -> bool:
        if not self.judged:
            return False
        answered = len(self.judged) / (len(self.judged) + len(self.refused) * self.promised)
        return answered * self.inside >= SHARE and float(self.excesses.max()) <= EXCESS

    def row(self) -> tuple[str, ...]:
        if not self.judged:
            return (self.name, "0", str(len(self.refused)), str(len(self.checks)), *["-"] * 6)
        bars = [check.relative_error for check in self.judged]
        references = [check.reference_error / abs(check.reference) for check in self.judged]
        return (
            self.name,
            str(len(self.judged)),
            str(len(self.refused)),
            str(len(self.checks) - len(self.judged)),
            f"{100.0 * self.inside:.1f} %",
            f"{self.excesses.max():.2f}",
            f"{self.width:.1f}",
            *(percent(value) for value in (np.median(bars), max(bars), np.median(references))),
        )


def random_scene(rng: np.random.Generator, direct_share: float) -> tuple[Fruit, Tips]:
    """Two like tips on a block; `direct_share` of the scenes lie where direct finite elements must serve."""
    side = float(np.exp(rng.uniform(np.log(0.5), np.log(8.0))))
    direct = rng.random() < direct_share
    gap, height = side * rng.uniform(1.5, 8.0, 2), side * rng.uniform(1.0, 10.0)
    if direct:
        if rng.random() < 0.5:
            gap = side * np.array([rng.uniform(0.2, 1.5), rng.uniform(1.5, 4.0)])
        else:
            height = side * rng.uniform(0.4, 1.0)
    height = min(max(height, 3.0 if not direct else 0.4 * side), 80.0)
    spacing = side * rng.uniform(1.2, 8.0)
    offset = 0.0 if rng.random() < 0.5 else rng.uniform(-1.0, 1.0) * side
    poisson = float(rng.choice([rng.uniform(0.0, 0.49), rng.uniform(0.49, 0.4999)], p=[0.7, 0.3]))
    fruit = Fruit(
        length_mm=float(spacing + side + 2.0 * (gap[0] + abs(offset))),
        width_mm=float(side + 2.0 * gap[1]),
        height_mm=float(height),
        poisson=min(poisson, 0.45) if direct else poisson,
    )
    shape = "cylinder" if rng.random() < 0.3 and not direct else "cube"
    return fruit, Tips(shape=shape, side_mm=side, spacing_mm=float(spacing), offset_mm=float(offset))


def random_design(rng: np.random.Generator, process: str) -> Design:
    """Draw a design whose springs the process may make."""
    return Design(
        targets=Targets(P_max=float(rng.uniform(3.0, 8.0)), NL=float(rng.uniform(0.02, 0.15))),
        tips=Tips(side_mm=float(rng.uniform(1.0, 3.0))),
        print=Print(process=process),
    )


def contact_coverage(
    count: int, seed: int, direct_share: float, tolerance: float = TOLERANCE
) -> tuple[Covered, Covered]:
    """Check s11 - s12 and s11."""
    rng = np.random.default_rng(seed)
    paired, alone, refused = [], [], []
    for place in range(count):
        fruit, tips = random_scene(rng, direct_share)
        start = time.perf_counter()
        try:
            both = compliance_checks(fruit, tips, tolerance=tolerance)
        except REFUSALS as refusal:
            refused.append(str(refusal))
            continue
        paired.append(both[0])
        alone.append(both[1])
        _progress(f"contact {place + 1}", both, start)
        if max(check.excess for check in both) > 1.0:
            print(f"    {fruit}\n    {tips}", file=sys.stderr, flush=True)
    reasons = tuple(refused)
    pair = Covered("contact s11 - s12", tuple(paired), reasons, promised=True)
    return pair, Covered("contact s11", tuple(alone), reasons, promised=True)


def random_curved(rng: np.random.Generator) -> tuple[Fruit, Tips]:
    """Draw a curved body under a central pair: a piece or a whole fruit, radii of 15 to 100 mm, tips of 1 to 2 mm."""
    radius, side = float(np.exp(rng.uniform(np.log(15.0), np.log(100.0)))), float(rng.uniform(1.0, 2.0))
    across = radius * float(rng.uniform(0.7, 1.4))
    tips = Tips(side_mm=side, spacing_mm=float(rng.uniform(3.0, min(10.0, 0.8 * radius / side)) * side))
    plan = {}
    if rng.random() < 0.5:
        sizes = rng.uniform(1.0, 1.5, 2) * (tips.spacing_mm + 5.0 * side, 6.0 * side)
        plan = {"length_mm": min(float(sizes[0]), 1.2 * radius), "width_mm": min(float(sizes[1]), 0.8 * radius)}
    thickness = radius * float(rng.uniform(0.5, 1.2) if plan else rng.uniform(0.8, 1.85))
    round_ = {"radius_mm": radius, "radius_across_mm": across, "thickness_mm": thickness}
    return Fruit(shape="ellipsoid", **round_, **plan, poisson=float(rng.uniform(0.0, 0.45))), tips


def curved_coverage(count: int, seed: int) -> tuple[Covered, ...]:
    """Check s11 - s12 of curved bodies by tetrahedra on the solid of the CAD kernel, calibrated on its block."""
    rng = np.random.default_rng(seed)
    checks, refused = [], []
    for place in range(count):
        fruit, tips = random_curved(rng)
        start = time.perf_counter()
        try:
            found = contact_compliance(fruit, tips)
            value = pair_and_own(found.S)[0]
            size = sizes(tips, 1.0, 0.25, max(fruit.depth_mm, 4.0 * tips.side_mm) / 8.0)
            truth = pair_and_own(found.S - found.shape_change)[0] + solid_change(fruit, tips, size)
        except REFUSALS as refusal:
            refused.append(str(refusal))
            continue
        reference = Reference(values=(truth,), errors=(SOLID_ERROR * truth,), source="tetrahedra on the solid")
        checks += reference_checks(("s11 - s12",), (value,), (found.error_pair,), reference)
        _progress(f"curved {place + 1}", checks[-1:], start)
    return (Covered("curved bodies, s11 - s12", tuple(checks), tuple(refused)),)


def scene_coverage(name: str, scenes: Iterable[Sequence[ReferenceCheck]]) -> tuple[Covered, ...]:
    """Check the numbers of scenes of one name by what judges them."""
    found = []
    for place, checks in enumerate(scenes):
        found.append(checks)
        _progress(f"{name} {place + 1}", checks, time.perf_counter())
    return tuple(Covered(kind[0].name, tuple(kind), ()) for kind in zip(*found, strict=True))


def flexure_coverage(count: int, seed: int) -> tuple[Covered, ...]:
    """Check both stiffnesses of random housings with beam-law leaves, on the default and on the cheapest mesh.

    The processes take turns.
    """
    rng = np.random.default_rng(seed)
    checks: dict[MeshPair, list[ReferenceCheck]] = {pair: [] for pair in (DEFAULT, MESH_PAIRS[0])}
    processes = list(PROCESSES.values())
    refused: list[str] = []
    judged = 0
    while judged < count:
        process = processes[judged % len(processes)]
        start = time.perf_counter()
        try:
            housing, _ = beam_guess(random_design(rng, process.name))
            found = stiffness_checks(housing, process.E_MPa, process.poisson, tuple(checks))
        except REFUSALS as refusal:
            refused.append(str(refusal))
            continue
        judged += 1
        for place, kept in enumerate(checks.values()):
            kept += found[2 * place : 2 * place + 2]
        _progress(f"flexure {judged} {process.name}", found, start)
    names = [f"flexure K_l, K_h, --tol {pair.least_tolerance:g}" for pair in checks]
    return tuple(Covered(name, tuple(kept), tuple(refused)) for name, kept in zip(names, checks.values(), strict=True))


def _progress(name: str, checks: Sequence[ReferenceCheck], start: float) -> None:
    words = ", ".join(f"{c.name} {c.value:.6g} bar {c.relative_error:.1e} excess {c.excess:.2f}" for c in checks)
    print(f"{name}: {words} [{checks[0].source}] {time.perf_counter() - start:.1f} s", file=sys.stderr, flush=True)


def main(arguments: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--contact", type=int, default=200, help="random contact scenes")
    parser.add_argument("--flexures", type=int, default=30, help="random flexure pairs")
    parser.add_argument("--curved", type=int, default=0, help="random curved bodies, a minute each")
    parser.add_argument("--tilted", type=int, default=0, help="random tilted scenes, half a minute each")
    parser.add_argument("--squares", type=int, default=0, help="random squares of domes, some seconds each")
    parser.add_argument("--direct", type=float, default=0.1, help="share of contact scenes beyond the split")
    parser.add_argument("--tolerance", type=float, default=TOLERANCE, help="of the split")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=OUT, help=f"folder of the page (default {OUT})")
    asked = parser.parse_args(arguments)
    covered: list[Covered] = []
    if asked.contact:
        covered += contact_coverage(asked.contact, asked.seed, asked.direct, asked.tolerance)
    if asked.curved:
        covered += curved_coverage(asked.curved, asked.seed)
    if asked.tilted:
        covered += scene_coverage("tilted", tilted_scenes(asked.tilted, asked.seed))
    if asked.squares:
        covered += scene_coverage("square", square_scenes(asked.squares, asked.seed))
    if asked.flexures:
        covered += flexure_coverage(asked.flexures, asked.seed)
    rows = tuple(kind.row() for kind in covered)
    sheet = Sheet(name="coverage", title="Random scenes and designs", heads=HEADS, rows=rows, notes=NOTES)
    flags = " ".join(f"--{name} {value:g}" for name, value in vars(asked).items() if name != "out")
    words = INTRODUCTION.format(share=SHARE, excess=EXCESS, width=WIDTH, flags=flags)
    publish(asked.out, {"coverage.md": page("Do the error bars hold?", words, sheet.markdown())}, as_json=False)
    return 0 if all(kind.holds and kind.width <= WIDTH for kind in covered) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
