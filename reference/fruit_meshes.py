"""Meshes of the fruit, refined at the edges of the tips.

The meshes come in families of three, whose errors decrease at a known rate.
"""

from collections.abc import Mapping, Sequence
from functools import partial

import cadquery as cq
from skfem import MeshTet1

from cad.parts.fruit import footprint
from cad.parts.part import NEAR_MM, FaceTest, Part, named_part, plane_face_test
from mesh.volume import SizeField, volume_mesh
from sensor.design.fruit import Fruit
from sensor.design.tips import Tips, check_tips_on_fruit

HALF = ("symmetry_y",)
QUARTER = ("symmetry_x", "symmetry_y")
MIRROR_PLANES = {"symmetry_x": plane_face_test(0, 0.0), "symmetry_y": plane_face_test(1, 0.0)}

# At the edge of a sharp tip, u ~ r^1/2, so the energy error there is of first order in the element size h. Away from
# the edge, the error of quadratic elements is of fourth order in the element size. The growth and the largest size are
# therefore proportional to h^1/4, so that both errors are O(h).
REFINEMENTS = (1.0, 0.5, 0.25)
# The following sizes apply to the coarsest mesh.
_EDGE_SIZE_RATIO = 0.1  # ratio of the element size at the edge of a tip to the side of the tip
_GROWTH = 0.5  # growth of the size with distance from an edge [mm per mm]
# The largest size is a third of the shortest side of the block, but at least a sixtieth of the longest side.
_MIN_ELEMENTS_ACROSS = 3.0
_MAX_ELEMENTS_ALONG = 60.0


def fruit_block(fruit: Fruit, tips: Tips, mirrors: Sequence[str] = ()) -> Part:
    """Return the block of a fruit [mm], or a half or a quarter of it, with the faces base, top, low_tip and high_tip.

    `mirrors` names the planes of symmetry at which the block is cut, and which become named faces. With "symmetry_x",
    the half x >= 0 remains, which does not have the low tip. With "symmetry_y", the half y >= 0 remains. Raises
    InputError if a tip extends beyond the fruit. The top of the block is at z = 0, and its centre at x = y = 0.
    """
    check_tips_on_fruit(fruit, tips)
    right = 0.5 * fruit.length_mm
    back = 0.5 * fruit.width_mm
    left = 0.0 if "symmetry_x" in mirrors else -right
    front = 0.0 if "symmetry_y" in mirrors else -back
    corner = cq.Vector(left, front, -fruit.height_mm)
    block = cq.Solid.makeBox(right - left, back - front, fruit.height_mm, corner)
    centres = {face: x for face, x in tip_centres(tips).items() if x > left}  # the tips on this part of the block
    faces = {
        "base": plane_face_test(2, -fruit.height_mm),
        **{plane: MIRROR_PLANES[plane] for plane in mirrors},
        **top_faces(tips, centres, plane_face_test(2, 0.0), NEAR_MM),
    }
    divided = block.split(*(footprint(tips, x) for x in centres.values()))  # so that each tip has its own face
    return named_part("fruit block", divided, faces)


def tip_centres(tips: Tips) -> dict[str, float]:
    """Return the x coordinate of the centre of each tip [mm], by the name of the face under the tip."""
    return dict(zip(("low_tip", "high_tip"), tips.centres_mm, strict=True))


def top_faces(tips: Tips, centres: Mapping[str, float], on_top: FaceTest, near: float) -> dict[str, FaceTest]:
    """Return tests that select the faces of the top by name: the face under each tip, and "top" for all other faces.

    `centres` holds the x coordinate of each tip [mm] by the name of its face, and `on_top` selects all faces of the
    top. The bounding box of a face may extend beyond its tip by `near` [mm] on each side.
    """
    half_width = 0.5 * tips.side_mm + near

    def is_under_tip(x: float, face: cq.Face) -> bool:
        """Return whether a face is under the tip whose centre is at x [mm] and y = 0."""
        box = face.BoundingBox()
        return on_top(face) and max(x - box.xmin, box.xmax - x, box.ymax) < half_width

    def is_beside_tips(face: cq.Face) -> bool:
        """Return whether a face belongs to the top, but is not under a tip."""
        return on_top(face) and not any(is_under_tip(x, face) for x in centres.values())

    return {"top": is_beside_tips, **{name: partial(is_under_tip, x) for name, x in centres.items()}}


def solved_block(fruit: Fruit, tips: Tips) -> Part:
    """Return the part of a block that is solved [mm].

    The solved part is the quarter x, y >= 0 if the tips are centred on the block, and the half y >= 0 if they are not.
    """
    return fruit_block(fruit, tips, QUARTER if tips.offset_mm == 0.0 else HALF)


def fruit_mesh(part: Part, fruit: Fruit, tips: Tips, scale: float) -> MeshTet1:
    """Return the mesh [mm] of a part of the fruit. `scale` is 1 for the coarsest mesh."""
    return volume_mesh(part, fruit_size(part, fruit, tips, scale))


def edge_size(tips: Tips, scale: float) -> float:
    """Return the element size at the edges of the tips [mm]. `scale` is 1 for the coarsest mesh."""
    return _EDGE_SIZE_RATIO * tips.side_mm * scale


def fruit_size(part: Part, fruit: Fruit, tips: Tips, scale: float) -> SizeField:
    """Return the element sizes of one mesh: small at the edges of the tips, and increasing away from them.

    `scale` [1] is the relative element size at the edges of the tips, 1 for the coarsest mesh. `part` is the part of
    the block that is meshed. The sizes refer to the tips and the planes of symmetry on this part.
    """
    lengths = (fruit.length_mm, fruit.width_mm, fruit.height_mm)
    # Away from the edges, the error is of fourth order in the size, so this scale makes it proportional to `scale`.
    smooth_scale = scale**0.25
    smallest = edge_size(tips, scale)
    # Small enough for the shortest side, but without needlessly many elements along the longest side.
    size_across = smooth_scale * min(lengths) / _MIN_ELEMENTS_ACROSS
    size_along = smooth_scale * max(lengths) / _MAX_ELEMENTS_ALONG
    return SizeField(
        smallest_mm=smallest,
        growth=_GROWTH * smooth_scale,
        largest_mm=max(size_across, size_along, smallest),
        faces=tuple(name for name in ("low_tip", "high_tip") if name in part.faces),
        cuts=tuple(name for name in ("symmetry_x", "symmetry_y") if name in part.faces),
    )
