"""Meshes of the fruit, graded to the edges of the tips, in families of three whose error falls at a known rate."""

from collections.abc import Mapping, Sequence

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

# At the edge of a sharp tip u ~ r^1/2, so the energy error is of first order in the element size h there. Away from the
# edge, quadratic elements have an error h^4. So growth and largest size are scaled by h^1/4: both errors are then O(h).
REFINEMENTS = (1.0, 0.5, 0.25)
_EDGE_SIZE = 0.1  # element size at the edge of a tip over the side of the tip, on the coarsest mesh
_GROWTH = 0.5  # growth of the size per distance from an edge, on the coarsest mesh
# Largest size on the coarsest mesh: a third of the shortest side of the block, but at least a sixtieth of the longest.
_ACROSS = 3.0
_ALONG = 60.0


def fruit_block(fruit: Fruit, tips: Tips, mirrors: Sequence[str] = ()) -> Part:
    """Return the block of a fruit [mm], or a half or quarter of it, with the faces base, top, low_tip and high_tip.

    `mirrors` names planes of symmetry, at which the block is cut and which become faces. "symmetry_x" keeps x >= 0,
    without the low tip, and "symmetry_y" keeps y >= 0. Raises InputError if a tip reaches beyond the fruit.
    """
    check_tips_on_fruit(fruit, tips)
    right = 0.5 * fruit.length_mm
    back = 0.5 * fruit.width_mm
    left = 0.0 if "symmetry_x" in mirrors else -right
    front = 0.0 if "symmetry_y" in mirrors else -back
    corner = cq.Vector(left, front, -fruit.height_mm)
    block = cq.Solid.makeBox(right - left, back - front, fruit.height_mm, corner)
    centres = {face: x for face, x in tip_centres(tips).items() if x > left}
    faces = {
        "base": plane_face_test(2, -fruit.height_mm),
        **{plane: MIRROR_PLANES[plane] for plane in mirrors},
        **top_faces(tips, centres, plane_face_test(2, 0.0), NEAR_MM),
    }
    divided = block.split(*(footprint(tips, x) for x in centres.values()))
    return named_part("fruit block", divided, faces)


def tip_centres(tips: Tips) -> dict[str, float]:
    """Return the x coordinate of the centre of each tip [mm], by the name of the face under it."""
    return dict(zip(("low_tip", "high_tip"), tips.centres_mm, strict=True))


def top_faces(tips: Tips, centres: Mapping[str, float], on_top: FaceTest, near: float) -> dict[str, FaceTest]:
    """Return tests that select the faces of the top by name: the face under each tip, and "top" for all others.

    `centres` holds x of each tip [mm] by the name of its face, and `on_top` selects all faces of the top. The bounding
    box of a face may extend beyond its tip by `near` [mm] on each side.
    """
    reach = 0.5 * tips.side_mm + near

    def under_tip(x: float) -> FaceTest:
        def is_under(face: cq.Face) -> bool:
            box = face.BoundingBox()
            return on_top(face) and max(x - box.xmin, box.xmax - x, box.ymax) < reach

        return is_under

    footprints = {name: under_tip(x) for name, x in centres.items()}
    return {"top": lambda face: on_top(face) and not any(test(face) for test in footprints.values()), **footprints}


def solved_block(fruit: Fruit, tips: Tips) -> Part:
    """Return the part of a block to be solved [mm]: the quarter x, y >= 0 for central tips, else the half y >= 0."""
    return fruit_block(fruit, tips, QUARTER if tips.offset_mm == 0.0 else HALF)


def fruit_mesh(part: Part, fruit: Fruit, tips: Tips, scale: float) -> MeshTet1:
    """Return the mesh [mm] of a part of the fruit; `scale` multiplies the coarsest size at the edges of the tips."""
    return volume_mesh(part, fruit_size(part, fruit, tips, scale))


def edge_size(tips: Tips, scale: float) -> float:
    """Return the element size at the edges of the tips [mm]; `scale` is 1 on the coarsest mesh."""
    return _EDGE_SIZE * tips.side_mm * scale


def fruit_size(part: Part, fruit: Fruit, tips: Tips, scale: float) -> SizeField:
    """Return the size field [mm] of one mesh; `scale` multiplies the coarsest size at the edges of the tips."""
    lengths = (fruit.length_mm, fruit.width_mm, fruit.height_mm)
    smooth = scale**0.25
    smallest = edge_size(tips, scale)
    return SizeField(
        smallest_mm=smallest,
        growth=_GROWTH * smooth,
        largest_mm=max(smooth * min(lengths) / _ACROSS, smooth * max(lengths) / _ALONG, smallest),
        faces=tuple(name for name in ("low_tip", "high_tip") if name in part.faces),
        cuts=tuple(name for name in ("symmetry_x", "symmetry_y") if name in part.faces),
    )
