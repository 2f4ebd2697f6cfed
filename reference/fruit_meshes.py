"""Meshes of the fruit graded to the edges of the tips, three in a family whose error falls at a known rate."""

from skfem import MeshTet1

from cad.parts.fruit import HALF, QUARTER, fruit_block
from cad.parts.part import Part
from mesh.volume import SizeField, volume_mesh
from sensor.design.fruit import Fruit
from sensor.design.tips import Tips

# Under a sharp tip u ~ r^1/2, so the energy error is first order in the size h at the edge; away from it
# quadratic elements give h^4. Growth and largest size scaled with h^1/4 let both fall together, at rate 1 in h.
REFINEMENTS = (1.0, 0.5, 0.25)
_EDGE_SIZE = 0.1  # of the side of a tip, on the coarsest mesh
_GROWTH = 0.5  # of the size with the distance from an edge, on the coarsest mesh
# Largest size on the coarsest mesh: a third of the shortest side of the block, but at least a sixtieth of the longest.
_ACROSS = 3.0
_ALONG = 60.0


def solved_block(fruit: Fruit, tips: Tips) -> Part:
    """Return the part of a block that is solved [mm]: the quarter x, y >= 0 under central tips, else y >= 0."""
    return fruit_block(fruit, tips, QUARTER if tips.offset_mm == 0.0 else HALF)


def fruit_meshes(fruit: Fruit, tips: Tips) -> tuple[MeshTet1, ...]:
    """Return three meshes [mm], coarse to fine: of the quarter when the tips are central, else of the half y >= 0.

    Raises MeshError when a mesh cannot be made, InputError when a tip stands beyond the fruit.
    """
    part = solved_block(fruit, tips)
    return tuple(fruit_mesh(part, fruit, tips, scale) for scale in REFINEMENTS)


def fruit_mesh(part: Part, fruit: Fruit, tips: Tips, scale: float) -> MeshTet1:
    """Return the mesh [mm] of one part of the fruit; `scale` times the coarsest size at the edges of the tips."""
    return volume_mesh(part, fruit_size(part, fruit, tips, scale))


def edge_size(tips: Tips, scale: float) -> float:
    """Return the element size at the edges of the tips [mm]."""
    return _EDGE_SIZE * tips.side_mm * scale


def fruit_size(part: Part, fruit: Fruit, tips: Tips, scale: float) -> SizeField:
    """Return the size field [mm] of one mesh: `scale` times the family's coarsest size at the edges of the tips."""
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
