"""The fruit under a simulated unit and its pose, as given or drawn from all ranges of a design."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from pipeline.report.report import Report
from sensor.arrays import Floats
from sensor.design.reading import ReadingRequirements
from solve.presses.pressed_bodies import EllipsoidFruit, FleshOnStone

_WAVES = 24  # waves of an uneven skin
_FLAT = 1e9  # [mm] radius of a flat fruit
_LARGEST_POISSON = 0.495
_AT_THE_EDGE = 1e-9  # relative tolerance at the ends of a range
_UNDER_THE_TIP = 0.5  # largest distance from a tip's centre at which a bruise is under the tip [mm]

Vector = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class PressedFruit:
    """A fruit of modulus E [MPa] with two radii [mm], the first at an `azimuth` [deg] from +x, and its pose.

    Its flesh has a `thickness` [mm] over a stone; None is a fruit without a stone. The sensor is tilted by `tilt` [deg]
    against the normal of the skin; positive components lower its sides at +x and +y. During the press the tilt changes
    by `turned` [deg]. It is placed at `off_centre` [mm] from the apex. `heights` are added
    to the skin. `softness` (tips,) is the modulus of the fruit over the modulus of the flesh under each tip, within
    `soft_radius` [mm].
    """

    E: float
    radii: Vector
    azimuth: float
    thickness: float | None
    poisson: float
    tilt: Vector = (0.0, 0.0)
    turned: Vector = (0.0, 0.0)
    off_centre: Vector = (0.0, 0.0)
    heights: Callable[[Floats, Floats], Floats] | None = None
    softness: tuple[float, ...] = (1.0,)
    soft_radius: tuple[float, ...] = (math.inf,)

    def under(self, heights: Floats) -> EllipsoidFruit:
        """Return the fruit under domes that protrude by heights [mm], in the frame of the sensor."""
        layer = None if self.thickness is None else FleshOnStone(self.thickness, self.poisson)
        fruit = EllipsoidFruit(
            E=self.E,
            R1=self.radii[0],
            R2=self.radii[1],
            azimuth=self.azimuth,
            apex=(-self.off_centre[0], -self.off_centre[1]),
            poisson=self.poisson,
            heights=tuple(heights.tolist()),
            bumps=self.heights,
            softness=self.softness,
            soft_radius=self.soft_radius,
            layer=layer,
        )
        # A hand tilts against the normal at the place of the press, which is inclined to the normal at the apex.
        slope = np.tan(np.radians(self.tilt)) + fruit.curvature @ np.array(self.off_centre)
        tilt = math.degrees(math.atan(float(np.hypot(*slope))))
        return replace(fruit, tilt=tilt, tilt_azimuth=math.degrees(math.atan2(slope[1], slope[0])))

    @property
    def drift(self) -> Vector:
        """Return the change of the slope during the press [1]."""
        return math.radians(self.turned[0]), math.radians(self.turned[1])

    def pressed_again(self, turn: float) -> "PressedFruit":
        """Return the fruit in the frame of a sensor that was turned by an angle [deg], with an even skin."""
        return replace(self, azimuth=self.azimuth - turn)


def usual_fruit(report: Report) -> PressedFruit:
    """Return the fruit of a design with the middle of its moduli and radii, pressed level at its apex."""
    fruit, reading = report.design.fruit, report.design.reading or ReadingRequirements()
    least, largest = range_of_moduli(report)
    radii = designed_radii(report)
    if reading.radius_mm is not None and reading.radius_across_mm is not None:
        radii = (0.5 * sum(reading.radius_mm), 0.5 * sum(reading.radius_across_mm))
    return PressedFruit(
        E=math.sqrt(least * largest),
        radii=radii,
        azimuth=fruit.azimuth_deg or 0.0,
        thickness=fruit.depth_mm,
        poisson=fruit.poisson,
    )


def drawn_fruit(report: Report, rng: np.random.Generator) -> PressedFruit:
    """Return a random fruit, place and hand, uniform over the ranges of a design.

    Moduli are uniform in their logarithm, tilts and places in area. Poisson's ratio is normal with half its spread, and
    skin and flesh are uneven.
    """
    reading, fruit = report.design.reading or ReadingRequirements(), report.design.fruit
    least, largest = range_of_moduli(report)
    usual = usual_fruit(report)
    poisson = fruit.poisson + 0.5 * fruit.poisson_spread * rng.normal()
    drawn = replace(
        usual,
        E=math.exp(rng.uniform(math.log(least), math.log(largest))),
        radii=_drawn_radii(report, rng),
        azimuth=float(rng.uniform(0.0, 180.0)),
        thickness=usual.thickness if reading.thickness_mm is None else float(rng.uniform(*reading.thickness_mm)),
        poisson=min(float(poisson), _LARGEST_POISSON),
        tilt=_in_disc(rng, max(reading.tilt_deg - reading.tilt_change_deg, 0.0)),
        turned=_in_disc(rng, reading.tilt_change_deg),
        off_centre=_in_disc(rng, reading.off_centre_mm),
    )
    return uneven(drawn, report, rng)


def uneven(fruit: PressedFruit, report: Report, rng: np.random.Generator) -> PressedFruit:
    """Return a fruit with the uneven skin and flesh of the design."""
    of_design = report.design.fruit
    scatter = 0.01 * of_design.flesh_scatter_percent
    soft = np.exp(scatter * rng.normal(size=len(report.tips)))
    waves = waves_of_skin(rng, of_design.roughness_mm, *of_design.roughness_wave_mm)
    together = np.multiply(fruit.softness, soft)
    return replace(fruit, heights=waves if of_design.roughness_mm else None, softness=tuple(together.tolist()))


def waves_of_skin(
    rng: np.random.Generator, rms: float, shortest: float, longest: float
) -> Callable[[Floats, Floats], Floats]:
    """Return a function for the heights of a skin with an rms [mm] at places x and y [mm], (..., rows, columns).

    The waves run in all directions, and their lengths are uniform in the logarithm. x is constant along each row, y
    along each column.
    """
    angle, phase = rng.uniform(0.0, 2.0 * math.pi, (2, _WAVES))
    lengths = np.exp(rng.uniform(math.log(shortest), math.log(longest), _WAVES))
    kx, ky = 2.0 * math.pi / lengths * np.array([np.cos(angle), np.sin(angle)])
    size = rms * math.sqrt(2.0 / _WAVES)

    def heights(x: Floats, y: Floats) -> Floats:
        shape = np.broadcast_shapes(x.shape, y.shape)
        if shape[-1] == 1 or shape[-2] == 1:
            return np.asarray(size * np.cos(kx * x[..., None] + ky * y[..., None] + phase).sum(axis=-1))
        along = kx * x[..., :, :1] + phase  # (..., rows, waves)
        across = ky[:, None] * y[..., :1, :]  # (..., waves, columns)
        # The cosine of a sum is expanded, so that rows and columns are one matrix product.
        of_rows = np.concatenate([np.cos(along), -np.sin(along)], axis=-1)
        of_columns = np.concatenate([np.cos(across), np.sin(across)], axis=-2)
        return np.asarray(size * (of_rows @ of_columns))

    return heights


def bruised(fruit: PressedFruit, report: Report, radius: float, turn: float) -> PressedFruit:
    """Return a fruit whose flesh has half its modulus in a hemisphere of a radius [mm] where the first tip pressed.

    The sensor was turned by an angle [deg] since. A bruise that is no longer under a tip has no effect.
    """
    places = np.array([(tip.x_mm, tip.y_mm) for tip in report.tips])
    angle = -math.radians(turn)
    c, s = math.cos(angle), math.sin(angle)
    at = np.array([[c, -s], [s, c]]) @ places[0]
    felt = np.linalg.norm(places - at, axis=1) < _UNDER_THE_TIP
    softness = np.broadcast_to(fruit.softness, len(places)) * np.where(felt, 2.0, 1.0)
    return replace(
        fruit,
        softness=tuple(softness.tolist()),
        soft_radius=tuple(np.where(felt, radius, math.inf).tolist()),
    )


def beyond_design(fruit: PressedFruit, report: Report) -> Iterator[str]:
    """Yield as text each property of a fruit and its pose outside the ranges of a design."""
    reading, of_design = report.design.reading or ReadingRequirements(), report.design.fruit
    least, largest = 1.0 - reading.radius_spread, 1.0 + reading.radius_spread
    radii: list[Vector] = [(least * radius, largest * radius) for radius in designed_radii(report)]
    if reading.radius_mm is not None and reading.radius_across_mm is not None:
        radii = [reading.radius_mm, reading.radius_across_mm]
    thickness = reading.thickness_mm or (of_design.depth_mm, of_design.depth_mm)
    rows: list[tuple[str, float, float, float, str]] = [("E", fruit.E, *range_of_moduli(report), "MPa")]
    names = ("radius", "radius across")
    # The order of the two radii is arbitrary, so the better match is taken.
    turned = sum(low <= r <= high for r, (low, high) in zip(fruit.radii[::-1], radii, strict=True))
    straight = sum(low <= r <= high for r, (low, high) in zip(fruit.radii, radii, strict=True))
    given = fruit.radii[::-1] if turned > straight else fruit.radii
    rows += [(name, r, *ends, "mm") for name, r, ends in zip(names, given, radii, strict=True)]
    if fruit.thickness is not None:
        rows.append(("thickness", fruit.thickness, *thickness, "mm"))
    rows.append(("tilt", math.hypot(*fruit.tilt), 0.0, reading.tilt_deg, "deg"))
    rows.append(("distance from the apex", math.hypot(*fruit.off_centre), 0.0, reading.off_centre_mm, "mm"))
    for name, value, least, largest, unit in rows:
        if not least * (1.0 - _AT_THE_EDGE) <= value <= largest * (1.0 + _AT_THE_EDGE):
            yield f"{name} {value:.4g} {unit} is outside {least:.4g} to {largest:.4g} {unit}, the range of the design"


def designed_radii(report: Report) -> Vector:
    """Return the principal radii of the fruit in the design's solution [mm]."""
    first, second = report.design.fruit.radii_mm
    return min(first, _FLAT), min(second, _FLAT)


def range_of_moduli(report: Report) -> Vector:
    """Return the least and the largest modulus of a design [MPa]."""
    fruit = report.design.fruit
    return min(fruit.E_MPa), fruit.largest_E_MPa


def _drawn_radii(report: Report, rng: np.random.Generator) -> Vector:
    """Return random principal radii [mm] from the ranges of a design."""
    reading, fruit = report.design.reading or ReadingRequirements(), report.design.fruit
    if reading.radius_mm is not None and reading.radius_across_mm is not None:
        return float(rng.uniform(*reading.radius_mm)), float(rng.uniform(*reading.radius_across_mm))
    if fruit.radius_mm is None:
        return _FLAT, _FLAT
    factor = float(rng.uniform(1.0 - reading.radius_spread, 1.0 + reading.radius_spread))
    return factor * fruit.radii_mm[0], factor * fruit.radii_mm[1]


def _in_disc(rng: np.random.Generator, radius: float) -> Vector:
    """Return a random point of a disc, uniform in area."""
    area, direction = rng.uniform(size=2).tolist()
    angle = 2.0 * math.pi * direction
    return radius * math.sqrt(area) * math.cos(angle), radius * math.sqrt(area) * math.sin(angle)
