"""Whether a curve can be a compression test at all: what cannot is refused with its file, line and column."""

import numpy as np
from numpy.typing import NDArray

from cad.quantity import InputError, fault
from pipeline.compression.loading import noise_of
from pipeline.compression.specimens import Specimen

Floats = NDArray[np.float64]

LEAST_ROWS = 12
_JITTER = 0.02  # of the travel: a machine's own reading steps back by less
_BELOW = 0.1  # of the forces' range: a force so far below the first ones is none of a compression
_LOUD = 6.0  # standard deviations of noise
_CONCAVE = 0.75  # slope of the upper half of a load over that of its lower half: a convex fruit has more than 1
_LOWER, _MIDDLE, _UPPER = 0.1, 0.5, 0.9  # of the load
_FIRST = 20  # rows that show where the force begins


def checked_curve(specimen: Specimen, *, compression_negative: bool) -> tuple[Floats, Floats]:
    """Return travel [mm] and force [N], shape (rows,) each, both rising in compression.

    With `compression_negative` signs of columns that fall are turned. Raises InputError for too few rows, time or
    travel that runs backwards, a force below the zero line, one that never rises, and columns that look swapped.
    """
    travel, force = specimen.travel, specimen.force
    if len(travel) < LEAST_ROWS:
        raise fault(_place(specimen), len(travel), "rows", f"at least {LEAST_ROWS}", "export every point of the test")
    if specimen.time is not None:
        _refuse_backwards_time(specimen, specimen.time)
    if compression_negative:
        travel, force = _turned(travel), _turned(force)
    _refuse_wrong_sign(specimen, travel, force)
    _refuse_backwards_travel(specimen, travel, force)
    _refuse_low_force(specimen, force)
    _refuse_concave(specimen, travel, force)
    return travel, force


def _place(specimen: Specimen, row: int | None = None, kind: str = "") -> str:
    """Return where a fault is: file, then line and column, or the specimen."""
    if row is None:
        return f"{specimen.file}, specimen {specimen.name!r}"
    label = dict(specimen.labels.items()).get(kind, kind)  # type: ignore[call-overload]
    return f"{specimen.file}, line {specimen.lines[row]}, column {label!r}"


def _turned(values: Floats) -> Floats:
    moved = values - np.median(values[:3])
    return -values if abs(moved.min()) > abs(moved.max()) else values


def _refuse_backwards_time(specimen: Specimen, time: Floats) -> None:
    back = np.flatnonzero(np.diff(time) < 0.0)
    if back.size:
        row = int(back[0]) + 1
        bound = f"at least that of the row before, {time[row - 1]:g} s"
        raise fault(_place(specimen, row, "time"), float(time[row]), "s", bound, "put the rows in order of time")


def _refuse_wrong_sign(specimen: Specimen, travel: Floats, force: Floats) -> None:
    for kind, unit, values in (("force", "N", force), ("travel", "mm", travel)):
        moved = values - np.median(values[:3])
        row = int(np.argmin(moved))
        if moved[row] < 0.0 and -moved[row] > moved.max():
            remedy = "with --compression-negative its sign is turned"
            raise fault(_place(specimen, row, kind), float(values[row]), unit, "rising in compression", remedy)
    if float(force.max()) == float(force.min()):
        place = _place(specimen, 0, "force")
        raise fault(place, float(force[0]), "N", "a force that rises, and all are this one", "check the load cell")


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
    raise fault(_place(specimen, row, "travel"), float(travel[row]), "mm", bound, remedy)


def _refuse_low_force(specimen: Specimen, force: Floats) -> None:
    zero = float(np.median(force[:_FIRST]))
    limit = max(_BELOW * float(force.max() - zero), _LOUD * noise_of(force))
    row = int(np.argmin(force))
    if force[row] < zero - limit:
        bound = f"not below where the force begins, {zero:.3g} N"
        raise fault(_place(specimen, row, "force"), float(force[row]), "N", bound, "correct it, or leave the row out")


def _refuse_concave(specimen: Specimen, travel: Floats, force: Floats) -> None:
    """Raise InputError where the force rises ever less with the travel, as in a table whose columns are swapped."""
    end = int(np.argmax(force)) + 1
    width = max(1, end // 30)
    smooth = np.convolve(force[:end], np.ones(width) / width, mode="valid")
    places = travel[width // 2 : width // 2 + len(smooth)]
    load = (smooth - smooth.min()) / max(float(smooth.max() - smooth.min()), np.finfo(float).tiny)
    at = [float(places[int(np.argmax(load >= share))]) for share in (_LOWER, _MIDDLE, _UPPER)]
    first, second = at[1] - at[0], at[2] - at[1]
    if first < _CONCAVE * second:
        raise _swapped(specimen)


def _swapped(specimen: Specimen) -> InputError:
    shown = f"{specimen.labels['force']} over {specimen.labels['travel']}"
    bound = "a force that rises ever more with the travel, as on a convex fruit"
    remedy = "swap the names of the columns if they are swapped, or cut the table at the failure"
    return fault(_place(specimen), shown, "", bound, remedy)
