"""The smallest distance between bodies, measured only between faces whose bounding boxes are close to each other."""

from collections.abc import Mapping

import cadquery as cq
import numpy as np

from sensor.arrays import Floats

PLACE_TOLERANCE_MM = 1e-3  # tolerance when a distance or a wall thickness is compared with its limit
_ROUND_OFF_MM = 1e-9  # round-off error of the gap between two boxes


def nearest_pair(pairs: Mapping[str, tuple[cq.Shape, cq.Shape]]) -> tuple[str, float]:
    """Return the name of the pair of shapes that are closest to each other, and the distance [mm] between the two.

    `pairs` holds the two shapes of each pair, keyed by name. The distance is 0 if the shapes intersect or if one lies
    inside the other. The CAD kernel measures pairs of faces in ascending order of the gaps between their bounding
    boxes. The search stops when the next gap exceeds the smallest distance found, because faces cannot be closer to
    each other than their boxes.
    """
    faces = {shape: shape.Faces() for pair in pairs.values() for shape in pair}
    boxes = {shape: _bounding_boxes(shape_faces) for shape, shape_faces in faces.items()}
    nearest_name = ""
    smallest_distance = np.inf
    for name, (first, second) in pairs.items():
        if _starts_inside(first, second) or _starts_inside(second, first):
            return name, 0.0
        first_faces, second_faces = faces[first], faces[second]
        gaps = _box_gaps(boxes[first], boxes[second])  # shape (faces of `first`, faces of `second`)
        for index in np.argsort(gaps, axis=None, kind="stable").tolist():
            row, column = divmod(index, len(second_faces))  # the index counts the gaps row by row
            if gaps[row, column] >= smallest_distance - _ROUND_OFF_MM:
                break
            distance = first_faces[row].distance(second_faces[column])
            if distance < smallest_distance:
                nearest_name, smallest_distance = name, distance
    return nearest_name, float(smallest_distance)


def _starts_inside(shape: cq.Shape, other: cq.Shape) -> bool:
    """Return whether the first vertex of a shape lies inside a solid of another shape.

    If the surfaces of two shapes do not meet, this vertex shows whether the first shape lies inside the other.
    """
    corner = shape.Vertices()[0].Center()
    return any(solid.isInside(corner) for solid in other.Solids())


def _bounding_boxes(faces: list[cq.Face]) -> Floats:
    """Return the bounding boxes of faces [mm], (faces, 2, 3): the smallest and the largest x, y and z."""
    boxes = [face.BoundingBox() for face in faces]
    return np.array([[(box.xmin, box.ymin, box.zmin), (box.xmax, box.ymax, box.zmax)] for box in boxes])


def _box_gaps(boxes: Floats, other_boxes: Floats) -> Floats:
    """Return the gaps [mm] between two sets of bounding boxes, shape (boxes, other boxes).

    The gap between boxes that overlap is 0.
    """
    # Along each axis, the separation of two boxes is negative if their ranges overlap.
    separations = np.maximum(other_boxes[None, :, 0] - boxes[:, None, 1], boxes[:, None, 0] - other_boxes[None, :, 1])
    return np.asarray(np.linalg.norm(np.maximum(separations, 0.0), axis=2))
