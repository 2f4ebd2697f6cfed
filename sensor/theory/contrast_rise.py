"""The modulus from the rise of the contrast during one press, whatever the shape of the fruit and the pose.

**The law.** In every sample of a press the contrast of the tips (`contrast_law.py`) is

    a + b z^2 + d z^3 + gamma = 0,    a = w.(C F),  b = h w.F^(2/3),  d = w.(S F),  z = E^(-1/3),

with weights w whose contrast of any travel and tilt is 0. The offset gamma [mm] is the contrast of the gaps under the
tips. It holds all that the sensor cannot know: the saddle of the skin, the heights and places of the tips, their mount.
It is unknown, and the same in all samples of one press. A reading of the forces at one moment takes it for known.

**A pair.** Its weights (-1, 1) drop the travel alone, so its tilt must not change during the press. Its gamma is by how
much the low tip travels farther than the high one. Of flat tips, b = 0, a plotted against d is a line of slope -1/E.

**The estimator.** An instrument u is any quantity that rises with the press; here it is the total force, of an earlier
sample. Its covariance with the law has no gamma:

    G(z) = cov(u, a) + cov(u, b) z^2 + cov(u, d) z^3 = 0,

the same cubic as of one sample, with covariances for a, b and d. Its smallest root z above 0 gives E = 1 / z^3.

**No bias by noise.** The instrument of a sample is the sum of all forces in the sample before. Where noise is white
from sample to sample, u and F are then independent, and cov(u, F) has the mean that it has without noise. The sample's
own sum would not do: its noise is part of F (errors in variables). A sample counts where the sample before has all tips
on the fruit. If it were chosen by its own forces, samples whose noise is upwards would count more often. What is left
is of second order. F^(2/3) of a noisy force has another mean, which leaves E some 0.2 % high at a noise of 0.5 % of
full scale.

Channels that were brought to one time by interpolation share the noise of two neighbours. The instrument is then the
total force two samples earlier. Summed over many samples, interpolated noise has the variance of white noise, so the
standard uncertainty of E is the same.

**Least variance.** Tips on springs have one contrast that travel and tilt leave alone, so w is given. What is free is
how samples count. With independent noises sigma_t of the forces, the residual r of a sample has the variance

    s^2 = sum_t c_t^2 sigma_t^2,    c_t = dr/dF_t = (w C)_t + 2/3 h w_t z^2 F_t^(-1/3) + (w S)_t z^3 .

Nothing is known of the path of the true forces. So a sample tells of z and gamma by its residual r alone, the left side
of the law. The information on z is sum (q - mean q)^2 / s^2 with q = dr/dz = 2 b z + 3 d z^2, means weighted by 1 /
s^2. Its inverse is the Cramer-Rao bound of the variance of z. Where s is constant, an instrument u leaves the variance
s^2 var(u) / n / (dG/dz)^2. By the inequality of Cauchy and Schwarz it is least for u = q / s^2, and it is larger by 1 /
corr(u, q)^2 for another u. Both q and the total force rise together: their correlation is above 0.98, so the total
force comes within some per cent of the bound.

**What E moves by.** A cause that changes the law by dG moves ln E by 3 dG / (z dG/dz). For an error that is the same in
every sample, dG follows from the covariances that are kept. A change of u moves nothing to first order, as G = 0 for
all u.

**Time.** A channel whose time is off by dt has a force that is off by dt dF/dt. Its part of dG is the covariance of u
with that, c_t dt cov(u, dF_t/dt). It is nothing in a steady press, and the more the faster a press slows to its end. So
the covariance of u with the increments of each force is kept, each over the time that it took.

**The saddle.** Domes roll on the skin, so their contacts are nearer to each other than their axes, the more the skin is
curved. The offset tells the saddle, and the saddle the distances of the contacts: S becomes S(gamma), and the cubic is
solved anew until gamma rests. An error of a tip's height is mistaken for a saddle there. It moves E through S alone,
by `RiseSlopes.offset` per mm.

**One bad sample.** It moves E by its residual times how far its instrument is off the mean, the more the fewer the
samples are. The moduli without each one tell by how much, of whatever kind it is: the jackknife, J. W. Tukey, Ann.
Math. Stat. 29 (1958) 614. So the first samples of a press are kept.

Of all others only means and co-moments are kept, each from its mean. A press of any length needs the same memory, and
single precision is enough. W. A. Fuller, Measurement Error Models (1987), section 1.4, is on instruments. Noise that is
not white, as behind a filter, must be thinned out before. mm, N, MPa.
"""

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sensor.arrays import Floats, rows_of
from sensor.theory.contrast_law import ContrastLaw, ContrastTerms, Matrix, Place, ReadingError, smallest_root
from sensor.theory.hertz import hertz_factor

FEWEST = 5  # samples with all tips on the fruit, below which a covariance means nothing
LARGEST_TOUCH_FORCE = 0.7  # of the whole force: where the last tip touches later, too little of a rise is left
LEAST_RISE = 5.0  # of the instrument over its noise, which then costs less than four per cent of the information
LARGEST_NOISE = 1.0 / 3.0  # of E: beyond, the root of the cubic scatters too far for its slope
LARGEST_BY_TIME = 0.02  # of E, one standard deviation: a standard uncertainty of 5 % becomes 5.4 % by it
SETTLED = 1e-12  # relative change at which the offset has settled: round-off
MOST_LEFT_OUT_EACH = 32  # samples of a press whose moduli without each are told: of more a single one moves E little
MOST_STEPS = 50  # of the offset, each of which leaves some per cent of the error of the one before
STEP = 1e-4  # of an offset [mm], for its slope

Samples = NDArray[np.floating[Any]]


class RiseError(ReadingError):
    """A press that gives no modulus, with the flag that says why: few_samples, no_rise or out_of_range."""

    def __init__(self, flag: str, message: str) -> None:
        super().__init__(message)
        self.flag = flag


@dataclass(frozen=True, kw_only=True)
class RollingDomes:
    """Domes of one radius [mm] that roll on a half-space under a skin of a mean curvature [1/mm] and a saddle k_xy.

    `positions` (tips, 2) [mm] are those of their axes. On a skin of curvatures k a dome at X touches at (1 + r k)^-1 X.
    """

    positions: tuple[Place, ...]
    weights: tuple[float, ...]
    dome_radius: float
    mean_curvature: float
    poisson: float

    @cached_property
    def rolling_factor(self) -> float:
        """Return 1 + r H, by which domes stand farther from each other than their contacts on a ball [1]."""
        return 1.0 + self.dome_radius * self.mean_curvature

    @property
    def relative_radius(self) -> float:
        """Return R* of 1 / R* = 1 / r + H [mm]."""
        return self.dome_radius / self.rolling_factor

    @property
    def contrast_sees_saddle(self) -> bool:
        """Say whether the contrast holds the saddle k_xy: that of a square does; a line holds k_xx and k_yy alone."""
        return abs(self.contrast_of_xy) > SETTLED * float(np.abs(self.positions).max()) ** 2

    @cached_property
    def contrast_of_xy(self) -> float:
        """Return the contrast of x y under the axes [mm^2]."""
        return float(np.dot(self.weights, np.prod(self.positions, axis=1)))

    def saddle(self, offset: float) -> float:
        """Return the saddle k_xy of the skin [1/mm] under which the gaps have this contrast, `offset` [mm].

        Domes that roll on a saddle have the gaps g x y, with g = k_xy / (c^2 - (r k_xy)^2) and c = 1 + r H. The root
        that is 0 with g is k_xy = 2 g c^2 / (1 + sqrt(1 + (2 r g c)^2)), a form in which no digits cancel.
        """
        gap_per_xy = offset / self.contrast_of_xy
        return (
            2.0
            * gap_per_xy
            * self.rolling_factor**2
            / (1.0 + math.hypot(1.0, 2.0 * self.dome_radius * gap_per_xy * self.rolling_factor))
        )

    def S(self, offset: float = 0.0) -> Floats:
        """Return the compliance between the contacts, times E [1/mm], (tips, tips), on a saddle of an offset [mm].

        Feet are the positions by the inverse of [[c, r k_xy], [r k_xy, c]].
        """
        along = self.rolling_factor
        across = self.dome_radius * (self.saddle(offset) if offset else 0.0)
        x, y = self._apart
        apart = np.hypot(along * x - across * y, along * y - across * x)
        return np.asarray((1.0 - self.poisson**2) / math.pi * (along**2 - across**2) / (apart + self._of_itself))

    @cached_property
    def level_S(self) -> Floats:
        """Return S without an offset, which every step to an offset starts from."""
        return self.S()

    @cached_property
    def _of_itself(self) -> Floats:
        """Return infinity where a contact would be its own neighbour, else 0, (tips, tips)."""
        return np.where(np.eye(len(self.positions)) > 0.0, math.inf, 0.0)

    @cached_property
    def _apart(self) -> Floats:
        """Return how far the axes stand from each other along x and y [mm], (2, tips, tips)."""
        positions = np.array(self.positions).T
        return np.asarray(positions[:, :, None] - positions[:, None])

    def law(self, C: Matrix) -> "RiseLaw":
        """Return the law of these domes on springs of a compliance C [mm/N], (tips, tips)."""
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
    """The contrast of a sensor, and how its S changes with the offset.

    `contrast.gaps` [mm] are those that are known; the offset is what their contrast lacks. `rolling` are the domes by
    which an offset moves the contacts; None where it tells nothing of their distances.
    """

    contrast: ContrastLaw
    rolling: RollingDomes | None = None

    def with_offset(self, offset: float) -> ContrastLaw:
        """Return the contrast law with the S of an offset [mm]: what the body adds to a half-space stays."""
        if self.rolling is None:
            return self.contrast
        return replace(self.contrast, S=rows_of(self.S(offset)))

    def S(self, offset: float) -> Floats:
        """Return the S of an offset [mm], (tips, tips), times E [1/mm]."""
        S = self.contrast.arrays[2]
        if self.rolling is not None:
            S = S.copy()
            _of_flesh(S, self.rolling)[:] += self.rolling.S(offset) - self.rolling.level_S
        return S

    def per_offset(self, offset: float) -> Floats:
        """Return the slope of S, times E, over the offset [1/mm^2], of the shape of S."""
        slope = np.zeros_like(self.contrast.arrays[2])
        if self.rolling is not None:
            change = self.rolling.S(offset + STEP) - self.rolling.S(offset - STEP)
            _of_flesh(slope, self.rolling)[:] = change / (2.0 * STEP)
        return slope

    @property
    def over_time(self) -> "RiseLaw":
        """Return the law of flesh that relaxes, which has two channels for each tip: 2 n for n tips.

        The first n are the forces of the tips, which bend the springs. The last n are the forces with which elastic
        flesh would answer the same indentation, which tell of the flesh. The contrast is that of the last n rows.
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


def _of_flesh(S: Floats, rolling: RollingDomes) -> Floats:
    """Return the part of S, a view, that belongs to the channels of the flesh: the last ones."""
    tips = len(rolling.positions)
    return S[-tips:, -tips:]


@dataclass(frozen=True)
class RiseSums:
    """Samples of a press as means and as co-moments with the instrument u, in a memory that does not grow.

    Rows of `means` and `with_instrument` (5, tips) are the forces F [N], F^(2/3), F^(-1/3), the rates dF/dt at which
    the forces rise [N/s], and F^2. `spread` [N^2] is the co-moment of u with itself, `with_count` [N] that with the
    number of the sample. Co-moments are sums over samples of products of what both differ by from their means.
    """

    count: int = 0
    instrument: float = 0.0
    spread: float = 0.0
    with_count: float = 0.0
    means: Samples = field(default_factory=lambda: np.zeros((5, 1)))
    with_instrument: Samples = field(default_factory=lambda: np.zeros((5, 1)))

    def with_sample(self, instrument: float, forces: Samples, rates: Samples) -> "RiseSums":
        """Return the sums with one sample more: its instrument [N] and its forces [N], (tips,), each above 0.

        `rates` (tips,) [N/s] are those at which the forces rise, 0 where that is not asked.
        Sums are kept in the precision of the forces. Means and co-moments are brought up to date one sample at a time:
        B. P. Welford, Technometrics 4 (1962) 419. A co-moment grows by the step of u from its old mean, times the step
        of the other quantity from its new one.
        """
        roots = np.cbrt(forces)
        values = np.array([forces, roots * roots, 1.0 / roots, rates, forces * forces], dtype=forces.dtype)
        count = self.count + 1
        step = instrument - self.instrument
        mean = self.instrument + step / count
        before = self.means.astype(forces.dtype, copy=False)
        means = before + (values - before) / forces.dtype.type(count)
        return RiseSums(
            count=count,
            instrument=mean,
            spread=self.spread + step * (instrument - mean),
            # Samples are numbered from 0: the number of this one is self.count, and the mean of all numbers half of it.
            with_count=self.with_count + step * 0.5 * self.count,
            means=means,
            with_instrument=self.with_instrument.astype(forces.dtype, copy=False) + step * (values - means),
        )


class BendSlopes(NamedTuple):
    """Slopes of ln E over the error of a slope that changes with the force F of its tip, e(F) = e_0 + k F, (tips,).

    `at_zero` [1] is over e_0, `per_N` [N] over k.
    """

    at_zero: tuple[float, ...]
    per_N: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class RiseSlopes:
    """By which fraction of E a reading moves with the causes of its error.

    `noise` is that of noise in each force which is independent from sample to sample, one standard deviation [1/N].
    All others are the same in all samples. Per tip they are the relative changes of gain and stiffness [1], and a zero
    that is off [1/N]. Then a zero that drifts evenly from the first sample to the last [1/N], and a time of its channel
    that is later than told [1/s]. Alike for all tips: relative change of the Hertz term and of S [1], and an offset
    that is no saddle of the skin [1/mm].

    `channel_bends` and `spring_bends` are those over lines that bend, of gains and of the compliances of springs.
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
        """Return the slope per change of the mean curvature of the skin [mm] under domes of R* [mm] on a half-space.

        1 / R* = 1 / r + H: h is proportional to R*^(-1/3), S to 1 + r H.
        """
        return relative_radius * (self.hertz / 3.0 + self.body)


@dataclass(frozen=True, kw_only=True)
class RiseReading:
    """What a press tells: the modulus E [MPa], and the offset gamma [mm], the contrast of gaps that is not in the law.

    `noise` [1] is the standard uncertainty of E, relative, by noise that is independent from sample to sample.
    `offset_noise` [mm] is that of the offset, `offset_per_log_E` [mm] by how much it moves with ln E where other causes
    move E. `touch` [1] is the whole force where the last tip touches over the largest.
    """

    E: float
    offset: float
    noise: float
    offset_noise: float
    offset_per_log_E: float
    samples: int
    touch: float
    slopes: RiseSlopes


class RisingPress:
    """One press, sample by sample, up to the deepest one; after it flesh may have yielded.

    `noises` (tips,) [N] are the standard deviations of the forces, white from sample to sample. The instrument is that
    of the sample before, or of as many before as the `lag` says: 2 where channels were brought to one time. A sample
    counts where every force of the samples up to there is above `least_forces` (channels,) [N], some times its noise.
    Its own must be above 0.

    The channels are the forces of the tips, of which the instrument is made. Behind them there may be as many again
    that are made from the same forces (`RiseLaw.over_time`).
    """

    def __init__(self, law: RiseLaw, noises: Floats, least_forces: Floats | float = 0.0, *, lag: int = 1) -> None:
        """Begin a press."""
        self._law = law
        self._noises = noises
        self._least = least_forces
        # Since all tips touched: the sums, the total force [N] at which the last of them did, and the first samples.
        self._sums = RiseSums()
        self._touch = 0.0
        self._first: list[tuple[float, Samples, Samples]] = []
        # The same up to the deepest sample, which has the largest total force [N].
        self._to_deepest = RiseSums()
        self._touch_of_deepest = 0.0
        self._first_of_deepest = self._first
        self._largest = 0.0
        self.deepest: Samples | None = None
        # Total forces [N] of the samples before, the oldest of which is the instrument; forces of the last one.
        self._before: deque[float] = deque(maxlen=lag)
        self._forces_before: Samples = np.zeros(1)

    def add(self, forces: Samples, elapsed: float | None = None) -> None:
        """Take the channels of the next sample [N], (channels,), and the time elapsed since the one before [s].

        Without times the reading has no slopes over the times of channels. A lift ends a press: what comes after it
        has an offset of its own, and is read if it goes deeper.
        """
        total = forces[: len(self._noises)].sum()
        if len(self._before) == self._before.maxlen and forces.min() > 0.0:
            self._count(total, forces, elapsed)
        self._forces_before = forces
        all_touch = (forces > self._least).all()
        if all_touch:
            self._before.append(total)
        else:
            self._before.clear()
            self._sums = RiseSums()

    def _count(self, total: float, forces: Samples, elapsed: float | None) -> None:
        """Add a sample to the sums; `total` is the sum of the tips' forces [N], `elapsed` as in `add` [s]."""
        instrument = self._before[0]
        if self._sums.count == 0:
            self._touch = instrument
            self._first = []
        rates = (forces - self._forces_before) / elapsed if elapsed else 0.0 * forces
        self._sums = self._sums.with_sample(instrument, forces, rates)
        if len(self._first) <= MOST_LEFT_OUT_EACH:
            self._first.append((instrument, forces, rates))
        if total >= self._largest:
            self._largest = total
            self._to_deepest = self._sums
            self._first_of_deepest = self._first
            self._touch_of_deepest = self._touch
            self.deepest = forces

    def reading(self, *, whole: bool = True) -> RiseReading:
        """Return the reading of the press; raises RiseError.

        A `whole` press has to rise far enough after its last tip touched. What is read of a part of one need not: its
        uncertainty tells how far it rose.
        """
        touch = self._checked_touch(whole=whole)
        return replace(rise_reading(self._law, self._to_deepest, self._noises), touch=touch)

    def modulus(self) -> float:
        """Return the modulus [MPa] of a whole press alone, as `reading` has it without noise; raises RiseError."""
        self._checked_touch(whole=True)
        return _solve(self._law, self._to_deepest).E

    def _checked_touch(self, *, whole: bool) -> float:
        """Return the whole force where the last tip touches over the largest [1]; raises RiseError as `reading`."""
        count = self._to_deepest.count
        touch = float(self._touch_of_deepest / self._largest) if self._largest > 0.0 else 1.0
        if count < FEWEST:
            hint = "press farther, or more slowly"
            message = f"samples with all tips on the fruit = {count}: must be at least {FEWEST}; {hint}"
            raise RiseError("few_samples", message)
        if whole:
            self._refuse_short_rise(touch)
        return touch

    def moduli_without(self, several: int = 1) -> Iterator[float]:
        """Yield the modulus of a press [MPa] without each `several` samples in a row, nan where it has none.

        A press of more than `MOST_LEFT_OUT_EACH` samples yields none.
        """
        count = self._to_deepest.count
        if count > MOST_LEFT_OUT_EACH:
            return
        for start in range(count - several + 1):
            sums = RiseSums()
            for sample in (*self._first_of_deepest[:start], *self._first_of_deepest[start + several : count]):
                sums = sums.with_sample(*sample)
            try:
                yield _solve(self._law, sums).E
            except RiseError:
                yield math.nan

    def _refuse_short_rise(self, touch: float) -> None:
        if touch > LARGEST_TOUCH_FORCE:
            message = f"the whole force where the last tip touches = {touch:.2g} of the largest: must be at most "
            raise RiseError("no_rise", f"{message}{LARGEST_TOUCH_FORCE:g}; press farther, or more level")
        # The standard deviation of an even rise: a hold at the end, which adds nothing, does not count against it.
        rise = float(self._largest - self._touch_of_deepest) / math.sqrt(12.0)
        least = LEAST_RISE * float(np.linalg.norm(self._noises))
        if not rise > least:
            message = f"rise of the whole force = {rise:.2g} N: must be above {least:.2g} N, five times its noise"
            raise RiseError("no_rise", f"{message}; press farther")


def rise_reading(law: RiseLaw, sums: RiseSums, noises: Floats) -> RiseReading:
    """Return the reading of the sums over a press, its `touch` nan: sums do not tell when the last tip touched.

    `noises` (tips,) [N] are the standard deviations of the forces. Raises RiseError where no modulus belongs to the
    sums, or where noise leaves too much of it open.
    """
    E, offset, of_S = _solve(law, sums)
    S = law.S(of_S)
    at_root = _SlopesAtRoot(law.contrast, S, sums, E, len(noises))
    by_noise = float(np.linalg.norm(at_root.noise_per_force * noises))
    if by_noise > LARGEST_NOISE:
        message = f"standard uncertainty of E by noise = {by_noise:.2g} of it: must be at most a third; press farther"
        raise RiseError("no_rise", message)
    per_tip = at_root.per_tip()
    S_per_offset = law.per_offset(offset)
    zeros = at_root.with_saddle(per_tip.zeros, at_root.of_tips(at_root.by_force), S_per_offset)
    return RiseReading(
        E=E,
        offset=offset,
        noise=by_noise,
        offset_noise=math.hypot(at_root.residual(noises) / math.sqrt(sums.count), at_root.mean_per_log_E * by_noise),
        offset_per_log_E=at_root.mean_per_log_E,
        samples=sums.count,
        touch=math.nan,
        slopes=RiseSlopes(
            noise=tuple(at_root.noise_per_force.tolist()),
            gains=tuple(per_tip.gains.tolist()),
            springs=tuple(per_tip.springs.tolist()),
            zeros=tuple(zeros.tolist()),
            drifts=tuple(per_tip.drifts.tolist()),
            times=tuple(per_tip.times.tolist()),
            hertz=at_root.per_hertz,
            body=at_root.per_S(S),
            offset=at_root.per_S(S_per_offset),
            channel_bends=at_root.bends(per_tip.gains, at_root.by_force, S_per_offset),
            spring_bends=at_root.bends(per_tip.springs, at_root.by_deflection, S_per_offset),
        ),
    )


class _Solution(NamedTuple):
    """The modulus E [MPa] and the offset [mm] of a press, and the offset [mm] of the S that gave both."""

    E: float
    offset: float
    of_S: float


def _solve(law: RiseLaw, sums: RiseSums) -> _Solution:
    """Return the solution of both equations of a press: that of the co-moments gives E, that of the means the offset.

    Only domes need more than one step. Their offset changes S by some per cent, and S changes the offset. Each step
    reduces the error to that fraction. Raises RiseError.
    """
    weights, _, S = law.contrast.arrays
    rise_rigid, rise_dome, _ = _terms(law.contrast, S, sums.with_instrument)
    rigid, dome, _ = _terms(law.contrast, S, sums.means)
    rise_F, mean_F = (moments[0].astype(np.float64) for moments in (sums.with_instrument, sums.means))
    known_gaps = float(np.dot(law.contrast.weights, law.contrast.gaps))
    offset = 0.0  # that S belongs to
    for _ in range(MOST_STEPS):
        of_S = weights @ S
        try:
            z = smallest_root(rise_rigid, rise_dome, float(of_S @ rise_F))  # E^(-1/3)
        except ReadingError as error:
            raise RiseError("out_of_range", str(error)) from error
        found = -(rigid + known_gaps + z * z * (dome + float(of_S @ mean_F) * z))
        if law.rolling is None or abs(found - offset) <= SETTLED * abs(rigid):
            return _Solution(1.0 / (z * z * z), found, offset)
        offset = found
        S = law.S(offset)
    message = "the offset of the contrast does not settle: must be a press of this sensor on a fruit; calibrate it anew"
    raise RiseError("out_of_range", message)


def _terms(contrast: ContrastLaw, S: Floats, moments: Samples) -> ContrastTerms:
    """Return the terms of the contrast with an S, without its gaps, of means or co-moments (5, tips) of `RiseSums`."""
    weights, C, _ = contrast.arrays
    F = moments[0].astype(np.float64)
    return ContrastTerms(
        rigid=float(weights @ C @ F),
        dome=float(contrast.hertz * weights @ moments[1]),
        body=float(weights @ S @ F),
    )


class _TipSlopes(NamedTuple):
    """Slopes of ln E over the causes of each tip, (tips,) each; units as in `RiseSlopes`."""

    gains: Floats
    springs: Floats
    zeros: Floats
    drifts: Floats
    times: Floats


class _SlopesAtRoot:
    """The slopes of ln E at the root of the cubic of a press: by how much each cause of an error moves the modulus.

    A cause that changes the co-moments of the law by dG moves ln E by dG / `_dG_per_log_E`.
    """

    def __init__(self, contrast: ContrastLaw, S: Floats, sums: RiseSums, E: float, tips: int) -> None:
        """Take the law, its S at the offset, the sums and the modulus [MPa] of a press.

        `tips` of them may have several channels each.
        """
        self._weights, self._C, _ = contrast.arrays
        self._S = S
        self._tips = tips
        self._sums = sums
        moments = sums.with_instrument.astype(np.float64)
        self._F, self._two_thirds, self._inverse_roots, self._rates, self._squares = moments
        self._z = math.pow(E, -1.0 / 3.0)
        self._dome = contrast.hertz * self._z**2 * self._weights
        _, dome, body = _terms(contrast, S, sums.with_instrument)
        self._hertz = dome * self._z**2
        # z dG/dz / 3, since E = z^(-3)
        self._dG_per_log_E = (2.0 * self._hertz + 3.0 * body * self._z**3) / 3.0
        _, mean_dome, mean_body = _terms(contrast, S, sums.means)
        # The same of the means: by how much the offset moves with ln E [mm].
        self.mean_per_log_E = (2.0 * mean_dome * self._z**2 + 3.0 * mean_body * self._z**3) / 3.0

    @property
    def per_hertz(self) -> float:
        """Return d ln E / d ln h [1]."""
        return self._hertz / self._dG_per_log_E

    def bends(self, slopes: Floats, by_force: Floats, per_offset: Floats) -> BendSlopes:
        """Return the slopes over lines that bend, of those over straight ones, (tips,).

        A slope that is off by e_0 + k F adds e_0 F + k F^2 / 2 to a force. The press sees e at the force at which F^2
        has the slope cov(u, F^2) / cov(u, F). The law is moved by c = `by_force` [mm/N], (channels,).
        """
        rises, squares = self._F[: self._tips], self._squares[: self._tips]
        middles = np.divide(squares, 2.0 * rises, out=np.zeros_like(rises), where=rises != 0.0)
        forces, *_, of_squares = self._sums.means
        return BendSlopes(
            at_zero=tuple(self.with_saddle(slopes, self.of_tips(by_force * forces), per_offset).tolist()),
            per_N=tuple(
                self.with_saddle(slopes * middles, self.of_tips(0.5 * by_force * of_squares), per_offset).tolist()
            ),
        )

    def per_S(self, change: Floats) -> float:
        """Return the change of ln E [1] with a `change` of S, (channels, channels) [1/mm]."""
        return float(self._weights @ change @ self._F) * self._z**3 / self._dG_per_log_E

    def per_tip(self) -> _TipSlopes:
        """Return the slopes of ln E over the causes of each tip; springs count as in `contrast_slopes`."""
        of_springs = self._weights @ self._C
        of_fruit = self._weights @ self._S * self._z**3
        gains = (of_springs + of_fruit) * self._F + self._dome / 1.5 * self._two_thirds
        springs = -0.5 * (self._weights * (self._C @ self._F) + of_springs * self._F)
        zeros = self._dome / 1.5 * self._inverse_roots
        drifts = self.by_force * self._sums.with_count / (self._sums.count - 1)
        times = self.by_force * self._rates
        return _TipSlopes(
            *(self.of_tips(slopes) / self._dG_per_log_E for slopes in (gains, springs, zeros, drifts, times))
        )

    def of_tips(self, of_channels: Floats) -> Floats:
        """Return slopes over what moves all channels of a tip alike, (tips,), from those over each channel."""
        return np.asarray(of_channels.reshape(-1, self._tips).sum(axis=0))

    def with_saddle(self, slopes: Floats, means: Floats, per_offset: Floats) -> Floats:
        """Return the slopes of ln E over a cause of each tip, (tips,), with what the offset adds that they move.

        The cause moves the mean of the law by `means` [mm]. A zero that is off moves the offset by up to 4 mm/N. The
        law takes the offset for a saddle of the skin. So it moves S by `per_offset`, and S moves the modulus. Zeros and
        bends do so; the other causes move the offset less than the modulus.

        With x the slope of the offset over the cause, ln E moves by slopes + by_offset x. The offset is minus the mean
        of the law, so x = mean_per_log_E (slopes + by_offset x) - means + by_S x: solved here for x.
        """
        by_offset = self.per_S(per_offset)
        by_S = -float(self._weights @ per_offset @ self._sums.means[0]) * self._z**3
        offset_slopes = (self.mean_per_log_E * slopes - means) / (1.0 - by_S - self.mean_per_log_E * by_offset)
        return np.asarray(slopes + by_offset * offset_slopes)

    @property
    def by_deflection(self) -> Floats:
        """Return the slope of the residual over each force [mm/N], (channels,), of which a spring sinks too little."""
        return np.asarray(-self._weights @ self._C)

    @cached_property
    def by_force(self) -> Floats:
        """Return c_t, the slope of the residual over each force [mm/N], (tips,), at the mean of F^(-1/3)."""
        by_body = self._weights @ (self._C + self._S * self._z**3)
        return np.asarray(by_body + self._dome / 1.5 * self._sums.means[2])

    def residual(self, noises: Floats) -> float:
        """Return s, the standard deviation of the residual of a sample [mm]."""
        return float(np.linalg.norm(self.of_tips(self.by_force) * noises))

    @cached_property
    def noise_per_force(self) -> Floats:
        """Return the relative standard uncertainty of E per noise of each force [1/N], (tips,)."""
        by_force = np.abs(self.of_tips(self.by_force))
        return np.asarray(by_force * math.sqrt(self._sums.spread) / abs(self._dG_per_log_E))
