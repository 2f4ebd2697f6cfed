"""The fruit as the user describes it: its shape, its flesh, and the moduli that the sensor measures.

Units: mm, MPa.
"""

import dataclasses
import math
from dataclasses import dataclass, field
from typing import Literal

from sensor.design.fruits import FRUITS
from sensor.float_or_array import FloatOrArray
from sensor.quantity import LENGTH, MODULUS, Bounds, check_fields, choice, quantity, validation_error
from sensor.theory.relaxation import FORM, Relaxation

_ENDS = 2  # number of ends of a range
_SPREAD = Bounds(at_least=0.0, at_most=0.5)
_ANGLE = Bounds(at_least=-180.0, at_most=180.0)
_UNEVEN = Bounds(at_least=0.0, at_most=1.0)
_WAVE = Bounds(at_least=0.1, at_most=100.0)
_SCATTER = Bounds(at_least=0.0, at_most=50.0)
_BLOCK_PLAN_MM = 20.0  # length and width of the block in the paper
USUAL_MODULI = Bounds(at_least=0.1, at_most=12.0)
"""Usual moduli of fruit [MPa]. For other moduli, a note asks the user to check the units."""

FruitShape = Literal["block", "sphere", "ellipsoid"]


@dataclass(frozen=True, kw_only=True)
class Fruit:
    """The fruit, fixed at its base, with the tips above it. Its length is along the tips, and its width across them.

    A sphere or an ellipsoid has its apex at the centre of the top, and is whole down to its base. If a length and a
    width are given, they cut a piece out of it. `thickness_mm` is the thickness of the flesh under the apex, down to
    the stone or the table; without it, the height is used. `radius_mm` is the radius of curvature along the tips, which
    is half the height of the whole fruit. `radius_across_mm`, only for an ellipsoid, is the radius of curvature across
    the tips. `azimuth_deg` rotates both principal directions against the tips, about the axis of the press. A block has
    no radii: `radius_mm` is None if and only if the fruit is a block.
    """

    shape: FruitShape = choice(
        ("block", "sphere", "ellipsoid"),
        default="block",
        meaning=(
            "a flat block, or a piece of a sphere or of an ellipsoid whose apex is at the centre of its upper face"
        ),
    )
    name: str | None = choice(
        tuple(FRUITS),
        default=None,
        meaning="name of the fruit in the table of `pipeline suggest --fruit`; notes are then specific to this fruit",
    )
    length_mm: float = quantity(
        "mm",
        LENGTH,
        default=None,
        hint="the paper's block has 20",
        meaning=(
            "length along the line of the tips; by default 20 for a block, and the whole length of a curved fruit"
        ),
    )
    width_mm: float = quantity(
        "mm",
        LENGTH,
        default=None,
        hint="the paper's block has 20",
        meaning="width across the line of the tips; a curved fruit with both `length_mm` and `width_mm` is a piece "
        "of that length and width",
    )
    height_mm: float = quantity(
        "mm",
        LENGTH,
        default=12.0,
        hint="the paper's block has 12",
        meaning="height in the direction of the press; in the model, the fruit is fixed at its base",
    )
    radius_mm: float | None = quantity(
        "mm",
        LENGTH,
        default=None,
        hint="a mango has about 35",
        meaning="radius of curvature along the tips (sphere, ellipsoid); a mango has about 35",
    )
    radius_across_mm: float | None = quantity(
        "mm",
        LENGTH,
        default=None,
        hint="a mango has about 35",
        meaning="radius of curvature across the tips (ellipsoid)",
    )
    azimuth_deg: float | None = quantity(
        "deg",
        _ANGLE,
        default=None,
        hint="at 0, the radius along the tips is radius_mm",
        meaning=(
            "angle from the line along the tips to the direction of `radius_mm`, anticlockwise seen from above "
            "(ellipsoid); if not set, 0"
        ),
    )
    thickness_mm: float | None = quantity(
        "mm",
        LENGTH,
        default=None,
        hint="the flesh over the stone of a mango is about 12 thick",
        meaning="thickness of the flesh under the apex, down to the stone or the table (sphere, ellipsoid); "
        "replaces the height",
    )
    poisson: float = quantity(
        "1",
        Bounds(above=-1.0, below=0.5),
        default=0.3,
        hint="fruit flesh has 0.3 to 0.49",
        meaning=(
            "Poisson's ratio of the flesh, 0.3 to 0.49; flesh with 0 does not bulge, flesh near 0.5 keeps its volume"
        ),
    )
    poisson_spread: float = quantity(
        "1",
        _SPREAD,
        default=0.05,
        hint="use 0.05 if it was not measured",
        meaning="uncertainty of Poisson's ratio, two standard deviations; the stiffness of the flesh under a tip "
        "depends on it",
    )
    E_max_MPa: float = quantity(
        "MPa",
        MODULUS,
        default=3.5,
        hint="give the upper end of the range, 3.5 for mango",
        meaning="modulus of the firmest fruit to be measured, the upper end of the range",
    )
    E_MPa: tuple[float, ...] = quantity(
        "MPa",
        MODULUS,
        default=(0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5),
        hint="list the moduli at which forces are needed",
        meaning="list of the moduli at which forces and readings are computed",
    )
    bruise_limit_MPa: float | tuple[float, ...] | None = quantity(
        "MPa",
        MODULUS,
        default=None,
        hint="apple flesh fails at 0.29",
        meaning=(
            "mean pressure under a tip at which the fruit bruises, 0.29 for apple, or a list with one value for each "
            "of `E_MPa`. If it is set, the verdict `bruise` judges the pressure"
        ),
    )
    relaxation: tuple[tuple[float, float], ...] | None = field(
        default=None,
        metadata={
            "text": FORM,
            "meaning": (
                "Prony series of flesh that relaxes: pairs of a fraction of the force and the time constant with which "
                "it decays. Every modulus of the design is then the modulus at the first instant"
            ),
        },
    )

    skin_mm: float | None = quantity(
        "mm",
        LENGTH,
        default=None,
        hint="measure a strip of peel",
        meaning="thickness of the skin, which is bonded to the flesh; without this key the fruit has no skin",
    )
    skin_E_MPa: float | None = quantity(
        "MPa",
        MODULUS,
        default=None,
        hint="apple skin has up to 24",
        meaning="modulus of the skin, at least as large as the modulus of the flesh; apple skin has up to 24",
    )
    skin_poisson: float | None = quantity(
        "1",
        Bounds(above=-1.0, below=0.5),
        default=None,
        hint="omit it if it was not measured",
        meaning="Poisson's ratio of the skin; by default equal to Poisson's ratio of the flesh",
    )
    roughness_mm: float = quantity(
        "mm",
        _UNEVEN,
        default=0.016,
        hint="the roughness of a smooth peel is 0.01 to 0.02",
        meaning="root mean square roughness of the skin at the wavelengths `roughness_wave_mm`. A smooth pomegranate "
        "has 0.014 (Ra 0.011; 0.024 after three weeks), a smooth apple peel about 0.02, a russet peel 2.5 times that",
    )
    roughness_wave_mm: tuple[float, ...] = quantity(
        "mm",
        _WAVE,
        default=(2.0, 8.0),
        hint="list the shortest and the longest wavelength",
        meaning="shortest and longest wavelength of the uneven skin; all wavelengths in between have an equal share. "
        "Shorter waves average out under a dome, and longer waves belong to the shape of the fruit. The default is a "
        "judgement",
    )
    flesh_scatter_percent: float = quantity(
        "%",
        _SCATTER,
        default=5.0,
        hint="use 5 if it was not measured",
        meaning="scatter of the modulus of the flesh from tip to tip, one standard deviation. The default is a "
        "judgement: points a few millimetres apart differ less than two cheeks of a fruit",
    )

    def __post_init__(self) -> None:
        """Check each field and the fields together, and set the length and the width if they are not given.

        Raises InputError for an invalid field, a key of another shape, or a piece that extends beyond the fruit.
        """
        check_fields(self, "fruit")
        self._check_skin()
        self._check_keys_of_shape()
        # By default, the length and the width are the size of the whole fruit. The record is frozen, so
        # `object.__setattr__` is needed.
        for key, size in zip(("length_mm", "width_mm"), self._whole_plan_mm, strict=True):
            if getattr(self, key) is None:
                object.__setattr__(self, key, size)
        self._check_azimuth()
        self._check_bruise_limits()
        self._check_waves()
        if self.relaxation is not None:
            Relaxation(self.relaxation)  # only checks the numbers
        if self.radius_mm is not None:
            self._check_piece(self.radius_mm)

    def _check_keys_of_shape(self) -> None:
        """Raise InputError if a radius of this shape is missing, or if a dimension of another shape is given."""
        required = {"block": (), "sphere": ("radius_mm",), "ellipsoid": ("radius_mm", "radius_across_mm")}[self.shape]
        optional = () if self.shape == "block" else ("thickness_mm",)
        for key in ("radius_mm", "radius_across_mm", "thickness_mm"):
            name = f"fruit.{key}"
            value = getattr(self, key)
            if value is None and key in required:
                raise validation_error(name, None, "", f"given for fruit.shape = {self.shape!r}", "give it in mm")
            if value is not None and key not in (*required, *optional):
                bound = f"left out for fruit.shape = {self.shape!r}"
                raise validation_error(name, value, "mm", bound, "drop it, or choose a shape that has this dimension")

    def _check_azimuth(self) -> None:
        """Raise InputError for an azimuth of a fruit that is not an ellipsoid, or of a whole fruit."""
        if self.azimuth_deg is None:
            return
        name = "fruit.azimuth_deg"
        if self.shape != "ellipsoid":
            bound = f"left out for fruit.shape = {self.shape!r}"
            raise validation_error(name, self.azimuth_deg, "deg", bound, "a round fruit has no principal direction")
        if self.is_whole and self.azimuth_deg:
            bound = "0 on a whole fruit"
            hint = "give fruit.length_mm and fruit.width_mm, which make it a piece"
            raise validation_error(name, self.azimuth_deg, "deg", bound, hint)

    def _check_bruise_limits(self) -> None:
        """Raise InputError if the number of bruise limits differs from the number of moduli."""
        limits = self.bruise_limit_MPa
        if isinstance(limits, tuple) and len(limits) != len(self.E_MPa):
            bound = f"one number, or a list of {len(self.E_MPa)}, one for each of fruit.E_MPa"
            raise validation_error(
                "fruit.bruise_limit_MPa", list(limits), "MPa", bound, "give as many limits as moduli"
            )

    def _check_waves(self) -> None:
        """Raise InputError unless the wavelengths of the roughness are two numbers, the shorter first."""
        waves = self.roughness_wave_mm
        if not (len(waves) == _ENDS and waves[0] <= waves[1]):
            bound = "two numbers, the smaller first"
            name = "fruit.roughness_wave_mm"
            raise validation_error(name, list(waves), "mm", bound, "list the shortest and the longest wavelength")

    def _check_skin(self) -> None:
        """Raise InputError for a skin with a missing key, a skin that is not thin, or a skin softer than the flesh.

        A skin is thin up to a third of the depth of the flesh.
        """
        if (self.skin_mm is None) != (self.skin_E_MPa is None):
            bound = "given together with fruit.skin_E_MPa"
            raise validation_error(
                "fruit.skin_mm", self.skin_mm, "mm", bound, "give both the thickness and the modulus of the skin"
            )
        if self.skin_mm is None or self.skin_E_MPa is None:
            return
        thickest = self.depth_mm / 3.0
        if self.skin_mm > thickest:
            bound = f"at most {thickest:g} mm, a third of {self.depth_key}"
            hint = "omit the skin and treat all of it as flesh"
            raise validation_error("fruit.skin_mm", self.skin_mm, "mm", bound, hint)
        stiffest_flesh = self.largest_E_MPa
        if self.skin_E_MPa < stiffest_flesh:
            bound = f"at least {stiffest_flesh:g} MPa, the modulus of the stiffest flesh"
            hint = "omit a skin that is softer than the flesh"
            raise validation_error("fruit.skin_E_MPa", self.skin_E_MPa, "MPa", bound, hint)

    def _check_piece(self, radius: float) -> None:
        """Raise InputError if the flesh is deeper than the whole fruit, or if the piece is larger than the fruit.

        `radius` [mm] is the radius along the tips, which is half the height of the whole fruit.
        """
        if self.depth_mm > 2.0 * radius:
            bound = f"at most 2 fruit.radius_mm = {2.0 * radius:g} mm"
            raise validation_error(
                self.depth_key, self.depth_mm, "mm", bound, "choose a thinner piece, or a larger radius"
            )
        if self.is_whole:
            return
        if self.fall_mm(0.5 * self.length_mm, 0.5 * self.width_mm) >= self.depth_mm:
            bound = "so small that the corners of the piece lie on the fruit, above its base"
            hint = "choose a smaller length and width, or omit both for the whole fruit"
            raise validation_error("fruit.length_mm", self.length_mm, "mm", bound, hint)

    @property
    def _whole_plan_mm(self) -> tuple[float, float]:
        """Return the length and the width [mm] of the whole fruit, seen from above.

        By default, a block has the size of the block in the paper.
        """
        if self.radius_mm is None:
            return _BLOCK_PLAN_MM, _BLOCK_PLAN_MM
        # The fruit is an ellipsoid. Its half axis along the tips is the radius along the tips. Its half axis across the
        # tips is the geometric mean of both radii.
        axis_ratio = self._widest_axis_ratio(self.radius_mm)
        axis_along = self.radius_mm * axis_ratio
        axis_across = math.sqrt(self.radius_mm * self._effective_radius_across_mm) * axis_ratio
        if not self.azimuth_deg:
            return axis_along, axis_across
        cosine, sine = self._azimuth_components
        # sides of the bounding box of the rotated ellipse
        return (
            math.hypot(axis_along * cosine, axis_across * sine),
            math.hypot(axis_along * sine, axis_across * cosine),
        )

    def _widest_axis_ratio(self, radius: float) -> float:
        """Return the full axes of the widest section of a curved fruit, divided by the half axes of its ellipsoid [1].

        The centre of the ellipsoid lies `radius` [mm] below the apex. If the base is above the centre, it is the widest
        section. Otherwise, the equator is the widest section.
        """
        # The height of the widest section above the centre, divided by the radius.
        height_ratio = max(0.0, 1.0 - self.depth_mm / radius)
        # A size must not be 0. If the height ratio rounds to 1, because the flesh is very thin, the equator is used.
        return 2.0 * math.sqrt(1.0 - height_ratio**2) if height_ratio < 1.0 else 2.0

    @property
    def derived_keys(self) -> tuple[str, ...]:
        """Return the keys `length_mm` and `width_mm`, if their values are the size of the whole fruit.

        A design file may omit these keys. A block has no such keys.
        """
        if self.radius_mm is None:
            return ()
        sizes = zip(("length_mm", "width_mm"), self._whole_plan_mm, strict=True)
        return tuple(key for key, size in sizes if getattr(self, key) == size)

    @property
    def _azimuth_components(self) -> tuple[float, float]:
        """Return the cosine and the sine of the azimuth."""
        azimuth = math.radians(self.azimuth_deg or 0.0)
        return math.cos(azimuth), math.sin(azimuth)

    @property
    def is_symmetric(self) -> bool:
        """Return whether the fruit is symmetric about the vertical planes along and across the tips."""
        return not self.azimuth_deg or self.azimuth_deg % 90.0 == 0.0

    def to_principal(self, x: FloatOrArray, y: FloatOrArray) -> tuple[FloatOrArray, FloatOrArray]:
        """Convert a position along and across the tips to coordinates along the principal directions."""
        if not self.azimuth_deg:
            return x, y
        cosine, sine = self._azimuth_components
        return cosine * x + sine * y, cosine * y - sine * x

    def from_principal(self, u: FloatOrArray, v: FloatOrArray) -> tuple[FloatOrArray, FloatOrArray]:
        """Convert coordinates along the principal directions to a position along and across the tips."""
        if not self.azimuth_deg:
            return u, v
        cosine, sine = self._azimuth_components
        return cosine * u - sine * v, sine * u + cosine * v

    @property
    def largest_E_MPa(self) -> float:
        """Return the largest modulus of the design [MPa]. A modulus in `E_MPa` may be larger than `E_max_MPa`."""
        return max(self.E_max_MPa, *self.E_MPa)

    @property
    def radii_mm(self) -> tuple[float, float]:
        """Return the principal radii of curvature [mm] along and across the tips at azimuth 0; infinite for a block."""
        return self.radius_mm or math.inf, self._effective_radius_across_mm

    @property
    def _effective_radius_across_mm(self) -> float:
        """Return the radius of curvature across the tips [mm]: for a sphere, its radius, and for a block, infinity."""
        return self.radius_across_mm or self.radius_mm or math.inf

    @property
    def can_roll(self) -> bool:
        """Return whether the fruit can roll on a table.

        A fruit can roll if it is curved and whole, and if its centre is above the table.
        """
        return self.radius_mm is not None and self.is_whole and self.depth_mm > self.radius_mm

    @property
    def is_whole(self) -> bool:
        """Return whether a curved fruit is whole down to its base, instead of a piece cut to a length and a width."""
        length, width = self._whole_plan_mm
        return self.radius_mm is not None and self.length_mm >= length and self.width_mm >= width

    @property
    def depth_key(self) -> str:
        """Return the name of the key whose value is `depth_mm`."""
        return "fruit.height_mm" if self.thickness_mm is None else "fruit.thickness_mm"

    @property
    def depth_mm(self) -> float:
        """Return the depth of flesh under the apex [mm]: the height of a block or the thickness of a curved fruit."""
        return self.height_mm if self.thickness_mm is None else self.thickness_mm

    @property
    def bruise_limits_MPa(self) -> tuple[float, ...]:
        """Return the mean pressure [MPa] at which flesh of each modulus in `E_MPa` bruises.

        The result is empty if the fruit has no limit.
        """
        limit = self.bruise_limit_MPa
        if limit is None or isinstance(limit, tuple):
            return limit or ()
        return (limit,) * len(self.E_MPa)

    @property
    def equivalent_block(self) -> "Fruit":
        """Return the block with the same length, width and flesh thickness, for which the springs are sized."""
        return dataclasses.replace(
            self,
            shape="block",
            height_mm=self.depth_mm,
            radius_mm=None,
            radius_across_mm=None,
            azimuth_deg=None,
            thickness_mm=None,
        )

    def fall_mm(self, x: float, y: float) -> float:
        """Return the depth [mm] of the skin below the apex at (x, y) [mm]. The depth is infinite beyond the fruit."""
        if self.radius_mm is None:
            return 0.0
        x, y = self.to_principal(x, y)
        level = 1.0 - (x / self.radius_mm) ** 2 - y * y / (self.radius_mm * self._effective_radius_across_mm)
        return self.radius_mm * (1.0 - math.sqrt(level)) if level >= 0.0 else math.inf
