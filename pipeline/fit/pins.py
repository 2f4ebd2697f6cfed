"""The fit of a housing as it is made up: with pins that give in their feet, with gauges that stiffen the leaves."""

import dataclasses

import numpy as np

from cad.parts.housing import Housing
from cad.parts.pin_socket import pin_give
from cad.quantity import fault
from pipeline.fit.leaf_lengths import TOLERANCE, FittedFlexures, fit_flexures
from solve.housing.stiffness import HousingStiffness, Pair


def fit_made(housing: Housing, targets: Pair, material: Pair, tolerance: float = TOLERANCE) -> FittedFlexures:
    """Return the housing whose stiffnesses as made up are the targets [N/mm from mm, and E in MPa and nu].

    Raises InputError where pins alone give more than a target allows, else as `fit_flexures`.
    """
    fitted = fit_flexures(housing, *feet_targets(housing, targets, material), *material, tolerance)
    return dataclasses.replace(fitted, stiffness=with_pins(fitted.stiffness, fitted.housing, material))


def feet_targets(housing: Housing, targets: Pair, material: Pair) -> Pair:
    """Return the stiffnesses [N/mm] of the feet with which pins glued into them have the targets."""
    give = pin_give(housing, *material).compliance
    for key, K in zip(("flexures.low.stiffness", "flexures.high.stiffness"), targets, strict=True):
        if give * K >= 1.0:
            bound = f"less than {1.0 / give:.4g} N/mm, the stiffness of a pin in its foot"
            raise fault(key, K, "N/mm", bound, "choose tips.socket = 'none' or other targets")
    low, high = (K / (1.0 - give * K) for K in targets)
    return low, high


def with_pins(stiffness: HousingStiffness, housing: Housing, material: Pair) -> HousingStiffness:
    """Return the stiffness at the faces of pins from that of the feet; half the span of their give is in the error."""
    give = pin_give(housing, *material)
    if not give.compliance:
        return stiffness
    C = stiffness.C + give.compliance * np.eye(2)
    K = (1.0 / float(C[0, 0]), 1.0 / float(C[1, 1]))
    # The mesh's share of the error shrinks with the share of the feet in the compliance.
    low, high = (
        k / foot * mesh + 100.0 * give.error * k
        for k, foot, mesh in zip(K, stiffness.K, stiffness.error_percent, strict=True)
    )
    status = f"{stiffness.status}; with what pins give in their feet {low:.2g} and {high:.2g} %"
    return dataclasses.replace(stiffness, C=C, K=K, error_percent=(low, high), status=status)
