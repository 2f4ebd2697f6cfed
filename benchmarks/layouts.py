"""The largest error of one reading by tilt, for each layout of tips, beside the numbers that led to the presets.

`python -m benchmarks.layouts` (2 minutes) writes docs/layouts.md. The numbers beside are those of quick boundary
elements: half-space, small slopes, 1 mm tips on a sphere of 35 mm, travel 0.6 mm, springs 0.753 and 17.3 N/mm.
"""

import dataclasses
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cad.design.fruit import Fruit
from cad.design.tips import Press, Tips
from cad.theory.contrast_law import ContrastLaw, ReadingError, contrast_weights, read_modulus
from solve.contact.domes.law import dome_contrast
from solve.contact.linear_response import spring_compliance, travels
from solve.contact.poses import Pose, pose_forces
from solve.contact.response import scene_response
from solve.contact.scene import Scene
from solve.fruit.compliance import FruitCompliance
from solve.fruit.curved_body import curved_compliance
from solve.fruit.split import block_compliance, contact_footprints

PAGE = Path(__file__).parents[1] / "docs" / "layouts.md"
RADIUS, POISSON = 35.0, 0.3
MODULI = (0.5, 1.0, 3.5)
TILTS = (0.0, 2.0, 4.0, 6.0, 8.0)
DIRECTIONS = 8
SAMPLES = 12  # over the travel, of a pair
# As deep and as wide as the sphere allows: what is left of its bounds is alike under all tips and drops out.
HALF_SPACE = Fruit(shape="sphere", radius_mm=RADIUS, thickness_mm=65.0, poisson=POISSON)
FLESH = Fruit(shape="sphere", radius_mm=RADIUS, thickness_mm=12.0, poisson=POISSON)
LINE = {"layout": "line", "spacing_mm": 2.5, "outer_mm": 2.5**2 / (2.0 * RADIUS)}
DOME = {"shape": "dome", "dome_radius_mm": 1.0, "side_mm": 1.9}
LIFTS = "lifts"


@dataclass(frozen=True)
class Row:
    """A layout, how it is read, the document's errors [%] at each tilt or None, travel [mm] and springs [N/mm]."""

    name: str
    tips: Tips
    reading: str
    document: tuple[float | str | None, ...]
    travel: float = 0.6
    stiffness: tuple[float, float] = (0.753, 17.3)

    def springs(self) -> np.ndarray:
        """Return the compliance of the springs [mm/N], (tips, tips)."""
        return spring_compliance(*(self.stiffness[kind == "high"] for kind in self.tips.springs))

    def scene(self, fruit: Fruit) -> Scene:
        return Scene(fruit=fruit, tips=self.tips, press=Press(travel_mm=self.travel))


ROWS = (
    Row("two tips, spacing 8", Tips(), "force ratio", (1.0, 147.0, 800.0, None, LIFTS)),
    Row("two tips, spacing 8", Tips(), "slope after touch", (6.0, 29.0, 55.0, None, LIFTS)),
    Row("H-L-H, outer tips longer", Tips(order="HLH", **LINE), "contrast", (0.8, 0.8, 0.8, 0.8, 2.8)),
    Row("L-H-L, outer tips longer", Tips(order="LHL", **LINE), "contrast", (0.6, 0.7, 1.9, 4.0, 6.8)),
    Row("L-H-L, domes r 1", Tips(order="LHL", **LINE, **DOME), "contrast", (0.2, 0.3, 0.6, 0.5, 0.5)),
    Row("H-L-H, domes r 1", Tips(order="HLH", **LINE, **DOME), "contrast", (0.8, 1.2, 1.3, 1.2, 4.8)),
    Row("square, flat 1, side 4", Tips(layout="square", spacing_mm=4.0), "contrast", (0.1, 0.9, 2.7, 5.6, 9.5)),
    Row(
        "square, domes r 1, side 4",
        Tips(layout="square", spacing_mm=4.0, **DOME),
        "contrast",
        (0.5, 0.5, 0.5, 0.4, 1.9),
    ),
    Row(
        "square, domes r 10, side 6",
        Tips(layout="square", spacing_mm=6.0, shape="dome", dome_radius_mm=10.0, side_mm=5.95),
        "contrast",
        (0.8, 0.8, 0.8, LIFTS, LIFTS),
        travel=0.4,
        stiffness=(1.2, 20.0),
    ),
)


def compliance(fruit: Fruit, tips: Tips, half_space: bool) -> FruitCompliance:
    """Return the compliance [1/mm]: of the equivalent block alone where the fruit stands for a half-space."""
    footprints = contact_footprints(fruit, tips)
    block = block_compliance(fruit.equivalent_block, footprints, 1e-3, tips.names)
    return block if half_space else curved_compliance(block, fruit, footprints, tips.shape == "dome")


def directions(tilt: float) -> list[tuple[float, float]]:
    """Return tilts along and across [deg] of one size in every direction."""
    turns = 2.0 * math.pi * np.arange(DIRECTIONS if tilt else 1) / DIRECTIONS
    return [(tilt * math.cos(turn), tilt * math.sin(turn)) for turn in turns]


def contrast_law(scene: Scene, known: FruitCompliance, C: np.ndarray) -> ContrastLaw:
    """Return the law that reads a line or a square."""
    S, hertz = known.S, 0.0
    if scene.tips.shape == "dome":
        level = dome_contrast(scene, known, C, 1.0)
        S, hertz = level.S, level.hertz
    weights = contrast_weights(scene.tips.places_mm, scene.tips.springs)
    return ContrastLaw(weights=weights, gaps=(0.0,) * len(C), C=C.tolist(), S=S.tolist(), hertz=hertz)


def contrast_errors(row: Row, scene: Scene, known: FruitCompliance, tilt: float) -> Iterator[float]:
    """Yield E read / E - 1 [1] at every modulus and direction; nan where a tip is off."""
    C = row.springs()
    law = contrast_law(scene, known, C)
    poses = [Pose(E=E, travel=row.travel, tilt_deg=turn) for E in MODULI for turn in directions(tilt)]
    found = pose_forces(scene, known, C, poses)
    for pose, forces in zip(poses, found.F, strict=True):
        try:
            yield read_modulus(law, forces.tolist()) / pose.E - 1.0
        except ReadingError:
            yield math.nan


def pair_errors(row: Row, scene: Scene, known: FruitCompliance, tilt: float) -> Iterator[float]:
    """Yield E read / E - 1 [1] of a pair at every modulus, tilted along either way; nan where a tip is off."""
    C = row.springs()
    paired = 1.0 / known.K_m_over_E()
    soft, stiff = np.diag(C)
    for turn in {tilt, -tilt}:
        posed = dataclasses.replace(scene, press=dataclasses.replace(scene.press, tilt_deg=turn))
        found = scene_response(posed, known, C, MODULI, travels(row.travel, SAMPLES))
        for E, P, F in zip(MODULI, found.P, found.F, strict=True):
            touching = np.isfinite(P)
            ratio = P[-1] if row.reading == "force ratio" else _slope(F[touching])
            left = soft - ratio * stiff
            read = paired * (ratio - 1.0) / left if left > 0.0 else math.inf
            yield read / E - 1.0 if touching[-1] else math.nan


def _slope(F: np.ndarray) -> float:
    """Return the slope of the line through the forces of the high tip over those of the low one [1]."""
    return float(np.polyfit(F[:, 0], F[:, 1], 1)[0]) if len(F) > 1 else math.nan


def largest_error(row: Row, fruit: Fruit, known: FruitCompliance, tilt: float) -> float | str:
    """Return the largest |E read / E - 1| [%], or that a tip lifts."""
    errors = (pair_errors if row.tips.layout == "pair" else contrast_errors)(row, row.scene(fruit), known, tilt)
    sizes = [100.0 * abs(error) for error in errors]
    return LIFTS if any(math.isnan(size) for size in sizes) else max(sizes)


def shown(value: float | str | None) -> str:
    if value is None or isinstance(value, str):
        return value or "-"
    return "none" if math.isinf(value) else f"{value:.0f}" if value >= 100.0 else f"{value:.1f}"


def table(rows: tuple[Row, ...] = ROWS) -> list[str]:
    """Return the lines of the table, each number of the product followed by the document's."""
    lines = [
        "| layout | read by | body | " + " | ".join(f"{tilt:g} deg" for tilt in TILTS) + " |",
        "|---|---|---|" + "---|" * len(TILTS),
    ]
    for row in rows:
        for body, fruit in (("half-space", HALF_SPACE), ("flesh of 12 mm", FLESH)):
            known = compliance(fruit, row.tips, body == "half-space")
            found = [shown(largest_error(row, fruit, known, tilt)) for tilt in TILTS]
            beside = [f" ({shown(value)})" if body == "half-space" else "" for value in row.document]
            cells = [value + other for value, other in zip(found, beside, strict=True)]
            lines.append(f"| {row.name} | {row.reading} | {body} | " + " | ".join(cells) + " |")
            print(lines[-1], flush=True)
    return lines


if __name__ == "__main__":
    lines = table()
    head, _, _ = PAGE.read_text(encoding="utf-8").partition("<!-- table -->") if PAGE.exists() else ("", "", "")
    PAGE.write_text(f"{head}<!-- table -->\n\n" + "\n".join(lines) + "\n", encoding="utf-8")
