"""Whether a curve can be a compression test at all: what cannot is refused with its file, line and column."""

import numpy as np
from numpy.typing import NDArray

from cad.quantity import InputError, validation_error
from pipeline.measure.compression.columns import Kind
from pipeline.measure.compression.loading import Loading, noise_of
from pipeline.measure.compression.specimens import Specimen

Floats = NDArray[np.float64]

LEAST_ROWS = 12
_JITTER = 0.02  # of the travel: a machine's own reading steps back by less
_BELOW = 0.1  # of the forces' range: a force so far below the first ones is none of a compression
_LOUD = 6.0  # standard deviations of noise
_CONCAVE = 0.75  # later slope of a load over the earlier one: a convex fruit has more than 1
_LOAD = (0.1, 0.3, 0.6)  # shares of the load between which the slopes are taken
_FIRST, _FIRST_SHARE = 20, 0.05  # rows, and share of them, that show where the force begins


def checked_curve(specimen: Specimen, *, compression_negative: bool) -> tuple[Floats, Floats]:
    """Return travel [mm] and force [N], shape (rows,) each, both rising in compression.

    With `compression_negative` signs of columns that fall are turned. Raises InputError for too few rows, time or
    travel that runs backwards, a force below the zero line, and one that never rises.
    """
    travel, force = specimen.travel, specimen.force
    _refuse_few(specimen, len(travel))
    if specimen.time is not None:
        _refuse_backwards_time(specimen, specimen.time)
    if compression_negative:
        travel, force = _turned(travel), _turned(force)
    _refuse_wrong_sign(specimen, travel, force)
    _refuse_backwards_travel(specimen, travel, force)
    _refuse_low_force(specimen, force)
    _refuse_few(specimen, int(np.argmax(travel)) + 1)
    return travel, force


def _place(specimen: Specimen, row: int | None = None, kind: Kind = "force") -> str:
    """Return where a fault is: file, then line and column, or the specimen."""
    if row is None:
        return f"{specimen.file}, specimen {specimen.name!r}"
    return f"{specimen.file}, line {specimen.lines[row]}, column {specimen.labels[kind]!r}"


def _refuse_few(specimen: Specimen, rows: int) -> None:
    if rows < LEAST_ROWS:
        raise validation_error(
            _place(specimen), rows, "rows of load", f"at least {LEAST_ROWS}", "export every point of the test"
        )


def _turned(values: Floats) -> Floats:
    moved = values - np.median(values[:3])
    return -values if abs(moved.min()) > abs(moved.max()) else values


def _refuse_backwards_time(specimen: Specimen, time: Floats) -> None:
    back = np.flatnonzero(np.diff(time) < 0.0)
    if back.size:
        row = int(back[0]) + 1
        bound = f"at least that of the row before, {time[row - 1]:g} s"
        raise validation_error(
            _place(specimen, row, "time"), float(time[row]), "s", bound, "put the rows in order of time"
        )


def _refuse_wrong_sign(specimen: Specimen, travel: Floats, force: Floats) -> None:
    checked: tuple[tuple[Kind, str, Floats], ...] = (("force", "N", force), ("travel", "mm", travel))
    for kind, unit, values in checked:
        moved = values - np.median(values[:3])
        row = int(np.argmin(moved))
        if moved[row] < 0.0 and -moved[row] > moved.max():
            remedy = "with --compression-negative its sign is turned"
            raise validation_error(
                _place(specimen, row, kind), float(values[row]), unit, "rising in compression", remedy
            )
        if float(values.max()) == float(values.min()):
            place = _place(specimen, 0, kind)
            raise validation_error(
                place, float(values[0]), unit, "one that rises, and all are alike", "export the whole test"
            )


def _refuse_backwards_travel(specimen: Specimen, travel: Floats, force: Floats) -> None:
    rising = travel[: int(np.argmax(travel)) + 1]
    behind = np.maximum.accumulate(rising) - rising
    limit = _JITTER * float(travel.max() - travel.min())
    back = np.flatnonzero(behind > limit)
    if not back.size:
        return
    if bool((np.diff(force) > 0.0).all()):
        raise _swapped(specimen)
    row = int(back[0])
    bound = "rising up to its largest value: one loading for each table"
    remedy = "cut the table where the plate turns back, or check that the columns are not swapped"
    raise validation_error(_place(specimen, row, "travel"), float(travel[row]), "mm", bound, remedy)


def _refuse_low_force(specimen: Specimen, force: Floats) -> None:
    zero = float(np.median(force[: max(3, min(_FIRST, round(_FIRST_SHARE * len(force))))]))
    limit = max(_BELOW * float(force.max() - zero), _LOUD * noise_of(force))
    row = int(np.argmin(force))
    if force[row] < zero - limit:
        bound = f"not below where the force begins, {zero:.3g} N"
        raise validation_error(
            _place(specimen, row, "force"), float(force[row]), "N", bound, "correct it, or leave the row out"
        )


def refuse_concave(specimen: Specimen, curve: Loading) -> None:
    """Raise InputError where a force rises ever less with the travel, as in a table whose columns are swapped."""
    width = max(1, len(curve.force) // 30)
    smooth = np.convolve(curve.force, np.ones(width) / width, mode="valid")
    places = curve.travel[width // 2 : width // 2 + len(smooth)]
    load = (smooth - smooth.min()) / max(float(smooth.max() - smooth.min()), np.finfo(float).tiny)
    low, middle, high = (float(places[int(np.argmax(load >= share))]) for share in _LOAD)
    slopes = (_LOAD[1] - _LOAD[0]) * (high - middle), (_LOAD[2] - _LOAD[1]) * (middle - low)
    if slopes[1] < _CONCAVE * slopes[0]:
        raise _swapped(specimen)


def _swapped(specimen: Specimen) -> InputError:
    shown = f"{specimen.labels['force']} over {specimen.labels['travel']}"
    bound = "a force that rises ever more with the travel, as on a convex fruit"
    remedy = "swap the names of the columns if they are swapped, or cut the table at the failure"
    return validation_error(_place(specimen), shown, "", bound, remedy)
