"""Verdicts on values: the table of all verdicts, the record of one verdict, and the function that decides it."""

import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal

from sensor.attributes import with_attributes
from sensor.quantity import Estimate, report_field

Sense = Literal["at most", "at least"]
"""Whether a limit is an upper or a lower bound of the value."""
Group = Literal["target", "print", "solid", "files"]
Level = Literal["contact", "flexures"]
ByTravel = Literal["pressure", "distance", "strain"]

READABLE = "geometry.readable"
_NO_TOLERANCE = "none"


@dataclass(frozen=True, kw_only=True)
class VerdictRow:
    """The properties of a verdict that do not depend on its value.

    The comment at the top of `verdicts.toml` explains the fields.
    """

    name: str
    group: Group
    meaning: str = ""
    formula: str = ""
    source: str = ""
    each: tuple[str, ...] = ()
    sense: Sense | None = None
    limit: float | str | None = None
    unit: str = "1"
    tolerance: float | None = 0.0
    relative: bool = False
    tolerance_with_pins: float = 0.0
    tolerance_of_own_part: float = 0.0
    error_parts: int = 2
    shown: Literal["%"] | None = None
    standard: bool = False
    given: tuple[str, ...] = ()
    level: Level | None = None
    value_level: Level | None = None
    needs: Literal["reading"] | None = None
    by_travel: ByTravel | None = None
    mended_by: tuple[str, ...] = ()
    hint: str = ""
    hint_without_value: str = ""
    key: str | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of all verdicts that this row describes."""
        return self.each or (self.name,)


@cache
def verdict_rows() -> tuple[VerdictRow, ...]:
    """Read the table of verdicts, `verdicts.toml`, and return its rows in the order of the file."""
    rows = []
    text = (Path(__file__).parent / "verdicts.toml").read_text(encoding="utf-8")
    for name, columns in tomllib.loads(text).items():
        # Lists become tuples, because a row is immutable.
        fields: dict[str, Any] = {
            column: tuple(value) if isinstance(value, list) else value for column, value in columns.items()
        }
        if fields.get("tolerance") == _NO_TOLERANCE:  # TOML has no null
            fields["tolerance"] = None
        rows.append(VerdictRow(name=name, **fields))
    return tuple(rows)


@cache
def _rows_by_name() -> dict[str, VerdictRow]:
    """Return the row of each verdict, with the name of the verdict as key."""
    return {name: row for row in verdict_rows() for name in row.names}


def row_of(name: str) -> VerdictRow:
    """Return the row of a verdict in the table of verdicts, or a row of defaults if its name is not in the table."""
    return _rows_by_name().get(name) or VerdictRow(name=name, group="files")


@with_attributes
@dataclass(frozen=True, kw_only=True)
class Verdict:
    """One verdict: a value, its target or limit, and whether the value passed.

    A verdict is undecided if the error bar of the value includes the limit, or if an earlier check failed.

    Examples
    --------
    >>> result = twintip.evaluate(twintip.load_design("paper"))
    >>> K_l = next(one for one in result.verdicts if one.name == "K_l")
    >>> K_l.unit
    'N/m'
    """

    name: str = report_field("", "name of the [verdict](words.md#verdicts)")
    value: float | None = report_field("as in `unit`", "the number that is judged; null if there is no number")
    unit: str = report_field("", 'unit of value, limit and error; "1" for a plain number')
    limit: float | str | None = report_field("as in `unit`", "the target or the limit, a number or a text")
    tolerance: float | str | None = report_field(
        "as in `unit`",
        "largest deviation of the value from the limit; a fraction of the limit if `relative`",
    )
    passed: bool | None = report_field("", "whether the verdict passed; null if the error bar does not decide")
    reference: str = report_field(
        "", "what the value was compared with; why there is no number, or why the verdict did not pass"
    )
    error: float | None = report_field("as in `unit`", "half width of the value's error bar", default=None)
    relative: bool = report_field("", "whether the tolerance is a fraction of the limit", default=False)
    remedy: str | None = report_field(
        "",
        "a change that would make the verdict pass, or the advice to run `pipeline suggest`; null if it "
        "passed or if no hint was computed",
        default=None,
    )

    @property
    def row(self) -> VerdictRow:
        """Return the properties of this verdict from the table of verdicts."""
        return row_of(self.name)

    @property
    def sense(self) -> Sense | None:
        """Return whether the limit is an upper or a lower bound; None for a target, which the value must match."""
        return self.row.sense

    @property
    def allowed_miss(self) -> float:
        """Return the largest distance beyond the limit [unit of the limit] at which a value still passes.

        The distance is 0 if the limit or the tolerance is not a number.
        """
        return _allowed_miss(self.limit, self.tolerance, is_relative=self.relative)

    @property
    def limit_sense(self) -> Sense | None:
        """Return `sense`, or None if the limit is a string."""
        return self.sense if isinstance(self.limit, int | float) else None


def _allowed_miss(limit: float | str | None, tolerance: float | str | None, *, is_relative: bool) -> float:
    """Return the largest distance beyond the limit at which a value still passes, or 0 if there is no such distance.

    A relative tolerance is a fraction of the limit. There is no distance if the limit or the tolerance is no number.
    """
    if not isinstance(limit, int | float) or not isinstance(tolerance, int | float):
        return 0.0
    return tolerance * limit if is_relative else tolerance


def judge(
    name: str,
    value: Estimate | float | None,
    reference: str,
    *,
    limit: float | str | None = None,
    tolerance: float | None = None,
    passed: bool | None = False,
) -> Verdict:
    """Return the verdict `name` on a value, which may be an estimate with an error bar or None.

    By default, `limit` and `tolerance` come from the table of verdicts, in the unit of the verdict. A value must agree
    with a target within the tolerance, or stay on one side of a limit. If the error bar of the value crosses the limit,
    the verdict is undecided. A verdict with a target is undecided if the error bar is wider than the tolerance, unless
    the whole error bar lies outside the tolerance. A value without an error bar is always decided; nan then fails.

    `reference` says what the value was compared with. `passed` is the outcome if the value or the limit is not a
    number. Raises ValueError if the name is not in the table, if there is no limit, or if an estimate has another unit.
    """
    row = _rows_by_name().get(name)
    if row is None:
        msg = f"verdict {name} has no row in sensor/verdicts.toml. Add one."
        raise ValueError(msg)
    limit = row.limit if limit is None else limit
    if limit is None:
        msg = f"verdict {name} must have a limit. Pass one to `judge`, or add it to sensor/verdicts.toml."
        raise ValueError(msg)
    tolerance = row.tolerance if tolerance is None else tolerance
    number, error = _number_and_error(value, row.unit, name)
    if number is not None and not isinstance(limit, str):
        allowed_miss = _allowed_miss(limit, tolerance, is_relative=row.relative)
        passed = _decide(number, error, row.sense, limit, allowed_miss)
    return Verdict(
        name=name,
        value=number,
        unit=row.unit,
        limit=limit,
        tolerance=tolerance,
        passed=passed,
        reference=reference,
        error=error,
        relative=row.relative,
    )


def _number_and_error(value: Estimate | float | None, unit: str, name: str) -> tuple[float | None, float | None]:
    """Return a value as a number, and the half width of its error bar; each is None if there is none.

    Raises ValueError if an estimate for the verdict `name` has a different unit from `unit`.
    """
    if not isinstance(value, Estimate):
        return None if value is None else float(value), None
    if value.unit != unit:
        msg = f"verdict {name}: the value in {value.unit} must be in {unit}, its unit in sensor/verdicts.toml"
        raise ValueError(msg)
    return float(value.value), value.error


def _decide(value: float, error: float | None, sense: Sense | None, limit: float, allowed_miss: float) -> bool | None:
    """Return whether a value satisfies its limit, or None if the error bar prevents a decision.

    `error` is the half width of the error bar, or None. `sense` is None if the limit is a target, which the value must
    match. `allowed_miss` is the distance beyond the limit, or from the target, at which the value still passes. For a
    target, an error bar whose half width is at most this distance is ignored.
    """
    if sense is None:
        distance = abs(value - limit)
        if error is not None and error > allowed_miss:
            # The value cannot pass, because such an error bar always reaches beyond the tolerance. The value fails if
            # its whole error bar lies beyond the tolerance.
            return False if distance > allowed_miss + error else None
        return distance <= allowed_miss
    # The margin is the distance of the value from the limit with its tolerance, positive on the allowed side.
    margin = limit + allowed_miss - value if sense == "at most" else value - (limit - allowed_miss)
    if error is not None and not abs(margin) >= error:  # also if the margin is nan
        return None
    return margin >= 0.0


def all_passed(verdicts: Iterable[Verdict]) -> bool | None:
    """Return the combined outcome of verdicts: False if any failed, otherwise None if any is undecided, otherwise True.

    Without verdicts the outcome is True.
    """
    outcomes = {verdict.passed for verdict in verdicts}
    if False in outcomes:
        return False
    return None if None in outcomes else True
