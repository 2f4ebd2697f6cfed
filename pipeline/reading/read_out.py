"""How the forces of a design's tips become a modulus: the contrast of one reading, or the line through a press."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cad.design.parameters import Design
from cad.theory.contrast_law import ContrastLaw, contrast_weights, read_modulus, stiffened
from cad.theory.pair_line import line_over_press
from pipeline.response.scene_press import scene_of
from solve.contact.domes.law import dome_contrast
from solve.fruit.compliance import FruitCompliance

Floats = NDArray[np.float64]

PRESS_TRAVELS = 8  # samples of a press from which a line is read


@dataclass(frozen=True, kw_only=True)
class ContrastReadOut:
    """Reads the last sample of a press by the contrast of its tips."""

    law: ContrastLaw
    method: str = "contrast of one reading"
    samples: int = 1

    def modulus(self, press: Floats) -> float:
        """Return the modulus [MPa] of forces [N], shape (samples, tips); raises ReadingError."""
        return read_modulus(self.law, press[-1].tolist())

    def with_springs(self, factors: Floats) -> "ContrastReadOut":
        """Return the read-out that takes each spring for stiffer by a factor [1], shape (tips,)."""
        return replace(self, law=replace(self.law, C=stiffened(self.law.C, factors.tolist())))

    @property
    def gives(self) -> Floats:
        """Return how far each spring gives per force [mm/N], (tips,): how a hard plate tells heights by forces."""
        return np.diag(self.law.C)

    def with_heights(self, heights: Floats) -> "ContrastReadOut":
        """Return the read-out that takes each tip for longer by a height [mm], shape (tips,)."""
        gaps = tuple(gap - height for gap, height in zip(self.law.gaps, heights.tolist(), strict=True))
        return replace(self, law=replace(self.law, gaps=gaps))


@dataclass(frozen=True, kw_only=True)
class LineReadOut:
    """Reads a whole press by the straight line through its samples; how the tips are off level drops out."""

    C: tuple[tuple[float, ...], ...]
    own_less_other: float
    method: str = "straight line through the samples of a press"
    samples: int = PRESS_TRAVELS

    def modulus(self, press: Floats) -> float:
        """Return the modulus [MPa] of forces [N], shape (samples, tips); raises ReadingError."""
        return line_over_press(self.C, self.own_less_other, press.tolist()).modulus

    def with_springs(self, factors: Floats) -> "LineReadOut":
        """Return the read-out that takes each spring for stiffer by a factor [1], shape (tips,)."""
        return replace(self, C=stiffened(self.C, factors.tolist()))

    @property
    def gives(self) -> Floats:
        """Return how far each spring gives per force [mm/N], (tips,): how a hard plate tells heights by forces."""
        return np.diag(self.C)

    def with_heights(self, _heights: Floats) -> "LineReadOut":
        """Return the same read-out: heights move the intercept of the line alone."""
        return self


ReadOut = ContrastReadOut | LineReadOut


def read_out_of(design: Design, contact: FruitCompliance, C: Floats, ahead: Sequence[float] = ()) -> ReadOut:
    """Return the read-out of a design on its fruit; C (tips, tips) [mm/N] is the compliance of the springs.

    `ahead` is how far each tip stands before the foremost one by its weight [mm], which zeroing has told.
    """
    known = _read_out(design, contact, C)
    return known.with_heights(np.array(ahead)) if ahead else known


def _read_out(design: Design, contact: FruitCompliance, C: Floats) -> ReadOut:
    tips = design.tips
    if tips.layout == "pair":
        return LineReadOut(C=_rows(C), own_less_other=1.0 / contact.K_m_over_E())
    weights = contrast_weights(tips.places_mm, tips.springs)
    if tips.dome_radius_mm is None:
        fall = [design.fruit.fall_mm(x, y) for x, y in tips.places_mm]
        gaps = tuple(np.subtract(fall, tips.height_offset_mm).tolist())
        return ContrastReadOut(law=ContrastLaw(weights=weights, gaps=gaps, C=_rows(C), S=_rows(contact.S)))
    return ContrastReadOut(law=_dome_law(design, contact, C, weights))


def _dome_law(design: Design, contact: FruitCompliance, C: Floats, weights: tuple[float, ...]) -> ContrastLaw:
    """Return the contrast of domes that stand level in the middle of the fruit, in the middle of the range of E."""
    tips, scene = design.tips, scene_of(design)
    middle = math.sqrt(min(design.fruit.E_MPa) * design.fruit.E_max_MPa)
    found = dome_contrast(scene, contact, C, middle)
    reach = (tips.dome_radius_mm or 0.0) + np.array(design.fruit.radii_mm)
    fall = 0.5 * (np.square(tips.places_mm) / reach).sum(axis=1)
    return ContrastLaw(
        weights=weights,
        gaps=tuple((fall - tips.height_offset_mm).tolist()),
        C=_rows(C),
        S=_rows(found.S),
        hertz=found.hertz,
    )


def _rows(matrix: Floats) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in np.asarray(matrix, dtype=np.float64).tolist())
