"""P_max and NL of the scene that was asked for: at full travel, on this fruit, with this tilt."""

import math
from dataclasses import dataclass

import numpy as np

from cad.design.parameters import Targets
from cad.quantity import Estimate
from cad.theory.two_spring_law import curve_nonlinearity
from pipeline.response.scene_press import ScenePress, spring_shares
from pipeline.verdicts.characteristic import Characteristic
from solve.arrays import Floats
from solve.contact.linear_response import SensorResponse
from solve.contact.response import SAFETY
from solve.fruit.compliance import FruitCompliance


@dataclass(frozen=True, kw_only=True)
class SceneTargets:
    """The largest force ratio and the nonlinearity of the scene [1], None where a tip is off the fruit.

    `level` are those of a level sensor with flat sharp tips on the middle of a flat fruit, by the two-spring law.
    """

    P_max: Estimate | None
    NL: Estimate | None
    level: tuple[Estimate, Estimate]


def scene_targets(
    own: Characteristic, targets: Targets, contact: FruitCompliance, C: Floats, press: ScenePress | None
) -> SceneTargets:
    """Return P_max and NL of the scene, with their errors; C (tips, tips) [mm/N] is the compliance of the springs.

    The two-spring law gives them where it is exact, and where the scene was not pressed.
    The errors of springs and compliance move NL as they move that of the level sensor; the cells' own share is that of
    P_max, and of NL on two grids.
    """
    level = own.P_max(), own.NL(targets)
    if press is None or press.level:
        return SceneTargets(P_max=level[0], NL=level[1], level=level)
    relative = np.divide(own.spring_errors, own.springs.stiffnesses)
    of_springs = float(spring_shares(contact, C, float(press.curve.E[-1])) @ relative)
    return SceneTargets(
        P_max=_largest_ratio(press.curve, of_springs), NL=_bend(press.curve, targets, level[1].error), level=level
    )


def _largest_ratio(curve: SensorResponse, of_springs: float) -> Estimate | None:
    """Return P at E_max and full travel, with the errors of cells and compliance and that of the springs [1]."""
    P, error = float(curve.P[-1, -1]), float(curve.P_error[-1, -1])
    return Estimate(P, P * (error + of_springs)) if math.isfinite(P) else None


def _bend(curve: SensorResponse, targets: Targets, error: float) -> Estimate | None:
    """Return NL at full travel, with the larger step from coarser cells of the last two travels and an error [1]."""
    E, coarse = curve.E.tolist(), curve.P * (1.0 - curve.P_step)
    fine, rough = (
        [curve_nonlinearity(P[:, j].tolist(), E, targets.NL_definition) for j in (-2, -1)] for P in (curve.P, coarse)
    )
    step = max(abs(a - b) for a, b in zip(fine, rough, strict=True))
    return Estimate(fine[-1], SAFETY * step + error) if math.isfinite(step) else None
