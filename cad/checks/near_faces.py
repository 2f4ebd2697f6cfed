"""The least distance of bodies that stand apart, from the few pairs of faces whose boxes are near each other."""

from collections.abc import Mapping

import cadquery as cq
import numpy as np

from sensor.arrays import Floats

PLACE_TOLERANCE_MM = 1e-3  # of a distance or a wall that a limit bounds
_ROUND_OFF = 1e-9  # [mm] of a box: a pair that is farther apart by this can be no nearer


def nearest_pair(pairs: Mapping[str, tuple[cq.Shape, cq.Shape]]) -> tuple[str, float]:
    """Return the name of the pair of shapes that stand nearest to each other, and their least distance [mm].

    It is 0 where shapes cross or one lies in the other. Pairs of faces are measured from those whose boxes are nearest
    on, until the next boxes are farther apart than the least distance of all so far. So the kernel measures every pair
    that might count, whichever is nearest.
    """
    faces = {shape: shape.Faces() for pair in pairs.values() for shape in pair}
    boxes = {shape: _boxes(of_shape) for shape, of_shape in faces.items()}
    nearest = ""
    least = np.inf
    for name, (first, second) in pairs.items():
        if _lies_in(first, second) or _lies_in(second, first):
            return name, 0.0
        gaps = _gaps(boxes[first], boxes[second])
        for pair in np.argsort(gaps, axis=None, kind="stable").tolist():
            i, j = divmod(pair, len(faces[second]))
            if gaps[i, j] >= least - _ROUND_OFF:
                break
            distance = faces[first][i].distance(faces[second][j])
            if distance < least:
                nearest, least = name, distance
    return nearest, float(least)


def _lies_in(shape: cq.Shape, other: cq.Shape) -> bool:
    """Say whether a corner of a shape lies in a solid of another."""
    corner = shape.Vertices()[0].Center()
    return any(solid.isInside(corner) for solid in other.Solids())


def _boxes(faces: list[cq.Face]) -> Floats:
    """Return the least and the largest x, y and z of faces [mm], shape (faces, 2, 3)."""
    boxes = [face.BoundingBox() for face in faces]
    return np.array([[(box.xmin, box.ymin, box.zmin), (box.xmax, box.ymax, box.zmax)] for box in boxes])


def _gaps(boxes: Floats, others: Floats) -> Floats:
    """Return the distances between boxes, both as `_boxes` gives them, shape (boxes, others) [mm]."""
    beyond = np.maximum(others[None, :, 0] - boxes[:, None, 1], boxes[:, None, 0] - others[None, :, 1])
    return np.asarray(np.linalg.norm(np.maximum(beyond, 0.0), axis=2))
