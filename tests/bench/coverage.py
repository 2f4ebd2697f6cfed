"""Do the error bars hold: random contact scenes and random flexures against four times the dofs or another method.

Run as a script from the root of the repository: `python tests/bench/coverage.py [--contact 200] [--flexures 30]
[--seed 1] [--direct 0.1] [--tolerance 2.5e-4]`, one thread: OMP_NUM_THREADS=1. It prints a Markdown table and exits 1
when a goal is missed.
"""

import argparse
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from cad.design.parameters import Design, Fruit, Print, Targets, Tips  # noqa: E402
from cad.design.processes import PROCESSES  # noqa: E402
from pipeline.bench.flexure import beam_guess  # noqa: E402
from pipeline.bench.hard.contact import TOLERANCE, compliance_claims  # noqa: E402
from pipeline.bench.hard.flexure import stiffness_claims  # noqa: E402
from pipeline.bench.hard.reference_check import REFUSALS, Claim  # noqa: E402
from pipeline.fit.leaf_lengths import DEFAULT, RUNGS, Rung  # noqa: E402

SHARE, EXCESS, WIDTH = 0.95, 2.0, 5.0  # goals: inside, largest error over bar, median bar over error


@dataclass(frozen=True)
class Covered:
    """One kind of number: claims, and the scenes that were refused with a reason.

    `promised` says that these scenes lie where the product promises an answer: refusals then count as outside.
    """

    name: str
    claims: tuple[Claim, ...]
    refused: tuple[str, ...]
    promised: bool = False

    @property
    def excesses(self) -> np.ndarray:
        """Error over bar; a zero bar is an infinite excess."""
        errors = np.array([abs(one.value - one.reference) for one in self.claims])
        bars = np.array([one.bar + one.uncertainty for one in self.claims])
        return np.divide(errors, bars, out=np.full(len(errors), np.inf), where=bars > 0.0)

    @property
    def inside(self) -> float:
        return float((self.excesses <= 1.0).mean())

    @property
    def width(self) -> float:
        """Median of bar over true error."""
        return float(np.median(1.0 / np.maximum(self.excesses, 1e-300)))

    @property
    def holds(self) -> bool:
        if not self.claims:
            return False
        answered = len(self.claims) / (len(self.claims) + len(self.refused) * self.promised)
        return answered * self.inside >= SHARE and float(self.excesses.max()) <= EXCESS

    def row(self) -> str:
        bars = np.array([one.bar / abs(one.value) for one in self.claims])
        return (
            f"| {self.name} | {len(self.claims)} | {len(self.refused)} | {100.0 * self.inside:.1f} % "
            f"| {self.excesses.max():.2f} | {self.width:.1f} | {100.0 * np.median(bars):.2g} % "
            f"| {100.0 * bars.max():.2g} % |"
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
    """Claims on s11 - s12 and on s11."""
    rng = np.random.default_rng(seed)
    paired, alone, refused = [], [], []
    for place in range(count):
        fruit, tips = random_scene(rng, direct_share)
        start = time.perf_counter()
        try:
            both = compliance_claims(fruit, tips, tolerance=tolerance)
        except REFUSALS as refusal:
            refused.append(str(refusal))
            continue
        paired.append(both[0])
        alone.append(both[1])
        _progress(f"contact {place + 1}", both, start)
        if max(claim.excess for claim in both) > 1.0:
            print(f"    {fruit}\n    {tips}", file=sys.stderr, flush=True)
    found = tuple(refused)
    return Covered("contact s11 - s12", tuple(paired), found, True), Covered("contact s11", tuple(alone), found, True)


def flexure_coverage(count: int, seed: int) -> tuple[Covered, ...]:
    """Claims of the default and of the cheapest mesh on both stiffnesses of random housings, beam-law leaves.

    The processes take turns; one that never makes a spring (clamped strip) is left out.
    """
    rng = np.random.default_rng(seed)
    claims: dict[Rung, list[Claim]] = {rung: [] for rung in (DEFAULT, RUNGS[0])}
    processes = [process for process in PROCESSES.values() if process.one_piece]
    refused: list[str] = []
    made = 0
    while made < count:
        process = processes[made % len(processes)]
        start = time.perf_counter()
        try:
            housing, _ = beam_guess(random_design(rng, process.name))
            found = stiffness_claims(housing, process.E_MPa, process.poisson, tuple(claims))
        except REFUSALS as refusal:
            refused.append(str(refusal))
            continue
        made += 1
        for place, kept in enumerate(claims.values()):
            kept += found[2 * place : 2 * place + 2]
        _progress(f"flexure {made} {process.name}", found, start)
    names = [f"flexure K_l, K_h, --tol {rung.reach:g}" for rung in claims]
    return tuple(Covered(name, tuple(kept), tuple(refused)) for name, kept in zip(names, claims.values(), strict=True))


def _progress(name: str, claims: Sequence[Claim], start: float) -> None:
    words = ", ".join(f"{c.name} {c.value:.6g} bar {c.bar / c.value:.1e} excess {c.excess:.2f}" for c in claims)
    print(f"{name}: {words} [{claims[0].by}] {time.perf_counter() - start:.1f} s", file=sys.stderr, flush=True)


def table(covered: Sequence[Covered]) -> Iterator[str]:
    """Yield the lines of the table."""
    yield "| number | claims | refused | inside | largest error / bar | median bar / error | median bar | widest bar |"
    yield "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
    for one in covered:
        yield one.row()


def main(arguments: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--contact", type=int, default=200, help="random contact scenes")
    parser.add_argument("--flexures", type=int, default=30, help="random flexure pairs")
    parser.add_argument("--direct", type=float, default=0.1, help="share of contact scenes beyond the split")
    parser.add_argument("--tolerance", type=float, default=TOLERANCE, help="of the split")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args(arguments)
    covered: list[Covered] = []
    if asked.contact:
        covered += contact_coverage(asked.contact, asked.seed, asked.direct, asked.tolerance)
    if asked.flexures:
        covered += flexure_coverage(asked.flexures, asked.seed)
    print("\n".join(table(covered)))
    return 0 if all(one.holds and one.width <= WIDTH for one in covered) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
