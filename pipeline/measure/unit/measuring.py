"""A printed unit as it measures: the read-out of its design with its own springs, tips and channels."""

import bisect
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from cad.design.parameters import Design
from cad.design.reading import LEAST_OVER_NOISE, Reading
from cad.quantity import validation_error
from cad.theory.contrast_law import ContrastLaw, Matrix, Place, stiffened
from pipeline.measure.unit.deep_pair import DeepPair
from pipeline.measure.unit.printed_unit import PrintedUnit
from pipeline.measure.unit.ripeness import RipenessClasses
from pipeline.report.stored import StoredReport

SAME_DEPTH = "calibrate at the same depth on a body of known E"
LAW_OF_FLESH = f"at large strain flesh is taken for log neo-Hooke, which no fruit promises: {SAME_DEPTH}"
PAIR_TILT_DEG = 2.0  # beyond it a press of a pair is told to be crooked, where the design names no tilt
_ALLOWED_OVER_SCALE = 20.0  # a force beyond so many full scales is none of this sensor's, or in another unit


@dataclass(frozen=True, kw_only=True)
class MeasuringUnit:
    """A design's report with one printed unit of it, and the ripeness classes that its readings fall in, if any.

    Raises InputError for a design at large strain that is no pair: the contrast of more tips is linear in 1 / E.
    """

    report: StoredReport
    unit: PrintedUnit
    classes: RipenessClasses | None = None

    def __post_init__(self) -> None:
        """Refuse a line or a square whose fruit is not linear."""
        design = self.report.design
        if design.press.strain != "linear" and design.tips.layout != "pair":
            bound = f"'linear' where a {design.tips.layout} is calibrated or read"
            raise validation_error("press.strain", design.press.strain, "", bound, SAME_DEPTH)

    @property
    def design(self) -> Design:
        """Return the design."""
        return self.report.design

    @cached_property
    def places(self) -> tuple[Place, ...]:
        """Return x and y of each tip [mm]."""
        return tuple((tip.x_mm, tip.y_mm) for tip in self.report.tips)

    @cached_property
    def C(self) -> Matrix:
        """Return the compliance of the unit's springs [mm/N], coupled as the frame of the design couples them."""
        nominal = self.report.read_out.springs_mm_per_N
        factors = [K * nominal[tip][tip] for tip, K in enumerate(self.unit.stiffnesses)]
        return stiffened(nominal, factors)

    @cached_property
    def law(self) -> ContrastLaw | None:
        """Return the contrast law of the unit; None for a pair."""
        designed = self.report.read_out.contrast
        if designed is None:
            return None
        gaps = tuple(gap - height for gap, height in zip(designed.gaps, self.unit.height_mm, strict=True))
        return replace(designed, gaps=gaps, C=self.C)

    @cached_property
    def deep(self) -> DeepPair | None:
        """Return the law of a pair whose tips go deep; None where the flesh is linear."""
        rows = self.report.read_out.large_strain
        if not rows:
            return None
        return DeepPair(
            C=self.C,
            S=self.report.contact.compliance_per_mm,
            side=self.design.tips.side_mm,
            depths=tuple(row.depth_sides for row in rows),
            factors=tuple(row.factor for row in rows),
            errors=tuple(0.01 * row.error_percent for row in rows),
        )

    @cached_property
    def noises(self) -> tuple[float, ...]:
        """Return the standard deviation of the noise of each channel [N]: the design's, or that of a usual bridge."""
        asked = self.design.reading or Reading()
        return tuple(asked.force_noise(force) for force in self.report.read_out.full_scale_N)

    @cached_property
    def least_forces(self) -> tuple[float, ...]:
        """Return the force of each channel below which its tip counts as off the fruit [N]."""
        return tuple(LEAST_OVER_NOISE * noise for noise in self.noises)

    @cached_property
    def largest_forces(self) -> tuple[float, ...]:
        """Return the force of each channel above which it cannot be one of this sensor [N]."""
        return tuple(_ALLOWED_OVER_SCALE * force for force in self.report.read_out.full_scale_N)

    @property
    def range_MPa(self) -> tuple[float, float]:
        """Return the least and the largest modulus that the design is made for [MPa]."""
        return min(self.design.fruit.E_MPa), self.design.largest_E_MPa

    @property
    def steepest_deg(self) -> float:
        """Return the largest tilt against the skin that the design allows for [deg], its place off centre included."""
        asked, fruit = self.design.reading, self.design.fruit
        if asked is None:
            return PAIR_TILT_DEG
        aside = asked.off_centre_mm / (fruit.radii_mm[0] * (1.0 - asked.radius_spread))
        return asked.tilt_deg + math.degrees(math.atan(aside))

    def corrected(self, read: float) -> float:
        """Return the modulus [MPa] that a level sensor reads as `read` [MPa]: what the shape of the fruit adds."""
        rows = self.report.read_out.level
        if not rows:
            return read
        logs = [math.log(row.read_MPa) for row in rows]
        shifts = [math.log(row.E_MPa / row.read_MPa) for row in rows]
        return read * math.exp(interpolated(math.log(read), logs, shifts))

    def bias(self, E: float) -> float:
        """Return the largest bias of a reading over all poses of the design [1] at a modulus [MPa]; 0 if not asked."""
        rows = self.report.moduli
        if not rows:
            return 0.0
        shares = [0.01 * abs(row.E_bias_percent) for row in rows]
        return interpolated(math.log(E), [math.log(row.E_MPa) for row in rows], shares)

    def reduced(self, E: float) -> float:
        """Return E / (1 - nu^2) [MPa] of a modulus [MPa] at the Poisson's ratio of the design."""
        return E / (1.0 - self.design.fruit.poisson**2)

    def bruised_tips(self, forces: Sequence[float], E: float) -> bool:
        """Say whether forces [N] press a fruit of modulus E [MPa] harder than its bruise limit, where it has one."""
        fruit = self.design.fruit
        if not fruit.bruise_limits_MPa:
            return False
        limit = interpolated(E, list(fruit.E_MPa), list(fruit.bruise_limits_MPa))
        return any(force > limit * self._touching_area(force, E) for force in forces)

    def _touching_area(self, force: float, E: float) -> float:
        """Return the area that a tip touches [mm^2]: the face of a flat one, Hertz's circle of a round one."""
        return self.design.tips.tip_shape.contact_area_mm2(force, self.reduced(E), self.design.fruit.radii_mm[0])

    def with_stiffness(self, tip: int, factor: float) -> "MeasuringUnit":
        """Return the unit with the spring of one tip stiffer by a factor [1]."""
        K = [value * (factor if place == tip else 1.0) for place, value in enumerate(self.unit.K_N_per_m)]
        return replace(self, unit=replace(self.unit, K_N_per_m=tuple(K)))


def interpolated(x: float, places: Sequence[float], values: Sequence[float]) -> float:
    """Return the value at x between rising places, that of the nearest one beyond them [unit of the values]."""
    at = bisect.bisect_left(places, x)
    if at == 0:
        return values[0]
    if at == len(places):
        return values[-1]
    share = (x - places[at - 1]) / (places[at] - places[at - 1])
    return values[at - 1] + share * (values[at] - values[at - 1])
