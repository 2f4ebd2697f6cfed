"""The modulus from the rise of the contrast during one press, whatever the shape of the fruit and the pose.

**The law.** In every sample of a press the contrast of the tips (`contrast_law.py`) is

    a + b z^2 + d z^3 + gamma = 0,    a = w.(C F),  b = h w.F^(2/3),  d = w.(S F),  z = E^(-1/3),

with weights w whose contrast of any travel and tilt is 0. The offset gamma [mm] is the contrast of the gaps under the
tips. It holds all that the sensor cannot know: the saddle of the skin, the heights and places of the tips, their mount.
It is unknown, and the same in all samples of one press. A reading of the forces at one moment takes it for known.

**A pair.** Its weights (-1, 1) cancel only the travel, so its tilt must not change during the press. Its gamma is the
travel of the low tip less the travel of the high one. For flat tips, b = 0: a plotted over d is a line of slope -1/E.

**The estimator.** An instrument u is any quantity that rises with the press; here it is the total force, of an earlier
sample. Its covariance with the law has no gamma:

    G(z) = cov(u, a) + cov(u, b) z^2 + cov(u, d) z^3 = 0,

the same cubic as for one sample, with covariances for a, b and d. Its smallest positive root z gives E = 1 / z^3.

**No bias by noise.** The instrument of a sample is the sum of all forces in the previous sample. If noise is white from
sample to sample, u and F are then independent, and noise does not change the mean of cov(u, F). The sample's own sum is
no instrument: its noise is part of F (errors in variables). A sample is used if all tips touched the fruit in the
previous sample. Selection by its own forces would prefer samples whose noise is positive. The remaining bias is of
second order: noise changes the mean of F^(2/3), and E is some 0.2 % high at a noise of 0.5 % of full scale.

Channels that were brought to one time by interpolation share the noise of two neighbours. The instrument is then the
total force two samples earlier. Summed over many samples, interpolated noise has the variance of white noise, so the
standard uncertainty of E is the same.

**Least variance.** Only one contrast of the tips is independent of travel and tilt, so w is given. The weights of the
samples are free. With independent noises sigma_t of the forces, the residual r of a sample has the variance

    s^2 = sum_t c_t^2 sigma_t^2,    c_t = dr/dF_t = (w C)_t + 2/3 h w_t z^2 F_t^(-1/3) + (w S)_t z^3 .

The path of the true forces is unknown. So the only information of a sample on z and gamma is its residual r, the left
side of the law. The information on z is sum (q - mean q)^2 / s^2 with q = dr/dz = 2 b z + 3 d z^2, means weighted by 1
/ s^2. Its inverse is the Cramer-Rao bound of the variance of z. Where s is constant, an instrument u leaves the
variance s^2 var(u) / n / (dG/dz)^2. By the inequality of Cauchy and Schwarz it is least for u = q / s^2, and it is
larger by 1 / corr(u, q)^2 for another u. Both q and the total force rise together: their correlation is above 0.98, so
the total force comes within some per cent of the bound.

**Sensitivity.** A cause that changes the law by dG moves ln E by 3 dG / (z dG/dz). For an error that is the same in
every sample, dG follows from covariances of the forces. A change of u has no effect to first order, because G = 0 for
all u.

**Time.** An error dt of the time of a channel is a force error dt dF/dt. Its part of dG is the covariance of u with
this error, c_t dt cov(u, dF_t/dt). It is zero in a steady press, and grows with the deceleration of the press.

**The saddle.** Domes roll on the skin, so their contacts are nearer to each other than their axes, the more the skin is
curved. The offset determines the saddle, and the saddle the distances of the contacts: S becomes S(gamma). The cubic is
solved again until gamma converges. An error of a tip's height is mistaken for a saddle there. It moves E only through
S, by `RiseSlopes.offset` per mm.

**One bad sample.** It moves E by its residual times the deviation of its instrument from the mean, and by more if there
are few samples. The moduli without each sample show a change of any kind: the jackknife, J. W. Tukey, Ann. Math. Stat.
29 (1958) 614.

W. A. Fuller, Measurement Error Models (1987), section 1.4, is on instruments. Samples with correlated noise, for
example after a filter, must be decimated first. Units: mm, N, MPa.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from sensor.arrays import Floats, rows_of
from sensor.theory.contrast_law import ContrastLaw, Matrix, Place, ReadingError, smallest_root
from sensor.theory.dome_form import effective_cap_height
from sensor.theory.hertz import hertz_factor
from sensor.theory.uneven_skin import effective_heights

FEWEST = 5  # minimum number of samples with all tips on the fruit; the covariance of fewer means nothing
LARGEST_TOUCH_FORCE = 0.7  # force at the touch of the last tip over the largest; if larger, too little rise remains
LEAST_RISE = 5.0  # rise of the instrument over its noise; the noise then costs below four per cent of the information
LARGEST_NOISE = 1.0 / 3.0  # relative noise of E; beyond, the root of the cubic scatters too far to be linearised
LARGEST_BY_TIME = 0.02  # relative deviation of E by time errors; it turns an uncertainty of 5 % into 5.4 %
SETTLED = 1e-12  # relative change of the offset at convergence: round-off
MOST_LEFT_OUT_EACH = 32  # maximum number of samples for the jackknife; in a longer press one sample hardly changes E
MOST_STEPS = 50  # iterations of the offset; each leaves some per cent of the previous error
STEP = 1e-4  # [mm], step of the offset in its difference quotient


class RiseError(ReadingError):
    """A press that gives no modulus, with the flag that says why: few_samples, no_rise or out_of_range."""

    def __init__(self, flag: str, message: str) -> None:
        super().__init__(message)
        self.flag = flag


@dataclass(frozen=True, kw_only=True)
class RollingDomes:
    """Domes of one radius [mm] that roll on a half-space under a skin of a mean curvature [1/mm] and a saddle k_xy.

    `positions` (tips, 2) [mm] are the positions of their axes. On a skin with the curvature matrix k, a dome of radius
    r at X touches at (1 + r k)^-1 X.
    """

    positions: tuple[Place, ...]
    weights: tuple[float, ...]
    dome_radius: float
    mean_curvature: float
    poisson: float

    @cached_property
    def rolling_factor(self) -> float:
        """Return c = 1 + r H [1], the distance of two axes over the distance of their contacts on a ball."""
        return 1.0 + self.dome_radius * self.mean_curvature

    @property
    def relative_radius(self) -> float:
        """Return the relative radius R* [mm], with 1 / R* = 1 / r + H."""
        return self.dome_radius / self.rolling_factor

    @property
    def contrast_sees_saddle(self) -> bool:
        """Return whether the contrast depends on the saddle k_xy.

        This is true for a square. The contrast of a line depends only on k_xx and k_yy.
        """
        return abs(self.contrast_of_xy) > SETTLED * float(np.abs(self.positions).max()) ** 2

    @cached_property
    def contrast_of_xy(self) -> float:
        """Return the contrast of x y under the axes [mm^2]."""
        return float(np.dot(self.weights, np.prod(self.positions, axis=1)))

    def saddle(self, offset: float) -> float:
        """Return the saddle k_xy of the skin [1/mm] that gives the gaps the contrast `offset` [mm].

        Domes that roll on a saddle have the gaps g x y, with g = k_xy / (c^2 - (r k_xy)^2) and c = 1 + r H. The root
        that is 0 for g = 0 is k_xy = 2 g c^2 / (1 + sqrt(1 + (2 r g c)^2)), a form in which no digits cancel.
        """
        gap_per_xy = offset / self.contrast_of_xy
        return (
            2.0
            * gap_per_xy
            * self.rolling_factor**2
            / (1.0 + math.hypot(1.0, 2.0 * self.dome_radius * gap_per_xy * self.rolling_factor))
        )

    def S(self, offset: float = 0.0) -> Floats:
        """Return the compliance S between the contacts, times E [1/mm], (tips, tips), on a saddle.

        The `offset` [mm] determines the saddle. The contacts lie at [[c, r k_xy], [r k_xy, c]]^-1 times the positions
        of the axes.
        """
        along = self.rolling_factor
        across = self.dome_radius * (self.saddle(offset) if offset else 0.0)
        x, y = self._between_axes
        distance = np.hypot(along * x - across * y, along * y - across * x)
        return np.asarray((1.0 - self.poisson**2) / math.pi * (along**2 - across**2) / (distance + self._self_distance))

    @cached_property
    def level_S(self) -> Floats:
        """Return S for an offset of 0, which is the base of all changes by an offset."""
        return self.S()

    @cached_property
    def _self_distance(self) -> Floats:
        """Return infinity on the diagonal and 0 elsewhere, (tips, tips), so that no contact acts on itself."""
        return np.where(np.eye(len(self.positions)) > 0.0, math.inf, 0.0)

    @cached_property
    def _between_axes(self) -> Floats:
        """Return the distances between the axes along x and y [mm], (2, tips, tips)."""
        positions = np.array(self.positions).T
        return np.asarray(positions[:, :, None] - positions[:, None])

    def law(self, C: Matrix) -> "RiseLaw":
        """Return the law of these domes on springs with compliance C [mm/N], (tips, tips)."""
        contrast = ContrastLaw(
            weights=self.weights,
            gaps=(0.0,) * len(self.positions),
            C=C,
            S=rows_of(self.S()),
            hertz=hertz_factor(self.relative_radius, self.poisson),
        )
        return RiseLaw(contrast=contrast, rolling=self if self.contrast_sees_saddle else None)


@dataclass(frozen=True, kw_only=True)
class RiseLaw:
    """The contrast of a sensor, and the dependence of its S on the offset.

    `contrast.gaps` [mm] are the known gaps; the offset is the contrast of the unknown ones. `rolling` are the domes
    whose contacts an offset moves, or None if the offset says nothing about the distances of the contacts.
    """

    contrast: ContrastLaw
    rolling: RollingDomes | None = None

    def with_offset(self, offset: float) -> ContrastLaw:
        """Return the contrast law with the S of an offset [mm], which keeps what the body adds to a half-space."""
        if self.rolling is None:
            return self.contrast
        return replace(self.contrast, S=rows_of(self.S(offset)))

    def S(self, offset: float) -> Floats:
        """Return S at an offset [mm], times E [1/mm], (tips, tips)."""
        S = self.contrast.arrays[2]
        if self.rolling is not None:
            S = S.copy()
            _flesh_block(S, self.rolling)[:] += self.rolling.S(offset) - self.rolling.level_S
        return S

    def per_offset(self, offset: float) -> Floats:
        """Return the slope of S, times E, over the offset [1/mm^2], in the shape of S."""
        slope = np.zeros_like(self.contrast.arrays[2])
        if self.rolling is not None:
            change = self.rolling.S(offset + STEP) - self.rolling.S(offset - STEP)
            _flesh_block(slope, self.rolling)[:] = change / (2.0 * STEP)
        return slope

    @property
    def over_time(self) -> "RiseLaw":
        """Return the law for flesh that relaxes, which has two channels per tip: 2 n for n tips.

        The first n channels are the measured forces, which bend the springs. The last n are the forces with which
        elastic flesh would resist the same indentation; they hold the modulus. So the springs act on the first n
        columns, the flesh acts on the last n, and the contrast weights only the last n rows.
        """
        law = self.contrast
        _, C, S = law.arrays
        none = np.zeros_like(C)
        zeros = (0.0,) * len(law.weights)
        contrast = ContrastLaw(
            weights=(*zeros, *law.weights),
            gaps=(*zeros, *law.gaps),
            C=rows_of(np.block([[none, none], [C, none]])),
            S=rows_of(np.block([[none, none], [none, S]])),
            hertz=law.hertz,
        )
        return replace(self, contrast=contrast)


def _flesh_block(S: Floats, rolling: RollingDomes) -> Floats:
    """Return a view of the part of S that belongs to the channels of the flesh, which come last."""
    tips = len(rolling.positions)
    return S[-tips:, -tips:]


@dataclass(frozen=True, kw_only=True, eq=False)
class Rise:
    """The samples of one press that are used: from the touch of the last tip to the deepest sample.

    `forces` (samples, channels) [N] are all above 0. `instrument` (samples,) [N] is the total force some samples
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
        """Return the moments of the forces, from which the coefficients of the law follow."""
        return _Moments(self.rise_and_mean(self.forces), self.rise_and_mean(np.cbrt(self.forces) ** 2))

    def rise_and_mean(self, values: Floats) -> Floats:
        """Return two rows for values (samples, channels): their co-moment with the instrument, and their mean."""
        return np.stack([self._centred_instrument @ values, values.mean(axis=0)])

    @cached_property
    def _centred_instrument(self) -> Floats:
        return np.asarray(self.instrument - self.instrument.mean())

    @property
    def spread(self) -> float:
        """Return the co-moment of the instrument with itself [N^2]."""
        return float(self._centred_instrument @ self._centred_instrument)

    def without(self, first: int, several: int) -> "Rise":
        """Return the press without `several` consecutive samples, starting at sample `first`."""
        left_out = slice(first, first + several)
        kept = [np.delete(values, left_out, axis=0) for values in (self.instrument, self.forces, self.rates)]
        return Rise(instrument=kept[0], forces=kept[1], rates=kept[2], touch=self.touch, largest=self.largest)


class _Moments(NamedTuple):
    """Two rows (2, channels), co-moment with the instrument and mean, for the forces F and for F^(2/3)."""

    F: Floats
    two_thirds: Floats


def rise_of(
    forces: Floats, tips: int, least_forces: Floats | float = 0.0, *, t: Floats | None = None, lag: int = 1
) -> Rise:
    """Select the samples of a press from which its modulus is read: those of the rise to its deepest sample.

    `forces` (samples, channels) [N] begin with the forces of the tips in the first `tips` channels; their sum is the
    instrument. As many channels that were derived from these forces may follow (`RiseLaw.over_time`). The instrument of
    a sample is the sum `lag` samples earlier: 1 for white noise, 2 if the channels were interpolated to one time. A
    sample is used if all forces of the `lag` samples before it exceed `least_forces` (channels,) [N], a multiple of
    their noise, and its own forces are above 0. The times `t` [s] give the rates, which are 0 without them.

    A lift ends a press. The samples after a lift have their own offset, and are read instead if they reach deeper.
    Samples after the deepest one are left out, because the flesh may have yielded.
    """
    index = np.arange(len(forces))
    total = forces[:, :tips].sum(axis=1)
    # index of the last sample up to each one in which a tip does not touch, or -1
    last_lift = np.maximum.accumulate(np.where((forces > least_forces).all(axis=1), -1, index))
    touch_start = np.concatenate([[0], last_lift[:-1] + 1])[: len(forces)]  # first sample since the last lift
    is_usable = (index - touch_start >= lag) & (forces > 0.0).all(axis=1)
    if not is_usable.any():
        none = forces[:0]
        return Rise(instrument=none[:, 0], forces=none, rates=none, touch=0.0, largest=0.0)
    usable_total = np.where(is_usable, total, 0.0)
    # the last one, if a hold repeats the largest force
    deepest = len(usable_total) - 1 - int(usable_total[::-1].argmax())
    begin = int(touch_start[deepest])
    rows = slice(begin + lag, deepest + 1)
    rates = np.zeros_like(forces[rows])
    if t is not None:
        elapsed = np.diff(t, prepend=t[0])[rows, None]
        np.divide(np.diff(forces[begin + lag - 1 : deepest + 1], axis=0), elapsed, out=rates, where=elapsed > 0.0)
    return Rise(
        instrument=total[begin : deepest + 1 - lag],
        forces=forces[rows],
        rates=rates,
        touch=float(total[begin]),
        largest=float(total[deepest]),
    )


class BendSlopes(NamedTuple):
    """Slopes of ln E for a gain or compliance whose relative error e(F) = e_0 + k F changes with the force, (tips,).

    `at_zero` [1] is the slope over e_0, `per_N` [N] the slope over k.
    """

    at_zero: tuple[float, ...]
    per_N: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class RiseSlopes:
    """Relative change of E per unit of each cause of error.

    `noise` (tips,) [1/N] is one standard deviation of E per standard deviation of the force, for noise that is
    independent from sample to sample. All other errors are the same in all samples. Per tip they are the relative
    changes of gain and stiffness [1], and the error of the zero [1/N]. There are also a zero that drifts linearly from
    the first sample to the last [1/N], and a delay of the channel [1/s]. Common to all tips are the relative changes of
    the Hertz term and of S [1], and an offset [1/mm] that is not due to a saddle of the skin.

    `channel_bends` and `spring_bends` are the slopes over the nonlinearity of the gains and of the spring compliances.
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
        """Return the slope over the mean curvature of the skin [mm] under domes of relative radius R* [mm].

        The flesh is a half-space. As 1 / R* = 1 / r + H, h is proportional to R*^(-1/3), and S to 1 + r H.
        """
        return relative_radius * (self.hertz / 3.0 + self.body)


@dataclass(frozen=True, kw_only=True, eq=False)
class UnevenSlopes:
    """Relative change of E per unit of the unevenness of a fruit, which differs from tip to tip.

    `heights` (waves, tips) [1/mm] are slopes over the height of each wave of the skin at the middle of a contact.
    `flesh` (tips,) [1] are slopes over the relative change of the modulus of the flesh under each tip.
    """

    heights: Floats
    flesh: Floats


@dataclass(frozen=True, kw_only=True)
class RiseReading:
    """The result of a press: the modulus E [MPa], and the offset gamma [mm], the contrast of the unknown gaps.

    `noise` [1] is the relative standard uncertainty of E by noise that is independent from sample to sample, and
    `offset_noise` [mm] the standard uncertainty of the offset. `offset_per_log_E` [mm] is the change of the offset per
    change of ln E due to other causes. `touch` [1] is the total force when the last tip touches, relative to the
    largest.
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
    """Read the modulus from the rise of a press, with its uncertainty by noise and its sensitivity to other causes.

    `noises` (tips,) [N] are the standard deviations of the forces, white from sample to sample. A `whole` press must
    rise far enough after the touch of its last tip. A part of a press need not, because its uncertainty shows a small
    rise. Raises RiseError if the press has too few samples or too small a rise, or if no modulus fits it.
    """
    _refuse_few_samples(rise)
    if whole:
        _refuse_short_rise(rise, noises)
    E, offset, S_offset = _solve(law, rise.moments)
    at_root = _Root(law, rise, E, offset, law.S(S_offset), len(noises))
    noise_per_force = np.abs(at_root.of_tips(at_root.by_force)) * math.sqrt(rise.spread) / abs(at_root.per_log_E[0])
    by_noise = float(np.linalg.norm(noise_per_force * noises))
    if by_noise > LARGEST_NOISE:
        message = f"standard uncertainty of E by noise = {by_noise:.2g} E: must be at most a third of E; press farther"
        raise RiseError("no_rise", message)
    residual = float(np.linalg.norm(at_root.of_tips(at_root.by_force) * noises))
    return RiseReading(
        E=E,
        offset=offset,
        noise=by_noise,
        offset_noise=math.hypot(residual / math.sqrt(len(rise.forces)), at_root.per_log_E[1] * by_noise),
        offset_per_log_E=float(at_root.per_log_E[1]),
        samples=len(rise.forces),
        touch=rise.touch / rise.largest,
        slopes=at_root.slopes(noise_per_force),
    )


def rise_modulus(law: RiseLaw, rise: Rise) -> float:
    """Return the modulus [MPa] of a press without noise, as `read_rise` does and with its errors."""
    _refuse_few_samples(rise)
    _refuse_short_rise(rise, np.zeros(1))
    return _solve(law, rise.moments).E


def uneven_slopes(law: RiseLaw, rise: Rise, wave_numbers: Floats, relative_radius: float) -> UnevenSlopes:
    """Return the sensitivity of the modulus of a press to uneven skin and flesh; there is one channel for each tip.

    `wave_numbers` (waves,) are in [1/mm]. The contact of a dome of relative radius R* = `relative_radius` [mm] has the
    radius sqrt(R* d), with d its indentation. For a flat tip pass 0: its whole face touches, so a height is an offset.
    Raises RiseError as `read_rise` does.
    """
    _refuse_few_samples(rise)
    E, offset, S_offset = _solve(law, rise.moments)
    root = _Root(law, rise, E, offset, law.S(S_offset), rise.forces.shape[1])
    weights = law.contrast.arrays[0]
    contact_radius = np.sqrt(relative_radius * law.contrast.hertz * np.cbrt(rise.forces / E) ** 2)
    heights = [weights * rise.rise_and_mean(effective_heights(k, contact_radius)) for k in wave_numbers]
    return UnevenSlopes(
        heights=np.array([root.moved_with_saddle(*each) for each in heights]),
        flesh=root.moved_with_saddle(*root.own_flesh),
    )


def form_slopes(law: RiseLaw, rise: Rise, domes: RollingDomes, cap_radii: Sequence[float]) -> Floats:
    """Return the sensitivity of the modulus of a press to errors of form that all domes have in common.

    The first slope is per relative change of the dome radius [1], the others per height of a cap of each of the
    `cap_radii` [mm] at the apex [1/mm]. The change of the distances between the contacts is computed for a half-space.
    Raises RiseError as `read_rise` does.
    """
    _refuse_few_samples(rise)
    E, offset, S_offset = _solve(law, rise.moments)
    root = _Root(law, rise, E, offset, law.S(S_offset), rise.forces.shape[1])
    relative = domes.relative_radius
    # If the real dome is rounder than in the law, the law is too flat: so the sign is opposite to a change of the law.
    hertz_change = relative / domes.dome_radius / 3.0 * root.hertz
    distance_change = -relative * domes.mean_curvature * root.flesh
    weights = law.contrast.arrays[0]
    contact_radius = np.sqrt(relative * law.contrast.hertz * np.cbrt(rise.forces / E) ** 2)
    cap_changes = [rise.rise_and_mean(effective_cap_height(radius, contact_radius)) @ weights for radius in cap_radii]
    slopes = [root.moved_with_saddle(*change) for change in (hertz_change + distance_change, *cap_changes)]
    return np.array(slopes)


def moduli_without(law: RiseLaw, rise: Rise, several: int = 1) -> Iterator[float]:
    """Yield the modulus [MPa] of a press without each window of `several` consecutive samples, as a jackknife.

    It is nan where the other samples determine no modulus. A press of more than `MOST_LEFT_OUT_EACH` samples yields
    nothing.
    """
    count = len(rise.forces)
    if count > MOST_LEFT_OUT_EACH:
        return
    for first in range(count - several + 1):
        try:
            yield _solve(law, rise.without(first, several).moments).E
        except RiseError:
            yield math.nan


def _refuse_few_samples(rise: Rise) -> None:
    count = len(rise.forces)
    if count < FEWEST:
        hint = "press farther, or more slowly"
        message = f"samples with all tips on the fruit = {count}: must be at least {FEWEST}; {hint}"
        raise RiseError("few_samples", message)


def _refuse_short_rise(rise: Rise, noises: Floats) -> None:
    touch = rise.touch / rise.largest
    if touch > LARGEST_TOUCH_FORCE:
        message = f"the total force when the last tip touches = {touch:.2g} of the largest: must be at most "
        raise RiseError("no_rise", f"{message}{LARGEST_TOUCH_FORCE:g}; press farther, or more level")
    # Standard deviation of a linear rise between these forces. It ignores a hold at the end, which adds no information.
    rises = (rise.largest - rise.touch) / math.sqrt(12.0)
    least = LEAST_RISE * float(np.linalg.norm(noises))
    if not rises > least:
        message = f"rise of the total force = {rises:.2g} N: must be above {least:.2g} N, five times its noise"
        raise RiseError("no_rise", f"{message}; press farther")


class _Solution(NamedTuple):
    """The modulus E [MPa] and the offset [mm] of a press, and `S_offset`, the offset [mm] at which S was evaluated.

    After the last step, `S_offset` and the offset agree within the tolerance.
    """

    E: float
    offset: float
    S_offset: float


def _solve(law: RiseLaw, moments: _Moments) -> _Solution:
    """Solve the two equations of a press for the modulus E and the offset gamma.

    With z = E^(-1/3), the co-moments with the instrument determine z, and the means then determine the offset:

        cov(u, a) + cov(u, b) z^2 + cov(u, d) z^3 = 0,    gamma = -(mean a + mean b z^2 + mean d z^3).

    For domes d depends on the offset, because the offset shifts their contacts and changes S by some per cent. So the
    two equations are solved in turn; each step reduces the error to some per cent. Raises RiseError if no modulus fits
    the press.
    """
    contrast = law.contrast
    weights, C, S = contrast.arrays
    # Springs (a), Hertz's contact (b) and flesh (d), each by its co-moment and its mean.
    rise_rigid, rigid = (moments.F @ (weights @ C)).tolist()
    rise_dome, dome = (contrast.hertz * moments.two_thirds @ weights).tolist()
    rigid += float(np.dot(weights, contrast.gaps))
    offset = 0.0  # the offset at which S below was computed
    for _ in range(MOST_STEPS):
        rise_body, body = (moments.F @ (weights @ S)).tolist()
        try:
            z = smallest_root(rise_rigid, rise_dome, rise_body)  # E^(-1/3)
        except ReadingError as error:
            raise RiseError("out_of_range", str(error)) from error
        new_offset = -(rigid + z * z * (dome + body * z))
        if law.rolling is None or abs(new_offset - offset) <= SETTLED * abs(rigid):
            return _Solution(1.0 / (z * z * z), new_offset, offset)
        offset = new_offset
        S = law.S(offset)
    message = "the forces fit no modulus and offset: must be of a press of this sensor on a fruit; calibrate again"
    raise RiseError("out_of_range", message)


class _Root:
    """The law of a press linearised at its root: the change of ln E due to any cause that adds to the law.

    What a cause adds has shape (2, ...): the increment dG of the co-moment with the instrument, and the increment dM
    [mm] of the mean.
    """

    def __init__(self, law: RiseLaw, rise: Rise, E: float, offset: float, S: Floats, tips: int) -> None:
        """Linearise the law at the modulus E [MPa] and the offset [mm] of a press, with the compliance S there.

        `tips` is the number of tips, each of which may have several channels. Each attribute is the slope of the law
        with respect to one kind of cause, or a factor of such slopes.
        """
        self._weights, self._C, _ = law.contrast.arrays
        self._rise = rise
        self._tips = tips
        z = math.pow(E, -1.0 / 3.0)
        domes = law.contrast.hertz * z**2 * self._weights
        F, two_thirds = rise.moments
        self._inverse_roots = rise.rise_and_mean(1.0 / np.cbrt(rise.forces))
        self._body = self._weights @ (self._C + S * z**3)  # slope over each force [mm/N] without Hertz
        self._dome = domes / 1.5  # slope by Hertz's term, times F^(1/3)
        self.hertz = two_thirds @ domes
        self.flesh = F @ (self._weights @ S) * z**3
        self.per_log_E = (2.0 * self.hertz + 3.0 * self.flesh) / 3.0  # slope over -ln E, as E = z^(-3)
        # A dome indents its own flesh by Hertz's law, which has E^(-2/3); a flat tip does so as its force over E.
        self.own_flesh = self._dome * two_thirds if law.contrast.hertz else self._weights * np.diag(S) * z**3 * F
        self.per_offset = F @ (self._weights @ law.per_offset(offset)) * z**3

    @property
    def by_force(self) -> Floats:
        """Return c_t, the slope of the residual over each force [mm/N], (channels,), at the mean of F^(-1/3)."""
        return np.asarray(self._body + self._dome * self._inverse_roots[1])

    def of_tips(self, of_channels: Floats) -> Floats:
        """Return the sums over the channels of each tip, (..., tips).

        They are slopes over a cause that changes all channels of a tip equally.
        """
        return np.asarray(of_channels.reshape(*of_channels.shape[:-1], -1, self._tips).sum(axis=-2))

    def moved(self, rise: Floats) -> Floats:
        """Return the slopes of ln E over causes that add `rise` to the co-moments of the law, at a constant saddle."""
        return np.asarray(rise / self.per_log_E[0])

    def moved_with_saddle(self, rise: Floats, mean: Floats) -> Floats:
        """Return the slopes of ln E over causes that add `rise` and `mean` to the law, with their effect on the saddle.

        A zero error shifts the offset by up to 4 mm per newton; errors of gains and spring stiffnesses shift it less.
        The law attributes the offset to a saddle of the skin, so it moves S, and S moves the modulus. Let f be the
        change of the rise per mean that is attributed to a saddle. Then ln E moves by (dG - f dM) / (dG / d ln E - f dM
        / d ln E).
        """
        f = self.per_offset[0] / (1.0 + self.per_offset[1])
        return np.asarray((rise - f * mean) / (self.per_log_E[0] - f * self.per_log_E[1]))

    def slopes(self, noise_per_force: Floats) -> RiseSlopes:
        """Return the slopes of ln E with respect to all causes; a spring acts on C as in `contrast_slopes`.

        `noise_per_force` (tips,) [1/N] is copied into the result. Gains, springs and zeros change the offset greatly,
        so their effect on the saddle is included. The effect of the other causes on the saddle is neglected.
        """
        rise = self._rise
        F, two_thirds = rise.moments
        squares = rise.rise_and_mean(rise.forces**2)
        index = np.arange(len(rise.forces))[:, None]
        drift = rise.rise_and_mean(index / (len(index) - 1))[0]  # from 0 at the first sample to 1 at the last
        gains = self.of_tips(self._body * F + self._dome * two_thirds)
        spring_slopes = self._weights @ self._C
        springs = self.of_tips(-0.5 * (self._weights * (F @ self._C.T) + spring_slopes * F))
        zeros = self.of_tips(self._dome * self._inverse_roots[0])
        return RiseSlopes(
            noise=_numbers(noise_per_force),
            gains=_numbers(self.moved_with_saddle(*gains)),
            springs=_numbers(self.moved_with_saddle(*springs)),
            zeros=_numbers(self.moved_with_saddle(zeros, self.of_tips(self.by_force))),
            drifts=_numbers(self.moved(self.of_tips(self.by_force * drift))),
            times=_numbers(self.moved(self.of_tips(self.by_force * rise.rise_and_mean(rise.rates)[0]))),
            hertz=float(self.moved(self.hertz[0])),
            body=float(self.moved(self.flesh[0])),
            offset=float(self.moved(self.per_offset[0])),
            channel_bends=self._bends(gains, self.by_force, F, squares),
            spring_bends=self._bends(springs, -spring_slopes, F, squares),
        )

    def _bends(self, straight: Floats, by_force: Floats, F: Floats, squares: Floats) -> BendSlopes:
        """Return the slopes of ln E for gains or springs whose relative error e_0 + k F changes with the force.

        Such an error adds e_0 F + k F^2 / 2 to a force. `straight` (2, tips) is what a constant error of 1 adds to the
        law, and c = `by_force` (channels,) [mm/N] the slope of the law with respect to a force.
        """
        # A press sees the error at the force where F^2 / 2 has the slope cov(u, F^2) / (2 cov(u, F)). So k adds to the
        # co-moments like a constant error of k times this force, and c k F^2 / 2 to the mean.
        force_rises, square_rises = F[0, : self._tips], squares[0, : self._tips]
        middle_forces = np.divide(
            square_rises, 2.0 * force_rises, out=np.zeros_like(force_rises), where=force_rises != 0.0
        )
        mean = self.of_tips(0.5 * by_force * squares[1])
        return BendSlopes(
            at_zero=_numbers(self.moved_with_saddle(*straight)),
            per_N=_numbers(self.moved_with_saddle(straight[0] * middle_forces, mean)),
        )


def _numbers(values: Floats) -> tuple[float, ...]:
    return tuple(values.tolist())
