"""Reading of presses in the subset of Python that MicroPython runs; `pipeline read --micropython` copies this file.

Forces are in N, lengths in mm and moduli in MPa. A list has one value for each tip. Only math is imported, annotations
are builtin types, and the memory of a press does not grow. The C header implements the same reading. `pipeline read`
uses this source to cut touches and to find bad samples. It refuses what is flagged here as bad, saturated or not tared.
"""

import math

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

BAD_FORCE = 1  # not a number, below zero by more than noise, or far beyond full scale
LIFT_OFF = 2  # a tip does not touch the fruit
OUT_OF_RANGE = 4  # no modulus, or one outside the range of the design
SATURATED = 8  # counts at the end of the converter's range
NOT_TARED = 16  # no counts of the free sensor were given before
FEW_SAMPLES = 32  # a press of too few samples with all tips on the fruit
NO_RISE = 64  # a press that hardly rises after the last tip touched
TOO_FAST = 128  # a press so fast that the time error of the channels changes E by 2 % or more
PRESSES_DISAGREE = 256  # presses of a fruit that differ by more than their own errors allow

MOST_PRESSES = 8  # maximum number of presses of one fruit that are stored
MUCH_LESS_CERTAIN = 2.0  # a press counts only if its deviation is at most this multiple of the smallest deviation


class Unit:
    """The constants of a unit, as `pipeline read --c-header` and `--micropython` write them."""

    # Channels and forces, one value for each tip unless stated otherwise.
    gains: list[float]  # force divided by channel reading [1]
    newtons: list[float]  # matrix from counts to channel readings [N per count], row by row; empty without calibration
    saturation: int  # count at the end of the converter's range
    least_forces: "Sequence[float]"  # smallest force of a tip that is in contact [N]
    lowest_forces: "Sequence[float]"  # a force below this is bad [N]
    largest_forces: "Sequence[float]"  # a force above this is bad [N]
    later: list[float]  # delay after the first conversion, as a fraction of a sample; empty if all are simultaneous
    several: int  # number of consecutive samples that one bad conversion affects
    time_deviation: float  # standard deviation of the channels' sampling times, as a fraction of a sample
    largest_by_time: float  # largest relative error of E due to sampling times before a press is too fast [1]
    # Moduli.
    least_E: float  # lower end of the design's range [MPa]
    largest_E: float  # upper end of the design's range [MPa]
    reduced: float  # E / (1 - nu^2) divided by E [1]
    level_logs: list[float]  # logarithms of the moduli that a level sensor reads
    level_shifts: list[float]  # logarithms of the true moduli, minus `level_logs`
    # The contrast: the mean of a quantity over the high tips minus its mean over the low tips.
    springs: list[float]  # weights of the contrast for F [mm/N]
    fruit: list[float]  # weights of the contrast for F / E [mm/N MPa]
    domes: list[float]  # weights of the contrast for (F / E)^(2/3) [mm/N^(2/3) MPa^(2/3)]
    gap: float  # contrast of the known gaps under the tips [mm]
    noises: list[float]  # standard deviation of each force [N]
    fewest: int  # minimum number of samples of a reading
    latest_touch: float  # largest total force at the touch of the last tip, as a fraction of the largest total force
    least_rise: float  # smallest standard deviation of the total force during a press [N]
    largest_noise: float  # largest standard deviation of ln E due to noise [1]
    # Domes that roll on a saddle of the skin, so that their contacts move. `places` is empty for other tips.
    weights: list[float]  # weight of each tip in the contrast [1]
    places: list[float]  # x and y of each dome's axis [mm]
    dome_radius: float  # [mm]
    rolled: float  # distance of two axes divided by the distance of their contacts, on a ball [1]
    felt: float  # contrast of x y at the axes [mm^2]
    body: float  # (1 - nu^2) / pi: deflection of a half-space at distance r from a force F, times E r / F [1]
    still: list[float]  # part of `fruit` that does not depend on the saddle: what the body adds to a half-space
    saddle_steps: int  # maximum number of iterations for the saddle
    settled: float  # largest last change of the offset, relative to the springs' part of the contrast [1]
    # The contrast that finds outliers, at a fixed modulus.
    linear: list[float]  # its weights for F [mm/N]
    line_domes: list[float]  # its weights for F^(2/3) [mm/N^(2/3)]
    errors: list[float]  # standard deviation of each force [N]
    least_slope: float  # smallest slope of this contrast against the total force [mm/N]
    most_slope: float  # largest slope [mm/N]
    of_whole: float  # variance of the total force [N^2]
    slack: float  # largest difference between the slope of a chord and the slope of a press [mm/N]
    others: int  # number of samples that a line is fitted to
    beside: int  # number of samples that are compared on either side of a sample
    firm: float  # multiple of `least_forces` above which noise does not end a touch [1]
    largest_residual: float  # largest residual of a sample [standard deviations]
    # The part of a press in which flat tips are fully seated.
    loads: list[float]  # loads from which a press is summed, as E times depth [N/mm]
    load_forces: "Sequence[float]"  # forces of the tips at each load [N], load by load
    per_offset: float  # side of a tip divided by the tip spacing [1]
    by_skin: float  # side of a tip times the slope of the skin [mm]
    rounds: int  # maximum number of iterations between the reading and the seated part
    # Several presses of one fruit.
    own_logs: list[float]  # logarithms of moduli
    own_deviations: list[float]  # standard deviations of ln E at `own_logs` that presses do not share, without noise
    chi_squares: list[float]  # limits of chi square for two presses, for three, and so on; few fruits exceed them

    def __init__(self, constants: dict[str, object]) -> None:
        """Set each constant as an attribute of its name."""
        for name in constants:
            setattr(self, name, constants[name])
        self.size = len(self.gains)

    def forces_of(self, channels: list[float]) -> tuple[list[float], int]:
        """Return the forces of the tips [N] from the readings of their channels [N], and the flags of these forces."""
        forces = []
        flags = 0
        for tip in range(self.size):
            force = self.gains[tip] * channels[tip]
            if not self.lowest_forces[tip] <= force <= self.largest_forces[tip]:
                flags |= BAD_FORCE
            if not force > self.least_forces[tip]:
                flags |= LIFT_OFF
            forces.append(force)
        return forces, flags

    def channels_of(self, above: list[float]) -> list[float]:
        """Return the channel readings [N] from the counts of all channels above tare."""
        rows = [self.newtons[tip * self.size : (tip + 1) * self.size] for tip in range(self.size)]
        return [dot(row, above) for row in rows]

    def is_saturated(self, counts: list[int]) -> bool:
        """Return whether a count is at the end of the converter's range."""
        return max(abs(count) for count in counts) >= self.saturation

    def check_range(self, E: float) -> tuple[float, float, int]:
        """Return E [MPa], E / (1 - nu^2) [MPa] and the flag OUT_OF_RANGE, or 0 if E is in the range of the design."""
        outside = not self.least_E <= E <= self.largest_E
        return E, self.reduced * E, OUT_OF_RANGE if outside else 0

    def correct_modulus(self, read: float) -> float:
        """Return the true modulus [MPa] of a fruit that a level sensor reads as `read` [MPa].

        The correction covers the shape and the skin of the fruit, and the creep of the springs.
        """
        logs = self.level_logs
        shifts = self.level_shifts
        if not logs:
            return read
        if len(logs) == 1:
            return read * math.exp(shifts[0])
        return read * math.exp(interpolate(logs, shifts, math.log(read)))

    def fruit_weights(self, offset: float) -> list[float]:
        """Return w S, the change of the contrast by each force over E [1/mm], if the skin is a saddle.

        The contrast is a weighted sum of the displacements of the tips, and S the compliance of the fruit times E.
        `offset` [mm] is the contrast of the gaps that the saddle makes under the tips. Domes roll on the saddle, so
        their contacts are nearer to each other than their axes, and a force on one contact lowers the others more.
        """
        if not self.places:
            return self.fruit
        # The contact of a dome with its axis at X lies at [[c, s], [s, c]]^-1 X. Here c is `rolled`, and s is the dome
        # radius times the saddle's curvature k_xy, in a form in which no digits cancel. `felt` [mm^2] is the contrast
        # of x y under the axes, `still` the part of w S beyond a half-space, and `body` / distance its compliance.
        gap_ratio = 2.0 * self.dome_radius * offset / self.felt * self.rolled
        saddle = gap_ratio * self.rolled / (1.0 + math.sqrt(1.0 + gap_ratio * gap_ratio))
        determinant = self.rolled * self.rolled - saddle * saddle
        weights = []
        for tip in range(self.size):
            weight = self.still[tip]
            for other in range(self.size):
                if other != tip:
                    x = self.places[2 * other] - self.places[2 * tip]
                    y = self.places[2 * other + 1] - self.places[2 * tip + 1]
                    along_x = self.rolled * x - saddle * y
                    along_y = self.rolled * y - saddle * x
                    distance = math.sqrt(along_x * along_x + along_y * along_y)  # of contacts, times the determinant
                    weight += self.weights[other] * self.body * determinant / distance
            weights.append(weight)
        return weights

    def contrast_point(self, forces: "Sequence[float]") -> tuple[float, float, float, float]:
        """Return the total force [N], the contrast [mm], the variance of the contrast and the covariance of both.

        This contrast finds outliers: at a fixed modulus it is nearly a linear function of the total force in a press.
        The covariance [N mm] is due to errors of the forces, which are in both numbers.
        """
        contrast = variance = covariance = 0.0
        for tip in range(self.size):
            cube_root = forces[tip] ** (1.0 / 3.0)
            slope = self.linear[tip] + self.line_domes[tip] / 1.5 / cube_root
            error = self.errors[tip]
            contrast += self.linear[tip] * forces[tip] + self.line_domes[tip] * cube_root * cube_root
            variance += (slope * error) ** 2
            covariance += slope * error * error
        return sum(forces), contrast, variance, covariance

    def distance_variance(self, variance: float, covariance: float, slope: float) -> float:
        """Return the variance of a point's distance from a line [mm^2], along the contrast.

        `variance` [mm^2] and `covariance` [N mm] belong to the point's contrast, and `slope` [mm/N] to the line.
        """
        return variance - slope * (2.0 * covariance - slope * self.of_whole)

    def are_firm(self, forces: "Sequence[float]") -> list[bool]:
        """Return for each tip whether its force [N] is so large that noise does not end its contact."""
        return [force > self.firm * least for force, least in zip(forces, self.least_forces)]


def dot(weights: list[float], values: list[float]) -> float:
    """Return the dot product."""
    return sum(weight * value for weight, value in zip(weights, values))


def interpolate(positions: list[float], values: list[float], position: float) -> float:
    """Return the linear interpolation of `values` at rising `positions`, constant beyond both ends."""
    row = 1
    while row < len(positions) - 1 and positions[row] < position:
        row += 1
    share = min(max((position - positions[row - 1]) / (positions[row] - positions[row - 1]), 0.0), 1.0)
    return values[row - 1] + share * (values[row] - values[row - 1])


def smallest_root(rigid: float, dome: float, body: float) -> float | None:
    """Return the smallest positive root z = E^(-1/3) of rigid + dome z^2 + body z^3 = 0, or None if there is none."""
    # The cubic is monotonic up to its extremum. Without an extremum above 0, a bound of the root ends the interval.
    end = -2.0 * dome / (3.0 * body) if body else 0.0
    if not end > 0.0:
        ends = [abs(rigid / dome) ** 0.5] if dome else []
        ends += [abs(rigid / body) ** (1.0 / 3.0)] if body else []
        end = 2.0 * min(ends) if ends else 0.0
    if not rigid * (rigid + end * end * (dome + body * end)) < 0.0:
        return None
    start = 0.0
    for _ in range(60):  # bisection to round-off
        middle = 0.5 * (start + end)
        if rigid * (rigid + middle * middle * (dome + body * middle)) > 0.0:
            start = middle
        else:
            end = middle
    return end


class UnitTare:
    """The tare: the mean counts of a sensor that touches nothing."""

    def __init__(self, unit: Unit) -> None:
        """Begin without a sample."""
        self.unit = unit
        self.samples = 0  # number of samples
        self.sums = [0] * unit.size  # sum of the counts of each channel

    def add(self, counts: list[int]) -> int:
        """Add a sample of counts to the tare, unless a count is saturated; return the flag SATURATED or 0."""
        if self.unit.is_saturated(counts):
            return SATURATED
        self.sums = [a + b for a, b in zip(self.sums, counts)]
        self.samples += 1
        return 0

    def above(self, counts: list[int]) -> tuple[list[float], int]:
        """Return the counts minus the tare, and a flag or 0; the list is empty if there is a flag."""
        if not self.samples:
            return [], NOT_TARED
        if self.unit.is_saturated(counts):
            return [], SATURATED
        return [(count * self.samples - total) / self.samples for count, total in zip(counts, self.sums)], 0


class Rising:
    """Running sums of one press, from which its modulus follows by a regression with an instrumental variable.

    The instrumental variable, or instrument, of a sample is the total force one or two samples earlier. It rises with
    the press, but its noise is independent of the sample's noise. A sample counts if all forces of the samples just
    before it exceed `least` [N]. Selection by its own forces would prefer samples with positive noise.
    """

    def __init__(self, unit: Unit, least: "Sequence[float]") -> None:
        """Begin a press; `least` are the smallest forces of the tips [N] at which samples count."""
        self.unit = unit
        self.least = least
        self.deepest = 0.0  # largest total force [N]
        self.noise = 0.0  # standard deviation of ln E of the last reading
        self.begin_sums()
        self.save_sums()

    def begin_sums(self) -> None:
        """Reset the sums, because samples after a lift belong to another press."""
        size = self.unit.size
        self.forget_previous()
        self.touch = 0.0  # total force of the first sample with all tips on the fruit [N]
        self.count = 0
        self.mean_instrument = 0.0  # [N]
        self.spread = 0.0  # sum of squared deviations of the instrument [N^2]
        self.means = [(0.0, 0.0, 0.0)] * size  # means of F, F^(2/3) and F^(-1/3) of each tip
        self.rising = [(0.0, 0.0)] * size  # co-moments of the instrument with F and F^(2/3)
        self.steps = [0.0] * size  # mean change of each force from sample to sample [N]
        self.rising_steps = [0.0] * size  # co-moments of the instrument with these changes [N^2]

    def save_sums(self) -> None:
        """Save the sums at the deepest sample until here; later samples do not enter the reading."""
        self.to_deepest = (self.count, self.touch, self.spread, self.means, self.rising, self.rising_steps)

    def forget_previous(self) -> None:
        """Forget the previous samples, because the next one does not follow them."""
        # total forces of the previous samples [N], earliest first; 0 if there is none
        self.previous = [0.0] * self.unit.several

    def add(self, forces: "Sequence[float]", steps: list[float]) -> None:
        """Add the forces of a sample [N], each above 0, and their changes since the previous sample [N]."""
        if self.previous[0]:
            self.add_to_sums(forces, steps)
        if all(force > least for force, least in zip(forces, self.least)):
            self.previous = self.previous[1:]
            self.previous.append(sum(forces))
        else:
            self.begin_sums()

    def add_to_sums(self, forces: "Sequence[float]", steps: list[float]) -> None:
        """Update the means, and the co-moments with the instrument, by the forces of a sample and their changes [N].

        This is Welford's method: no sum of squares grows until digits cancel.
        """
        instrument = self.previous[0]
        total = sum(forces)
        if not self.count:
            self.touch = instrument
        self.count += 1
        deviation = instrument - self.mean_instrument  # from the mean without this sample
        self.mean_instrument += deviation / self.count
        self.spread += deviation * (instrument - self.mean_instrument)
        means = []
        rising = []
        for force, mean, moment in zip(forces, self.means, self.rising):
            power = force ** (2.0 / 3.0)
            new = (
                mean[0] + (force - mean[0]) / self.count,
                mean[1] + (power - mean[1]) / self.count,
                mean[2] + (force ** (-1.0 / 3.0) - mean[2]) / self.count,
            )
            means.append(new)
            rising.append((moment[0] + deviation * (force - new[0]), moment[1] + deviation * (power - new[1])))
        self.means = means
        self.rising = rising
        self.steps = [mean + (step - mean) / self.count for mean, step in zip(self.steps, steps)]
        self.rising_steps = [
            moment + deviation * (step - mean) for moment, step, mean in zip(self.rising_steps, steps, self.steps)
        ]
        if total >= self.deepest:
            self.deepest = total
            self.save_sums()

    def read(self, *, whole: bool) -> tuple[float | None, float, int]:
        """Return E [MPa], the offset [mm] and flags; E is None if the press determines no modulus.

        In each sample the contrast of springs, domes and fruit equals minus the contrast of the unknown gaps under the
        tips, the offset. It is constant in a press, so it drops out of co-moments with the instrument. They are the
        coefficients of rigid + dome z^2 + body z^3 = 0, whose root z gives E = z^(-3). With `whole`, a press that
        begins late or rises little is flagged.
        """
        unit = self.unit
        count, touch, spread, means, rising, rising_steps = self.to_deepest
        if count < unit.fewest:
            return None, 0.0, FEW_SAMPLES
        rise = (self.deepest - touch) / math.sqrt(12.0)  # standard deviation of a uniform distribution
        if whole and (touch / self.deepest > unit.latest_touch or not rise > unit.least_rise):
            return None, 0.0, NO_RISE
        # The coefficients of the cubic, and from the means of the samples those of the offset.
        moments = [moment[0] for moment in rising]
        forces = [mean[0] for mean in means]
        rigid = dot(unit.springs, moments)
        dome = dot(unit.domes, [moment[1] for moment in rising])
        mean_rigid = unit.gap + dot(unit.springs, forces)
        mean_dome = dot(unit.domes, [mean[1] for mean in means])
        z = offset = change = 0.0
        fruit = unit.fruit
        # The saddle that the offset shows moves the contacts, and so changes the modulus: a fixed-point iteration.
        for _ in range(unit.saddle_steps):
            fruit = unit.fruit_weights(offset)
            root = smallest_root(rigid, dome, dot(fruit, moments))
            if root is None:
                return None, 0.0, OUT_OF_RANGE
            z = root
            previous = offset
            offset = -(mean_rigid + z * z * (mean_dome + dot(fruit, forces) * z))
            change = abs(offset - previous)
        if unit.places and not change <= unit.settled * abs(mean_rigid):
            return None, 0.0, OUT_OF_RANGE
        # Errors of ln E: the standard deviation of the cubic due to noise or sampling times, divided by its slope.
        slope = z * z * (2.0 * dome + 3.0 * dot(fruit, moments) * z) / 3.0  # of the cubic against -ln E
        noise_variance = 0.0  # of the contrast in one sample
        time_variance = 0.0
        for tip in range(unit.size):
            dome_slope = unit.domes[tip] / 1.5 * z * z * means[tip][2]
            force_slope = unit.springs[tip] + fruit[tip] * z * z * z + dome_slope  # of the contrast against the force
            noise_variance += (force_slope * unit.noises[tip]) ** 2
            time_variance += (force_slope * rising_steps[tip]) ** 2
        if math.sqrt(noise_variance * spread) > unit.largest_noise * abs(slope):
            return None, 0.0, NO_RISE
        self.noise = math.sqrt(noise_variance * spread) / abs(slope)
        too_fast = unit.time_deviation * math.sqrt(time_variance) > unit.largest_by_time * abs(slope)
        return 1.0 / (z * z * z), offset, TOO_FAST if too_fast else 0


class ContrastLine:
    """The line of the contrast [mm] against the total force [N] that fits points by least squares."""

    def __init__(self, unit: Unit, points: list[tuple[float, float, float, float]]) -> None:
        """Fit the line to points of `Unit.contrast_point`; its slope is limited to the slopes that moduli allow."""
        self.unit = unit
        # Means of the points: total force, contrast, its variance, and the covariance of both.
        self.whole = sum(point[0] for point in points) / len(points)
        self.contrast = sum(point[1] for point in points) / len(points)
        self.variance = sum(point[2] for point in points) / len(points)
        self.covariance = sum(point[3] for point in points) / len(points)
        deviations = [(point[0] - self.whole, point[1] - self.contrast) for point in points]
        self.spread = sum(u * u for u, _ in deviations)
        self.moment = sum(u * y for u, y in deviations)
        slope = self.moment / self.spread if self.spread > 0.0 else 0.0
        self.slope = min(max(slope, unit.least_slope), unit.most_slope) if self.spread > 0.0 else 0.0
        self.squares = sum((y - self.slope * u) ** 2 for u, y in deviations)

    def distance_variance(self, slope: float) -> float:
        """Return the mean variance [mm^2] of the points' distances from a line with `slope` [mm/N]."""
        return self.unit.distance_variance(self.variance, self.covariance, slope)

    def residual(self, point: tuple[float, float, float, float], slope: float) -> float:
        """Return the distance of a further point from the line through the mean with `slope` [standard deviations]."""
        # The mean of the fitted points has an error too.
        own = self.unit.distance_variance(point[2], point[3], slope)
        variance = own + self.distance_variance(slope) / self.unit.others
        return (point[1] - self.contrast - slope * (point[0] - self.whole)) / math.sqrt(variance)


class TouchSample:
    """One sample of a touch: its forces [N], its point, its number, and whether its decision is pending."""

    def __init__(self, unit: Unit, forces: "Sequence[float]", number: int) -> None:
        """Take the forces [N]."""
        self.forces = forces
        self.point = unit.contrast_point(forces)
        self.number = number
        self.is_pending = True


class Touch:
    """A touch of all tips, whose samples are accepted or dropped as outliers of their press.

    The decision on a sample is pending until the samples after it have arrived.
    """

    def __init__(
        self, unit: Unit, take: "Callable[[Sequence[float], int], object]", drop: "Callable[[int], object]"
    ) -> None:
        """Begin without a touch.

        `take` is called with the forces [N] of each accepted sample and its number, from 1. `drop` is called with the
        number of each rejected sample.
        """
        self.unit = unit
        self.take = take
        self.drop = drop
        self.length = unit.several + unit.others  # number of samples that are compared
        self.number = 0  # number of the last sample in the signal
        self.begin()

    def begin(self) -> None:
        """Begin a touch."""
        self.window: list[TouchSample] = []  # the last `length` samples with all tips in contact
        self.out_of_contact = 0  # number of samples since then with a tip out of contact
        # sum over fits of the squared residuals, divided by their variance, and the number of fits
        self.squares = 0.0
        self.fits = 0
        # number of accepted samples, and their mean total force [N] and mean contrast [mm]
        self.released = 0
        self.whole = 0.0
        self.contrast = 0.0

    def add_out_of_contact(self, forces: "Sequence[float]") -> bool:
        """Add a sample with a tip out of contact; return whether this is a lift rather than a bad conversion.

        One bad conversion affects `unit.several` samples. So more samples out of contact are a lift, and so is a second
        one in which no tip has a firm force. `forces` are in N.
        """
        self.number += 1
        if self.window:
            self.out_of_contact += 1
        count = self.out_of_contact
        return not self.window or count > self.unit.several or (count > 1 and not any(self.unit.are_firm(forces)))

    def is_bad_conversion(self, forces: "Sequence[float]") -> bool:
        """Return whether samples out of contact lie between two firm touches: a bad conversion, not a lift.

        `forces` [N] are the forces of the second touch.
        """
        unit = self.unit
        if unit.several > 1:  # a bad conversion affects two samples, so the second touch need not be firm
            return any(all(unit.are_firm(sample.forces)) for sample in self.window[-unit.several :])
        return all(unit.are_firm(forces)) and all(unit.are_firm(self.window[-1].forces))

    def add(self, forces: "Sequence[float]") -> None:
        """Add the forces [N] of a sample in which all tips touch; drop the samples out of contact just before it."""
        for number in range(self.number - self.out_of_contact, self.number):
            self.drop(number + 1)
        self.number += 1
        self.out_of_contact = 0
        self.window = self.window[1 - self.length :]
        self.window.append(TouchSample(self.unit, forces, self.number))
        if len(self.window) == self.length:
            # The decision on the last samples is left to later windows, in which more samples follow them.
            self.drop_outliers(self.unit.beside + 1)
            self.release(len(self.window) - self.unit.several - (self.unit.beside - 1))

    def close(self) -> None:
        """Decide on all pending samples, because the touch or the press is over."""
        if len(self.window) == self.length:
            self.drop_outliers(len(self.window))
        self.release(len(self.window))
        self.begin()

    def release(self, count: int) -> None:
        """Accept those of the first `count` samples of the window whose decision is pending."""
        for sample in self.window[: max(count, 0)]:
            if sample.is_pending:
                sample.is_pending = False
                self.released += 1
                self.whole += (sample.point[0] - self.whole) / self.released
                self.contrast += (sample.point[1] - self.contrast) / self.released
                self.take(sample.forces, sample.number)

    def slope_limits(self, line: ContrastLine, scale: float) -> tuple[float, float]:
        """Return the smallest and the largest slope [mm/N] of the contrast against the total force.

        Three conditions limit it: the range of moduli, the points of `line`, and the chord to the accepted samples.
        `scale` [1] multiplies the stated variance of the forces.
        """
        unit = self.unit
        smallest = unit.least_slope
        largest = unit.most_slope
        variance = scale * max(line.distance_variance(smallest), line.distance_variance(largest))
        noise = unit.largest_residual * math.sqrt(variance)
        if line.spread > 0.0:  # the slope by least squares; if it contradicts the range of moduli, only it counts
            slope = line.moment / line.spread
            error = noise / math.sqrt(line.spread)
            smallest = max(smallest, slope - error)
            largest = min(largest, slope + error)
            if smallest > largest:
                smallest = slope - error
                largest = slope + error
        # The chord from the mean of the accepted samples to the mean of the line's points; it is left out if it
        # contradicts these points.
        if self.released and line.whole != self.whole:
            chord = (line.contrast - self.contrast) / (line.whole - self.whole)
            distance = abs(line.whole - self.whole)
            error = noise * math.sqrt(1.0 / unit.others + 1.0 / self.released) / distance + unit.slack
            if max(smallest, chord - error) <= min(largest, chord + error):
                return max(smallest, chord - error), min(largest, chord + error)
        return smallest, largest

    def drop_outliers(self, decided_count: int) -> None:
        """Drop the samples of the window that contradict the others, if they begin in its first `decided_count`.

        One bad conversion makes `unit.several` consecutive samples bad. Each such run is left out in turn, and a line
        of the contrast against the total force is fitted to the other samples. The run that leaves the smallest sum
        of squares is the suspect. It is dropped if one of its samples is an outlier for every slope that is possible.
        """
        unit = self.unit
        points = [sample.point for sample in self.window]
        run = unit.several
        lines = [ContrastLine(unit, points[:first] + points[first + run :]) for first in range(unit.others + 1)]
        squares = [line.squares for line in lines]
        first = squares.index(min(squares))
        line = lines[first]
        # The residuals until here may exceed the stated noise; then they set the scale of the variance.
        scale = max(1.0, self.squares / self.fits) if self.fits else 1.0
        smallest, largest = self.slope_limits(line, scale)
        residual = 0.0
        for point in points[first : first + run]:
            # If the residuals at both limits have opposite signs, a slope between them leaves none.
            at_smallest = line.residual(point, smallest)
            at_largest = line.residual(point, largest)
            least_residual = 0.0 if at_smallest * at_largest < 0.0 else min(abs(at_smallest), abs(at_largest))
            residual = max(residual, least_residual)
        self.squares += line.squares / line.distance_variance(line.slope)
        self.fits += 1
        if first < decided_count and residual > unit.largest_residual * math.sqrt(scale):
            outliers = [sample for sample in self.window[first : first + run] if sample.is_pending]
            for sample in outliers:
                self.drop(sample.number)
            self.window = [sample for sample in self.window if sample not in outliers]


class UnitPress:
    """The sums of one press, from each load at which flat tips may be seated; the memory does not grow."""

    def __init__(self, unit: Unit, last: list[float] | None = None) -> None:
        """Begin a press; `last` is the last sample before it, if there was one."""
        self.unit = unit
        self.last = last
        self.touched = False
        self.over = False  # whether the tips were lifted after a press that noise does not end
        self.firm_samples = 0  # number of consecutive samples with all tips in firm contact
        self.left_out = 0  # number of samples that were dropped because they contradict the press
        self.noise = 0.0  # standard deviation of ln E of the last reading
        self.touch = Touch(unit, self.accept, self.count_dropped)
        self.forces: Sequence[float] = [0.0] * unit.size  # forces of the last accepted sample [N]
        self.number = 0  # its number in the signal
        size = unit.size
        self.rising = [
            Rising(unit, unit.load_forces[size * load : size * (load + 1)]) for load in range(len(unit.loads))
        ]

    def add(self, channels: list[float]) -> int:
        """Add a sample of channel readings [N] unless it is bad; return its flags."""
        _, flags = self.unit.forces_of(channels)
        if flags & BAD_FORCE and self.unit.later:
            return self.forget_last(flags)
        simultaneous = self.interpolate_channels(channels)
        return self.add_simultaneous(simultaneous) if simultaneous else flags

    def add_counts(self, tare: UnitTare, counts: list[int]) -> int:
        """Add a sample of counts unless it is bad; return its flags."""
        above, flags = tare.above(counts)
        if flags:
            return self.forget_last(flags) if self.unit.later else flags
        _, flags = self.unit.forces_of(self.unit.channels_of(above))
        if flags & BAD_FORCE and self.unit.later:
            return self.forget_last(flags)
        simultaneous = self.interpolate_channels(above)
        return self.add_simultaneous(self.unit.channels_of(simultaneous)) if simultaneous else flags

    def interpolate_channels(self, sample: list[float]) -> list[float]:
        """Return a sample interpolated to the time of its first conversion; empty without a previous sample.

        The converter reads the channels in turn, so each later channel is interpolated back to the first one's time.
        """
        if not self.unit.later:
            return sample
        last = self.last
        self.last = sample
        if last is None:
            return []
        return [value - later * (value - previous) for value, later, previous in zip(sample, self.unit.later, last)]

    def forget_last(self, flags: int) -> int:
        """Forget the last sample, because a bad sample leaves nothing to interpolate from; return the flags."""
        self.last = None
        self.forget_previous()
        return flags

    def add_simultaneous(self, channels: list[float]) -> int:
        """Add a sample with simultaneous channel readings [N], unless it is bad; return its flags."""
        forces, flags = self.unit.forces_of(channels)
        self.touched = self.touched or not flags
        if flags & BAD_FORCE:
            self.touch.number += 1
            self.forget_previous()
        elif flags:
            if self.touch.add_out_of_contact(forces):
                self.end_touch()
        else:
            if self.touch.out_of_contact and not self.touch.is_bad_conversion(forces):
                self.end_touch()
            self.touch.add(forces)
        return flags

    def forget_previous(self) -> None:
        """Forget the previous samples, because the next one does not follow them."""
        self.touch.close()
        for rising in self.rising:
            rising.forget_previous()

    def end_touch(self) -> None:
        """Reset the sums, because samples after a lift belong to another press."""
        self.touch.close()
        for rising in self.rising:
            rising.begin_sums()
        self.over = self.over or self.firm_samples > self.unit.several
        self.firm_samples = 0

    def count_dropped(self, _: int) -> None:
        """Count a sample that is left out."""
        self.left_out += 1

    def accept(self, forces: "Sequence[float]", number: int) -> None:
        """Add the forces [N] of an accepted sample to the sums; `number` is its number in the signal."""
        if all(self.unit.are_firm(forces)):
            self.firm_samples += 1
        elif self.firm_samples <= self.unit.several:
            self.firm_samples = 0
        # A dropped sample leaves a gap in the numbers, so the change is divided by it.
        steps = [(force - previous) / (number - self.number) for force, previous in zip(forces, self.forces)]
        self.forces = forces
        self.number = number
        for rising in self.rising:
            rising.add(forces, steps)

    def read(self) -> tuple[float | None, float | None, int]:
        """Return E, E / (1 - nu^2) [MPa] and flags, from the part of the press in which flat tips are fully seated.

        The modulus and the offset determine the load that seats the tips, and the press is read again from that load
        on. This is repeated until the load no longer changes. If no modulus follows, the next lower load is used.
        """
        self.touch.close()
        if not self.touched:
            return None, None, LIFT_OFF
        unit = self.unit
        index = 0  # of the load
        E, offset, flags = self.rising[0].read(whole=True)
        for _ in range(unit.rounds):
            if E is None:
                break
            seating_load = E * (unit.per_offset * abs(offset) + unit.by_skin)
            seated = sum(load < seating_load for load in unit.loads[:-1])
            if seated == index:
                break
            index = seated
            E, offset, flags = self.rising[index].read(whole=not index)
            while E is None and index:
                index -= 1
                E, offset, flags = self.rising[index].read(whole=not index)
        if E is None:
            return None, None, flags
        self.noise = self.rising[index].noise
        E, reduced, outside = unit.check_range(unit.correct_modulus(E))
        return E, reduced, outside | flags


def own_deviation(logs: list[float], deviations: list[float], E: float, noise: float) -> float:
    """Return the standard deviation of ln E of one press, without the errors that all presses of a fruit share.

    `deviations` at `logs`, logarithms of moduli, are interpolated to E [MPa]. `noise` is the standard deviation of ln E
    due to noise, which is added in quadrature.
    """
    without_noise = interpolate(logs, deviations, math.log(E))
    return math.sqrt(without_noise * without_noise + noise * noise)


def hodges_lehmann(logs: list[float]) -> float:
    """Return the Hodges-Lehmann estimate: the median of the means of all pairs, each value also paired with itself.

    J. L. Hodges and E. L. Lehmann, Ann. Math. Stat. 34 (1963) 598. For two values it is their mean. For four and more,
    one outlier moves it by no more than the spread of the others.
    """
    means = sorted(0.5 * (logs[one] + logs[other]) for one in range(len(logs)) for other in range(one + 1))
    half = len(means) // 2
    return means[half] if len(means) % 2 else 0.5 * (means[half - 1] + means[half])


def standard_deviation(logs: list[float]) -> float:
    """Return the standard deviation of at least two values of ln E, one of each press [1]."""
    mean = sum(logs) / len(logs)
    return math.sqrt(sum((log - mean) ** 2 for log in logs) / (len(logs) - 1))


def counted_presses(deviations: list[float]) -> list[int]:
    """Return the indices of the presses that count; a deviation [1] much larger than the smallest does not."""
    limit = MUCH_LESS_CERTAIN * min(deviations)
    return [press for press, deviation in enumerate(deviations) if deviation <= limit]


def are_inconsistent(logs: list[float], deviations: list[float], limit: float) -> bool:
    """Return whether values of ln E differ by more than their standard deviations allow.

    This is a chi-square test: the sum of squares about the weighted mean, divided by the variances, exceeds `limit`.
    """
    weights = [1.0 / (deviation * deviation) for deviation in deviations]
    mean = dot(weights, logs) / sum(weights)
    return sum(weight * (log - mean) ** 2 for weight, log in zip(weights, logs)) > limit


class UnitFruit:
    """The last presses of one fruit, and their common reading."""

    def __init__(self, unit: Unit) -> None:
        """Begin a fruit."""
        self.unit = unit
        self.logs: list[float] = []
        self.deviations: list[float] = []

    def add(self, E: float | None, noise: float) -> None:
        """Add the reading of a press: E [MPa] and the noise of ln E; a press without a modulus is ignored."""
        if E is None:
            return
        self.logs = self.logs[1 - MOST_PRESSES :]
        self.logs.append(math.log(E))
        own = own_deviation(self.unit.own_logs, self.unit.own_deviations, E, noise)
        self.deviations = self.deviations[1 - MOST_PRESSES :]
        self.deviations.append(own)

    def read(self) -> tuple[float | None, float | None, float, int]:
        """Return E, E / (1 - nu^2) [MPa], the scatter of ln E between presses (0 for one press) and flags."""
        if not self.logs:
            return None, None, 0.0, LIFT_OFF
        counted = counted_presses(self.deviations)
        logs = [self.logs[press] for press in counted]
        E, reduced, flags = self.unit.check_range(math.exp(hodges_lehmann(logs)))
        if len(logs) == 1:
            return E, reduced, 0.0, flags
        deviations = [self.deviations[press] for press in counted]
        if are_inconsistent(logs, deviations, self.unit.chi_squares[len(logs) - 2]):
            flags |= PRESSES_DISAGREE
        return E, reduced, standard_deviation(logs), flags


def readings_of(
    unit: Unit, rows: "Iterable[list[int]]", tare_samples: int
) -> "Iterator[tuple[float | None, float | None, int]]":
    """Yield E, E / (1 - nu^2) [MPa] and flags of each press in rows of counts.

    The first `tare_samples` rows are the tare, taken while the sensor touches nothing. A press begins when all tips
    touch. It ends when a tip is lifted, at bad counts, whose flags follow, or with the signal if it has enough firm
    samples by then. A signal without a press yields the reading of its last touch.
    """
    tare = UnitTare(unit)
    press = UnitPress(unit)
    has_reading = False
    for counts in rows:
        if tare.samples < tare_samples:
            flags = tare.add(counts)
            if flags:
                yield None, None, flags
            continue
        flags = press.add_counts(tare, counts)
        is_bad = flags and flags != LIFT_OFF
        if press.over or (is_bad and press.touched):
            has_reading = True
            yield press.read()
            press = UnitPress(unit, press.last)
        if is_bad:
            yield None, None, flags
    reading = press.read()
    if press.firm_samples > unit.several or (press.touched and not has_reading):
        yield reading


def recorded_counts(path: str, size: int) -> "Iterator[list[int]]":
    """Yield the counts in each line of a file with comma-separated numbers: the last `size` cells of the line.

    Lines with another text among these cells, such as headers, are skipped.
    """
    with open(path, "rb") as lines:
        for line in lines:
            try:
                counts = [int(cell) for cell in line.strip().split(b",")[-size:]]
            except ValueError:
                continue
            if len(counts) == size:
                yield counts
