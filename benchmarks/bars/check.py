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

REFERENCE_BYTES = 10.0 * 2**30  # memory limit for factorising a reference; the largest needs 6.3 GiB
WIDEST_ERROR = 0.1  # largest relative error bar that is still useful
REFUSALS = (InputError, MeshError, SolveError)


@dataclass(frozen=True, kw_only=True)
class ReferenceCheck:
    """A value and a reference, each with its error bar, all in the same unit.

    `source` is the origin of the reference. If the reference computation raised an error, `reference` is None, and
    `source` is the reason. An error bar wider than `widest` [1] is useless, and therefore wrong.
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
        """Return the error bar divided by the value [1]; infinite for a value of 0."""
        return self.error / abs(self.value) if self.value else math.inf

    @property
    def excess(self) -> float:
        """Return the deviation from the reference, divided by the sum of both error bars [1].

        A value with an excess above 1 is wrong.
        """
        if self.reference is None:
            return 0.0
        allowed = self.error + self.reference_error
        return abs(self.value - self.reference) / allowed if allowed > 0.0 else math.inf

    @property
    def is_wrong(self) -> bool:
        """Return whether the value is wrong: outside the error bars, nan, or without a useful error bar."""
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

    `relative_errors` are the error bars of the values, relative to the values [1]. A reference without errors is exact.
    A reference without values could not be computed, and its checks have no reference either.
    """
    true_values = reference.values or (None,) * len(names)
    true_errors = reference.errors or (0.0,) * len(names)
    checks = []
    for name, value, relative_error, true_value, true_error in zip(
        names, values, relative_errors, true_values, true_errors, strict=True
    ):
        check = ReferenceCheck(
            name=name,
            value=float(value),
            error=relative_error * abs(float(value)),
            reference=true_value,
            reference_error=true_error,
            source=reference.source,
        )
        checks.append(check)
    return tuple(checks)


def try_reference(compute: Callable[[], Reference]) -> Reference:
    """Return the result of a reference computation, which may use more memory than the product allows for a solve.

    If the computation raises one of `REFUSALS`, the reference has no values, and its source is the reason. The memory
    limit of the product is restored afterwards.
    """
    try:
        with patch.object(solve.linear, "MOST_BYTES", REFERENCE_BYTES):
            return compute()
    except REFUSALS as refusal:
        return Reference(values=(), errors=(), source=f"the reference refused: {refusal}")


def case_outcome(work: Callable[[], Sequence[ReferenceCheck]], answerable: bool) -> Outcome:
    """Run the checks of a case, and return its outcome.

    `work` computes the checks. If the case is `answerable`, it must not raise an error. Otherwise it may raise one of
    `REFUSALS` with a message of one line that names a bound. All other exceptions propagate, and warnings become
    errors.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", DeprecationWarning)
            checks = work()
    except REFUSALS as refusal:
        reason = str(refusal)
        # A clear message is one line with a bound, which follows "must". A MeshError names a measured quantity instead.
        is_clear = "\n" not in reason and ("must" in reason or isinstance(refusal, MeshError))
        is_allowed = is_clear and not answerable
        return Outcome("refused" if is_allowed else "WRONG", reason)
    # The worst check determines the outcome: a wrong one, else one without a reference, else the largest deviation.
    worst = max(checks, key=lambda check: (check.is_wrong, check.reference is None, check.excess))
    if worst.is_wrong:
        return Outcome("WRONG", worst.source, worst)
    return Outcome("no reference" if worst.reference is None else "right", worst.source, worst)
