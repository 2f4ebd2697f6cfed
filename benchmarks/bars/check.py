"""Values of the product, each with its error bar, held against a reference; and how a hard case ends."""

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

REFERENCE_BYTES = 10.0 * 2**30  # for one factor of a reference; the largest takes 6.3 GiB
WIDEST_ERROR = 0.1  # of the value: beyond, the answer tells nothing
REFUSALS = (InputError, MeshError, SolveError)


@dataclass(frozen=True, kw_only=True)
class ReferenceCheck:
    """A value with its error bar and a reference with its own, all in one unit; `source` says who judges.

    `reference` is None if the computation that should judge refused; `source` is then the reason. An error bar wider
    than `widest` [1] counts as no answer.
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
        """Return the distance to the reference over what both error bars allow [1]: more than 1 is wrong."""
        if self.reference is None:
            return 0.0
        allowed = self.error + self.reference_error
        return abs(self.value - self.reference) / allowed if allowed > 0.0 else math.inf

    @property
    def wrong(self) -> bool:
        """Say whether the value is off, or has no bar that tells anything; nan is wrong too."""
        return not (0.0 < self.relative_error <= self.widest and self.excess <= 1.0)


@dataclass(frozen=True)
class Outcome:
    """How a case ended: right, refused, no reference or WRONG, who judged or why not, and the check that says so."""

    verdict: str
    reason: str
    check: ReferenceCheck | None = None


def checks(
    names: Sequence[str], values: Iterable[float], relative_errors: Sequence[float], reference: Reference
) -> tuple[ReferenceCheck, ...]:
    """Return a check of each value of the product, in the unit of the reference; error bars are relative [1]."""
    trues = reference.values or (None,) * len(names)
    uncertainties = reference.errors or (0.0,) * len(names)
    every = []
    for name, value, error, true, uncertainty in zip(names, values, relative_errors, trues, uncertainties, strict=True):
        every.append(
            ReferenceCheck(
                name=name,
                value=float(value),
                error=error * abs(float(value)),
                reference=true,
                reference_error=uncertainty,
                source=reference.source,
            )
        )
    return tuple(every)


def attempted(compute: Callable[[], Reference]) -> Reference:
    """Return the reference of a computation; one without values, with the reason, where it refuses.

    It may take more memory than a solve of the product.
    """
    try:
        with patch.object(solve.linear, "MOST_BYTES", REFERENCE_BYTES):
            return compute()
    except REFUSALS as refusal:
        return Reference(values=(), errors=(), source=f"the reference refused: {refusal}")


def ending(work: Callable[[], Sequence[ReferenceCheck]], answerable: bool) -> Outcome:
    """Return how a case ends; a refusal must be one line that names a bound, and none where an answer is promised.

    A warning is raised, as are all errors that are no refusal.
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
