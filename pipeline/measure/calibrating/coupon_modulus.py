"""The modulus of a print from its coupon: weights at the end of each leaf, and how far it sags."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cad.parts.coupon import coupon_of, modulus_factor
from cad.quantity import InputError
from pipeline.measure.calibrating.measured_table import MeasuredRow
from pipeline.measure.calibrating.weighing import weighed_springs
from pipeline.report.stored import StoredReport


@dataclass(frozen=True)
class PrintedModulus:
    """The modulus of a print [MPa] with its standard deviation as a share [1], and that of the design [MPa]."""

    E: float
    share: float
    of_design: float


def modulus_of_coupon(path: Path, rows: Sequence[MeasuredRow], report: StoredReport) -> PrintedModulus:
    """Return the modulus that the leaves of a coupon show, the surer leaf counting more; raises InputError."""
    if report.housing is None:
        msg = "the design has no housing: must have one to have a coupon; run pipeline design with springs that print"
        raise InputError(msg)
    coupon = coupon_of(report.housing)
    named = {row.words["coupon"] for row in rows}
    arms = [arm for arm in coupon.arms if arm.name in named] or list(coupon.arms)
    springs = weighed_springs(path, rows, "coupon", [arm.name for arm in arms])
    factors = [modulus_factor(arm.flexure, coupon.arm_beyond_leaf) for arm in arms]
    moduli = [factor * spring.K for factor, spring in zip(factors, springs, strict=True)]
    E, share = _weighted_mean(moduli, [1.0 / spring.share**2 for spring in springs])
    return PrintedModulus(E=E, share=share, of_design=report.design.process.E_MPa)


def _weighted_mean(moduli: Sequence[float], weights: Sequence[float]) -> tuple[float, float]:
    """Return the mean of moduli [MPa] and its standard deviation as a share [1]: what is left, and how they differ."""
    whole = math.fsum(weights)
    E = math.fsum(weight * modulus for weight, modulus in zip(weights, moduli, strict=True)) / whole
    apart = math.fsum(weight * (modulus / E - 1.0) ** 2 for weight, modulus in zip(weights, moduli, strict=True))
    return E, math.sqrt((apart + 1.0) / whole)
