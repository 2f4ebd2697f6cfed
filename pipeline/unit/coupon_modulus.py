"""The modulus of a print from its coupon: weights at the end of each leaf, and how far it sags."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cad.parts.coupon import coupon_of, modulus_factor
from cad.quantity import InputError
from pipeline.report.stored import StoredReport
from pipeline.unit.measured_table import MeasuredRow
from pipeline.unit.weighing import weighed_springs


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
    arms = [arm for arm in coupon.arms if arm.name in named]
    names = [arm.name for arm in arms] or [arm.name for arm in coupon.arms]
    springs = weighed_springs(path, rows, "coupon", names)
    moduli = [
        modulus_factor(arm.flexure, coupon.arm_beyond_leaf) * spring.K
        for arm, spring in zip(arms, springs, strict=True)
    ]
    weights = [1.0 / spring.share**2 for spring in springs]
    whole = math.fsum(weights)
    E = math.fsum(weight * modulus for weight, modulus in zip(weights, moduli, strict=True)) / whole
    apart = math.sqrt(
        math.fsum(weight * (modulus / E - 1.0) ** 2 for weight, modulus in zip(weights, moduli, strict=True)) / whole
    )
    return PrintedModulus(
        E=E, share=math.hypot(apart, 1.0 / math.sqrt(whole)), of_design=report.design.print.made_by.E_MPa
    )
