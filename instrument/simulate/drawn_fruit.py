"""The fruit that a simulated unit presses and the pose of the unit, as given or drawn from the ranges of a design."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from pipeline.report.report import Report
from sensor.arrays import Floats
from sensor.design.radius_ranges import FLAT_RADIUS, Vector, designed_radii, outside_range, radii_beyond_design
from sensor.design.reading import ReadingRequirements
from solve.presses.pressed_bodies import EllipsoidFruit, FleshOnStone

_WAVES = 24  # number of plane waves in an uneven skin
_LARGEST_POISSON = 0.495  # upper limit of a random Poisson's ratio
_LARGEST_BRUISE_OFFSET = 0.5  # maximum distance between a tip and the centre of a bruise that lies under it [mm]


@dataclass(frozen=True, kw_only=True)
class PressedFruit:
    """A fruit of modulus E [MPa] and the pose of the sensor on it.

    `radii` are the principal radii [mm]; the first one lies at the angle `azimuth` [deg] from +x. `thickness` [mm] is
    the thickness of the flesh over a stone, or None if there is no stone. The sensor is tilted by `tilt` [deg] from the
    normal of the skin; positive components lower its sides at +x and +y. During the press the tilt changes by
    `tilt_change` [deg]. The sensor is placed at `off_centre` [mm] from the apex. The function `heights` returns the
    heights [mm] that are added to the skin at x and y. Under each tip, within `soft_radius` (tips,) [mm], the modulus
    of the flesh is E divided by `softness` (tips,). A tuple of one number in these two fields holds for all tips.
    """

    E: float
    radii: Vector
    azimuth: float
    thickness: float | None
    poisson: float
    tilt: Vector = (0.0, 0.0)
    tilt_change: Vector = (0.0, 0.0)
    off_centre: Vector = (0.0, 0.0)
    heights: Callable[[Floats, Floats], Floats] | None = None
    softness: tuple[float, ...] = (1.0,)
    soft_radius: tuple[float, ...] = (math.inf,)

    def in_sensor_frame(self, protrusions: Floats) -> EllipsoidFruit:
        """Return the fruit in the frame of a sensor, as the solver needs it.

        `protrusions` (tips,) [mm] are the lengths by which the domes of the sensor protrude further than designed. The
        tilt is converted, because the solver measures it from the normal at the apex of the fruit instead of the normal
        at the position of the press.
        """
        layer = None if self.thickness is None else FleshOnStone(self.thickness, self.poisson)
        fruit = EllipsoidFruit(
            E=self.E,
            R1=self.radii[0],
            R2=self.radii[1],
            azimuth=self.azimuth,
            apex=(-self.off_centre[0], -self.off_centre[1]),
            poisson=self.poisson,
            heights=tuple(protrusions.tolist()),
            bumps=self.heights,
            softness=self.softness,
            soft_radius=self.soft_radius,
            layer=layer,
        )
        # The normal at the position of the press is inclined to the normal at the apex. For small slopes, the tilt and
        # this inclination add.
        slope = np.tan(np.radians(self.tilt)) + fruit.curvature @ np.array(self.off_centre)
        tilt = math.degrees(math.atan(float(np.hypot(*slope))))
        return replace(fruit, tilt=tilt, tilt_azimuth=math.degrees(math.atan2(slope[1], slope[0])))

    @property
    def drift(self) -> Vector:
        """Return the change of the sensor's slope along x and y during the press [1]."""
        return math.radians(self.tilt_change[0]), math.radians(self.tilt_change[1])

    def in_turned_frame(self, turn: float) -> "PressedFruit":
        """Return the fruit in the frame of a sensor that is turned by `turn` [deg] about the normal.

        Only the radii are turned. The heights of an uneven skin are not, so they must be drawn again.
        """
        return replace(self, azimuth=self.azimuth - turn)


def usual_fruit(report: Report) -> PressedFruit:
    """Return a typical fruit of a design, pressed level at its apex.

    The modulus is the geometric mean of the design's range. Each radius is the mean of its range, or the radius of the
    design's fruit if no range is stated.
    """
    fruit = report.design.fruit
    reading = report.design.reading or ReadingRequirements()
    softest, firmest = range_of_moduli(report)
    if reading.radius_mm is not None and reading.radius_across_mm is not None:
        radii = (0.5 * sum(reading.radius_mm), 0.5 * sum(reading.radius_across_mm))
    else:
        radii = designed_radii(report.design)
    return PressedFruit(
        E=math.sqrt(softest * firmest),
        radii=radii,
        azimuth=fruit.azimuth_deg or 0.0,
        thickness=fruit.depth_mm,
        poisson=fruit.poisson,
    )


def draw_fruit(report: Report, rng: np.random.Generator) -> PressedFruit:
    """Return a random fruit with uneven skin and flesh, in a random pose, within the ranges of a design.

    The modulus is log-uniform. Tilts and positions are distributed uniformly in a disc, and lengths and the azimuth
    uniformly over their ranges. Poisson's ratio is normally distributed; its standard deviation is half of its spread.
    """
    reading = report.design.reading or ReadingRequirements()
    fruit = report.design.fruit
    softest, firmest = range_of_moduli(report)
    usual = usual_fruit(report)
    poisson = fruit.poisson + 0.5 * fruit.poisson_spread * rng.normal()
    drawn = replace(
        usual,
        E=math.exp(rng.uniform(math.log(softest), math.log(firmest))),
        radii=_draw_radii(report, rng),
        azimuth=float(rng.uniform(0.0, 180.0)),
        thickness=usual.thickness if reading.thickness_mm is None else float(rng.uniform(*reading.thickness_mm)),
        poisson=min(float(poisson), _LARGEST_POISSON),
        # The tilt may change during the press, and must stay within the range of the design until its end.
        tilt=_draw_in_disc(rng, max(reading.tilt_deg - reading.tilt_change_deg, 0.0)),
        tilt_change=_draw_in_disc(rng, reading.tilt_change_deg),
        off_centre=_draw_in_disc(rng, reading.off_centre_mm),
    )
    return make_uneven(drawn, report, rng)


def make_uneven(fruit: PressedFruit, report: Report, rng: np.random.Generator) -> PressedFruit:
    """Return a copy of the fruit with random heights of the skin and a random modulus of the flesh under each tip.

    The design states the root mean square of the heights, and the scatter of the modulus. A skin without roughness
    remains even.
    """
    design_fruit = report.design.fruit
    scatter = 0.01 * design_fruit.flesh_scatter_percent  # standard deviation of ln E [1]
    flesh_factors = np.exp(scatter * rng.normal(size=len(report.tips)))
    # The skin is drawn even without roughness, so that later random numbers do not depend on the roughness.
    skin = random_skin(rng, design_fruit.roughness_mm, *design_fruit.roughness_wave_mm)
    # The modulus of the flesh is divided by `softness`.
    softness = np.multiply(fruit.softness, flesh_factors)
    return replace(fruit, heights=skin if design_fruit.roughness_mm else None, softness=tuple(softness.tolist()))


def random_skin(
    rng: np.random.Generator, rms: float, shortest: float, longest: float
) -> Callable[[Floats, Floats], Floats]:
    """Return a function that computes the heights [mm] of a random uneven skin with the root mean square `rms` [mm].

    The skin is a sum of plane waves in random directions. Their wavelengths are log-uniform between `shortest` and
    `longest` [mm]. The arguments of the function are x and y [mm], shape (..., rows, columns). They are either any
    points in a single row or column, or a grid in which x is constant along each row, and y along each column.
    """
    angle, phase = rng.uniform(0.0, 2.0 * math.pi, (2, _WAVES))
    wavelengths = np.exp(rng.uniform(math.log(shortest), math.log(longest), _WAVES))
    kx, ky = 2.0 * math.pi / wavelengths * np.array([np.cos(angle), np.sin(angle)])  # wave vectors [1/mm]
    amplitude = rms * math.sqrt(2.0 / _WAVES)  # the mean square of one wave is amplitude^2 / 2

    def heights(x: Floats, y: Floats) -> Floats:
        """Return the heights [mm] at the points x and y [mm], in their common shape."""
        shape = np.broadcast_shapes(x.shape, y.shape)
        if shape[-1] == 1 or shape[-2] == 1:  # points instead of a grid
            return np.asarray(amplitude * np.cos(kx * x[..., None] + ky * y[..., None] + phase).sum(axis=-1))
        # The first column holds the x of every row, and the first row holds the y of every column.
        x_phase = kx * x[..., :, :1] + phase  # (..., rows, waves)
        y_phase = ky[:, None] * y[..., :1, :]  # (..., waves, columns)
        # With cos(a + b) = cos(a) cos(b) - sin(a) sin(b), all heights are one matrix product of rows and columns.
        rows = np.concatenate([np.cos(x_phase), -np.sin(x_phase)], axis=-1)
        columns = np.concatenate([np.cos(y_phase), np.sin(y_phase)], axis=-2)
        return np.asarray(amplitude * (rows @ columns))

    return heights


def add_bruise(fruit: PressedFruit, report: Report, radius: float, turn: float) -> PressedFruit:
    """Return a copy of the fruit with a bruise, a hemisphere of `radius` [mm] with half of the modulus.

    The bruise lies where the first tip pressed before the sensor was turned by `turn` [deg]. A bruise that is no longer
    under a tip has no effect.
    """
    positions = np.array([(tip.x_mm, tip.y_mm) for tip in report.tips])  # in the frame of the sensor
    angle = -math.radians(turn)  # in the frame of the sensor, the fruit turns in the opposite direction
    cosine, sine = math.cos(angle), math.sin(angle)
    centre = np.array([[cosine, -sine], [sine, cosine]]) @ positions[0]
    is_over_bruise = np.linalg.norm(positions - centre, axis=1) < _LARGEST_BRUISE_OFFSET
    # The modulus of the flesh is divided by `softness`, so a factor of 2 halves it.
    softness = np.broadcast_to(fruit.softness, len(positions)) * np.where(is_over_bruise, 2.0, 1.0)
    return replace(
        fruit,
        softness=tuple(softness.tolist()),
        soft_radius=tuple(np.where(is_over_bruise, radius, math.inf).tolist()),
    )


def beyond_design(fruit: PressedFruit, report: Report) -> Iterator[str]:
    """Yield a note for each property of the fruit or the pose that lies outside the range of a design.

    The properties are the modulus, the radii, the thickness over a stone, the tilt and the distance from the apex.
    """
    reading = report.design.reading or ReadingRequirements()
    depth = report.design.fruit.depth_mm
    # Without a stated range, only the thickness of the design's fruit is in range.
    thickness_range = reading.thickness_mm or (depth, depth)
    tilt, distance = math.hypot(*fruit.tilt), math.hypot(*fruit.off_centre)
    yield from outside_range("E", fruit.E, range_of_moduli(report), "MPa")
    yield from radii_beyond_design(fruit.radii, report.design)
    if fruit.thickness is not None:
        yield from outside_range("thickness", fruit.thickness, thickness_range, "mm")
    yield from outside_range("tilt", tilt, (0.0, reading.tilt_deg), "deg")
    yield from outside_range("distance from the apex", distance, (0.0, reading.off_centre_mm), "mm")


def range_of_moduli(report: Report) -> Vector:
    """Return the smallest and the largest modulus of a design [MPa]."""
    fruit = report.design.fruit
    return min(fruit.E_MPa), fruit.largest_E_MPa


def _draw_radii(report: Report, rng: np.random.Generator) -> Vector:
    """Return random principal radii [mm], distributed uniformly over the ranges of a design.

    If the design has no range for each radius, both radii of its fruit are multiplied by the same random factor. A
    fruit without a radius is flat.
    """
    reading = report.design.reading or ReadingRequirements()
    fruit = report.design.fruit
    if reading.radius_mm is not None and reading.radius_across_mm is not None:
        return float(rng.uniform(*reading.radius_mm)), float(rng.uniform(*reading.radius_across_mm))
    if fruit.radius_mm is None:
        return FLAT_RADIUS, FLAT_RADIUS
    factor = float(rng.uniform(1.0 - reading.radius_spread, 1.0 + reading.radius_spread))
    return factor * fruit.radii_mm[0], factor * fruit.radii_mm[1]


def _draw_in_disc(rng: np.random.Generator, radius: float) -> Vector:
    """Return a random point in a disc of this radius around the origin, uniform in area."""
    area_fraction, turn_fraction = rng.uniform(size=2).tolist()
    angle = 2.0 * math.pi * turn_fraction
    # The area within a distance is proportional to its square, hence the root.
    return radius * math.sqrt(area_fraction) * math.cos(angle), radius * math.sqrt(area_fraction) * math.sin(angle)
