"""Triangles as pixels: which triangle is in front at each fine pixel, and how fine pixels become those of a picture."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Pixels = NDArray[np.uint8]

FINE = 2
"""Pixels drawn for each pixel kept, each way."""


def frontmost(places: Floats, size: tuple[int, int]) -> tuple[Ints, Floats]:
    """Return for each fine pixel the triangle in front, -1 for none, and its depth, both of shape (rows, columns).

    Places (triangles, 3, 3) are x and y in fine pixels from the upper left, and the depth, larger in front; `size` is
    the width and height of the picture in its own pixels.
    """
    width, height = (FINE * count for count in size)
    pixel, triangle = _covered(places, width, height)
    slope, level = _planes(places)
    x, y = (pixel % width) + 0.5, (pixel // width) + 0.5
    depth = level[triangle] + slope[triangle, 0] * x + slope[triangle, 1] * y
    front, nearest = np.full(width * height, -1), np.full(width * height, -np.inf)
    np.maximum.at(nearest, pixel, depth)
    seen = depth == nearest[pixel]
    front[pixel[seen]] = triangle[seen]
    return front.reshape(height, width), nearest.reshape(height, width)


def _planes(places: Floats) -> tuple[Floats, Floats]:
    """Return the slopes (triangles, 2) and the level (triangles,) of the depth of triangles over the picture."""
    start = places[:, 0]
    normal = np.cross(places[:, 1] - start, places[:, 2] - start)
    upright = np.where(normal[:, 2] == 0.0, 1.0, normal[:, 2])  # one that is seen from its edge covers no pixel
    slope = -normal[:, :2] / upright[:, None]
    return slope, start[:, 2] - (slope * start[:, :2]).sum(axis=1)


def _covered(places: Floats, width: int, height: int) -> tuple[Ints, Ints]:
    """Return every pixel whose middle a triangle covers, and the triangle, line by line."""
    y = places[:, :, 1]
    triangle, row = _runs(*_middles(y.min(axis=1), y.max(axis=1), height))
    line, column = _runs(*_middles(*_ends(places[triangle], np.asarray(row + 0.5, dtype=np.float64)), width))
    return row[line] * width + column, triangle[line]


def _middles(start: Floats, end: Floats, size: int) -> tuple[Ints, Ints]:
    """Return the first pixel whose middle lies beyond each start, and how many lie before the end, within a size."""
    first, last = (np.clip(np.ceil(at - 0.5), 0, size).astype(np.int64) for at in (start, end))
    return first, np.maximum(last - first, 0)


def _runs(first: Ints, count: Ints) -> tuple[Ints, Ints]:
    """Return, for runs of so many numbers from a first one, which run each number is of, and the number."""
    run = np.repeat(np.arange(len(count)), count)
    before = np.cumsum(count) - count
    return run, np.arange(len(run)) - before[run] + first[run]


def _ends(corners: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Return where a level line enters and leaves each triangle; corners (n, 3, 3), y (n,) [pixels]."""
    left, right = np.full(len(y), np.inf), np.full(len(y), -np.inf)
    for start, end in ((0, 1), (1, 2), (2, 0)):
        a, b = corners[:, start], corners[:, end]
        rise = b[:, 1] - a[:, 1]
        share = np.divide(y - a[:, 1], rise, out=np.full(len(y), -1.0), where=rise != 0.0)
        crosses = (share >= 0.0) & (share <= 1.0)
        x = a[:, 0] + share * (b[:, 0] - a[:, 0])
        left[crosses] = np.minimum(left, x)[crosses]
        right[crosses] = np.maximum(right, x)[crosses]
    return left, right


def reduced(shades: Ints, palette: Floats) -> Pixels:
    """Return the pixels of a picture, shape (rows, columns, 4), each the mean of a block of fine ones.

    `shades` (fine rows, fine columns) are rows of a palette (shades, 3) of red, green, blue from 0 to 1; -1 is nothing,
    and weighs nothing in the colour of a pixel.
    """
    # sums in whole numbers: the last row of the palette is nothing, the last column counts what is drawn
    parts = np.zeros((len(palette) + 1, 4), dtype=np.uint16)
    parts[:-1, :3], parts[:-1, 3] = np.round(255.0 * palette), 1
    rows, columns = (FINE * (count // FINE) for count in shades.shape)
    blocks = [shades[i:rows:FINE, j:columns:FINE] for i in range(FINE) for j in range(FINE)]
    total = sum((parts[block] for block in blocks[1:]), start=parts[blocks[0]])
    drawn = total[..., 3]
    total[..., :3] //= np.maximum(drawn, 1)[..., None]
    total[..., 3] = 255 * drawn // len(blocks)
    return total.astype(np.uint8)
