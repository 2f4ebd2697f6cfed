"""The rise law of a design's tips: its contrast, and the domes that roll on the skin of a fruit of some curvatures."""

import math
from dataclasses import replace

import numpy as np

from cad.design.parameters import Design
from cad.theory.contrast_law import ContrastLaw
from cad.theory.contrast_rise import RiseLaw, RollingDomes

Curvatures = tuple[float, float]


def design_curvatures(design: Design) -> Curvatures:
    """Return the principal curvatures of a design's fruit [1/mm]; 0 for a flat one."""
    along, across = design.fruit.radii_mm
    return 1.0 / along, 1.0 / across


def rolling_domes(
    design: Design, weights: tuple[float, ...], curvatures: Curvatures | None = None
) -> RollingDomes | None:
    """Return the domes of a design on a skin of principal curvatures [1/mm]; None for other tips.

    Without curvatures those of the design's fruit are taken.
    """
    radius = design.tips.dome_radius_mm
    if radius is None:
        return None
    return RollingDomes(
        positions=tuple((place.x, place.y) for place in design.tips.places_mm),
        weights=weights,
        dome_radius=radius,
        mean_curvature=0.5 * math.fsum(curvatures or design_curvatures(design)),
        poisson=design.fruit.poisson,
    )


def rise_law(design: Design, contrast: ContrastLaw, curvatures: Curvatures | None = None) -> RiseLaw:
    """Return the law by which a press is read, of a contrast on the design's fruit.

    Where the principal curvatures of the fruit are told [1/mm], h goes with R*^(-1/3), contacts are as far from each
    other as domes roll, and gaps are those of a ball of the mean curvature in place of those of the design's fruit.
    """
    designed = rolling_domes(design, contrast.weights)
    rolling = rolling_domes(design, contrast.weights, curvatures)
    if designed is None or rolling is None:
        return RiseLaw(contrast=contrast)
    if curvatures is not None:
        axes = np.array(design.tips.places_mm)
        principal = np.stack(design.fruit.to_principal(*axes.T), axis=1)
        of_design = np.square(principal) @ [1.0 / (radius + rolling.dome_radius) for radius in design.fruit.radii_mm]
        of_ball = rolling.mean_curvature / rolling.rolling_factor * np.square(axes).sum(axis=1)
        gaps = 0.5 * (of_ball - of_design)
        contrast = replace(
            contrast,
            gaps=tuple((contrast.gaps + gaps).tolist()),
            S=tuple(tuple(row) for row in (np.array(contrast.S) + rolling.S() - designed.S()).tolist()),
            hertz=contrast.hertz * math.pow(designed.relative_radius / rolling.relative_radius, 1.0 / 3.0),
        )
    is_curved = rolling.mean_curvature > 0.0
    return RiseLaw(contrast=contrast, rolling=rolling if is_curved and rolling.contrast_sees_saddle else None)
