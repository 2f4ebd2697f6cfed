"""The rise law of a design's tips: its contrast, and the domes that roll on the skin of a fruit of some curvatures."""

import math
from dataclasses import replace

import numpy as np

from sensor.arrays import Floats, rows_of
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design
from sensor.design.tips import Tips
from sensor.theory.contrast_law import ContrastLaw
from sensor.theory.contrast_rise import RiseLaw, RollingDomes

Curvatures = tuple[float, float]


def design_curvatures(design: Design) -> Curvatures:
    """Return the principal curvatures of a design's fruit [1/mm]; 0 for a flat one."""
    along, across = design.fruit.radii_mm
    return 1.0 / along, 1.0 / across


def fall_under_domes(fruit: Fruit, tips: Tips) -> Floats:
    """Return how far level domes hang over the skin beside its apex [mm], (tips,): spheres on a paraboloid."""
    reach = (tips.dome_radius_mm or 0.0) + np.array(fruit.radii_mm)
    principal = np.stack(fruit.to_principal(*np.array(tips.places_mm).T), axis=1)
    return np.asarray(0.5 * (np.square(principal) / reach).sum(axis=1))


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

    Where the fruit's principal curvatures are told [1/mm], h is proportional to R*^(-1/3), and contacts are as far from
    each other as domes roll. Gaps are those of a ball of the mean curvature in place of those of the design's fruit.
    """
    designed = rolling_domes(design, contrast.weights)
    rolling = rolling_domes(design, contrast.weights, curvatures)
    if designed is None or rolling is None:
        return RiseLaw(contrast=contrast)
    if curvatures is not None:
        of_ball = 0.5 * rolling.mean_curvature / rolling.rolling_factor
        gaps = of_ball * np.square(design.tips.places_mm).sum(axis=1) - fall_under_domes(design.fruit, design.tips)
        contrast = replace(
            contrast,
            gaps=tuple((contrast.gaps + gaps).tolist()),
            S=rows_of(np.array(contrast.S) + rolling.S() - designed.S()),
            hertz=contrast.hertz * math.pow(designed.relative_radius / rolling.relative_radius, 1.0 / 3.0),
        )
    is_curved = rolling.mean_curvature > 0.0
    return RiseLaw(contrast=contrast, rolling=rolling if is_curved and rolling.contrast_sees_saddle else None)
