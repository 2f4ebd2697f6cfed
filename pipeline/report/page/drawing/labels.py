"""Labels beside lines and points of a plot, moved so that none covers another and none leaves the panel."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import isotonic_regression

from pipeline.report.page.drawing.panel import Panel, Words
from pipeline.report.page.drawing.scale import Floats

_ROW = 11.0  # [pt] from one label to the next


def write_beside(panel: Panel, x: ArrayLike, y: ArrayLike, texts: Sequence[str], words: Sequence[Words]) -> None:
    """Write a text beside each place (n,) on the scales of a panel, at least a row from the next; inner ones may go.

    Where there are more labels than rows, as many as there are rows are written: the outermost, and some between them.
    """
    box = panel.box
    places = panel.places(x, y)
    rise = box.top + box.height - places[:, 1]
    rows = int(box.height / _ROW)
    ascending = np.argsort(rise, kind="stable")
    written = ascending[_spread_out(len(ascending), rows)]
    levels = apart(rise[written], _ROW, 0.5 * _ROW, box.height - 0.5 * _ROW)
    for place, level in zip(written.tolist(), levels.tolist(), strict=True):
        panel.write_at(texts[place], float(places[place, 0]), box.top + box.height - level, words[place])


def _spread_out(count: int, most: int) -> NDArray[np.int64]:
    """Return so many of the first numbers, evenly between the first and the last of them."""
    return np.round(np.linspace(0.0, count - 1.0, min(count, most))).astype(np.int64)


def apart(places: Floats, step: float, low: float, high: float) -> Floats:
    """Return ascending places (n,) moved as little as may be so that neighbours are a step apart, all from low to high.

    The ends are n - 1 steps apart or more. The places less so many steps each only have to ascend, which is isotonic
    regression.
    """
    count = len(places)
    steps = step * np.arange(count)
    free = isotonic_regression(places - steps).x if count else places
    return np.asarray(np.clip(free, low, high - step * (count - 1)) + steps)
