"""The fit of a housing with pins glued into its feet: the springs in the solve, the give of the pins in series."""

import dataclasses
from collections.abc import Sequence
from concurrent.futures import Executor

import numpy as np

from cad.parts.housing import Housing
from cad.parts.pin import pin_compliance
from cad.quantity import validation_error
from pipeline.springs.leaf_lengths import TOLERANCE, fit_lengths
from pipeline.springs.solve_memo import FittedHousing
from solve.housing.stiffness import HousingStiffness


def fit_with_pins(
    housing: Housing,
    targets: Sequence[float],
    E: float,
    poisson: float,
    tolerance: float = TOLERANCE,
    executor: Executor | None = None,
) -> FittedHousing:
    """Return the housing whose springs have the target stiffnesses [N/mm from mm, E in MPa], pins included.

    Raises InputError where pins alone give more than a target allows, else as `fit_lengths`.
    """
    fitted = fit_lengths(housing, targets_without_pins(housing, targets, E, poisson), E, poisson, tolerance, executor)
    stiffness = add_pin_compliance(fitted.stiffness, fitted.housing, E, poisson)
    return dataclasses.replace(fitted, stiffness=stiffness)


def targets_without_pins(housing: Housing, targets: Sequence[float], E: float, poisson: float) -> tuple[float, ...]:
    """Return the stiffnesses [N/mm] of the feet with which pins glued into them have the targets."""
    give = pin_compliance(housing, E, poisson).compliance
    for arm, K in zip(housing.arms, targets, strict=True):
        if give * K >= 1.0:
            bound = f"less than {1.0 / give:.4g} N/mm, the stiffness of a pin in its foot"
            remedy = "choose tips.socket = 'none' or other targets"
            key = f"flexures.{arm.name}.stiffness"
            raise validation_error(key, K, "N/mm", bound, remedy)
    return tuple(K / (1.0 - give * K) for K in targets)


def add_pin_compliance(stiffness: HousingStiffness, housing: Housing, E: float, poisson: float) -> HousingStiffness:
    """Return the stiffness [N/mm] at the faces of pins from that of the feet; half their span is in the error."""
    give = pin_compliance(housing, E, poisson)
    if not give.compliance:
        return stiffness
    C = stiffness.C + give.compliance * np.eye(len(stiffness.C))
    K = tuple(1.0 / float(own) for own in np.diag(C))
    # The mesh's share of the error shrinks with the share of the feet in the compliance.
    errors = tuple(
        k / foot * mesh + give.error * k for k, foot, mesh in zip(K, stiffness.K, stiffness.error, strict=True)
    )
    bars = " and ".join(f"{100.0 * error:.2g}" for error in errors)
    info = stiffness.info
    status = f"{info.status}; with what pins give in their feet {bars} %"
    return dataclasses.replace(stiffness, C=C, K=K, error=errors, info=dataclasses.replace(info, status=status))
