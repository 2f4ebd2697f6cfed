"""Comparison of the product's values and error bars with references, and the outcome of a hard case."""

import math
import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from unittest.mock import patch

import solve.linear
from benchmarks.harness import Reference
from mesh.session import MeshError
from sensor.quantity import InputError
from solve.linear import SolveError

REFERENCE_BYTES = 10.0 * 2**30  # memory limit of the factorisation of a reference; the largest takes 6.3 GiB
WIDEST_ERROR = 0.1  # widest useful error bar over its value
REFUSALS = (InputError, MeshError, SolveError)


@dataclass(frozen=True, kw_only=True)
class ReferenceCheck:
    """A value with its error bar, and a reference with its own, all in one unit; `source` names the reference.

    `reference` is None if the reference computation refused; `source` is then the reason. An error bar wider than
    `widest` [1] is useless, and therefore wrong.
    """

    name: str
    value: float
    error: float
    reference: float | None
    reference_error: float
    source: str
    widest: float = WIDEST_ERROR

    @property
    def relative_error(self) -> float:
        """Return the error bar over the value [1]; infinite for a value of 0."""
        return self.error / abs(self.value) if self.value else math.inf

    @property
    def excess(self) -> float:
        """Return the deviation from the reference over the sum of both error bars [1]; more than 1 is wrong."""
        if self.reference is None:
            return 0.0
        allowed = self.error + self.reference_error
        return abs(self.value - self.reference) / allowed if allowed > 0.0 else math.inf

    @property
    def wrong(self) -> bool:
        """Return whether the value is outside the error bars, is nan, or has no error bar or one that is too wide."""
        return not (0.0 < self.relative_error <= self.widest and self.excess <= 1.0)


@dataclass(frozen=True)
class Outcome:
    """The outcome of a case: right, refused, no reference or WRONG, with its reason and the worst check."""

    verdict: str
    reason: str
    check: ReferenceCheck | None = None


def make_checks(
    names: Sequence[str], values: Iterable[float], relative_errors: Sequence[float], reference: Reference
) -> tuple[ReferenceCheck, ...]:
    """Return a check for each value of the product, in the unit of the reference.

    `relative_errors` are the error bars of the values, over the values [1].
    """
    truths = reference.values or (None,) * len(names)
    uncertainties = reference.errors or (0.0,) * len(names)
    every = []
    rows = zip(names, values, relative_errors, truths, uncertainties, strict=True)
    for name, value, error, truth, uncertainty in rows:
        every.append(
            ReferenceCheck(
                name=name,
                value=float(value),
                error=error * abs(float(value)),
                reference=truth,
                reference_error=uncertainty,
                source=reference.source,
            )
        )
    return tuple(every)


def try_reference(compute: Callable[[], Reference]) -> Reference:
    """Return the result of a reference computation, which may use more memory than a solve of the product.

    If the computation raises one of `REFUSALS`, the reference has no values, and its source is the reason.
    """
    try:
        with patch.object(solve.linear, "MOST_BYTES", REFERENCE_BYTES):
            return compute()
    except REFUSALS as refusal:
        return Reference(values=(), errors=(), source=f"the reference refused: {refusal}")


def case_outcome(work: Callable[[], Sequence[ReferenceCheck]], answerable: bool) -> Outcome:
    """Return the outcome of a case; a case that is `answerable` must not raise an error.

    Other cases may raise one of `REFUSALS` with one line that names a bound. All other errors are passed on, and
    warnings are raised as errors.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", DeprecationWarning)
            every = work()
    except REFUSALS as refusal:
        reason = str(refusal)
        is_clear = "\n" not in reason and ("must" in reason or isinstance(refusal, MeshError))
        return Outcome("refused" if is_clear and not answerable else "WRONG", reason)
    worst = max(every, key=lambda check: (check.wrong, check.reference is None, check.excess))
    verdict = "right" if worst.reference is not None else "no reference"
    return Outcome("WRONG" if worst.wrong else verdict, worst.source, worst)
