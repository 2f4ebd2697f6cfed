"""Random deep presses of one tip: each converges or is refused, and its bar is held against a mesh of half the size.

From the root of the repository, `python tests/bench/large_scenes.py [--count 50] [--seed 1] [--out docs]` writes
large-scenes.md into a folder and exits 1 when a goal is missed. A scene takes some 10 s of a processor.
"""

import argparse
import math
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from cad.design.fruit import Fruit  # noqa: E402
from cad.design.tips import Press, Tips  # noqa: E402
from cad.quantity import InputError  # noqa: E402
from cad.theory.soft_tissue import FLESH_LAWS  # noqa: E402
from pipeline.bench.bench import OUT  # noqa: E402
from pipeline.bench.table import Sheet, page, publish  # noqa: E402
from solve.contact.large_response import round_tip  # noqa: E402
from solve.contact.scene import Scene  # noqa: E402
from solve.large_strain import grid  # noqa: E402
from solve.large_strain.flesh_law import FleshLaw  # noqa: E402
from solve.large_strain.force_curve import REFINEMENTS, ForceCurve, force_curve  # noqa: E402
from solve.large_strain.press import TipPress, pressed  # noqa: E402
from solve.linear import SolveError  # noqa: E402

LEAST_COVERED = 0.95  # of the forces
FINER, SLOWER = 2 * REFINEMENTS[-1], 1.5
EVERY = 3  # of the depths of a curve, the deepest one included: a finer press costs ten times as much
INTRODUCTION = """\
`tests/bench/large_scenes.py {flags}` writes this page. It draws presses at random:
a cube or a cylinder of 0.5 to 4 mm, up to 0.6 sides deep, its edge sharp or rounded up to a tenth of the side, flesh of
Poisson's ratio 0 to 0.49 by one of the three laws, a tip that grips or slides. One that grips is solved as a run
solves it; one that slides has the same meshes, but no run asks for it. Each is solved again on a mesh whose elements at
the edge are half as large as the finer one's and grow by {growth:g} from one to the next instead of {coarse:g}.

Goals: every press converges, ends at a depth that it names, or is refused in one line; its bars hold the forces of the
finer mesh in {percent:.0f} % of all depths that are compared: every third one of a curve. A depth at which the finer
mesh finds no equilibrium counts as one that is not held."""


@dataclass(frozen=True, kw_only=True)
class DeepScene:
    """One tip on flesh, its depth [tip sides], and whether it slides."""

    tips: Tips
    law: FleshLaw
    depth: float
    slides: bool


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What became of a scene: its curve or why it was refused; how far it is off over its bar [1] at each depth.

    A share is infinite where the finer mesh finds no equilibrium.
    """

    scene: DeepScene
    curve: ForceCurve | None
    refused: str
    shares: tuple[float, ...]
    seconds: float

    @property
    def end(self) -> str:
        """Return in words how the press ended."""
        if self.curve is None:
            return "refused in one line"
        return "converged" if self.curve.reached >= (1.0 - 1e-9) * self.curve.asked else "ended at a named depth"


def random_scene(rng: np.random.Generator) -> DeepScene:
    """Return a scene at random; a third of the edges are sharp."""
    side = float(np.round(0.5 * 8.0 ** rng.random(), 3))
    radius = 0.0 if rng.random() < 1.0 / 3.0 else float(np.round(0.1 * side * rng.random(), 4))
    return DeepScene(
        tips=Tips(shape=str(rng.choice(["cube", "cylinder"])), side_mm=side, fillet_mm=radius),
        law=FleshLaw(name=str(rng.choice(FLESH_LAWS)), poisson=float(np.round(0.49 * rng.random(), 3))),
        depth=float(np.round(rng.uniform(0.02, 0.6), 3)),
        slides=bool(rng.random() < 0.5),
    )


def outcome(scene: DeepScene) -> Outcome:
    """Return what becomes of a scene, on the meshes of a run and on the finer one."""
    tip = round_tip(Scene(fruit=Fruit(), tips=scene.tips, press=Press()))
    start = time.process_time()
    try:
        curve = force_curve(tip, scene.law, scene.depth, slides=scene.slides)
    except (InputError, SolveError) as error:
        seconds = time.process_time() - start
        return Outcome(scene=scene, curve=None, refused=str(error), shares=(), seconds=seconds)
    seconds = time.process_time() - start
    depths = curve.depths[::-EVERY][::-1]
    with slower_growth():
        finer = pressed(TipPress(tip=tip, law=scene.law, slides=scene.slides, refinement=FINER), depths)
    off = np.abs(finer.forces / (finer.sharp * finer.depths) - curve.factor(finer.depths))
    missed = len(depths) - len(finer.depths)
    shares = (*(off / curve.error(finer.depths)).tolist(), *[math.inf] * missed)
    return Outcome(scene=scene, curve=curve, refused="", shares=shares, seconds=seconds)


@contextmanager
def slower_growth() -> Iterator[None]:
    """Let elements grow more slowly from one to the next, so that those far from the edge are smaller too."""
    growth = grid.GROWTH
    grid.GROWTH = SLOWER
    try:
        yield
    finally:
        grid.GROWTH = growth


def outcomes(count: int, seed: int) -> Iterator[Outcome]:
    """Yield what becomes of random scenes."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield outcome(random_scene(rng))


def covered(found: Sequence[Outcome]) -> float:
    """Return the share of all forces whose bar holds that of the finer mesh [1]."""
    shares = [share for one in found for share in one.shares]
    return float(np.mean(np.array(shares) <= 1.0)) if shares else 0.0


def whole_curves(found: Sequence[Outcome]) -> tuple[int, int]:
    """Return how many curves hold the finer mesh at every depth, and how many there are."""
    curves = [one.shares for one in found if one.shares]
    return sum(max(shares) <= 1.0 for shares in curves), len(curves)


def sheets(found: Sequence[Outcome]) -> list[Sheet]:
    """Return the tables of the page: how presses end, and each scene."""
    ends = ("converged", "ended at a named depth", "refused in one line")
    rows = tuple((end, str(sum(one.end == end for one in found))) for end in ends)
    return [
        Sheet(name="ends", title="How the presses end", heads=("end", "presses"), rows=rows),
        Sheet(name="presses", title="Each press", heads=_COLUMNS, rows=tuple(_row(one) for one in found)),
    ]


_COLUMNS = (
    "tip", "side, mm", "edge / side", "law", "ν", "grip", "depth / side", "reached", "largest bar, %",
    "finer mesh, of the bar", "within", "CPU s",
)  # fmt: skip


def _row(one: Outcome) -> tuple[str, ...]:
    tips, law = one.scene.tips, one.scene.law
    grip = "slides" if one.scene.slides else "grips"
    scene = [
        tips.shape,
        f"{tips.side_mm:g}",
        f"{tips.fillet_mm / tips.side_mm:.3f}",
        law.name,
        f"{law.poisson:g}",
        grip,
    ]
    if one.curve is None:
        return (*scene, f"{one.scene.depth:g}", "refused", "-", "-", "-", f"{one.seconds:.1f}")
    bar, held = 100.0 * max(one.curve.errors), sum(share <= 1.0 for share in one.shares)
    within = f"{held} of {len(one.shares)}"
    reached, solved = f"{one.curve.reached:.3g}", [share for share in one.shares if share < math.inf]
    worst = f"{max(solved, default=math.nan):.2f}"
    return (*scene, f"{one.scene.depth:g}", reached, f"{bar:.2f}", worst, within, f"{one.seconds:.1f}")


def main() -> int:
    """Write the page; return 1 when a goal is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=OUT)
    arguments = parser.parse_args()
    found = []
    for one in outcomes(arguments.count, arguments.seed):
        found.append(one)
        print(f"{len(found):3} {' | '.join(_row(one))} {one.refused}", flush=True)
    share = covered(found)
    flags = f"--count {arguments.count} --seed {arguments.seed}"
    introduction = INTRODUCTION.format(flags=flags, percent=100.0 * LEAST_COVERED, growth=SLOWER, coarse=grid.GROWTH)
    seconds = [one.seconds for one in found if one.curve is not None]
    missed = sum(share == math.inf for one in found for share in one.shares)
    whole, curves = whole_curves(found)
    summary = (
        f"{100.0 * share:.1f} % of {sum(len(one.shares) for one in found)} forces are covered; at {missed} of them the "
        f"finer mesh found no equilibrium. {whole} of {curves} curves hold it at every depth. A curve took "
        f"{np.median(seconds):.1f} CPU s in the median, {max(seconds):.1f} at most."
    )
    tables = [sheet.markdown() for sheet in sheets(found)]
    text = page("Random deep presses", f"{introduction}\n\n{summary}", *tables)
    publish(arguments.out, {"large-scenes.md": text}, as_json=False)
    return 0 if share >= LEAST_COVERED else 1


if __name__ == "__main__":
    sys.exit(main())
