"""The rise law of a design: the contrast law of its tips, and domes that roll on a curved skin."""

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
    """Return the principal curvatures [1/mm] of a design's fruit; they are 0 for a flat fruit."""
    along, across = design.fruit.radii_mm
    return 1.0 / along, 1.0 / across


def gaps_under_domes(fruit: Fruit, tips: Tips) -> Floats:
    """Return the gaps [mm] between level domes and the fruit when a dome at the apex would just touch, shape (tips,).

    The domes are spheres of radius r, and the fruit is a paraboloid with the principal radii R1 and R2. The axis of a
    dome has the coordinates (u, v) along the principal directions of the fruit. The gap under this dome is

        u^2 / (2 (R1 + r)) + v^2 / (2 (R2 + r)).

    For tips without domes, r = 0.
    """
    radius_sums = (tips.dome_radius_mm or 0.0) + np.array(fruit.radii_mm)  # R1 + r, R2 + r
    x, y = np.array(tips.places_mm).T
    u_and_v = np.stack(fruit.to_principal(x, y), axis=1)  # (tips, 2)
    return np.asarray(0.5 * (np.square(u_and_v) / radius_sums).sum(axis=1))


def rolling_domes(
    design: Design, weights: tuple[float, ...], curvatures: Curvatures | None = None
) -> RollingDomes | None:
    """Return the model of domes that roll on a skin with these principal curvatures [1/mm]; None for other tips.

    The contact of a dome on a curved skin lies nearer to the apex than the axis of the dome. `weights` (tips,) [1] are
    the weights of the contrast. By default, the curvatures of the design's fruit are used.
    """
    radius = design.tips.dome_radius_mm
    if radius is None:
        return None
    return RollingDomes(
        positions=tuple((position.x, position.y) for position in design.tips.places_mm),
        weights=weights,
        dome_radius=radius,
        mean_curvature=0.5 * math.fsum(curvatures or design_curvatures(design)),
        poisson=design.fruit.poisson,
    )


def rise_law(design: Design, contrast: ContrastLaw, curvatures: Curvatures | None = None) -> RiseLaw:
    """Return the law by which the modulus is read from a whole press, for the design's fruit or for known curvatures.

    `contrast` is the contrast law on the design's fruit. If the principal `curvatures` [1/mm] of a fruit are known, the
    law for domes is adapted to them. The law of tips without domes does not depend on `curvatures`.
    """
    designed = rolling_domes(design, contrast.weights)
    rolling = rolling_domes(design, contrast.weights, curvatures)
    if designed is None or rolling is None:  # tips without domes
        return RiseLaw(contrast=contrast)
    if curvatures is not None:
        contrast = _adapt_contrast(contrast, design, designed, rolling)
    is_curved = rolling.mean_curvature > 0.0  # on a flat fruit, the contacts do not shift
    return RiseLaw(contrast=contrast, rolling=rolling if is_curved and rolling.contrast_depends_on_saddle else None)


def _adapt_contrast(
    contrast: ContrastLaw, design: Design, designed: RollingDomes, rolling: RollingDomes
) -> ContrastLaw:
    """Return the contrast law of domes on the design's fruit, adapted to a fruit of other curvatures.

    `designed` are the domes on the design's fruit, and `rolling` the domes on the other fruit. Three parts change:

    - Hertz's factor h is proportional to R*^(-1/3), where R* is the relative radius of dome and skin.
    - The compliance S is recomputed for the new distances between the contacts.
    - The gaps become the gaps on a ball of the same mean curvature, because the saddle is determined from the press.
    """
    gap_per_square = 0.5 * rolling.mean_curvature / rolling.rolling_factor  # gap over squared distance [1/mm]
    gaps_on_ball = gap_per_square * np.square(design.tips.places_mm).sum(axis=1)
    gap_changes = gaps_on_ball - gaps_under_domes(design.fruit, design.tips)
    return replace(
        contrast,
        gaps=tuple((contrast.gaps + gap_changes).tolist()),
        S=rows_of(np.array(contrast.S) + rolling.S() - designed.S()),
        hertz=contrast.hertz * math.pow(designed.relative_radius / rolling.relative_radius, 1.0 / 3.0),
    )
