"""The modulus from the rise of the contrast during one press, whatever the shape of the fruit and the pose.

**The law.** In every sample of a press the contrast of the tips (`contrast_law.py`) satisfies

    a + b z^2 + d z^3 + gamma = 0,    a = w.(C F),  b = h w.F^(2/3),  d = w.(S F),  z = E^(-1/3),

with weights w that cancel any travel and any tilt. The offset gamma [mm] is the contrast of the gaps under the tips. It
contains everything that the sensor cannot measure: the saddle of the skin, and errors in the heights, the positions and
the mounting of the tips. It is unknown, but it is the same in all samples of one press. A reading from the forces at a
single moment has to assume that gamma is known.

**A pair.** The weights (-1, 1) of a pair cancel only the travel, so its tilt must not change during the press. Its
gamma is the travel of the low tip minus the travel of the high tip. For flat tips b = 0, and a plotted against d is a
straight line of slope -1/E.

**The estimator.** An instrument u is any quantity that rises during the press; here it is the total force in an earlier
sample. The constant gamma drops out of the covariance of u with the law:

    G(z) = cov(u, a) + cov(u, b) z^2 + cov(u, d) z^3 = 0.

This is the cubic of a single sample, with covariances in place of a, b and d. Its smallest positive root z gives
E = 1 / z^3.

**No bias due to noise.** The instrument of a sample is the sum of all forces in the previous sample. If the noise is
independent from sample to sample, u and F have independent noise, and noise does not change the mean of cov(u, F). The
sum of the sample itself cannot be used, because its noise is part of F (errors in variables). A sample is used if all
tips touched the fruit in the previous sample. Selecting a sample by its own forces would favour positive noise. The
remaining bias is of second order: noise changes the mean of F^(2/3), and E is about 0.2 % too high for a noise of 0.5 %
of full scale.

Channels that are interpolated to a common time share the noise of two neighbouring samples. The instrument is then the
total force two samples earlier. Summed over many samples, interpolated noise has the variance of white noise, so the
standard uncertainty of E is the same.

**Minimum variance.** Only one contrast of the tips is independent of travel and tilt, so w is given. The weights of the
samples are free to choose. If the forces have independent noise with standard deviations sigma_t, the residual r of a
sample has the variance

    s^2 = sum_t c_t^2 sigma_t^2,    c_t = dr/dF_t = (w C)_t + 2/3 h w_t z^2 F_t^(-1/3) + (w S)_t z^3 .

The true forces are unknown. So a sample contains information on z and gamma only in its residual r, which is the left
side of the law. The information on z is sum (q - mean q)^2 / s^2 with q = dr/dz = 2 b z + 3 d z^2, where the mean is
weighted by 1 / s^2. Its inverse is the Cramer-Rao bound on the variance of z. If s is constant, an instrument u gives
the variance s^2 var(u) / n / (dG/dz)^2. By the Cauchy-Schwarz inequality, this variance is smallest for u = q / s^2.
For any other u, it is larger by a factor of 1 / corr(u, q)^2. Both q and the total force rise during a press, and their
correlation is above 0.98. So the total force comes within a few per cent of the bound.

**Sensitivity.** A cause that changes the law by dG changes ln E by 3 dG / (z dG/dz). For an error that is the same in
every sample, dG follows from covariances of the forces. A change of u has no effect to first order, because G = 0 for
all u.

**Time.** A timing error dt of a channel has the same effect as a force error dt dF/dt. It contributes c_t dt
cov(u, dF_t/dt) to dG, the covariance of u with this error. The covariance is zero in a press at constant rate, and it
grows with the deceleration of the press.

**The saddle.** Domes roll on the skin, so their contacts are closer together than their axes. The difference grows with
the curvature of the skin. The offset determines the saddle, and the saddle determines the distances between the
contacts, so S becomes S(gamma). The cubic is solved repeatedly until gamma converges. An error in the height of a tip
is mistaken for a saddle there. It changes E only through S, by `RiseSlopes.offset` per mm.

**One bad sample.** It changes E in proportion to its residual times the deviation of its instrument from the mean. The
change is larger if there are few samples. The jackknife computes the modulus without each sample in turn, and so
detects a bad sample of any kind: J. W. Tukey, Ann. Math. Stat. 29 (1958) 614.

For instruments, see W. A. Fuller, Measurement Error Models (1987), section 1.4. Samples with correlated noise, for
example after a filter, must be decimated first. Units: mm, N, MPa.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from sensor.arrays import Flags, Floats, Ints, rows_of
from sensor.theory.contrast_law import ContrastLaw, Matrix, Place, ReadingError, smallest_root
from sensor.theory.dome_form import effective_cap_height
from sensor.theory.hertz import hertz_factor
from sensor.theory.uneven_skin import effective_heights

FEWEST = 5  # minimum number of samples with all tips on the fruit; a covariance of fewer samples is meaningless
LARGEST_TOUCH_FORCE = 0.7  # touch force of the last tip divided by the largest force; above it, too little rise remains
# ratio of the rise to the noise of the instrument; the noise then costs less than 4 % of the information
LEAST_RISE = 5.0
# maximum relative noise of E; above it, the root of the cubic scatters too far to be linearised
LARGEST_NOISE = 1.0 / 3.0
LARGEST_BY_TIME = 0.02  # relative error of E by timing errors; such an error increases an uncertainty of 5 % to 5.4 %
SETTLED = 1e-12  # relative change of the offset at convergence, close to round-off
MOST_LEFT_OUT_EACH = 32  # maximum number of samples for the jackknife; in a longer press, one sample hardly changes E
MOST_STEPS = 50  # iterations of the offset; each one reduces the error to a few per cent of the previous error
STEP = 1e-4  # step of the offset in its difference quotient [mm]


class RiseError(ReadingError):
    """A press that does not determine a modulus. `flag` is the reason: few_samples, no_rise or out_of_range."""

    def __init__(self, flag: str, message: str) -> None:
        super().__init__(message)
        self.flag = flag


@dataclass(frozen=True, kw_only=True)
class RollingDomes:
    """Domes of equal radius [mm] that roll on a half-space. Its skin has a mean curvature H [1/mm] and a saddle k_xy.

    `positions` (tips, 2) [mm] are the positions of the dome axes. On a skin with the curvature matrix k, a dome of
    radius r with its axis at X touches at (1 + r k)^-1 X.
    """

    positions: tuple[Place, ...]
    weights: tuple[float, ...]
    dome_radius: float
    mean_curvature: float
    poisson: float

    @cached_property
    def rolling_factor(self) -> float:
        """Return c = 1 + r H [1], the ratio of the distances between two axes and between their contacts on a ball."""
        return 1.0 + self.dome_radius * self.mean_curvature

    @property
    def relative_radius(self) -> float:
        """Return the relative radius R* [mm], with 1 / R* = 1 / r + H."""
        return self.dome_radius / self.rolling_factor

    @property
    def contrast_depends_on_saddle(self) -> bool:
        """Return whether the contrast depends on the saddle k_xy.

        The contrast of a square depends on k_xy, but the contrast of a line only on k_xx and k_yy.
        """
        return abs(self.contrast_of_xy) > SETTLED * float(np.abs(self.positions).max()) ** 2

    @cached_property
    def contrast_of_xy(self) -> float:
        """Return the contrast of the product x y [mm^2] of the axis positions."""
        return float(np.dot(self.weights, np.prod(self.positions, axis=1)))

    def saddle(self, offset: float) -> float:
        """Return the saddle k_xy of the skin [1/mm] at which the gaps have the contrast `offset` [mm].

        Domes of radius r that roll on a saddle have the gaps g x y, with g = k_xy / (c^2 - (r k_xy)^2). Here c is
        1 + r H, with the mean curvature H of the skin. The root that vanishes for g = 0 is

            k_xy = 2 g c^2 / (1 + sqrt(1 + (2 r g c)^2)).

        This form does not subtract nearly equal numbers.
        """
        g = offset / self.contrast_of_xy  # [1/mm]
        c = self.rolling_factor
        return 2.0 * g * c**2 / (1.0 + math.hypot(1.0, 2.0 * self.dome_radius * g * c))

    def S(self, offset: float = 0.0) -> Floats:
        """Return the compliance S between the contacts on a saddle, times E [1/mm], (tips, tips).

        On a half-space it is (1 - nu^2) / (pi d), where d is the distance between two contacts. The `offset` [mm]
        determines the saddle. The contacts are at M^-1 times the positions of the axes, with
        M = [[c, r k_xy], [r k_xy, c]], the dome radius r, and c as in `saddle`.
        """
        c = self.rolling_factor
        saddle = self.saddle(offset) if offset else 0.0  # without an offset, `saddle` could divide 0 by 0
        off_diagonal = self.dome_radius * saddle
        x, y = self._between_axes
        determinant = c**2 - off_diagonal**2
        scaled_distance = np.hypot(c * x - off_diagonal * y, c * y - off_diagonal * x)  # distance times the determinant
        return np.asarray((1.0 - self.poisson**2) / math.pi * determinant / (scaled_distance + self._self_distance))

    @cached_property
    def level_S(self) -> Floats:
        """Return S for an offset of 0, the reference for the change of S with the offset."""
        return self.S()

    @cached_property
    def _self_distance(self) -> Floats:
        """Return a matrix (tips, tips) of zeros with an infinite diagonal.

        This matrix is added to the distances, so that S is 0 on its diagonal. The Hertz term already contains the
        effect of a contact on itself.
        """
        return np.where(np.eye(len(self.positions)) > 0.0, math.inf, 0.0)

    @cached_property
    def _between_axes(self) -> Floats:
        """Return the differences between the positions of the axes along x and y [mm], (2, tips, tips)."""
        positions = np.array(self.positions).T
        return np.asarray(positions[:, :, None] - positions[:, None])

    def law(self, C: Matrix) -> "RiseLaw":
        """Return the law for these domes on springs with the compliance matrix C [mm/N], (tips, tips)."""
        contrast = ContrastLaw(
            weights=self.weights,
            gaps=(0.0,) * len(self.positions),
            C=C,
            S=rows_of(self.S()),
            hertz=hertz_factor(self.relative_radius, self.poisson),
        )
        return RiseLaw(contrast=contrast, rolling=self if self.contrast_depends_on_saddle else None)


@dataclass(frozen=True, kw_only=True)
class RiseLaw:
    """The contrast law of a sensor, and the dependence of its compliance S on the offset.

    `contrast.gaps` [mm] are the known gaps; the offset is the contrast of the unknown gaps. `rolling` are the domes
    whose contacts shift with the offset. `rolling` is None if the offset does not determine the distances between
    contacts.
    """

    contrast: ContrastLaw
    rolling: RollingDomes | None = None

    def with_offset(self, offset: float) -> ContrastLaw:
        """Return the contrast law whose S is evaluated at an offset [mm]."""
        if self.rolling is None:
            return self.contrast
        return replace(self.contrast, S=rows_of(self.S(offset)))

    def S(self, offset: float) -> Floats:
        """Return S at an offset [mm], times E [1/mm], (tips, tips)."""
        _, _, S = self.contrast.arrays
        if self.rolling is not None:
            S = S.copy()  # the array of the law is cached
            _flesh_block(S, self.rolling)[:] += self.rolling.S(offset) - self.rolling.level_S
        return S

    def per_offset(self, offset: float) -> Floats:
        """Return the derivative of S, times E, with respect to the offset [1/mm^2], in the shape of S."""
        slope = np.zeros_like(self.contrast.arrays[2])
        if self.rolling is not None:
            change = self.rolling.S(offset + STEP) - self.rolling.S(offset - STEP)
            _flesh_block(slope, self.rolling)[:] = change / (2.0 * STEP)
        return slope

    @property
    def relaxing_law(self) -> "RiseLaw":
        """Return the law for flesh that relaxes, with 2 n channels for n tips.

        The first n channels are the measured forces, which bend the springs. The last n channels are the forces with
        which elastic flesh would resist the same indentation; they determine the modulus. So the springs act on the
        first n columns, and the flesh acts on the last n. Only the last n rows have a weight in the contrast.
        """
        law = self.contrast
        _, C, S = law.arrays
        zero_block = np.zeros_like(C)
        zeros = (0.0,) * len(law.weights)
        contrast = ContrastLaw(
            weights=(*zeros, *law.weights),
            gaps=(*zeros, *law.gaps),
            C=rows_of(np.block([[zero_block, zero_block], [C, zero_block]])),
            S=rows_of(np.block([[zero_block, zero_block], [zero_block, S]])),
            hertz=law.hertz,
        )
        return replace(self, contrast=contrast)


def _flesh_block(S: Floats, rolling: RollingDomes) -> Floats:
    """Return a view of the block (tips, tips) of S that belongs to the flesh channels, which come last."""
    tips = len(rolling.positions)
    return S[-tips:, -tips:]


@dataclass(frozen=True, kw_only=True, eq=False)
class Rise:
    """The samples of a press that are used: from the touch of the last tip to the deepest sample.

    `forces` (samples, channels) [N] are all above 0. `instrument` (samples,) [N] is the total force a few samples
    earlier. `rates` (samples, channels) [N/s] are the time derivatives of the forces. `touch` [N] is the total force
    when the last tip touches, `largest` [N] the total force in the deepest sample.
    """

    instrument: Floats
    forces: Floats
    rates: Floats
    touch: float
    largest: float

    @cached_property
    def moments(self) -> "_Moments":
        """Return the moments of the forces, from which the coefficients of the law are computed."""
        return _Moments(self.comoment_and_mean(self.forces), self.comoment_and_mean(np.cbrt(self.forces) ** 2))

    def comoment_and_mean(self, values: Floats) -> Floats:
        """Return the co-moment with the instrument and the mean of each channel of `values` (samples, channels)."""
        return np.stack([self._centred_instrument @ values, values.mean(axis=0)])

    @cached_property
    def _centred_instrument(self) -> Floats:
        """Return the instrument minus its mean [N], (samples,)."""
        return np.asarray(self.instrument - self.instrument.mean())

    @property
    def drift_comoment(self) -> Floats:
        """Return the co-moment with the instrument of a drift from 0 at the first sample to 1 at the last, (1,)."""
        sample_numbers = np.arange(len(self.forces))[:, None]
        comoment, _ = self.comoment_and_mean(sample_numbers / (len(sample_numbers) - 1))
        return np.asarray(comoment)

    @property
    def spread(self) -> float:
        """Return the co-moment of the instrument with itself [N^2]."""
        return float(self._centred_instrument @ self._centred_instrument)

    def without(self, first: int, count: int) -> "Rise":
        """Return the press without the `count` consecutive samples that start at index `first`."""
        omitted = slice(first, first + count)
        return replace(
            self,
            instrument=np.delete(self.instrument, omitted, axis=0),
            forces=np.delete(self.forces, omitted, axis=0),
            rates=np.delete(self.rates, omitted, axis=0),
        )


class _Moments(NamedTuple):
    """The co-moment with the instrument and the mean, (2, channels), of the forces F and of F^(2/3)."""

    F: Floats
    F_two_thirds: Floats


def select_rise(
    forces: Floats, tips: int, least_forces: Floats | float = 0.0, *, t: Floats | None = None, lag: int = 1
) -> Rise:
    """Return the samples of a press from which its modulus is read: the samples of the rise to the deepest one.

    `forces` (samples, channels) [N] contain the forces of the tips in the first `tips` channels; the sum of these is
    the instrument. The same number of channels derived from these forces may follow (`RiseLaw.relaxing_law`). The
    instrument of a sample is the sum `lag` samples earlier: 1 for white noise, 2 if the channels were interpolated to a
    common time. A sample is used if its own forces are above 0, and if all forces of the `lag` samples before it exceed
    `least_forces`. The limits `least_forces` (channels,) [N] are a multiple of the noise. The times `t` (samples,) [s]
    determine the rates, which are 0 without them.

    A press ends when a tip lifts off. The samples after a lift have a different offset. If the press goes deeper after
    the lift, only the samples after it are used. Samples after the deepest one are not used, because the flesh may have
    yielded. If no sample can be used, the result has no samples.
    """
    total = forces[:, :tips].sum(axis=1)
    touch_start = _touch_starts(np.asarray((forces > least_forces).all(axis=1)))
    samples_since_touch = np.arange(len(forces)) - touch_start
    is_usable = (samples_since_touch >= lag) & (forces > 0.0).all(axis=1)
    if not is_usable.any():
        no_samples = forces[:0]
        return Rise(instrument=no_samples[:, 0], forces=no_samples, rates=no_samples, touch=0.0, largest=0.0)
    # A hold repeats the largest force, so the last of several equal maxima is used.
    deepest = _last_maximum(np.where(is_usable, total, 0.0))
    touch = int(touch_start[deepest])  # the sample in which the last tip touches
    rows = slice(touch + lag, deepest + 1)
    return Rise(
        instrument=total[touch : deepest + 1 - lag],  # `lag` samples before each of the rows
        forces=forces[rows],
        rates=_force_rates(forces, t, rows),
        touch=float(total[touch]),
        largest=float(total[deepest]),
    )


def _last_maximum(values: Floats) -> int:
    """Return the index of the maximum of a vector, or of the last maximum if several are equal."""
    return len(values) - 1 - int(values[::-1].argmax())  # backwards, because `argmax` returns the first maximum


def _touch_starts(all_touch: Flags) -> Ints:
    """Return, for each sample, the index of the first sample after the last lift of a tip.

    `all_touch` (samples,) is true in samples in which all tips are in contact. A lift in the sample itself is ignored,
    because a selection of samples by their own forces would favour positive noise.
    """
    # For each sample, the index of the last sample up to then in which a tip is out of contact, or -1 if there is none.
    last_lift = np.maximum.accumulate(np.where(all_touch, -1, np.arange(len(all_touch))))
    # The lifts are shifted by one sample, so that each start depends on earlier samples only. The slice at the end only
    # matters for an empty press.
    return np.concatenate([[0], last_lift[:-1] + 1])[: len(all_touch)]


def _force_rates(forces: Floats, t: Floats | None, rows: slice) -> Floats:
    """Return the time derivatives [N/s] of the `forces` (samples, channels) in some `rows`.

    A rate is the change of a force since the previous sample, divided by the time since then. The rows must not include
    the first sample, which has no previous one. A rate is 0 if no time has passed, or if `t` [s], the times of all
    samples, is None.
    """
    rates = np.zeros_like(forces[rows])
    if t is not None:
        elapsed = np.diff(t, prepend=t[0])[rows, None]
        changes = np.diff(forces[rows.start - 1 : rows.stop], axis=0)
        np.divide(changes, elapsed, out=rates, where=elapsed > 0.0)
    return rates


class BendSlopes(NamedTuple):
    """Sensitivity of ln E to a relative error e(F) = e_0 + k F of a gain or a compliance that changes with the force.

    `at_zero` (tips,) [1] is the derivative with respect to e_0, and `per_N` (tips,) [N] with respect to k.
    """

    at_zero: tuple[float, ...]
    per_N: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class RiseSlopes:
    """The slopes of ln E with respect to each cause of error.

    `noise` (tips,) [1/N] is the standard deviation of ln E per standard deviation of the force, for noise that is
    independent from sample to sample. All other errors are the same in all samples. `gains` and `springs` (tips,) [1]
    are the slopes with respect to the relative errors of the gain and the spring stiffness. `zeros` (tips,) [1/N] are
    the slopes for a zero error. `drifts` (tips,) [1/N] are the slopes for a zero error that grows linearly from the
    first sample to the last. `times` (tips,) [1/s] are the slopes for a delay of the channel.

    `hertz` and `body` [1] are the slopes for relative errors of the Hertz term and of S, which all tips share. `offset`
    [1/mm] is the slope for an offset that is not caused by a saddle of the skin. `channel_bends` and `spring_bends` are
    the slopes for the nonlinearity of the gains and of the spring compliances.
    """

    noise: tuple[float, ...]
    gains: tuple[float, ...]
    springs: tuple[float, ...]
    zeros: tuple[float, ...]
    drifts: tuple[float, ...]
    times: tuple[float, ...]
    hertz: float
    body: float
    offset: float
    channel_bends: BendSlopes
    spring_bends: BendSlopes

    def mean_curvature(self, relative_radius: float) -> float:
        """Return the slope of ln E with respect to the mean curvature H of the skin [mm].

        The domes have the relative radius R* = `relative_radius` [mm], with 1 / R* = 1 / r + H, and the flesh is a
        half-space. The Hertzian constant h is then proportional to R*^(-1/3), and S to 1 + r H.
        """
        return relative_radius * (self.hertz / 3.0 + self.body)


@dataclass(frozen=True, kw_only=True, eq=False)
class UnevennessSensitivity:
    """The slopes of ln E with respect to the unevenness of a fruit, which differs from tip to tip.

    `heights` (waves, tips) [1/mm] are the slopes for the height of each wave of the skin at the centre of a contact.
    `flesh` (tips,) [1] are the slopes for the relative change of the modulus of the flesh under each tip.
    """

    heights: Floats
    flesh: Floats


@dataclass(frozen=True, kw_only=True)
class RiseReading:
    """The result of a press: the modulus E [MPa], and the offset gamma [mm], which is the contrast of the unknown gaps.

    `noise` [1] is the relative standard uncertainty of E due to noise that is independent from sample to sample.
    `offset_noise` [mm] is the standard uncertainty of the offset. `offset_per_log_E` [mm] is the change of the offset
    that accompanies a change of ln E due to other causes. `touch` [1] is the total force when the last tip touches,
    divided by the largest total force.
    """

    E: float
    offset: float
    noise: float
    offset_noise: float
    offset_per_log_E: float
    samples: int
    touch: float
    slopes: RiseSlopes


def read_rise(law: RiseLaw, rise: Rise, noises: Floats, *, whole: bool = True) -> RiseReading:
    """Read the modulus from the rise of a press, with its uncertainty due to noise and its sensitivity to other causes.

    `law` is the law of the sensor, and `rise` holds the samples of the press. `noises` (tips,) [N] are the standard
    deviations of the forces, whose noise is independent from sample to sample. If `whole` is true, the press must rise
    far enough after the touch of its last tip. Pass False for a part of a press, whose small rise shows in its
    uncertainty. Raises RiseError if there are too few samples, the rise is too small, no modulus fits, or noise makes
    the modulus too uncertain.
    """
    _refuse_few_samples(rise)
    if whole:
        _refuse_short_rise(rise, noises)
    solution, linearised = _solve_and_linearise(law, rise, tips=len(noises))
    comoment_per_log_E, mean_per_log_E = linearised.per_log_E
    # Let c be the derivative of the law with respect to a force, and u the instrument. If the force has noise with the
    # standard deviation sigma, the co-moment has the standard deviation |c| sigma sqrt(sum (u - mean u)^2).
    per_tip_force = linearised.sum_per_tip(linearised.per_force)
    noise_per_force = np.abs(per_tip_force) * math.sqrt(rise.spread) / abs(comoment_per_log_E)
    relative_noise = float(np.linalg.norm(noise_per_force * noises))
    _refuse_noisy_modulus(relative_noise)
    # The offset is uncertain for two reasons: the noise of the mean residual, and the change of the offset with E.
    residual_noise = float(np.linalg.norm(per_tip_force * noises))
    mean_noise = residual_noise / math.sqrt(len(rise.forces))
    return RiseReading(
        E=solution.E,
        offset=solution.offset,
        noise=relative_noise,
        offset_noise=math.hypot(mean_noise, mean_per_log_E * relative_noise),
        offset_per_log_E=float(mean_per_log_E),
        samples=len(rise.forces),
        touch=rise.touch / rise.largest,
        slopes=linearised.slopes(noise_per_force),
    )


def rise_modulus(law: RiseLaw, rise: Rise) -> float:
    """Return the modulus [MPa] of a press without noise. Raises RiseError like `read_rise`."""
    _refuse_few_samples(rise)
    _refuse_short_rise(rise, np.zeros(1))
    return _solve_press(law, rise.moments).E


def unevenness_sensitivity(
    law: RiseLaw, rise: Rise, wave_numbers: Floats, relative_radius: float
) -> UnevennessSensitivity:
    """Return the sensitivity of the modulus of a press to uneven skin and flesh. The press has one channel per tip.

    `wave_numbers` (waves,) [1/mm] describe the waves of the skin. `relative_radius` [mm] is the relative radius of the
    domes. For a flat tip pass 0: its whole face touches, so a height only shifts the first contact. Raises RiseError if
    there are too few samples, or if no modulus fits.
    """
    _refuse_few_samples(rise)
    solution, linearised = _solve_and_linearise(law, rise, tips=rise.forces.shape[1])
    weights, _, _ = law.contrast.arrays
    contact_radius = _contact_radii(law, rise, solution.E, relative_radius)
    # The changes of the law per height of each wave under each tip.
    wave_changes = [weights * rise.comoment_and_mean(effective_heights(k, contact_radius)) for k in wave_numbers]
    return UnevennessSensitivity(
        heights=np.array([linearised.slope_with_saddle(*change) for change in wave_changes]),
        flesh=linearised.slope_with_saddle(*linearised.flesh_under_tips),
    )


def form_slopes(law: RiseLaw, rise: Rise, domes: RollingDomes, cap_radii: Sequence[float]) -> Floats:
    """Return the sensitivity of the modulus of a press to form errors that all domes have in common.

    The first entry [1] of the result is the change of ln E per relative change of the dome radius. The other entries
    [1/mm] are the changes of ln E per height of a cap, one for each of the `cap_radii` [mm]. A cap is the material that
    is missing or added at a flat or pointed apex. `domes` are the domes of the law, on a half-space. Raises RiseError
    if there are too few samples, or if no modulus fits.
    """
    _refuse_few_samples(rise)
    solution, linearised = _solve_and_linearise(law, rise, tips=rise.forces.shape[1])
    weights, _, _ = law.contrast.arrays
    contact_radius = _contact_radii(law, rise, solution.E, domes.relative_radius)
    cap_changes = [
        rise.comoment_and_mean(effective_cap_height(radius, contact_radius)) @ weights for radius in cap_radii
    ]
    changes = (_change_by_dome_radius(linearised, domes), *cap_changes)
    return np.array([linearised.slope_with_saddle(*change) for change in changes])


def _contact_radii(law: RiseLaw, rise: Rise, E: float, relative_radius: float) -> Floats:
    """Return the contact radius of each tip in each sample [mm], (samples, channels), on flesh of modulus E [MPa].

    A dome of relative radius R* = `relative_radius` [mm] has the contact radius sqrt(R* d). By Hertz's law, its
    indentation d is h (F / E)^(2/3).
    """
    return np.sqrt(relative_radius * law.contrast.hertz * np.cbrt(rise.forces / E) ** 2)


def _change_by_dome_radius(linearised: "_LinearisedLaw", domes: RollingDomes) -> Floats:
    """Return the change of the law per relative change of the radius of all domes, (2,).

    Let r be the dome radius, H the mean curvature of the fruit, and R* the relative radius, with 1 / R* = 1 / r + H.
    The Hertz term is proportional to R*^(-1/3), and S to 1 + r H = r / R*. If r grows by a fraction e, R* grows by the
    fraction e R* / r, and r / R* by the fraction e R* H.

    The dome changes, not the law: a dome with a larger radius than the law assumes acts like a law with a smaller
    radius. So the signs are reversed.
    """
    relative_radius = domes.relative_radius
    hertz_change = relative_radius / domes.dome_radius / 3.0 * linearised.hertz
    distance_change = -relative_radius * domes.mean_curvature * linearised.flesh
    return np.asarray(hertz_change + distance_change)


def moduli_without(law: RiseLaw, rise: Rise, window: int = 1) -> Iterator[float]:
    """Yield the moduli [MPa] of a press from which `window` consecutive samples are left out (a jackknife).

    There is one modulus for each position of the first sample left out. A modulus is nan if the remaining samples do
    not determine it. A press of more than `MOST_LEFT_OUT_EACH` samples yields nothing.
    """
    count = len(rise.forces)
    if count > MOST_LEFT_OUT_EACH:
        return
    for first in range(count - window + 1):
        try:
            yield _solve_press(law, rise.without(first, window).moments).E
        except RiseError:
            yield math.nan


def _refuse_few_samples(rise: Rise) -> None:
    """Raise RiseError if a press has too few samples."""
    count = len(rise.forces)
    if count < FEWEST:
        hint = "Press farther, or more slowly."
        message = f"Samples with all tips on the fruit = {count}; at least {FEWEST} are needed. {hint}"
        raise RiseError("few_samples", message)


def _refuse_short_rise(rise: Rise, noises: Floats) -> None:
    """Raise RiseError if the last tip touches too late, or if the rise of the total force is hidden by noise.

    `noises` [N] are the standard deviations of the forces.
    """
    touch = rise.touch / rise.largest
    if touch > LARGEST_TOUCH_FORCE:
        message = f"The last tip touches at {touch:.2g} of the largest total force, above {LARGEST_TOUCH_FORCE:g}."
        raise RiseError("no_rise", f"{message} Press farther, or more level.")
    # The standard deviation of a linear rise between these forces is its range divided by sqrt(12). A hold at the end
    # is ignored, because it adds no information.
    deviation = (rise.largest - rise.touch) / math.sqrt(12.0)
    least_deviation = LEAST_RISE * float(np.linalg.norm(noises))
    if not deviation > least_deviation:
        bound = f"five times its noise, {least_deviation:.2g} N"
        message = f"The total force rises by {deviation:.2g} N, which must be above {bound}."
        raise RiseError("no_rise", f"{message} Press farther.")


def _refuse_noisy_modulus(relative_noise: float) -> None:
    """Raise RiseError if the relative standard uncertainty of E due to noise [1] is too large."""
    if relative_noise > LARGEST_NOISE:
        message = f"The standard uncertainty of E due to noise, {relative_noise:.2g} E, is above a third of E."
        raise RiseError("no_rise", f"{message} Press farther.")


class _Solution(NamedTuple):
    """The solution of the two equations of a press: the modulus E [MPa] and the offset [mm].

    S was evaluated at the offset `S_offset` [mm], which agrees with `offset` within the tolerance of the iteration.
    """

    E: float
    offset: float
    S_offset: float


def _solve_press(law: RiseLaw, moments: _Moments) -> _Solution:
    """Solve the two equations of a press for the modulus E and the offset gamma.

    With z = E^(-1/3), the co-moments with the instrument determine z, and the means then determine the offset:

        cov(u, a) + cov(u, b) z^2 + cov(u, d) z^3 = 0,    gamma = -(mean a + mean b z^2 + mean d z^3).

    For domes, d depends on the offset, because the offset shifts their contacts and changes S by a few per cent. The
    two equations are therefore solved alternately. Each iteration reduces the error of the offset to a few per cent of
    its previous value. Raises RiseError if no modulus fits the press.
    """
    contrast = law.contrast
    weights, C, S = contrast.arrays
    # the co-moment and the mean of each term: springs (a), Hertzian contact (b) and flesh (d)
    spring_comoment, spring_mean = (moments.F @ (weights @ C)).tolist()
    hertz_comoment, hertz_mean = (contrast.hertz * moments.F_two_thirds @ weights).tolist()
    # The known gaps are the same in all samples, so they change only the mean.
    spring_mean += float(np.dot(weights, contrast.gaps))
    offset = 0.0  # the offset at which S was evaluated
    for _ in range(MOST_STEPS):
        flesh_comoment, flesh_mean = (moments.F @ (weights @ S)).tolist()
        try:
            z = smallest_root(spring_comoment, hertz_comoment, flesh_comoment)  # E^(-1/3)
        except ReadingError as error:
            raise RiseError("out_of_range", str(error)) from error
        new_offset = -(spring_mean + z * z * (hertz_mean + flesh_mean * z))
        # If S does not depend on the offset, the first solution is exact.
        if law.rolling is None or abs(new_offset - offset) <= SETTLED * abs(spring_mean):
            return _Solution(E=1.0 / (z * z * z), offset=new_offset, S_offset=offset)
        offset = new_offset
        S = law.S(offset)
    message = "No modulus and offset fit the forces. Press a fruit with a sensor of this design, or calibrate it again."
    raise RiseError("out_of_range", message)


class _LinearisedLaw:
    """The law of a press, linearised at its solution. It converts a change of the law into a change of ln E.

    A change of the law has shape (2, ...): the increment dG [N mm] of the co-moment with the instrument, and the
    increment dM [mm] of the mean.
    """

    def __init__(self, law: RiseLaw, rise: Rise, E: float, offset: float, S: Floats, tips: int) -> None:
        """Linearise the law at the modulus E [MPa] and the offset [mm] of a press, where the compliance is S.

        The law is w.(C F) + h z^2 w.F^(2/3) + z^3 w.(S F) + gamma = 0 with z = E^(-1/3). `S` (channels, channels)
        [1/mm] is the compliance times E. `tips` is the number of tips, each of which may have several channels.

        The public attributes are the terms of the law, or its derivatives with respect to one kind of cause. Their
        first axis has two entries: index 0 for the co-moment with the instrument, and index 1 for the mean.
        """
        self._weights, self._C, _ = law.contrast.arrays
        self._rise = rise
        self._tips = tips
        z = math.pow(E, -1.0 / 3.0)
        hertz_factors = law.contrast.hertz * z**2 * self._weights
        F, F_two_thirds = rise.moments
        # the co-moment and the mean of F^(-1/3)
        self._inverse_roots = rise.comoment_and_mean(1.0 / np.cbrt(rise.forces))
        # derivative of the residual with respect to each force [mm/N], without Hertzian contact
        self._linear_slope = self._weights @ (self._C + S * z**3)
        # derivative of the Hertz term with respect to each force, times F^(1/3); 1.5 comes from the exponent 2/3
        self._hertz_slope = hertz_factors / 1.5
        # the Hertz term and the flesh term of the law, (2,)
        self.hertz = F_two_thirds @ hertz_factors
        self.flesh = F @ (self._weights @ S) * z**3
        # derivative with respect to -ln E, (2,); the terms are proportional to E^(-2/3) and E^(-1)
        self.per_log_E = (2.0 * self.hertz + 3.0 * self.flesh) / 3.0
        self.flesh_under_tips = self._changes_by_flesh_under_tips(S, z, has_domes=law.contrast.hertz != 0.0)
        # derivative with respect to the offset, (2,), because the offset changes S
        self.per_offset = F @ (self._weights @ law.per_offset(offset)) * z**3

    def _changes_by_flesh_under_tips(self, S: Floats, z: float, *, has_domes: bool) -> Floats:
        """Return the change of the law per relative change of the modulus of the flesh under each tip, (2, channels).

        A dome indents this flesh by Hertz's law, in proportion to E^(-2/3), and a flat tip in proportion to 1 / E. `S`
        [1/mm] is the compliance times E, and `z` is E^(-1/3).
        """
        F, F_two_thirds = self._rise.moments
        if has_domes:
            return np.asarray(self._hertz_slope * F_two_thirds)
        return np.asarray(self._weights * np.diag(S) * z**3 * F)

    @property
    def per_force(self) -> Floats:
        """Return c_t [mm/N], (channels,), the derivative of the residual with respect to each force."""
        return np.asarray(self._linear_slope + self._hertz_slope * self._inverse_roots[1])

    def sum_per_tip(self, per_channel: Floats) -> Floats:
        """Return the sums of derivatives over the channels of each tip, (..., tips).

        A sum is the derivative with respect to a cause that changes all channels of a tip equally.
        """
        return np.asarray(per_channel.reshape(*per_channel.shape[:-1], -1, self._tips).sum(axis=-2))

    def slope_at_constant_saddle(self, comoment_change: Floats) -> Floats:
        """Return the change of ln E due to `comoment_change` [N mm], if the saddle of the skin does not change."""
        return np.asarray(comoment_change / self.per_log_E[0])

    def slope_with_saddle(self, comoment_change: Floats, mean_change: Floats) -> Floats:
        """Return the change of ln E due to causes that the law partly attributes to a saddle-shaped skin.

        The causes add `comoment_change` dG [N mm] and `mean_change` dM [mm] to the law. The change of ln E is

            (dG - f dM) / (g - f m),

        with the derivatives g of the co-moment and m of the mean with respect to -ln E (`per_log_E`). The law explains
        a change of the mean by an offset, and the offset by a saddle of the skin. The saddle changes the compliance S
        of the fruit, and S changes the co-moment: f is this change per change of the mean (from `per_offset`).
        """
        # An offset changes the mean by itself, and both moments through S.
        f = self.per_offset[0] / (1.0 + self.per_offset[1])
        return np.asarray((comoment_change - f * mean_change) / (self.per_log_E[0] - f * self.per_log_E[1]))

    def slopes(self, noise_per_force: Floats) -> RiseSlopes:
        """Return the slopes of ln E with respect to all causes of error.

        `noise_per_force` (tips,) [1/N] is copied into the result. Errors of gains, springs and zeros change the offset
        greatly, so their effect on the saddle is included. The effect of other causes on the saddle is neglected. A
        spring that is 1 % stiffer reduces its row and its column of C by 0.5 % each.
        """
        rise = self._rise
        F, F_two_thirds = rise.moments
        squares = rise.comoment_and_mean(rise.forces**2)
        # the co-moment of the change of each force per second of delay
        rate_comoment, _ = rise.comoment_and_mean(rise.rates)
        # Changes of the law, (2, tips), for a relative error of 1 of the gains and of the spring stiffnesses.
        gains = self.sum_per_tip(self._linear_slope * F + self._hertz_slope * F_two_thirds)
        spring_slopes = self._weights @ self._C
        springs = self.sum_per_tip(-0.5 * (self._weights * (F @ self._C.T) + spring_slopes * F))
        # A zero error is the same in all samples, so it changes the co-moment only because the Hertzian slope varies.
        zeros = self.sum_per_tip(self._hertz_slope * self._inverse_roots[0])
        return RiseSlopes(
            noise=_numbers(noise_per_force),
            gains=_numbers(self.slope_with_saddle(*gains)),
            springs=_numbers(self.slope_with_saddle(*springs)),
            zeros=_numbers(self.slope_with_saddle(zeros, self.sum_per_tip(self.per_force))),
            drifts=_numbers(self.slope_at_constant_saddle(self.sum_per_tip(self.per_force * rise.drift_comoment))),
            times=_numbers(self.slope_at_constant_saddle(self.sum_per_tip(self.per_force * rate_comoment))),
            hertz=float(self.slope_at_constant_saddle(self.hertz[0])),
            body=float(self.slope_at_constant_saddle(self.flesh[0])),
            offset=float(self.slope_at_constant_saddle(self.per_offset[0])),
            channel_bends=self._bend_slopes(gains, self.per_force, F, squares),
            spring_bends=self._bend_slopes(springs, -spring_slopes, F, squares),
        )

    def _bend_slopes(self, constant_error: Floats, per_force: Floats, F: Floats, squares: Floats) -> BendSlopes:
        """Return the slopes of ln E with respect to e_0 and k, if the relative error e_0 + k F changes with the force.

        Such an error of a gain or of a spring causes the force error e_0 F + k F^2 / 2. `constant_error` (2, tips) is
        the change of the law caused by a constant relative error of 1. `per_force` (channels,) [mm/N] is c, the
        derivative of the law with respect to a force. `F` and `squares` (2, channels) are the co-moments and means of
        the forces [N] and of their squares.
        """
        # In the co-moments, an error k F^2 / 2 acts like a constant relative error k F*. The equivalent force F* is
        # cov(u, F^2) / (2 cov(u, F)). In the mean, the error adds c k F^2 / 2.
        # The channels of the measured forces come first. A co-moment of 0 has no equivalent force, which is then 0.
        measured = slice(self._tips)
        force_comoment = F[0, measured]
        square_comoment = squares[0, measured]
        equivalent_force = np.divide(
            square_comoment, 2.0 * force_comoment, out=np.zeros_like(force_comoment), where=force_comoment != 0.0
        )
        mean_change = self.sum_per_tip(0.5 * per_force * squares[1])
        return BendSlopes(
            at_zero=_numbers(self.slope_with_saddle(*constant_error)),
            per_N=_numbers(self.slope_with_saddle(constant_error[0] * equivalent_force, mean_change)),
        )


def _solve_and_linearise(law: RiseLaw, rise: Rise, tips: int) -> tuple[_Solution, _LinearisedLaw]:
    """Return the solution of a press with this number of tips, and the law linearised at the solution."""
    solution = _solve_press(law, rise.moments)
    S = law.S(solution.S_offset)
    return solution, _LinearisedLaw(law, rise, solution.E, solution.offset, S, tips)


def _numbers(values: Floats) -> tuple[float, ...]:
    """Return a vector as a tuple of floats."""
    return tuple(values.tolist())
