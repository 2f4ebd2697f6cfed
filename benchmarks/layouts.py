"""The largest error of a single reading due to tilt, for each layout of tips on a round fruit.

`python -m benchmarks.layouts` (a minute) writes the table of docs/presets.md.
"""

import dataclasses
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from benchmarks.harness import ROOT, table
from pipeline.response.contact import contact_compliance
from sensor.arrays import Floats
from sensor.design.fruit import Fruit
from sensor.design.tips import PressMotion, Tips
from sensor.theory.contrast_law import ContrastLaw, ReadingError, contrast_weights, read_modulus
from solve.contact.domes.law import dome_contrast
from solve.contact.linear_response import spring_compliance, travels
from solve.contact.pose_forces import Pose, Stand, pose_forces
from solve.contact.response import scene_response
from solve.contact.scene import Scene
from solve.fruit.compliance import FruitCompliance

MODULI = (0.5, 1.0, 3.5)  # moduli of the fruit [MPa]
LEVEL_MODULUS = 1.0  # modulus at which the constants of domes in the contrast law are determined [MPa]
TILTS = (0.0, 2.0, 4.0, 6.0, 8.0)  # tilts of the sensor [deg]
DIRECTIONS = 8  # number of directions of a tilt
SAMPLES = 12  # samples over the travel of a pair
RADIUS = 35.0  # radius of the fruit [mm]
FRUIT = Fruit(shape="sphere", radius_mm=RADIUS, thickness_mm=12.0, poisson=0.3)
LINE = {"layout": "line", "spacing_mm": 2.5, "outer_mm": 2.5**2 / (2.0 * RADIUS)}
DOME = {"shape": "dome", "dome_radius_mm": 1.0, "side_mm": 1.9}
WIDE_DOME = {"shape": "dome", "dome_radius_mm": 10.0, "side_mm": 5.95}


@dataclass(frozen=True)
class Row:
    """A row of the table: a layout of tips, the method of reading, the travel [mm] and the springs [N/mm]."""

    name: str
    tips: Tips
    reading: str = "contrast"
    travel: float = 0.6
    K_l: float = 0.753
    K_h: float = 17.3

    @property
    def C(self) -> Floats:
        """Return the compliance of the springs [mm/N], shape (tips, tips)."""
        return spring_compliance(*self.tips.each(self.K_l, self.K_h))


ROWS = (
    Row("two tips, spacing 8", Tips(), "force ratio"),
    Row("two tips, spacing 8", Tips(), "slope after touch"),
    Row("H-L-H, outer tips longer", Tips(order="HLH", **LINE)),
    Row("L-H-L, outer tips longer", Tips(order="LHL", **LINE)),
    Row("L-H-L, domes r 1", Tips(order="LHL", **LINE, **DOME)),
    Row("H-L-H, domes r 1", Tips(order="HLH", **LINE, **DOME)),
    Row("square, flat 1, side 4", Tips(layout="square", spacing_mm=4.0)),
    Row("square, domes r 1, side 4", Tips(layout="square", spacing_mm=4.0, **DOME)),
    Row(
        "square, domes r 10, side 6",
        Tips(layout="square", spacing_mm=6.0, **WIDE_DOME),
        travel=0.4,
        K_l=1.2,
        K_h=20.0,
    ),
)


def contrast_errors(row: Row, scene: Scene, compliance: FruitCompliance, tilt: float) -> Iterator[float]:
    """Yield the relative error of E [1] read by the contrast law, at every modulus and direction of the tilt.

    `tilt` is in degrees. The error is nan if a tip does not touch.
    """
    law = _contrast_law(row, scene, compliance)
    angles = 2.0 * math.pi * np.arange(DIRECTIONS if tilt else 1) / DIRECTIONS
    tilts = [(tilt * math.cos(angle), tilt * math.sin(angle)) for angle in angles]  # about x and y [deg]
    stands = [Stand(tilt_deg=components) for components in tilts]
    poses = [Pose(E=E, travel=row.travel, stand=stand) for E in MODULI for stand in stands]
    solution = pose_forces(scene, compliance, row.C, poses)
    for pose, forces in zip(poses, solution.F, strict=True):
        try:
            yield read_modulus(law, forces.tolist()) / pose.E - 1.0
        except ReadingError:
            yield math.nan


def _contrast_law(row: Row, scene: Scene, compliance: FruitCompliance) -> ContrastLaw:
    """Return the contrast law of a level sensor, whose tips have no gaps.

    `compliance` is the compliance of the fruit under the tips. If the tips are domes, their compliance and their
    flattening come from a level press instead.
    """
    S = compliance.S
    hertz = 0.0  # flat tips do not flatten
    if row.tips.tip_shape.obeys_hertz:
        level_domes = dome_contrast(scene, compliance, row.C, LEVEL_MODULUS)
        S = level_domes.S
        hertz = level_domes.hertz
    weights = contrast_weights(row.tips.places_mm, row.tips.springs)
    return ContrastLaw(weights=weights, gaps=(0.0,) * len(S), C=row.C.tolist(), S=S.tolist(), hertz=hertz)


def pair_errors(row: Row, scene: Scene, compliance: FruitCompliance, tilt: float) -> Iterator[float]:
    """Yield the relative error of E [1] read from the force ratio of a pair, at every modulus and for both tilts.

    The ratio is taken at the end of the travel. For the reading "slope after touch", it is the slope of the force on
    the high tip against the force on the low tip. `tilt` is in degrees. The error is nan if a tip does not touch, and
    infinite if no modulus explains the ratio.
    """
    K_m_over_E = compliance.K_m_over_E()
    for signed_tilt in {tilt, -tilt}:  # a set, so that a level pair is pressed once
        press = dataclasses.replace(scene.press, tilt_deg=signed_tilt)
        tilted_scene = dataclasses.replace(scene, press=press)
        response = scene_response(tilted_scene, compliance, row.C, MODULI, travels(row.travel, SAMPLES))
        # P (travels,) are the force ratios at one modulus, and F (travels, tips) [N] are the forces.
        for E, P, F in zip(MODULI, response.P, response.F, strict=True):
            touching = np.isfinite(P)  # the ratio is finite if both tips touch
            ratio = float(P[-1])
            if row.reading == "slope after touch":
                low, high = F[touching].T
                ratio = float(np.polyfit(low, high, 1)[0]) if len(low) > 1 else math.nan
            # F_h / F_l = (1/K_l + 1/K_m) / (1/K_h + 1/K_m), solved for K_m = E K_m_over_E
            denominator = 1.0 / row.K_l - ratio / row.K_h
            E_read = (ratio - 1.0) / (K_m_over_E * denominator) if denominator > 0.0 else math.inf
            yield E_read / E - 1.0 if touching[-1] else math.nan


def error_cell(errors: Iterable[float]) -> str:
    """Return the largest of the relative errors [1] as text in percent.

    The text is "lifts" if a tip does not touch, and "none" if no modulus was read.
    """
    sizes = [100.0 * abs(error) for error in errors]
    if any(math.isnan(size) for size in sizes):
        return "lifts"
    return "none" if math.isinf(max(sizes)) else f"{max(sizes):.3g}"


def main() -> None:
    """Compute the table, and write it into docs/presets.md below the mark `<!-- table -->`."""
    heads = ["layout", "read by", *(f"{tilt:g} deg" for tilt in TILTS)]
    rows = []
    for row in ROWS:
        compliance = contact_compliance(FRUIT, row.tips)
        scene = Scene(fruit=FRUIT, tips=row.tips, press=PressMotion(travel_mm=row.travel))
        errors_at = contrast_errors if row.reading == "contrast" else pair_errors
        cells = [error_cell(errors_at(row, scene, compliance, tilt)) for tilt in TILTS]
        rows.append([row.name, row.reading, *cells])
        print(rows[-1], flush=True)
    page = ROOT / "docs" / "presets.md"
    head = page.read_text(encoding="utf-8").partition("<!-- table -->")[0]
    page.write_text(f"{head}<!-- table -->\n\n{table(heads, rows)}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
