"""A mesh of the block that is equivalent to a fruit, both flat and bent into the fruit's shape, under the same loads.

The difference in compliance between the two is the effect of the shape.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from skfem import CellBasis, ElementHex2, MeshHex2

from mesh.cells import cell_jacobian, determinant
from sensor.arrays import Floats, Ints
from sensor.design.fruit import Fruit
from solve.elasticity import vector_basis
from solve.fruit.body_lines import BodySteps, body_lines
from solve.fruit.box import Lines, box_mesh
from solve.fruit.curved_shape import CurvedShape, Plan
from solve.fruit.footprints import Footprint, level_parities, mirror_images
from solve.fruit.remainder import VOLUME_ORDER, Parity, mirror_dofs
from solve.fruit.smooth_load import SmoothLoad, line_fractions
from solve.linear import SolveError

# Factor on the maximum number of dofs if the principal directions of a fruit are rotated, so that it has no mirror
# planes. With this factor, the error is 3e-4, which is within the error bar. A solve takes 4 s on one core.
ROTATED_DOFS_FACTOR = 2
REACH = 3.0  # radius within which a load is significant [standard deviations]


@dataclass(frozen=True, eq=False)
class BentBlock:
    """The displacement bases of a block, `flat`, and of the fruit, `bent`, on the same mesh, and the loads on it.

    The mesh is the box over the grid lines `lines` [mm] along each axis. A load presses against its outward normal in
    `normals`. These are the normals of the skin if tips press along them, as domes do. Otherwise they point upwards.
    `parities` are the symmetry cases about the mirror planes in which the loads are solved (see `level_parities`).
    """

    loads: Sequence[SmoothLoad]
    normals: Sequence[Sequence[float]]
    parities: Sequence[Parity]
    lines: Lines
    flat: CellBasis
    bent: CellBasis

    def fixed_dofs(self, parity: Parity) -> Ints:
        """Return the dofs that the base and the mirror planes fix for a parity, which are the same for both bodies."""
        return np.union1d(self.flat.get_dofs("base").all(), mirror_dofs(self.flat, parity))

    def forces(self, parity: Parity, normals: Sequence[Sequence[float]]) -> Floats:
        """Return the nodal forces [N] of each unit load together with its mirror images, shape (dofs, loads).

        A load presses against its outward normal (3,) in `normals`. In plan, it is the product of two normal
        distributions, along x and along y. Its fraction on a node is therefore a product, too. `parity` holds the signs
        of the mirror images in the planes x = 0 and y = 0. A sign of 0 means that there is no mirror plane.
        """
        forces = np.zeros((self.flat.N, len(self.loads)))
        for component in range(3):  # force components along x, y and z
            top_dofs = self.flat.get_dofs("top").all(f"u^{component + 1}")  # scikit-fem numbers components from 1
            for load_index, load in enumerate(self.loads):
                # Start with the force component of the load, and multiply by its fraction along x and along y.
                nodal_forces = np.full(len(top_dofs), -normals[load_index][component])
                for axis in (0, 1):
                    # The mirror image of the component normal to the plane has the opposite sign.
                    sign = -parity[axis] if axis == component else parity[axis]
                    nodal_forces *= self._fractions(top_dofs, load, axis, sign)
                forces[top_dofs, load_index] = nodal_forces
        return forces

    def _fractions(self, dofs: Ints, load: SmoothLoad, axis: int, sign: int) -> Floats:
        """Return the fraction of a unit load on each of some `dofs` [1], in its distribution along x or y, axis 0 or 1.

        `sign` is the sign of the load's mirror image, or 0 if there is no mirror plane.
        """
        centre = (load.x, load.y)[axis]
        nodes, fractions = line_fractions(self.lines[axis], centre, load.deviation, sign)
        # Each dof is at a node of the line up to round-off, and therefore belongs to the nearest node.
        node_of_dof = np.abs(self.flat.doflocs[axis, dofs, None] - nodes).argmin(axis=1)
        return np.asarray(fractions[node_of_dof])


def bent_block(
    fruit: Fruit, footprints: Sequence[Footprint], loads: Sequence[SmoothLoad], steps: BodySteps, along_normals: bool
) -> BentBlock:
    """Mesh the equivalent block of a fruit twice, flat and bent to the shape of the fruit, under the same loads.

    The block has the plan and the thickness of the fruit. The difference between the two solutions is the effect of the
    shape. Most errors of the mesh cancel in this difference. The mesh ends at the mirror planes that fruit and
    footprints share, and `steps` determines how fine it is. The `loads` replace the footprints. With `along_normals`,
    they press along the normals of the skin. Raises SolveError if an element is folded when the block is bent.
    """
    shape = CurvedShape(fruit, enclosing_core(loads))
    if fruit.is_symmetric:
        mirrored = [bool(images) for images in mirror_images(footprints)]  # at x = 0, and at y = 0
        parities = level_parities(footprints)
    else:  # the fruit is rotated about z, so it has no mirror planes, and the whole block is meshed with more dofs
        mirrored = [False, False]
        parities = [(0, 0)]
        steps = replace(steps, most_dofs=ROTATED_DOFS_FACTOR * steps.most_dofs)
    lines = body_lines(shape, loads, mirrored, steps)
    box = box_mesh(lines)
    mesh = MeshHex2.from_mesh(box).with_boundaries(box.boundaries)
    flat = vector_basis(mesh, ElementHex2(), VOLUME_ORDER)
    is_curved = fruit.radius_mm is not None
    bent = _bent_basis(mesh, shape) if is_curved else flat
    if is_curved and along_normals:
        normals = [shape.normal(load.x, load.y) for load in loads]
    else:
        normals = [(0.0, 0.0, -1.0) for _ in loads]  # upwards, because z points down
    return BentBlock(loads=loads, normals=normals, parities=parities, lines=lines, flat=flat, bent=bent)


def _bent_basis(mesh: MeshHex2, shape: CurvedShape) -> CellBasis:
    """Return the basis on the mesh of a block that is bent into a fruit. Raises SolveError if an element is folded."""
    curved = replace(mesh, doflocs=shape.bend(mesh.doflocs))
    bent = vector_basis(curved, ElementHex2(), VOLUME_ORDER)
    # An element is folded if the Jacobian determinant is negative at one of its quadrature points.
    determinants = determinant(cell_jacobian(curved, bent.quadrature[0]))
    smallest = float((determinants / np.median(determinants)).min())
    if not smallest > 0.0:
        msg = (
            f"curved fruit: volume of a bent element = {smallest:.1g} of the median must be above 0. "
            "Move the tips towards the apex."
        )
        raise SolveError(msg)
    return bent


def enclosing_core(loads: Sequence[SmoothLoad]) -> Plan:
    """Return half the size along x and y [mm] of the rectangle around the apex that contains all loads."""
    x = max(abs(load.x) + REACH * load.deviation for load in loads)
    y = max(abs(load.y) + REACH * load.deviation for load in loads)
    return Plan(x, y)
