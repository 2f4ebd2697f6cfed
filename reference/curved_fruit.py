"""Half of a curved fruit as a CAD part, for comparison with a program that meshes and presses it."""

import cadquery as cq

from cad.parts.fruit import whole_fruit
from cad.parts.part import Part, named_part, plane_face_test
from reference.fruit_meshes import MIRROR_PLANES, tip_centres, top_faces
from sensor.design.fruit import Fruit
from sensor.design.tips import Tips

NEAR_BOX_MM = 1e-3  # margin by which the kernel's bounding box of a curved face exceeds the face


def is_curved(face: cq.Face) -> bool:
    """Return whether a face is curved, and therefore part of the skin."""
    return face.geomType() != "PLANE"


def curved_half(fruit: Fruit, tips: Tips) -> Part:
    """Return the half y >= 0 of the fruit [mm], with the faces base, top, low_tip, high_tip and symmetry_y.

    The top is the curved skin outside the tips, whose apex is at z = 0.
    """
    whole = whole_fruit(fruit, tips)
    size = whole.BoundingBox().DiagonalLength  # large enough for a box that contains the half
    half = whole.intersect(cq.Solid.makeBox(2.0 * size, size, 2.0 * size, cq.Vector(-size, 0.0, -size)))
    planes = {"base": plane_face_test(2, -fruit.depth_mm), "symmetry_y": MIRROR_PLANES["symmetry_y"]}
    skin = top_faces(tips, tip_centres(tips), is_curved, NEAR_BOX_MM)
    return named_part("half of a curved fruit", half, {**planes, **skin})
