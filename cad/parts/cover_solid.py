"""The cover that closes the frame: a flat plate with a rim, which is printed twice, for the front and for the back.

The cover is drawn as the back cover, behind the face y = depth / 2 of the housing. Rotated by 180 degrees about its
vertical centre line, it becomes the front cover. The rim keeps the plate away from the moving parts.
"""

import cadquery as cq

from cad.parts.cover import COVER_MM, RECESS_MM
from cad.parts.hall_seats import LEDGE_MM, HallSeats
from cad.parts.housing import SETBACK_MM, Housing
from cad.parts.part import FaceTest, Part, is_hole, named_part, plane_face_test

_MARGIN = 1.0  # extension of a cut beyond the cover [mm]


def cover_part(housing: Housing, seats: HallSeats | None = None) -> Part:
    """Return the back cover of a housing as one solid with the faces `rim` and `mounting_holes`.

    With the `seats` of a Hall read-out, the cover also has windows for the sensors. If the cover is mounted on the
    front, the windows are opposite the magnets.
    """
    frame_face = 0.5 * housing.depth  # y of the back of the frame, on which the rim lies
    width = housing.right - housing.left
    height = housing.top_level - housing.cover_level
    corner = cq.Vector(housing.left, frame_face, housing.cover_level)
    plate = cq.Workplane(obj=cq.Solid.makeBox(width, COVER_MM, height, corner))
    plate = plate.cut(cq.Workplane(obj=_draw_recess(housing)))

    # The normal of the workplane "XZ" is -y, so the holes are cut from the outer face to the rim.
    outer_plane = cq.Workplane("XZ", origin=(0.0, frame_face + COVER_MM, 0.0))
    screw_holes = outer_plane.pushPoints(list(housing.holes)).circle(0.5 * housing.hole_diameter)
    plate = plate.cut(screw_holes.extrude(COVER_MM))
    for box in _window_boxes(housing, seats):
        plate = plate.cut(cq.Workplane(obj=box))
    faces: dict[str, FaceTest] = {
        "rim": plane_face_test(1, frame_face),
        "mounting_holes": lambda face: is_hole(face, housing.hole_diameter),
    }
    return named_part("cover", plate.findSolid(), faces)


def _draw_recess(housing: Housing) -> cq.Solid:
    """Return the box that cuts the recess inside the rim of a back cover, where the moving parts of the housing are.

    The recess is open towards the tips. The box extends by RECESS_MM in front of the cover and below it, so that the
    cut leaves no thin layer.
    """
    frame_face = 0.5 * housing.depth
    rim_width = housing.wall_width - SETBACK_MM
    width = housing.right - housing.left
    lower_level = housing.cover_level - RECESS_MM
    corner = cq.Vector(housing.left + rim_width, frame_face - RECESS_MM, lower_level)
    height = housing.cavity_level + SETBACK_MM - lower_level
    return cq.Solid.makeBox(width - 2.0 * rim_width, 2.0 * RECESS_MM, height, corner)


def _window_boxes(housing: Housing, seats: HallSeats | None) -> list[cq.Solid]:
    """Return the boxes that cut the windows into a back cover.

    Each window consists of a pocket from the outside, and of a slot in the bottom of the pocket. The ledges above and
    below the slot hold the sensor. Without a Hall read-out, `seats` is None and there are no windows.
    """
    if seats is None:
        return []
    frame_face = 0.5 * housing.depth
    lower_level = housing.top_level - seats.sensor_level - 0.5 * seats.window_height
    middle = 0.5 * (housing.left + housing.right)
    boxes = []
    for centre in seats.windows:
        # The cover is drawn at the back but is mounted at the front, so the windows are mirrored here.
        left = 2.0 * middle - centre - 0.5 * seats.window_width
        # The pocket begins at the marked face of the sensor, and ends beyond the outer face of the cover.
        pocket_corner = cq.Vector(left, frame_face + seats.face_distance, lower_level)
        pocket_depth = COVER_MM + _MARGIN - seats.face_distance
        boxes.append(cq.Solid.makeBox(seats.window_width, pocket_depth, seats.window_height, pocket_corner))
        # The slot goes through the whole cover.
        slot_corner = cq.Vector(left, frame_face, lower_level + LEDGE_MM)
        slot_height = seats.window_height - 2.0 * LEDGE_MM
        boxes.append(cq.Solid.makeBox(seats.window_width, COVER_MM + _MARGIN, slot_height, slot_corner))
    return boxes
