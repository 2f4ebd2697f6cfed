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

MOST_PRESSES = 8  # most presses of one fruit that are kept
MUCH_LESS_CERTAIN = 2.0  # a press counts only if its deviation is at most this multiple of the least deviation


class Unit:
    """The constants of a unit, as `pipeline read --header` and `--micropython` write them."""

    gains: list[float]  # force over channel [1]
    newtons: list[float]  # channels over counts [N], tip by tip; empty if counts are not calibrated
    saturation: int  # largest count that the converter can give
    least_forces: "Sequence[float]"  # least force of a tip that touches the fruit [N]
    lowest_forces: "Sequence[float]"  # a force below this is bad [N]
    largest_forces: "Sequence[float]"
    # delay of a channel after the first one, as a fraction of a sample; empty if all are converted at once
    later: list[float]
    several: int  # number of samples that one bad conversion affects
    time_deviation: float  # standard deviation of the times of the channels, as a fraction of a sample
    largest_by_time: float
    least_E: float
    largest_E: float
    reduced: float  # E / (1 - nu^2) over E [1]
    level_logs: list[float]  # logarithms of the moduli that a level sensor reads
    level_shifts: list[float]  # logarithms of the true moduli, less `level_logs`
    springs: list[float]  # weights of the contrast for F [mm/N]
    fruit: list[float]  # weights of the contrast for F / E [mm/N MPa]
    domes: list[float]  # weights of the contrast for (F / E)^(2/3) [mm/N^(2/3) MPa^(2/3)]
    gap: float
    noises: list[float]
    fewest: int
    latest_touch: float  # latest touch of the last tip, as a fraction of the whole force [1]
    least_rise: float
    largest_noise: float  # largest standard deviation of ln E by noise [1]
    # weights to `saddle_steps` describe domes that roll on a saddle; `places` is empty for other tips
    weights: list[float]
    places: list[float]
    dome_radius: float
    rolled: float
    felt: float
    body: float
    still: list[float]
    saddle_steps: int
    settled: float
    # contrast that finds spikes: its weights for F [mm/N], and in `line_domes` for F^(2/3) [mm/N^(2/3)]
    linear: list[float]
    line_domes: list[float]
    errors: list[float]
    least_slope: float  # least slope of this contrast over the whole force [mm/N]
    most_slope: float
    of_whole: float  # variance of the whole force [N^2]
    slack: float
    others: int
    beside: int
    firm: float
    largest_residual: float  # largest residual of a sample [standard deviations]
    loads: list[float]
    load_forces: "Sequence[float]"
    per_offset: float
    by_skin: float
    rounds: int
    own_logs: list[float]  # logarithms of moduli
    # standard deviations of ln E at `own_logs`, by what differs between presses of a fruit, without noise
    own_deviations: list[float]
    chi_squares: list[float]  # limits of chi square for two presses, for three, and so on; few fruits exceed them

    def __init__(self, constants: dict[str, object]) -> None:
        """Set each constant as an attribute of its name."""
        for name in constants:
            setattr(self, name, constants[name])
        self.size = len(self.gains)

    def forces_of(self, channels: list[float]) -> tuple[list[float], int]:
        """Return the forces [N] of the tips from their channels [N], and the flags of what is wrong with them."""
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
        """Return the channels [N] from counts above tare."""
        rows = [self.newtons[tip * self.size : (tip + 1) * self.size] for tip in range(self.size)]
        return [dot(row, above) for row in rows]

    def saturated(self, counts: list[int]) -> bool:
        """Return whether counts are at the end of the converter's range."""
        return max(abs(count) for count in counts) >= self.saturation

    def judged(self, E: float) -> tuple[float, float, int]:
        """Return E [MPa], E / (1 - nu^2) [MPa] and a flag if E is outside the range of the design."""
        outside = not self.least_E <= E <= self.largest_E
        return E, self.reduced * E, OUT_OF_RANGE if outside else 0

    def corrected(self, read: float) -> float:
        """Return the true modulus [MPa] of a fruit that a level sensor reads as `read` [MPa].

        The correction covers the shape and the skin of the fruit, and the creep of the springs.
        """
        logs = self.level_logs
        shifts = self.level_shifts
        if not logs:
            return read
        if len(logs) == 1:
            return read * math.exp(shifts[0])
        return read * math.exp(between(logs, shifts, math.log(read)))

    def fruit_on(self, offset: float) -> list[float]:
        """Return the weights of the contrast for F / E [mm/N MPa] on a saddle that makes an offset [mm].

        Domes roll on it, so that their contacts are nearer to each other than their axes.
        """
        if not self.places:
            return self.fruit
        tall = 2.0 * self.dome_radius * offset / self.felt * self.rolled
        across = tall * self.rolled / (1.0 + math.sqrt(1.0 + tall * tall))
        area = self.rolled * self.rolled - across * across
        fruit = []
        for tip in range(self.size):
            total = self.still[tip]
            for other in range(self.size):
                if other != tip:
                    x = self.places[2 * other] - self.places[2 * tip]
                    y = self.places[2 * other + 1] - self.places[2 * tip + 1]
                    along = self.rolled * x - across * y
                    beside = self.rolled * y - across * x
                    distance = math.sqrt(along * along + beside * beside)
                    total += self.weights[other] * self.body * area / distance
            fruit.append(total)
        return fruit

    def point_of(self, forces: "Sequence[float]") -> tuple[float, float, float, float]:
        """Return the whole force [N], the contrast [mm], the variance of the contrast and the covariance of both."""
        contrast = variance = covariance = 0.0
        for tip in range(self.size):
            cube_root = forces[tip] ** (1.0 / 3.0)
            slope = self.linear[tip] + self.line_domes[tip] / 1.5 / cube_root
            error = self.errors[tip]
            contrast += self.linear[tip] * forces[tip] + self.line_domes[tip] * cube_root * cube_root
            variance += (slope * error) ** 2
            covariance += slope * error * error
        return sum(forces), contrast, variance, covariance

    def variance_off(self, variance: float, covariance: float, slope: float) -> float:
        """Return the variance of the distance between a point and a line of a slope [mm^2]."""
        return variance - slope * (2.0 * covariance - slope * self.of_whole)

    def are_firm(self, forces: "Sequence[float]") -> list[bool]:
        """Return for each tip whether its force [N] is so large that noise does not end its touch."""
        return [force > self.firm * least for force, least in zip(forces, self.least_forces)]


def dot(weights: list[float], values: list[float]) -> float:
    """Return the dot product."""
    return sum(weight * value for weight, value in zip(weights, values))


def between(places: list[float], values: list[float], at: float) -> float:
    """Return the linear interpolation of values at rising places, constant beyond both ends."""
    row = 1
    while row < len(places) - 1 and places[row] < at:
        row += 1
    share = min(max((at - places[row - 1]) / (places[row] - places[row - 1]), 0.0), 1.0)
    return values[row - 1] + share * (values[row] - values[row - 1])


def root(rigid: float, dome: float, body: float) -> float | None:
    """Return the smallest root z = E^(-1/3) of rigid + dome z^2 + body z^3 = 0, or None if there is none."""
    end = -2.0 * dome / (3.0 * body) if body else 0.0
    if not end > 0.0:
        ends = [abs(rigid / dome) ** 0.5] if dome else []
        ends += [abs(rigid / body) ** (1.0 / 3.0)] if body else []
        end = 2.0 * min(ends) if ends else 0.0
    if not rigid * (rigid + end * end * (dome + body * end)) < 0.0:
        return None
    start = 0.0
    for _ in range(60):
        middle = 0.5 * (start + end)
        if rigid * (rigid + middle * middle * (dome + body * middle)) > 0.0:
            start = middle
        else:
            end = middle
    return end


class UnitTare:
    """The tare: the mean counts of the free sensor."""

    def __init__(self, unit: Unit) -> None:
        """Begin without a sample."""
        self.unit = unit
        self.samples = 0
        self.sums = [0] * unit.size

    def add(self, counts: list[int]) -> int:
        """Add counts of the free sensor to the tare, unless a count is saturated; return the flag."""
        if self.unit.saturated(counts):
            return SATURATED
        self.sums = [a + b for a, b in zip(self.sums, counts)]
        self.samples += 1
        return 0

    def above(self, counts: list[int]) -> tuple[list[float], int]:
        """Return counts above tare and a flag; the list is empty if the counts are flagged."""
        if not self.samples:
            return [], NOT_TARED
        if self.unit.saturated(counts):
            return [], SATURATED
        return [(count * self.samples - total) / self.samples for count, total in zip(counts, self.sums)], 0


class Rising:
    """Running sums of one press over samples that follow a sample with all forces above their least values [N]."""

    def __init__(self, unit: Unit, least: "Sequence[float]") -> None:
        """Begin a press."""
        self.unit = unit
        self.least = least
        self.deepest = 0.0  # largest whole force [N]
        self.noise = 0.0  # standard deviation of ln E of the last reading
        self.begin_sums()
        self.keep()

    def begin_sums(self) -> None:
        """Reset the sums, because samples after a lift belong to another press."""
        size = self.unit.size
        self.break_off()
        self.touch = 0.0  # whole force of the first sample with all tips on the fruit [N]
        self.count = 0
        self.instrument = 0.0  # mean of the whole force of the sample before [N], the instrument of the regression
        self.spread = 0.0  # sum of squared deviations of the instrument [N^2]
        self.means = [(0.0, 0.0, 0.0)] * size  # means of F, F^(2/3) and F^(-1/3) of each tip
        self.rising = [(0.0, 0.0)] * size  # co-moments of the instrument with F and F^(2/3)
        self.steps = [0.0] * size  # mean change of each force from sample to sample [N]
        self.rising_steps = [0.0] * size  # co-moments of the instrument with these changes [N^2]

    def keep(self) -> None:
        """Save the sums at the deepest sample; later samples do not enter the reading."""
        self.to_deepest = (self.count, self.touch, self.spread, self.means, self.rising, self.rising_steps)

    def break_off(self) -> None:
        """Forget the samples before, because the next one does not follow them."""
        # whole forces of the samples before [N], earliest first; 0 if there is none
        self.before = [0.0] * self.unit.several

    def add(self, forces: "Sequence[float]", steps: list[float]) -> None:
        """Add forces [N], each above 0, and their changes since the sample before [N]."""
        if self.before[0]:
            self.count_in(forces, steps)
        if all(force > least for force, least in zip(forces, self.least)):
            self.before = self.before[1:]
            self.before.append(sum(forces))
        else:
            self.begin_sums()

    def count_in(self, forces: "Sequence[float]", steps: list[float]) -> None:
        """Add forces [N] to the sums."""
        before = self.before[0]
        whole = sum(forces)
        if not self.count:
            self.touch = before
        self.count += 1
        step = before - self.instrument
        self.instrument += step / self.count
        self.spread += step * (before - self.instrument)
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
            rising.append((moment[0] + step * (force - new[0]), moment[1] + step * (power - new[1])))
        self.means = means
        self.rising = rising
        self.steps = [a + (b - a) / self.count for a, b in zip(self.steps, steps)]
        self.rising_steps = [a + step * (b - c) for a, b, c in zip(self.rising_steps, steps, self.steps)]
        if whole >= self.deepest:
            self.deepest = whole
            self.keep()

    def read(self, *, whole: bool) -> tuple[float | None, float, int]:
        """Return E [MPa], the offset of the contrast [mm] and flags, from the rise of the contrast.

        E = z^(-3) solves rigid + dome z^2 + body z^3 = 0. The coefficients are co-moments with the whole force of the
        sample before. Gaps under the tips are constant in a press, so they drop out. With `whole`, a press that begins
        late or rises little is flagged.
        """
        unit = self.unit
        count, touch, spread, means, rising, rising_steps = self.to_deepest
        if count < unit.fewest:
            return None, 0.0, FEW_SAMPLES
        rise = (self.deepest - touch) / math.sqrt(12.0)
        if whole and (touch / self.deepest > unit.latest_touch or not rise > unit.least_rise):
            return None, 0.0, NO_RISE
        moments = [moment[0] for moment in rising]
        forces = [mean[0] for mean in means]
        rigid = dot(unit.springs, moments)
        dome = dot(unit.domes, [moment[1] for moment in rising])
        mean_rigid = unit.gap + dot(unit.springs, forces)
        mean_dome = dot(unit.domes, [mean[1] for mean in means])
        z = offset = moved = 0.0
        fruit = unit.fruit
        for _ in range(unit.saddle_steps):
            fruit = unit.fruit_on(offset)
            found = root(rigid, dome, dot(fruit, moments))
            if found is None:
                return None, 0.0, OUT_OF_RANGE
            z = found
            before = offset
            offset = -(mean_rigid + z * z * (mean_dome + dot(fruit, forces) * z))
            moved = abs(offset - before)
        if unit.places and not moved <= unit.settled * abs(mean_rigid):
            return None, 0.0, OUT_OF_RANGE
        falling = z * z * (2.0 * dome + 3.0 * dot(fruit, moments) * z) / 3.0
        variance = 0.0
        by_times = 0.0
        for tip in range(unit.size):
            of_dome = unit.domes[tip] / 1.5 * z * z * means[tip][2]
            by_force = unit.springs[tip] + fruit[tip] * z * z * z + of_dome
            variance += (by_force * unit.noises[tip]) ** 2
            by_times += (by_force * rising_steps[tip]) ** 2
        if math.sqrt(variance * spread) > unit.largest_noise * abs(falling):
            return None, 0.0, NO_RISE
        self.noise = math.sqrt(variance * spread) / abs(falling)
        too_fast = unit.time_deviation * math.sqrt(by_times) > unit.largest_by_time * abs(falling)
        return 1.0 / (z * z * z), offset, TOO_FAST if too_fast else 0


class ContrastLine:
    """The line of the contrast [mm] over the whole force [N] that fits points by least squares."""

    def __init__(self, unit: Unit, points: list[tuple[float, float, float, float]]) -> None:
        """Fit points: whole force, contrast, variance of the contrast, and its covariance with the force."""
        self.unit = unit
        self.whole = sum(point[0] for point in points) / len(points)
        self.contrast = sum(point[1] for point in points) / len(points)
        self.variance = sum(point[2] for point in points) / len(points)
        self.covariance = sum(point[3] for point in points) / len(points)
        apart = [(point[0] - self.whole, point[1] - self.contrast) for point in points]
        self.spread = sum(u * u for u, _ in apart)
        self.moment = sum(u * y for u, y in apart)
        slope = self.moment / self.spread if self.spread > 0.0 else 0.0
        self.slope = min(max(slope, unit.least_slope), unit.most_slope) if self.spread > 0.0 else 0.0
        self.squares = sum((y - self.slope * u) ** 2 for u, y in apart)

    def variance_off(self, slope: float) -> float:
        """Return the mean variance of the distance between a point and a line of a slope [mm^2]."""
        return self.unit.variance_off(self.variance, self.covariance, slope)

    def residual_of(self, point: tuple[float, float, float, float], slope: float) -> float:
        """Return the distance of a sample from a line of a slope [standard deviations]."""
        variance = self.unit.variance_off(point[2], point[3], slope) + self.variance_off(slope) / self.unit.others
        return (point[1] - self.contrast - slope * (point[0] - self.whole)) / math.sqrt(variance)


class TouchSample:
    """One sample of a touch: its forces [N], its point, its number, and whether its decision is pending."""

    def __init__(self, unit: Unit, forces: "Sequence[float]", number: int) -> None:
        """Take the forces [N]."""
        self.forces = forces
        self.point = unit.point_of(forces)
        self.number = number
        self.waits = True


class Touch:
    """The last samples of a touch, from which samples that contradict their press are dropped."""

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
        self.length = unit.several + unit.others
        self.number = 0
        self.begin()

    def begin(self) -> None:
        """Begin a touch."""
        self.row: list[TouchSample] = []
        self.off = 0
        self.squares = 0.0
        self.rows = 0
        self.released = 0
        self.whole = 0.0
        self.contrast = 0.0

    def lifts(self, forces: "Sequence[float]") -> bool:
        """Add forces [N] of a sample in which a tip is out of contact; return whether this is a lift."""
        self.number += 1
        if self.row:
            self.off += 1
        return not self.row or self.off > self.unit.several or (self.off > 1 and not any(self.unit.are_firm(forces)))

    def lost(self, forces: "Sequence[float]") -> bool:
        """Return whether samples out of contact lie between two firm touches: a bad conversion, not a lift.

        `forces` [N] are those of the second touch.
        """
        unit = self.unit
        if unit.several > 1:  # a bad conversion affects two samples, so the second touch need not be firm
            return any(all(unit.are_firm(sample.forces)) for sample in self.row[-unit.several :])
        return all(unit.are_firm(forces)) and all(unit.are_firm(self.row[-1].forces))

    def add(self, forces: "Sequence[float]") -> None:
        """Add forces [N] of a sample in which all tips touch."""
        for number in range(self.number - self.off, self.number):
            self.drop(number + 1)
        self.number += 1
        self.off = 0
        self.row = self.row[1 - self.length :]
        self.row.append(TouchSample(self.unit, forces, self.number))
        if len(self.row) == self.length:
            self.judge(self.unit.beside + 1)
            self.release(len(self.row) - self.unit.several - (self.unit.beside - 1))

    def close(self) -> None:
        """Decide on all pending samples, because the touch or the press is over."""
        if len(self.row) == self.length:
            self.judge(len(self.row))
        self.release(len(self.row))
        self.begin()

    def release(self, count: int) -> None:
        """Pass on the first samples of the row whose decision is pending."""
        for sample in self.row[: max(count, 0)]:
            if sample.waits:
                sample.waits = False
                self.released += 1
                self.whole += (sample.point[0] - self.whole) / self.released
                self.contrast += (sample.point[1] - self.contrast) / self.released
                self.take(sample.forces, sample.number)

    def slopes(self, line: ContrastLine, scale: float) -> tuple[float, float]:
        """Return the least and the largest slope that the row, the press before it and the range of moduli allow."""
        unit = self.unit
        least = unit.least_slope
        most = unit.most_slope
        variance = scale * max(line.variance_off(least), line.variance_off(most))
        noise = unit.largest_residual * math.sqrt(variance)
        if line.spread > 0.0:  # the slope of the row by least squares; if it contradicts the range of moduli, it holds
            slope = line.moment / line.spread
            error = noise / math.sqrt(line.spread)
            least = max(least, slope - error)
            most = min(most, slope + error)
            if least > most:
                least = slope - error
                most = slope + error
        # The chord from the mean of the press before to the mean of the row; if it contradicts the row, it is left out.
        if self.released and line.whole != self.whole:
            chord = (line.contrast - self.contrast) / (line.whole - self.whole)
            distance = abs(line.whole - self.whole)
            error = noise * math.sqrt(1.0 / unit.others + 1.0 / self.released) / distance + unit.slack
            if max(least, chord - error) <= min(most, chord + error):
                return max(least, chord - error), min(most, chord + error)
        return least, most

    def judge(self, decided: int) -> None:
        """Drop the samples that lie away from every line that the other samples allow, up to the number `decided`."""
        unit = self.unit
        points = [sample.point for sample in self.row]
        lines = [
            ContrastLine(unit, points[:first] + points[first + unit.several :]) for first in range(unit.others + 1)
        ]
        squares = [line.squares for line in lines]
        first = squares.index(min(squares))
        line = lines[first]
        scale = max(1.0, self.squares / self.rows) if self.rows else 1.0
        least, most = self.slopes(line, scale)
        residual = 0.0
        for point in points[first : first + unit.several]:
            a = line.residual_of(point, least)
            b = line.residual_of(point, most)
            residual = max(residual, 0.0 if a * b < 0.0 else min(abs(a), abs(b)))
        self.squares += line.squares / line.variance_off(line.slope)
        self.rows += 1
        if first < decided and residual > unit.largest_residual * math.sqrt(scale):
            spike = [sample for sample in self.row[first : first + unit.several] if sample.waits]
            for sample in spike:
                self.drop(sample.number)
            self.row = [sample for sample in self.row if sample not in spike]


class UnitPress:
    """The sums of one press from each load on, in a memory that does not grow."""

    def __init__(self, unit: Unit, last: list[float] | None = None) -> None:
        """Begin a press; `last` is the last sample before it, if there was one."""
        self.unit = unit
        self.last = last
        self.touched = False
        self.over = False  # whether the tips were lifted after a press that noise does not end
        self.firm = 0  # number of samples in a row in which all tips touched firmly
        self.left_out = 0  # number of samples that were dropped because they contradict the press
        self.noise = 0.0  # standard deviation of ln E of the last reading
        self.row = Touch(unit, self.take, self.drop)
        self.forces: Sequence[float] = [0.0] * unit.size  # forces of the sample before [N]
        self.number = 0
        size = unit.size
        self.rising = [
            Rising(unit, unit.load_forces[size * load : size * (load + 1)]) for load in range(len(unit.loads))
        ]

    def add(self, channels: list[float]) -> int:
        """Add a sample of channels [N] unless it is bad; return its flags."""
        _, flags = self.unit.forces_of(channels)
        if flags & BAD_FORCE and self.unit.later:
            return self.lost(flags)
        at_one_time = self.at_one_time(channels)
        return self.add_at_one_time(at_one_time) if at_one_time else flags

    def add_counts(self, tare: UnitTare, counts: list[int]) -> int:
        """Add a sample of counts unless it is bad; return its flags."""
        above, flags = tare.above(counts)
        if flags:
            return self.lost(flags) if self.unit.later else flags
        _, flags = self.unit.forces_of(self.unit.channels_of(above))
        if flags & BAD_FORCE and self.unit.later:
            return self.lost(flags)
        at_one_time = self.at_one_time(above)
        return self.add_at_one_time(self.unit.channels_of(at_one_time)) if at_one_time else flags

    def at_one_time(self, sample: list[float]) -> list[float]:
        """Return a sample interpolated to the time of its first conversion; empty if no sample is before it."""
        if not self.unit.later:
            return sample
        last = self.last
        self.last = sample
        if last is None:
            return []
        return [value - later * (value - before) for value, later, before in zip(sample, self.unit.later, last)]

    def lost(self, flags: int) -> int:
        """Forget the last sample, because a bad sample leaves nothing to interpolate from; return the flags."""
        self.last = None
        self.break_off()
        return flags

    def add_at_one_time(self, channels: list[float]) -> int:
        """Add a sample whose channels [N] have one time, unless it is bad; return its flags."""
        forces, flags = self.unit.forces_of(channels)
        self.touched = self.touched or not flags
        if flags & BAD_FORCE:
            self.row.number += 1
            self.break_off()
        elif flags:
            if self.row.lifts(forces):
                self.lift()
        else:
            if self.row.off and not self.row.lost(forces):
                self.lift()
            self.row.add(forces)
        return flags

    def break_off(self) -> None:
        """Forget the samples before, because the next one does not follow them."""
        self.row.close()
        for rising in self.rising:
            rising.break_off()

    def lift(self) -> None:
        """Reset the sums, because samples after a lift belong to another press."""
        self.row.close()
        for rising in self.rising:
            rising.begin_sums()
        self.over = self.over or self.firm > self.unit.several
        self.firm = 0

    def drop(self, _: int) -> None:
        """Count a sample that is left out."""
        self.left_out += 1

    def take(self, forces: "Sequence[float]", number: int) -> None:
        """Add the forces [N] of an accepted sample to the sums; `number` is its number in the signal."""
        if all(self.unit.are_firm(forces)):
            self.firm += 1
        elif self.firm <= self.unit.several:
            self.firm = 0
        steps = [(force - before) / (number - self.number) for force, before in zip(forces, self.forces)]
        self.forces = forces
        self.number = number
        for rising in self.rising:
            rising.add(forces, steps)

    def read(self) -> tuple[float | None, float | None, int]:
        """Return E, E / (1 - nu^2) [MPa] and flags, from the part of the press in which flat tips are fully seated."""
        self.row.close()
        if not self.touched:
            return None, None, LIFT_OFF
        unit = self.unit
        load = 0
        E, offset, flags = self.rising[0].read(whole=True)
        for _ in range(unit.rounds):
            if E is None:
                break
            needed = E * (unit.per_offset * abs(offset) + unit.by_skin)
            seated = sum(each < needed for each in unit.loads[:-1])
            if seated == load:
                break
            load = seated
            E, offset, flags = self.rising[load].read(whole=not load)
            while E is None and load:
                load -= 1
                E, offset, flags = self.rising[load].read(whole=not load)
        if E is None:
            return None, None, flags
        self.noise = self.rising[load].noise
        E, reduced, outside = unit.judged(unit.corrected(E))
        return E, reduced, outside | flags


def own_deviation(logs: list[float], deviations: list[float], E: float, noise: float) -> float:
    """Return the standard deviation of ln E of one press, without the errors that all presses of a fruit share.

    `deviations` are interpolated over `logs`, the logarithms of moduli. `noise` is added in quadrature.
    """
    of_fruit = between(logs, deviations, math.log(E))
    return math.sqrt(of_fruit * of_fruit + noise * noise)


def middle_of(logs: list[float]) -> float:
    """Return the Hodges-Lehmann estimate: the median of the means of all pairs, each value also paired with itself.

    J. L. Hodges and E. L. Lehmann, Ann. Math. Stat. 34 (1963) 598. For two values it is their mean. For four and more,
    one outlier moves it by no more than the spread of the others.
    """
    means = sorted(0.5 * (logs[one] + logs[other]) for one in range(len(logs)) for other in range(one + 1))
    half = len(means) // 2
    return means[half] if len(means) % 2 else 0.5 * (means[half - 1] + means[half])


def scatter_of(logs: list[float]) -> float:
    """Return the standard deviation of at least two logarithms of moduli between presses [1]."""
    mean = sum(logs) / len(logs)
    return math.sqrt(sum((log - mean) ** 2 for log in logs) / (len(logs) - 1))


def that_count(deviations: list[float]) -> list[int]:
    """Return the indices of the presses that count: deviations [1] much larger than the least do not."""
    most = MUCH_LESS_CERTAIN * min(deviations)
    return [press for press, deviation in enumerate(deviations) if deviation <= most]


def disagree(logs: list[float], deviations: list[float], limit: float) -> bool:
    """Return whether the weighted sum of squares of logarithms of moduli exceeds a limit of chi square."""
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
        count = that_count(self.deviations)
        logs = [self.logs[press] for press in count]
        E, reduced, flags = self.unit.judged(math.exp(middle_of(logs)))
        if len(logs) == 1:
            return E, reduced, 0.0, flags
        if disagree(logs, [self.deviations[press] for press in count], self.unit.chi_squares[len(logs) - 2]):
            flags |= PRESSES_DISAGREE
        return E, reduced, scatter_of(logs), flags


def readings_of(
    unit: Unit, rows: "Iterable[list[int]]", tare_samples: int
) -> "Iterator[tuple[float | None, float | None, int]]":
    """Yield E, E / (1 - nu^2) [MPa] and flags of each press in rows of counts, which begin with a free sensor.

    A press ends when a tip is lifted, or at bad counts, whose flags follow. A signal without a press yields the reading
    of its last touch.
    """
    tare = UnitTare(unit)
    press = UnitPress(unit)
    told = False
    for counts in rows:
        if tare.samples < tare_samples:
            flags = tare.add(counts)
            if flags:
                yield None, None, flags
            continue
        flags = press.add_counts(tare, counts)
        wrong = flags and flags != LIFT_OFF
        if press.over or (wrong and press.touched):
            told = True
            yield press.read()
            press = UnitPress(unit, press.last)
        if wrong:
            yield None, None, flags
    reading = press.read()
    if press.firm > unit.several or (press.touched and not told):
        yield reading


def recorded_counts(path: str, size: int) -> "Iterator[list[int]]":
    """Yield rows of counts of a file with comma-separated numbers; the last `size` cells of a line are the counts.

    Lines with a cell that is no number, such as headers, are skipped.
    """
    with open(path, "rb") as lines:
        for line in lines:
            try:
                counts = [int(cell) for cell in line.strip().split(b",")[-size:]]
            except ValueError:
                continue
            if len(counts) == size:
                yield counts
