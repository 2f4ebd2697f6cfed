"""The part of a force-travel curve that tells a modulus: up to where the flesh fails, or to the end of the load."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_MOST_POINTS = 1200  # more are averaged in groups: a fit takes no longer, and loses nothing
_MOVING_MEAN = 0.02  # of the points
_LOUD = 5.0  # standard errors by which a force has fallen
_FALL = 0.03  # of the largest force: a smaller fall is no failure
_RISEN = 0.1  # of the range of forces: a fall before is one of the zero line
_NORMAL = 1.4826  # standard deviation over median absolute deviation
_QUIET = 0.25  # of the range of forces: the zero line lies below


@dataclass(frozen=True, kw_only=True)
class Loading:
    """A curve up to failure, or to the end of the load: travel [mm] and force [N], shape (points,).

    `zero` [N] is about where the load cell begins, `noise` [N] its standard deviation, `failure` the travel at which
    the force fell [mm], None where it did not.
    """

    travel: Floats
    force: Floats
    zero: float
    noise: float
    failure: float | None


def loading(travel: Floats, force: Floats) -> Loading:
    """Return the loading of a curve, travel [mm] and force [N], shape (rows,) each."""
    end = int(np.argmax(travel)) + 1
    travel, force = _averaged(travel[:end]), _averaged(force[:end])
    noise = noise_of(force)
    broken = _failure(force, noise)
    failure = None if broken is None else float(travel[broken])
    last = len(travel) if broken is None else broken + 1
    return Loading(travel=travel[:last], force=force[:last], zero=_zero(force[:last]), noise=noise, failure=failure)


def noise_of(force: Floats) -> float:
    """Return the standard deviation of the noise of forces (points,) [N].

    Taken from second differences, which a smooth curve hardly has. At least what the last digit hides.
    """
    bend = force[2:] - 2.0 * force[1:-1] + force[:-2]
    spread = _NORMAL * float(np.median(np.abs(bend - np.median(bend)))) / math.sqrt(6.0)
    steps = np.abs(np.diff(force))
    digit = float(steps[steps > 0.0].min()) if bool((steps > 0.0).any()) else 0.0
    return max(spread, digit / math.sqrt(12.0)) if spread < digit else spread


def _averaged(values: Floats) -> Floats:
    group = -(-len(values) // _MOST_POINTS)
    count = len(values) // group
    return np.asarray(values[: count * group].reshape(count, group).mean(axis=1))


def _failure(force: Floats, noise: float) -> int | None:
    """Return the index of the largest force before the first fall that is neither noise nor small; None for none."""
    width = max(1, round(_MOVING_MEAN * len(force)))
    smooth = np.convolve(force, np.ones(width) / width, mode="valid")
    highest = np.maximum.accumulate(smooth)
    span = float(smooth.max() - smooth.min())
    limit = max(_FALL * span, _LOUD * noise * float(np.sqrt(2.0 / width)))
    fallen = np.flatnonzero((highest - smooth > limit) & (highest - smooth[0] > _RISEN * span))
    if not fallen.size:
        return None
    peak = int(np.argmax(smooth[: fallen[0] + 1]))
    return min(peak + width // 2, len(force) - 1)


def _zero(force: Floats) -> float:
    """Return about where the load cell begins [N]: the median of the first points that are low."""
    rising = np.flatnonzero(force > force[0] + _QUIET * (force.max() - force[0]))
    low = force[: max(1, int(rising[0]) // 2)] if rising.size else force[:1]
    return float(np.median(low))
