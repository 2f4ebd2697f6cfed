"""One mesh of the block of a fruit, flat and bent into the fruit, under the same smooth loads."""

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
from solve.fruit.smooth_load import SmoothLoad, line_forces
from solve.linear import SolveError

# A turned fruit has no mirror planes. With twice the dofs its error is 3e-4, within its bar, in 4 s on one core.
TURNED = 2  # factor of the most dofs
REACH = 3.0  # reach of a load from its centre [standard deviations]


@dataclass(frozen=True, eq=False)
class BentBlock:
    """Bases on one mesh of the block, `flat`, and of the fruit, `bent`, with the loads on it and their parities.

    The mesh lies between `lines` [mm]. `normals` are the outward normals at the loads, which press against them. They
    are the normals of the skin if the tips press along these, as domes do, else they point upwards.
    """

    loads: Sequence[SmoothLoad]
    normals: Sequence[Sequence[float]]
    parities: Sequence[Parity]
    lines: Lines
    flat: CellBasis
    bent: CellBasis

    def fixed_dofs(self, parity: Parity) -> Ints:
        """Return the dofs that the base and the mirror planes hold, which are the same for both bodies."""
        return np.union1d(self.flat.get_dofs("base").all(), mirror_dofs(self.flat, parity))

    def forces(self, parity: Parity, normals: Sequence[Sequence[float]]) -> Floats:
        """Return the nodal forces of each unit load and its mirror images, shape (dofs, loads).

        A load presses against its outward normal (3,). Seen from above it is a product of two normal distributions. So
        the fraction of a node is the product of the fractions of its lines along x and along y. The component of a
        force across a mirror plane changes sign with the image.
        """
        forces = np.zeros((self.flat.N, len(self.loads)))
        for component in range(3):
            top = self.flat.get_dofs("top").all(f"u^{component + 1}")
            for number, load in enumerate(self.loads):
                on_node = np.full(len(top), -normals[number][component])
                for axis, centre in enumerate((load.x, load.y)):
                    sign = -parity[axis] if axis == component else parity[axis]
                    nodes, fraction = line_forces(self.lines[axis], centre, load.deviation, sign)
                    nearest = np.abs(self.flat.doflocs[axis, top, None] - nodes).argmin(axis=1)
                    on_node *= fraction[nearest]
                forces[top, number] = on_node
        return forces


def bent_block(
    fruit: Fruit, footprints: Sequence[Footprint], loads: Sequence[SmoothLoad], steps: BodySteps, along_normals: bool
) -> BentBlock:
    """Return the mesh of a fruit's block, flat and bent, under the loads that represent footprints.

    The mesh ends at planes of symmetry that fruit and footprints share. With `along_normals` the loads press along the
    normals of the skin. Raises SolveError if an element folds as the block is bent.
    """
    shape = CurvedShape(fruit, core_of(loads))
    mirrored = [bool(images) for images in mirror_images(footprints)]
    parities = level_parities(footprints)
    if not fruit.mirrored:
        mirrored = [False, False]
        parities = [(0, 0)]
        steps = replace(steps, most_dofs=TURNED * steps.most_dofs)
    lines = body_lines(shape, loads, mirrored, steps)
    box = box_mesh(lines)
    mesh = MeshHex2.from_mesh(box).with_boundaries(box.boundaries)
    flat = vector_basis(mesh, ElementHex2(), VOLUME_ORDER)
    bent = flat
    normals = [(0.0, 0.0, -1.0) for _ in loads]
    if fruit.radius_mm is not None:
        bent = _bent_basis(mesh, shape)
        if along_normals:
            normals = [shape.normal(load.x, load.y) for load in loads]
    return BentBlock(loads, normals, parities, lines, flat, bent)


def _bent_basis(mesh: MeshHex2, shape: CurvedShape) -> CellBasis:
    """Return the basis on the mesh of a block bent into a fruit; raises SolveError if an element folds."""
    curved = replace(mesh, doflocs=shape.bend(mesh.doflocs))
    bent = vector_basis(curved, ElementHex2(), VOLUME_ORDER)
    volumes = determinant(cell_jacobian(curved, bent.quadrature[0]))
    smallest = float((volumes / np.median(volumes)).min())
    if not smallest > 0.0:
        msg = f"curved fruit: volume of a bent element = {smallest:.1g} of the median: must be above 0"
        raise SolveError(msg)
    return bent


def core_of(loads: Sequence[SmoothLoad]) -> Plan:
    """Return half the plan [mm] along x and y that contains all loads."""
    x = max(abs(load.x) + REACH * load.deviation for load in loads)
    y = max(abs(load.y) + REACH * load.deviation for load in loads)
    return Plan(x, y)
