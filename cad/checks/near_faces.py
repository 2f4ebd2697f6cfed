"""The least distance of separate bodies, measured only between faces whose bounding boxes are near each other."""

from collections.abc import Mapping

import cadquery as cq
import numpy as np

from sensor.arrays import Floats

PLACE_TOLERANCE_MM = 1e-3  # tolerance of a distance or a wall against its limit
_ROUND_OFF = 1e-9  # [mm] round-off of the gap between two boxes


def nearest_pair(pairs: Mapping[str, tuple[cq.Shape, cq.Shape]]) -> tuple[str, float]:
    """Return the name of the pair of shapes that are nearest to each other, and their least distance [mm].

    The distance is 0 if shapes cross or one lies in the other. The kernel measures pairs of faces in the order of the
    gaps between their boxes. It stops when the next gap exceeds the least distance found, because the faces cannot be
    nearer than their boxes.
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
    """Return whether the first corner of a shape lies in a solid of another."""
    corner = shape.Vertices()[0].Center()
    return any(solid.isInside(corner) for solid in other.Solids())


def _boxes(faces: list[cq.Face]) -> Floats:
    """Return the bounding boxes of faces [mm], (faces, 2, 3): the least and the largest x, y and z."""
    boxes = [face.BoundingBox() for face in faces]
    return np.array([[(box.xmin, box.ymin, box.zmin), (box.xmax, box.ymax, box.zmax)] for box in boxes])


def _gaps(boxes: Floats, others: Floats) -> Floats:
    """Return the gaps between two sets of boxes from `_boxes` [mm], (boxes, others); 0 for boxes that overlap."""
    beyond = np.maximum(others[None, :, 0] - boxes[:, None, 1], boxes[:, None, 0] - others[None, :, 1])
    return np.asarray(np.linalg.norm(np.maximum(beyond, 0.0), axis=2))
