"""Read the modulus from presses, in the subset of Python that MicroPython supports.

`pipeline read --micropython` copies this file, and the C header implements the same method. So the module imports only
math, and the memory that a press needs does not grow. Forces are in N, lengths in mm and moduli in MPa. A list holds
one value per tip. `pipeline read` uses this module to split a signal into touches and to find outliers. The command
raises an error for samples that this module only flags as bad, saturated or untared.
"""

import math

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

BAD_FORCE = 1  # a force that is not a number, below zero by more than the noise, or far above full scale
LIFT_OFF = 2  # a tip does not touch the fruit
OUT_OF_RANGE = 4  # no modulus, or a modulus outside the range of the design
SATURATED = 8  # a count at the end of the converter's range
NOT_TARED = 16  # no tare was taken before the press
FEW_SAMPLES = 32  # too few samples with all tips on the fruit
NO_RISE = 64  # the force hardly rises after the last tip has touched
TOO_FAST = 128  # a press so fast that the timing error of the channels changes E by 2 % or more
PRESSES_DISAGREE = 256  # presses of one fruit that differ by more than their own errors allow

BISECTIONS = 60  # halves an interval until only round-off remains
MOST_PRESSES = 8  # maximum number of presses of one fruit that are stored
# A press is used only if its standard deviation is at most this multiple of the smallest standard deviation.
MUCH_LESS_CERTAIN = 2.0


class Unit:
    """The constants of a printed sensor, as `pipeline read --c-header` and `--micropython` write them."""

    # Channels and forces, one value per tip unless stated otherwise.
    gains: list[float]  # force divided by channel reading [1]
    newtons: list[float]  # matrix from counts to channel readings [N per count], row by row; empty if not calibrated
    saturation: int  # count at the end of the converter's range
    least_forces: "Sequence[float]"  # smallest force of a tip in contact [N]
    lowest_forces: "Sequence[float]"  # lower limit of a plausible force [N]
    largest_forces: "Sequence[float]"  # upper limit of a plausible force [N]
    later: list[float]  # delay after the first conversion, in sampling periods; empty if conversions are simultaneous
    spike_length: int  # number of consecutive samples that one bad conversion affects
    time_deviation: float  # standard deviation of the channels' sampling times, in sampling periods
    largest_by_time: float  # largest allowed relative error of E due to the sampling times [1]
    # Moduli.
    least_E: float  # lower end of the design's range [MPa]
    largest_E: float  # upper end of the design's range [MPa]
    reduced: float  # 1 / (1 - nu^2) [1]
    level_logs: list[float]  # logarithms of the moduli that a level sensor reads
    level_shifts: list[float]  # logarithms of the true moduli, minus `level_logs`
    # The contrast: the mean of a quantity over the tips on high springs, minus its mean over the tips on low springs.
    springs: list[float]  # weights of the forces F in the contrast [mm/N]
    fruit: list[float]  # weights of F / E in the contrast [1/mm]
    gap: float  # contrast of the known gaps under the tips [mm]
    domes: list[float]  # weights of (F / E)^(2/3) in the contrast [mm (MPa/N)^(2/3)]
    noises: list[float]  # standard deviation of each force due to noise [N]
    fewest: int  # minimum number of samples for a reading
    latest_touch: float  # largest total force when the last tip touches, as a fraction of the largest total force
    least_rise: float  # smallest standard deviation of the total force during a press [N]
    largest_noise: float  # largest allowed standard deviation of ln E due to noise [1]
    # Domes roll on a saddle-shaped skin, so that their contacts move. `places` is empty for other tips.
    weights: list[float]  # weight of each tip in the contrast [1]
    places: list[float]  # x and y of each dome's axis [mm]
    dome_radius: float  # [mm]
    rolled: float  # distance of two axes divided by the distance of their contacts, on a spherical fruit [1]
    contrast_of_xy: float  # contrast of x y at the axes [mm^2]; the height of a saddle is k_xy x y
    fixed_fruit_part: list[float]  # part of `fruit` that stays as contacts move: fruit minus half-space [1/mm]
    body: float  # (1 - nu^2) / pi: deflection of a half-space at distance r from a force F, times E r / F [1]
    saddle_steps: int  # maximum number of iterations for the saddle
    settled: float  # largest change of the offset in the last iteration, divided by the springs' part of the contrast
    # The contrast at a fixed modulus, by which outliers are found.
    linear: list[float]  # weights of the forces F in this contrast [mm/N]
    line_domes: list[float]  # weights of F^(2/3) in this contrast [mm/N^(2/3)]
    errors: list[float]  # standard deviation of each force of a sensor that touches nothing [N]
    least_slope: float  # smallest slope of this contrast against the total force [mm/N]
    most_slope: float  # largest slope of this contrast against the total force [mm/N]
    total_force_variance: float  # variance of the total force [N^2]
    fitted_samples: int  # number of samples to which a line is fitted
    slope_tolerance: float  # largest difference between the slope of a chord and the slope of a press [mm/N]
    neighbours: int  # number of samples on either side of the sample under test
    largest_residual: float  # largest allowed residual of a sample [standard deviations]
    firm: float  # multiple of `least_forces` [1]; noise does not end the contact of a tip with a larger force
    # The part of a press in which flat tips are fully seated.
    loads: list[float]  # loads at which the evaluated part of a press may begin, as E times depth [N/mm]
    load_forces: "Sequence[float]"  # forces of the tips at each load [N], load by load
    per_offset: float  # side of a tip divided by the tip spacing [1]
    by_skin: float  # side of a tip times the slope of the skin [mm]
    rounds: int  # maximum number of iterations for the load at which tips are seated
    # Repeated presses of one fruit.
    own_logs: list[float]  # logarithms of moduli
    own_deviations: list[float]  # standard deviations of ln E at `own_logs` that presses do not share, without noise
    chi_squares: list[float]  # upper limits of chi-squared for two presses, for three, and so on

    def __init__(self, constants: dict[str, object]) -> None:
        """Store each constant as the attribute of the same name; `size` is the number of tips."""
        for name in constants:
            setattr(self, name, constants[name])
        self.size = len(self.gains)

    def forces_of(self, channels: list[float]) -> tuple[list[float], int]:
        """Return the forces of the tips [N] from the channel readings [N], and flags.

        The flags are the sum of BAD_FORCE if a force is implausible, and LIFT_OFF if a tip is out of contact.
        """
        forces = []
        flags = 0
        for tip in range(self.size):
            force = self.gains[tip] * channels[tip]
            # A force that is not a number fails both comparisons, hence the `not`.
            if not self.lowest_forces[tip] <= force <= self.largest_forces[tip]:
                flags |= BAD_FORCE
            if not force > self.least_forces[tip]:
                flags |= LIFT_OFF
            forces.append(force)
        return forces, flags

    def channels_of(self, above: list[float]) -> list[float]:
        """Return the channel readings [N] from the counts of all channels above tare."""
        # `newtons` holds a square matrix, row by row.
        rows = [self.newtons[tip * self.size : (tip + 1) * self.size] for tip in range(self.size)]
        return [dot(row, above) for row in rows]

    def is_saturated(self, counts: list[int]) -> bool:
        """Return whether a count is at the end of the converter's range."""
        return max(abs(count) for count in counts) >= self.saturation

    def check_range(self, E: float) -> tuple[float, float, int]:
        """Return E [MPa], E / (1 - nu^2) [MPa] and a flag: OUT_OF_RANGE, or 0 if E is in the range of the design."""
        is_outside = not self.least_E <= E <= self.largest_E
        flag = OUT_OF_RANGE if is_outside else 0
        return E, self.reduced * E, flag

    def correct_modulus(self, level_modulus: float) -> float:
        """Return the modulus [MPa] of a fruit for which a level sensor reads `level_modulus` [MPa].

        The correction is a factor whose logarithm is interpolated in ln E. This factor corrects for the shape and the
        skin of the fruit, and for the creep of the springs. A unit without a table of corrections needs no correction.
        """
        logs = self.level_logs
        shifts = self.level_shifts
        if not logs:
            return level_modulus
        if len(logs) == 1:
            return level_modulus * math.exp(shifts[0])
        return level_modulus * math.exp(interpolate(logs, shifts, math.log(level_modulus)))

    def fruit_weights(self, offset: float) -> list[float]:
        """Return the weights w S [1/mm] of F / E in the contrast, for tips on a saddle-shaped skin.

        Here w are the weights of the tips in the contrast, and S is the compliance matrix of the fruit times E.
        `offset` [mm] is the contrast of the gaps between the saddle and the tips. Domes roll on the skin. So their
        contacts are closer together than their axes, and a force on one contact lowers the skin under the others more.
        For tips that do not roll, the weights do not depend on the offset.
        """
        if not self.places:
            return self.fruit
        # A dome whose axis is at X touches the skin at [[c, s], [s, c]]^-1 X, with c = `rolled` and s = `saddle`.
        saddle = self.saddle_at(offset)
        determinant = self.rolled * self.rolled - saddle * saddle
        weights = []
        for tip in range(self.size):
            # S is the compliance of a half-space, body / distance, plus a part that does not change as contacts move.
            weight = self.fixed_fruit_part[tip]
            for other in range(self.size):
                if other != tip:
                    # From the axis of this tip to the other axis [mm]; `places` alternates between x and y.
                    x = self.places[2 * other] - self.places[2 * tip]
                    y = self.places[2 * other + 1] - self.places[2 * tip + 1]
                    # The inverse of [[c, s], [s, c]] is [[c, -s], [-s, c]] divided by the determinant.
                    along_x = self.rolled * x - saddle * y
                    along_y = self.rolled * y - saddle * x
                    # distance between the two contacts, times the determinant [mm]
                    distance = math.sqrt(along_x * along_x + along_y * along_y)
                    weight += self.weights[other] * self.body * determinant / distance
            weights.append(weight)
        return weights

    def saddle_at(self, offset: float) -> float:
        """Return the dome radius times the curvature k_xy of the saddle [1] whose gaps have the contrast `offset` [mm].

        The result divided by `rolled` is the smaller root t of g t^2 + 2 t - g = 0, with g = `gap_ratio`. The form
        g / (1 + sqrt(1 + g^2)) of this root is free of cancellation.
        """
        gap_ratio = 2.0 * self.dome_radius * offset / self.contrast_of_xy * self.rolled
        return gap_ratio * self.rolled / (1.0 + math.sqrt(1.0 + gap_ratio * gap_ratio))

    def contrast_point(self, forces: "Sequence[float]") -> tuple[float, float, float, float]:
        """Return the total force [N], the contrast [mm], its variance [mm^2], and its covariance with the total force.

        `forces` [N] holds one positive force per tip. The contrast is computed at a fixed modulus. In a press it is
        then nearly a linear function of the total force, so that outliers can be found. The covariance [N mm] is not
        0, because errors of the forces enter both the total force and the contrast. The errors of different tips are
        independent.
        """
        contrast = variance = covariance = 0.0
        for tip in range(self.size):
            cube_root = forces[tip] ** (1.0 / 3.0)
            # Derivative of the contrast with respect to the force. The derivative of F^(2/3) is F^(-1/3) / 1.5.
            slope = self.linear[tip] + self.line_domes[tip] / 1.5 / cube_root
            error = self.errors[tip]  # standard deviation of the force
            contrast += self.linear[tip] * forces[tip] + self.line_domes[tip] * cube_root * cube_root
            variance += (slope * error) ** 2
            covariance += slope * error * error
        return sum(forces), contrast, variance, covariance

    def distance_variance(self, variance: float, covariance: float, slope: float) -> float:
        """Return the variance [mm^2] of the contrast of a point minus the contrast of a line at the same total force.

        `variance` [mm^2] is the variance of the point's contrast, and `covariance` [N mm] its covariance with the
        total force. `slope` [mm/N] is the slope of the line. An error of the total force moves the point along the
        line, so it also changes the distance.
        """
        return variance - slope * (2.0 * covariance - slope * self.total_force_variance)

    def are_firm(self, forces: "Sequence[float]") -> list[bool]:
        """Return for each tip whether its force [N] is so large that noise cannot make the tip look out of contact."""
        return [force > self.firm * least for force, least in zip(forces, self.least_forces)]


def dot(weights: list[float], values: list[float]) -> float:
    """Return the dot product of two lists."""
    return sum(weight * value for weight, value in zip(weights, values))


def interpolate(positions: list[float], values: list[float], position: float) -> float:
    """Return `values` interpolated linearly at a `position`, and held constant beyond both ends.

    `positions` increase, and there are at least two of them.
    """
    row = 1  # index of the upper end of the interval
    while row < len(positions) - 1 and positions[row] < position:
        row += 1
    fraction = min(max((position - positions[row - 1]) / (positions[row] - positions[row - 1]), 0.0), 1.0)
    return values[row - 1] + fraction * (values[row] - values[row - 1])


def smallest_root(rigid: float, dome: float, body: float) -> float | None:
    """Return the root z of rigid + dome z^2 + body z^3 = 0 between 0 and the extremum at z > 0, or None.

    The unknown is z = E^(-1/3). The coefficients come from the springs, the flattening of the domes and the flesh. The
    cubic is monotonic from z = 0 to its extremum, so the root there is unique. A root beyond the extremum is not used.
    If there is no extremum at z > 0, the root may have any positive value.
    """
    end = -2.0 * dome / (3.0 * body) if body else 0.0  # extremum
    if not end > 0.0:
        # Without an extremum, the dome term and the body term have the same sign. So a root of the cubic with only one
        # of them is an upper bound, and twice that root safely ends the interval.
        upper_bounds = [abs(rigid / dome) ** 0.5] if dome else []
        upper_bounds += [abs(rigid / body) ** (1.0 / 3.0)] if body else []
        end = 2.0 * min(upper_bounds) if upper_bounds else 0.0
    # At z = 0 the cubic equals `rigid`. There is a root if the cubic has the opposite sign at the end of the interval.
    if not rigid * (rigid + end * end * (dome + body * end)) < 0.0:
        return None
    start = 0.0  # bisection: the cubic has the sign of `rigid` at the start, and the opposite sign at the end
    for _ in range(BISECTIONS):
        middle = 0.5 * (start + end)
        if rigid * (rigid + middle * middle * (dome + body * middle)) > 0.0:
            start = middle
        else:
            end = middle
    return end


class UnitTare:
    """The tare: the mean counts of a sensor that touches nothing."""

    def __init__(self, unit: Unit) -> None:
        self.unit = unit
        self.samples = 0  # number of samples in the sums
        self.sums = [0] * unit.size  # sum of the counts of each channel

    def add(self, counts: list[int]) -> int:
        """Add a sample of counts to the tare unless a count is saturated; return the flag SATURATED or 0."""
        if self.unit.is_saturated(counts):
            return SATURATED
        self.sums = [total + count for total, count in zip(self.sums, counts)]
        self.samples += 1
        return 0

    def above(self, counts: list[int]) -> tuple[list[float], int]:
        """Return the counts minus the tare, and a flag: 0, NOT_TARED or SATURATED.

        The list is empty if the flag is not 0.
        """
        if not self.samples:
            return [], NOT_TARED
        if self.unit.is_saturated(counts):
            return [], SATURATED
        # The integers are subtracted before the division, so that only the result is rounded.
        return [(count * self.samples - total) / self.samples for count, total in zip(counts, self.sums)], 0


class RiseSums:
    """Running sums of one press, from which its modulus follows by a regression with an instrumental variable.

    The instrumental variable, or instrument, of a sample is the total force one or two samples earlier. The instrument
    rises during the press, but its noise is independent of the sample's noise. A sample is used if the forces of the
    samples just before it exceed `least` [N], one limit per tip. A selection of samples by their own forces would
    prefer positive noise. A co-moment of two quantities is the sum of the products of their deviations from their
    means.
    """

    def __init__(self, unit: Unit, least: "Sequence[float]") -> None:
        self.unit = unit
        self.least = least
        self.largest_total = 0.0  # total force in the deepest sample [N]
        self.noise = 0.0  # standard deviation of ln E of the last reading
        self.begin_sums()
        self.save_sums()

    def begin_sums(self) -> None:
        """Reset all sums to 0, because samples after a lift belong to another press.

        The saved sums are kept until a deeper sample arrives.
        """
        size = self.unit.size
        self.forget_previous()
        self.touch_force = 0.0  # instrument of the first sample that is used [N]
        self.count = 0  # number of samples in the sums
        self.mean_instrument = 0.0  # [N]
        self.spread = 0.0  # sum of the squared deviations of the instrument from its mean [N^2]
        self.means = [(0.0, 0.0, 0.0)] * size  # means of F, F^(2/3) and F^(-1/3) for each tip
        self.comoments = [(0.0, 0.0)] * size  # co-moments of the instrument with F and F^(2/3), for each tip
        self.mean_steps = [0.0] * size  # mean change of each force from one sample to the next [N]
        self.step_comoments = [0.0] * size  # co-moments of the instrument with these changes [N^2]

    def save_sums(self) -> None:
        """Save the sums at the deepest sample, because later samples do not enter the reading."""
        self.saved_sums = (
            self.count,
            self.touch_force,
            self.spread,
            self.means,
            self.comoments,
            self.step_comoments,
        )

    def forget_previous(self) -> None:
        """Forget the previous samples, because the next sample does not follow them directly."""
        # total forces of the previous samples [N], earliest first; 0 means no sample
        self.previous = [0.0] * self.unit.spike_length

    def add(self, forces: "Sequence[float]", steps: list[float]) -> None:
        """Add the forces of a sample [N], all positive, and their changes since the previous sample [N].

        If one of the forces does not exceed its limit, the sums begin again.
        """
        if self.previous[0]:  # not 0, so the instrument of this sample is known
            self.add_to_sums(forces, steps)
        if all(force > least for force, least in zip(forces, self.least)):
            self.previous = self.previous[1:]
            self.previous.append(sum(forces))
        else:
            self.begin_sums()

    def add_to_sums(self, forces: "Sequence[float]", steps: list[float]) -> None:
        """Add the forces of a sample and their changes [N] to the means, and to the co-moments with the instrument.

        `steps` [N] are the changes of the forces since the previous sample. Welford's method avoids the cancellation
        that sums of squares would suffer. A co-moment grows by the deviation of one variable from its old mean, times
        the deviation of the other variable from its new mean.
        """
        instrument = self.previous[0]  # total force one or two samples earlier
        total = sum(forces)
        if not self.count:
            self.touch_force = instrument
        self.count += 1
        deviation = instrument - self.mean_instrument  # from the mean of the samples before this one
        self.mean_instrument += deviation / self.count
        self.spread += deviation * (instrument - self.mean_instrument)
        self.update_force_means(forces, deviation)
        self.mean_steps = [mean + (step - mean) / self.count for mean, step in zip(self.mean_steps, steps)]
        self.step_comoments = [
            comoment + deviation * (step - mean)
            for comoment, step, mean in zip(self.step_comoments, steps, self.mean_steps)
        ]
        if total >= self.largest_total:
            self.largest_total = total
            self.save_sums()

    def update_force_means(self, forces: "Sequence[float]", deviation: float) -> None:
        """Update the means and co-moments of F, F^(2/3) and F^(-1/3) with the forces [N] of a sample.

        `deviation` [N] is the deviation of the sample's instrument from its mean over the earlier samples. `count`
        includes the sample.
        """
        means = []
        comoments = []
        for force, old_means, old_comoments in zip(forces, self.means, self.comoments):
            power = force ** (2.0 / 3.0)
            inverse_root = force ** (-1.0 / 3.0)
            mean_force = old_means[0] + (force - old_means[0]) / self.count
            mean_power = old_means[1] + (power - old_means[1]) / self.count
            mean_inverse_root = old_means[2] + (inverse_root - old_means[2]) / self.count
            means.append((mean_force, mean_power, mean_inverse_root))
            force_comoment = old_comoments[0] + deviation * (force - mean_force)
            power_comoment = old_comoments[1] + deviation * (power - mean_power)
            comoments.append((force_comoment, power_comoment))
        self.means = means
        self.comoments = comoments

    def read(self, *, whole: bool) -> tuple[float | None, float, int]:
        """Return E [MPa], the offset [mm] and flags; E is None if it cannot be determined.

        With z = E^(-1/3) and the forces F of the tips, each sample fulfils

            gap + springs F + domes F^(2/3) z^2 + fruit F z^3 = -offset.

        Products of weights and forces are summed over the tips. The offset is the contrast of the unknown gaps under
        the tips. This contrast is constant during a press, and so drops out of the co-moments m with the instrument.
        The co-moments give a cubic equation for z:

            rigid + dome z^2 + body z^3 = 0,

        with rigid = springs m(F), dome = domes m(F^(2/3)) and body = fruit m(F).

        The flag NO_RISE is set if noise makes E too uncertain. With `whole`, it is also set if the last tip touches
        late, or if the force hardly rises afterwards. The standard deviation of ln E due to noise is stored in `noise`.
        """
        unit = self.unit
        count, touch_force, _, means, comoments, _ = self.saved_sums
        if count < unit.fewest:
            return None, 0.0, FEW_SAMPLES
        # standard deviation of a force that is distributed uniformly between the touch and the maximum [N]
        rise = (self.largest_total - touch_force) / math.sqrt(12.0)
        if whole and (touch_force / self.largest_total > unit.latest_touch or not rise > unit.least_rise):
            return None, 0.0, NO_RISE
        force_comoments = [comoment[0] for comoment in comoments]
        power_comoments = [comoment[1] for comoment in comoments]
        rigid = dot(unit.springs, force_comoments)
        dome = dot(unit.domes, power_comoments)
        z, offset, fruit = self.solve_contrast(rigid, dome, force_comoments, means)
        if z is None:
            return None, 0.0, OUT_OF_RANGE
        flag = self.check_errors(z, dome, dot(fruit, force_comoments), fruit)
        if flag == NO_RISE:
            return None, 0.0, NO_RISE
        return 1.0 / (z * z * z), offset, flag

    def check_errors(self, z: float, dome: float, body: float, fruit: list[float]) -> int:
        """Return a flag: NO_RISE if noise makes E too uncertain, TOO_FAST if the channels' timing does, or 0.

        The standard deviation of ln E due to noise is stored in `noise`, unless it is too large. `z` is E^(-1/3).
        `dome` and `body` are the coefficients of z^2 and z^3 in the cubic of `read`. `fruit` [1/mm] holds the weights
        of F / E.
        """
        unit = self.unit
        _, _, spread, means, _, step_comoments = self.saved_sums
        # derivative of the cubic with respect to -ln E [N mm]
        slope = z * z * (2.0 * dome + 3.0 * body * z) / 3.0
        force_slopes = self.force_slopes(z, fruit, [mean[2] for mean in means])
        noise_error, delay_error = self.cubic_errors(force_slopes, spread, step_comoments)
        # An error of ln E is the error of the cubic divided by this slope.
        if noise_error > unit.largest_noise * abs(slope):
            return NO_RISE
        self.noise = noise_error / abs(slope)
        is_too_fast = unit.time_deviation * delay_error > unit.largest_by_time * abs(slope)
        return TOO_FAST if is_too_fast else 0

    def solve_contrast(
        self, rigid: float, dome: float, force_comoments: list[float], means: list[tuple[float, float, float]]
    ) -> tuple[float | None, float, list[float]]:
        """Return z = E^(-1/3), the offset [mm], and the weights [1/mm] of F / E; z is None if there is no solution.

        This is a fixed-point iteration. The offset determines the saddle, which moves the contacts, and so changes the
        modulus and the offset. `rigid` and `dome` are coefficients of the cubic for z, and `force_comoments` are the
        co-moments of the instrument with the forces. `means` holds the means of F, F^(2/3) and F^(-1/3) for each tip,
        from which the offset follows.
        """
        unit = self.unit
        mean_forces = [mean[0] for mean in means]
        mean_rigid = unit.gap + dot(unit.springs, mean_forces)
        mean_dome = dot(unit.domes, [mean[1] for mean in means])
        z = offset = change = 0.0
        fruit = unit.fruit
        for _ in range(unit.saddle_steps):
            fruit = unit.fruit_weights(offset)
            root = smallest_root(rigid, dome, dot(fruit, force_comoments))
            if root is None:
                return None, 0.0, fruit
            z = root
            previous = offset
            offset = -(mean_rigid + z * z * (mean_dome + dot(fruit, mean_forces) * z))
            change = abs(offset - previous)
        if unit.places and not change <= unit.settled * abs(mean_rigid):  # the iteration did not converge
            return None, 0.0, fruit
        return z, offset, fruit

    def cubic_errors(
        self, force_slopes: list[float], spread: float, step_comoments: list[float]
    ) -> tuple[float, float]:
        """Return the standard deviations of the cubic [N mm] due to noise, and due to random delays of the channels.

        The delays have a standard deviation of one sampling period. `force_slopes` [mm/N] are the derivatives of the
        contrast with respect to the forces. `spread` [N^2] is the sum of the squared deviations of the instrument.
        `step_comoments` [N^2] are its co-moments with the changes of the forces in one sampling period.
        """
        unit = self.unit
        noise_variance = 0.0  # variance of the contrast in one sample [mm^2]
        time_variance = 0.0  # variance of the cubic [N^2 mm^2]
        for tip in range(unit.size):
            noise_variance += (force_slopes[tip] * unit.noises[tip]) ** 2
            time_variance += (force_slopes[tip] * step_comoments[tip]) ** 2
        return math.sqrt(noise_variance * spread), math.sqrt(time_variance)

    def force_slopes(self, z: float, fruit: list[float], inverse_roots: list[float]) -> list[float]:
        """Return the mean derivative of the contrast with respect to the force of each tip [mm/N].

        `z` is E^(-1/3), and `fruit` [1/mm] are the weights of F / E. `inverse_roots` are the means of F^(-1/3).
        """
        unit = self.unit
        slopes = []
        for tip in range(unit.size):
            # The derivative of F^(2/3) is F^(-1/3) / 1.5.
            dome_slope = unit.domes[tip] / 1.5 * z * z * inverse_roots[tip]
            slopes.append(unit.springs[tip] + fruit[tip] * z * z * z + dome_slope)
        return slopes


class ContrastLine:
    """A least-squares line of the contrast [mm] against the total force [N], from which outliers deviate."""

    def __init__(self, unit: Unit, points: list[tuple[float, float, float, float]]) -> None:
        """Fit the line to points from `Unit.contrast_point`; its slope is limited to the range of moduli."""
        self.unit = unit
        totals, contrasts, variances, covariances = zip(*points)
        # means over the points
        self.mean_force: float = sum(totals) / len(points)
        self.mean_contrast: float = sum(contrasts) / len(points)
        self.variance: float = sum(variances) / len(points)
        self.covariance: float = sum(covariances) / len(points)
        # Deviations from the means: u of the total force [N], and y of the contrast [mm].
        deviations = [
            (total - self.mean_force, contrast - self.mean_contrast) for total, contrast in zip(totals, contrasts)
        ]
        self.spread = sum(u * u for u, _ in deviations)  # sum of the squared deviations of the force [N^2]
        self.moment = sum(u * y for u, y in deviations)  # sum of the products of both deviations [N mm]
        self.slope = 0.0  # [mm/N]; it is unknown if all points have the same total force
        if self.spread > 0.0:
            self.slope = min(max(self.moment / self.spread, unit.least_slope), unit.most_slope)
        self.squares = sum((y - self.slope * u) ** 2 for u, y in deviations)  # sum of the squared residuals [mm^2]

    def distance_variance(self, slope: float) -> float:
        """Return the mean variance [mm^2] of the points' distances from a line with `slope` [mm/N]."""
        return self.unit.distance_variance(self.variance, self.covariance, slope)

    def residual(self, point: tuple[float, float, float, float], slope: float) -> float:
        """Return the residual of a point that was not fitted [standard deviations].

        The residual is the distance from a line with the given `slope` [mm/N] through the mean of the fitted points.
        Its variance combines the error of the point with the error of that mean.
        """
        total, contrast, point_variance, covariance = point
        distance_variance = self.unit.distance_variance(point_variance, covariance, slope)
        variance = distance_variance + self.distance_variance(slope) / self.unit.fitted_samples
        return (contrast - self.mean_contrast - slope * (total - self.mean_force)) / math.sqrt(variance)


class TouchSample:
    """One sample of a touch: its forces [N], its `Unit.contrast_point`, and its number in the signal.

    `is_pending` is True until the sample is accepted or dropped.
    """

    def __init__(self, unit: Unit, forces: "Sequence[float]", number: int) -> None:
        self.forces = forces
        self.point = unit.contrast_point(forces)
        self.number = number
        self.is_pending = True


class Touch:
    """A touch of all tips, from which outliers are dropped.

    The samples wait in a window. A sample is accepted or dropped only after the samples that follow it have arrived.
    """

    def __init__(
        self, unit: Unit, take: "Callable[[Sequence[float], int], object]", drop: "Callable[[int], object]"
    ) -> None:
        """Prepare for the first touch.

        `take` is called with the forces [N] of each accepted sample and its number, counted from 1. `drop` is called
        with the number of each rejected sample.
        """
        self.unit = unit
        self.take = take
        self.drop = drop
        self.length = unit.spike_length + unit.fitted_samples  # number of samples in a full window
        self.number = 0  # number of the last sample in the signal
        self.begin()

    def begin(self) -> None:
        """Reset the window and all sums, because the next sample begins a new touch."""
        self.window: list[TouchSample] = []  # the last `length` samples with all tips in contact
        self.out_of_contact = 0  # number of later samples with a tip out of contact
        # The sum of squared residuals of all fits, divided by their variance, and the number of fits.
        self.squares = 0.0
        self.fits = 0
        # The number of accepted samples, and their mean total force [N] and mean contrast [mm].
        self.accepted = 0
        self.mean_force = 0.0
        self.mean_contrast = 0.0

    def add_out_of_contact(self, forces: "Sequence[float]") -> bool:
        """Add a sample with a tip out of contact; return whether the sensor was lifted.

        One bad conversion affects at most `unit.spike_length` samples. So the sensor was lifted if more samples are out
        of contact. The sensor was also lifted if none of the `forces` [N] is firm in a second sample out of contact.
        """
        self.number += 1
        if not self.window:  # no sample in contact since the touch began or was closed
            return True
        self.out_of_contact += 1
        if self.out_of_contact > self.unit.spike_length:
            return True
        return self.out_of_contact > 1 and not any(self.unit.are_firm(forces))

    def is_bad_conversion(self, forces: "Sequence[float]") -> bool:
        """Return whether the samples out of contact were caused by a bad conversion instead of a lift.

        The cause is a bad conversion if the contact before and after these samples is firm. `forces` [N] are the forces
        of the first sample in contact after them.
        """
        unit = self.unit
        # Interpolation spreads a bad conversion over two samples, so the samples just before and after may be affected
        # too. Then a single firm sample before them is sufficient.
        if unit.spike_length > 1:
            return any(all(unit.are_firm(sample.forces)) for sample in self.window[-unit.spike_length :])
        return all(unit.are_firm(forces)) and all(unit.are_firm(self.window[-1].forces))

    def add(self, forces: "Sequence[float]") -> None:
        """Add the forces [N] of a sample in which all tips touch, and drop the samples out of contact just before."""
        for number in range(self.number - self.out_of_contact, self.number):
            self.drop(number + 1)  # samples are counted from 1
        self.number += 1
        self.out_of_contact = 0
        self.window = self.window[1 - self.length :]  # leaves space for one sample
        self.window.append(TouchSample(self.unit, forces, self.number))
        if len(self.window) == self.length:
            # Only runs that begin early in the window are dropped, and only its first samples are accepted. Later
            # windows decide on the last samples, because more samples then follow them.
            self.drop_outliers(self.unit.neighbours + 1)
            self.release(len(self.window) - self.unit.spike_length - (self.unit.neighbours - 1))

    def close(self) -> None:
        """Accept or drop all pending samples, because the touch or the press is over, and begin a new touch."""
        if len(self.window) == self.length:
            self.drop_outliers(len(self.window))
        self.release(len(self.window))
        self.begin()

    def release(self, count: int) -> None:
        """Accept the pending samples among the first `count` samples of the window.

        The accepted samples are added to the means and passed to `take`. They stay in the window, because later samples
        are compared with them.
        """
        for sample in self.window[: max(count, 0)]:  # no samples if `count` is negative
            if sample.is_pending:
                sample.is_pending = False
                self.accepted += 1
                total, contrast, _, _ = sample.point
                self.mean_force += (total - self.mean_force) / self.accepted
                self.mean_contrast += (contrast - self.mean_contrast) / self.accepted
                self.take(sample.forces, sample.number)

    def slope_limits(self, line: ContrastLine, scale: float) -> tuple[float, float]:
        """Return the smallest and the largest slope [mm/N] of the contrast against the total force.

        The slope is limited by the range of moduli, by the points to which `line` is fitted, and by the chord from the
        accepted samples to these points. `scale` [1] multiplies the stated variance of the forces.
        """
        unit = self.unit
        variance = scale * max(line.distance_variance(unit.least_slope), line.distance_variance(unit.most_slope))
        noise = unit.largest_residual * math.sqrt(variance)  # largest error of the contrast in one sample [mm]
        smallest, largest = self.fit_limits(line, noise)
        chord = self.chord_limits(line, noise)
        if chord:
            smallest_by_chord = max(smallest, chord[0])
            largest_by_chord = min(largest, chord[1])
            # A chord that contradicts the other limits is ignored.
            if smallest_by_chord <= largest_by_chord:
                return smallest_by_chord, largest_by_chord
        return smallest, largest

    def fit_limits(self, line: ContrastLine, noise: float) -> tuple[float, float]:
        """Return the smallest and the largest slope [mm/N] that the range of moduli and the points of `line` allow.

        The points limit the least-squares slope to within its error. If they contradict the range of moduli, that range
        is ignored. `noise` [mm] is the largest error of the contrast in one sample.
        """
        smallest = self.unit.least_slope
        largest = self.unit.most_slope
        if line.spread > 0.0:  # otherwise the points have the same total force, and determine no slope
            slope = line.moment / line.spread
            error = noise / math.sqrt(line.spread)
            smallest = max(smallest, slope - error)
            largest = min(largest, slope + error)
            if smallest > largest:
                return slope - error, slope + error
        return smallest, largest

    def chord_limits(self, line: ContrastLine, noise: float) -> tuple[float, float] | None:
        """Return the smallest and the largest slope [mm/N] that the mean of the accepted samples allows, or None.

        The chord runs from this mean to the mean of the points of `line`. `noise` [mm] is the largest error of the
        contrast in one sample. `unit.slope_tolerance` is the largest difference between the slopes of a chord and of
        the press. The result is None if the two means do not determine a chord.
        """
        unit = self.unit
        if not self.accepted or line.mean_force == self.mean_force:
            return None
        chord = (line.mean_contrast - self.mean_contrast) / (line.mean_force - self.mean_force)
        distance = abs(line.mean_force - self.mean_force)
        error = noise * math.sqrt(1.0 / unit.fitted_samples + 1.0 / self.accepted) / distance + unit.slope_tolerance
        return chord - error, chord + error

    def drop_outliers(self, decided_count: int) -> None:
        """Drop a run of outliers that begins among the first `decided_count` samples of the window.

        The suspected run is dropped if one of its samples is an outlier for every possible slope, which means that its
        residual exceeds `unit.largest_residual` standard deviations. Samples that were accepted before are not dropped.
        The window must be full.
        """
        unit = self.unit
        points = [sample.point for sample in self.window]
        length = unit.spike_length  # number of samples in a run
        first, line = self.find_suspect(points)
        # If earlier residuals exceed the stated noise, the variance is scaled up to match them.
        scale = max(1.0, self.squares / self.fits) if self.fits else 1.0
        residual = self.worst_residual(points[first : first + length], line, scale)
        self.squares += line.squares / line.distance_variance(line.slope)
        self.fits += 1
        if first < decided_count and residual > unit.largest_residual * math.sqrt(scale):
            outliers = [sample for sample in self.window[first : first + length] if sample.is_pending]
            for sample in outliers:
                self.drop(sample.number)
            self.window = [sample for sample in self.window if sample not in outliers]

    def find_suspect(self, points: list[tuple[float, float, float, float]]) -> tuple[int, ContrastLine]:
        """Return the index of the first point of the suspected run, and the line that is fitted to all other points.

        One bad conversion makes `unit.spike_length` consecutive points bad. Each such run is left out in turn, and a
        line of the contrast against the total force is fitted to the other points. The run without which the residuals
        are smallest is the suspect. `points` holds the `Unit.contrast_point` of each sample in a full window.
        """
        unit = self.unit
        length = unit.spike_length  # number of points in a run
        # A full window holds the fitted samples and one run, so a run may begin at `fitted_samples` + 1 positions.
        lines = [
            ContrastLine(unit, points[:first] + points[first + length :]) for first in range(unit.fitted_samples + 1)
        ]
        squares = [line.squares for line in lines]
        suspect = squares.index(min(squares))
        return suspect, lines[suspect]

    def worst_residual(
        self, points: list[tuple[float, float, float, float]], line: ContrastLine, scale: float
    ) -> float:
        """Return the largest residual of the `points` [standard deviations], each at the slope that fits it best.

        The slope lies within `slope_limits` for `line` and `scale`. The line is not fitted to the points.
        """
        smallest, largest = self.slope_limits(line, scale)
        worst = 0.0
        for point in points:
            at_smallest = line.residual(point, smallest)
            at_largest = line.residual(point, largest)
            # If the residuals at the two limits differ in sign, some slope between the limits passes through the point.
            least_residual = 0.0 if at_smallest * at_largest < 0.0 else min(abs(at_smallest), abs(at_largest))
            worst = max(worst, least_residual)
        return worst


class UnitPress:
    """One press, stored as sums from each load at which flat tips may be seated, so that its memory does not grow."""

    def __init__(self, unit: Unit, last: list[float] | None = None) -> None:
        """Begin a press.

        `last` holds the channels of the sample just before the press, from which its first sample is interpolated. If
        it is None, the first sample of a unit with delayed channels is not used.
        """
        self.unit = unit
        self.last = last
        self.touched = False  # whether a sample had all tips in contact
        self.over = False  # whether the tips were lifted after enough samples in firm contact
        self.firm_samples = 0  # number of consecutive samples with all tips in firm contact
        self.left_out = 0  # number of samples that were dropped as outliers
        self.noise = 0.0  # standard deviation of ln E of the last reading
        self.touch = Touch(unit, self.accept, self.count_dropped)
        self.forces: Sequence[float] = [0.0] * unit.size  # forces of the last accepted sample [N]
        self.number = 0  # number of that sample in the signal
        size = unit.size
        # One set of sums for each load; `load_forces` holds the forces of all tips at one load after the other.
        self.sums_by_load = [
            RiseSums(unit, unit.load_forces[size * index : size * (index + 1)]) for index in range(len(unit.loads))
        ]

    def add(self, channels: list[float]) -> int:
        """Add a sample of channel readings [N] unless it is bad; return its flags.

        Channels that are converted in turn are interpolated to one time first. A bad sample cannot be interpolated.
        """
        _, flags = self.unit.forces_of(channels)
        if flags & BAD_FORCE and self.unit.later:
            return self.forget_last(flags)
        simultaneous = self.interpolate_channels(channels)
        return self.add_simultaneous(simultaneous) if simultaneous else flags

    def add_counts(self, tare: UnitTare, counts: list[int]) -> int:
        """Add a sample of counts unless it is bad; return its flags.

        Channels that are converted in turn are interpolated to one time first. A bad sample cannot be interpolated.
        """
        above_tare, flags = tare.above(counts)
        if flags:
            return self.forget_last(flags) if self.unit.later else flags
        _, flags = self.unit.forces_of(self.unit.channels_of(above_tare))
        if flags & BAD_FORCE and self.unit.later:
            return self.forget_last(flags)
        simultaneous = self.interpolate_channels(above_tare)
        return self.add_simultaneous(self.unit.channels_of(simultaneous)) if simultaneous else flags

    def interpolate_channels(self, sample: list[float]) -> list[float]:
        """Return the channels of a sample at the time of its first conversion; empty if there is no previous sample.

        The converter reads the channels in turn. So each channel is interpolated between its last two conversions.
        `unit.later` holds the delay of each channel in sampling periods. If `unit.later` is empty, all channels are
        converted at once, and the sample is returned unchanged. Otherwise it is stored for the next interpolation.
        """
        if not self.unit.later:
            return sample
        last = self.last
        self.last = sample
        if last is None:
            return []
        return [value - later * (value - previous) for value, later, previous in zip(sample, self.unit.later, last)]

    def forget_last(self, flags: int) -> int:
        """Forget the last sample, because a bad sample cannot be interpolated; return the flags."""
        self.last = None
        self.forget_previous()
        return flags

    def add_simultaneous(self, channels: list[float]) -> int:
        """Add a sample of simultaneous channel readings [N] unless it is bad; return its flags."""
        forces, flags = self.unit.forces_of(channels)
        self.touched = self.touched or not flags  # without flags, all tips are in contact
        if flags & BAD_FORCE:
            self.touch.number += 1  # the sample is counted, but not used
            self.forget_previous()
        elif flags:  # a tip is out of contact
            is_lift = self.touch.add_out_of_contact(forces)
            if is_lift:
                self.end_touch()
        else:
            # All tips touch again, so this sample shows whether the samples out of contact before it were a lift.
            if self.touch.out_of_contact and not self.touch.is_bad_conversion(forces):
                self.end_touch()
            self.touch.add(forces)
        return flags

    def forget_previous(self) -> None:
        """Forget the previous samples, because the next sample does not follow them directly."""
        self.touch.close()
        for sums in self.sums_by_load:
            sums.forget_previous()

    def end_touch(self) -> None:
        """Close the touch and reset the sums, because samples after a lift belong to another press.

        The press is over if more samples were firm than one bad conversion can affect.
        """
        self.touch.close()
        for sums in self.sums_by_load:
            sums.begin_sums()
        self.over = self.over or self.firm_samples > self.unit.spike_length
        self.firm_samples = 0

    def count_dropped(self, _: int) -> None:
        """Count a dropped sample; its number is not needed."""
        self.left_out += 1

    def accept(self, forces: "Sequence[float]", number: int) -> None:
        """Add the forces [N] of an accepted sample to the sums; `number` is the number of the sample in the signal."""
        if all(self.unit.are_firm(forces)):
            self.firm_samples += 1
        elif self.firm_samples <= self.unit.spike_length:
            self.firm_samples = 0  # one bad conversion may have caused so few firm samples
        # If samples between these two were dropped, the change is divided by the number of steps.
        steps = [(force - previous) / (number - self.number) for force, previous in zip(forces, self.forces)]
        self.forces = forces
        self.number = number
        for sums in self.sums_by_load:
            sums.add(forces, steps)

    def read(self) -> tuple[float | None, float | None, int]:
        """Return E [MPa], E / (1 - nu^2) [MPa] and flags, from the part of the press in which flat tips are seated.

        The modulus and the offset determine the load at which the tips are fully seated. The press is then read from
        that load on. Both steps are repeated until the load no longer changes. If a load yields no modulus, the next
        lower load is used. Both moduli are None if the press determines no modulus. Before the reading, pending samples
        are accepted or dropped.
        """
        self.touch.close()
        if not self.touched:
            return None, None, LIFT_OFF
        unit = self.unit
        index, E, offset, flags = self.read_from(0)  # the whole press
        for _ in range(unit.rounds):
            if E is None:
                break
            seating_load = E * (unit.per_offset * abs(offset) + unit.by_skin)
            # index of the first load that is large enough, or of the last load
            seated_index = sum(load < seating_load for load in unit.loads[:-1])
            if seated_index == index:
                break
            index, E, offset, flags = self.read_from(seated_index)
        if E is None:
            return None, None, flags
        self.noise = self.sums_by_load[index].noise
        E, reduced, outside = unit.check_range(unit.correct_modulus(E))
        return E, reduced, outside | flags

    def read_from(self, index: int) -> tuple[int, float | None, float, int]:
        """Read the press from the load with this `index`, or from the next lower load that yields a modulus.

        The load with the index 0 selects the whole press. Return the index of the load that was used, E [MPa], the
        offset [mm] and flags; E is None if no load yields a modulus.
        """
        E, offset, flags = self.sums_by_load[index].read(whole=not index)
        while E is None and index:
            index -= 1
            E, offset, flags = self.sums_by_load[index].read(whole=not index)
        return index, E, offset, flags


def unshared_deviation(logs: list[float], deviations: list[float], E: float, noise: float) -> float:
    """Return the standard deviation of ln E of one press, without the errors that all presses of a fruit share.

    The `deviations` at the logarithms `logs` of moduli are standard deviations without noise, and are interpolated to E
    [MPa]. `noise` is the standard deviation of ln E due to noise, and is added in quadrature.
    """
    without_noise = interpolate(logs, deviations, math.log(E))
    return math.sqrt(without_noise * without_noise + noise * noise)


def hodges_lehmann(logs: list[float]) -> float:
    """Return the Hodges-Lehmann estimate: the median of the means of all pairs, each value also paired with itself.

    J. L. Hodges and E. L. Lehmann, Ann. Math. Stat. 34 (1963) 598. For two values it is their mean. With four values
    or more, one outlier shifts it by no more than the spread of the other values.
    """
    # `other` runs from 0 to `one`, so each pair occurs once, and each value is paired with itself.
    means = sorted(0.5 * (logs[one] + logs[other]) for one in range(len(logs)) for other in range(one + 1))
    half = len(means) // 2
    return means[half] if len(means) % 2 else 0.5 * (means[half - 1] + means[half])


def standard_deviation(logs: list[float]) -> float:
    """Return the standard deviation [1] of ln E between presses; `logs` holds one value per press, at least two."""
    mean = sum(logs) / len(logs)
    return math.sqrt(sum((log - mean) ** 2 for log in logs) / (len(logs) - 1))


def counted_presses(deviations: list[float]) -> list[int]:
    """Return the indices of the presses to use, given the standard deviation of ln E of each press [1].

    A press is left out if its standard deviation exceeds `MUCH_LESS_CERTAIN` times the smallest standard deviation.
    """
    limit = MUCH_LESS_CERTAIN * min(deviations)
    return [press for press, deviation in enumerate(deviations) if deviation <= limit]


def are_inconsistent(logs: list[float], deviations: list[float], limit: float) -> bool:
    """Return whether values of ln E differ by more than their standard deviations allow.

    This is a chi-squared test: the squared differences from the weighted mean are divided by the variances and summed,
    and the sum is compared with `limit`.
    """
    weights = [1.0 / (deviation * deviation) for deviation in deviations]
    mean = dot(weights, logs) / sum(weights)
    return sum(weight * (log - mean) ** 2 for weight, log in zip(weights, logs)) > limit


class UnitFruit:
    """The last presses of one fruit, up to MOST_PRESSES, and the modulus that follows from all of them."""

    def __init__(self, unit: Unit) -> None:
        self.unit = unit
        self.logs: list[float] = []  # ln E of each press, E in MPa
        self.deviations: list[float] = []  # standard deviation of ln E of each press, without shared errors

    def add(self, E: float | None, noise: float) -> None:
        """Add a press, unless its modulus E [MPa] is None; `noise` is the standard deviation of ln E due to noise."""
        if E is None:
            return
        self.logs = self.logs[1 - MOST_PRESSES :]  # leaves space for one press
        self.logs.append(math.log(E))
        deviation = unshared_deviation(self.unit.own_logs, self.unit.own_deviations, E, noise)
        self.deviations = self.deviations[1 - MOST_PRESSES :]
        self.deviations.append(deviation)

    def read(self) -> tuple[float | None, float | None, float, int]:
        """Return E [MPa], E / (1 - nu^2) [MPa], the standard deviation of ln E between presses, and flags.

        With only one press the standard deviation is 0. Without a press, both moduli are None, and the flag is
        LIFT_OFF.
        """
        if not self.logs:
            return None, None, 0.0, LIFT_OFF
        used = counted_presses(self.deviations)  # indices of the presses that are certain enough
        ln_moduli = [self.logs[press] for press in used]
        E, reduced, flags = self.unit.check_range(math.exp(hodges_lehmann(ln_moduli)))
        if len(ln_moduli) == 1:
            return E, reduced, 0.0, flags
        deviations = [self.deviations[press] for press in used]
        limit = self.unit.chi_squares[len(ln_moduli) - 2]  # chi_squares[0] is the limit for two presses
        if are_inconsistent(ln_moduli, deviations, limit):
            flags |= PRESSES_DISAGREE
        return E, reduced, standard_deviation(ln_moduli), flags


def readings_of(
    unit: Unit, rows: "Iterable[list[int]]", tare_samples: int
) -> "Iterator[tuple[float | None, float | None, int]]":
    """Yield E [MPa], E / (1 - nu^2) [MPa] and flags for each press in rows of counts.

    The first `tare_samples` rows are the tare, taken while the sensor touches nothing. A press begins when all tips
    touch, and ends when a tip lifts off. Bad counts end it too; their flags are yielded after its reading. A press that
    is unfinished at the end of the signal is read if enough samples are in firm contact. A signal without a press
    yields the reading of its last touch. Both moduli are None if a press determines none.
    """
    tare = UnitTare(unit)
    press = UnitPress(unit)
    has_reading = False  # whether a press was read before
    for counts in rows:
        if tare.samples < tare_samples:
            flags = tare.add(counts)
            if flags:
                yield None, None, flags
            continue
        flags = press.add_counts(tare, counts)
        is_bad = flags and flags != LIFT_OFF  # a tip out of contact is not an error
        if press.over or (is_bad and press.touched):
            has_reading = True
            yield press.read()
            press = UnitPress(unit, press.last)
        if is_bad:
            yield None, None, flags
    reading = press.read()  # this also accepts pending samples, which may increase `firm_samples`
    if press.firm_samples > unit.spike_length or (press.touched and not has_reading):
        yield reading


def recorded_counts(path: str, size: int) -> "Iterator[list[int]]":
    """Yield the counts in each line of a comma-separated file: the last `size` cells of the line.

    Lines with fewer cells are skipped. Lines in which one of these cells is not an integer are skipped too, such as a
    header.
    """
    with open(path, "rb") as lines:
        for line in lines:
            try:
                counts = [int(cell) for cell in line.strip().split(b",")[-size:]]
            except ValueError:
                continue
            if len(counts) == size:
                yield counts
