"""Cells of other materials than that of the print: strips of sheet as leaves, and the glue that holds them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from skfem import Mesh

from sensor.arrays import Floats, Ints
from solve.linear import SolveError


@dataclass(frozen=True, kw_only=True)
class Inset:
    """The material of the named cells of a mesh: E [MPa], Poisson's ratio, density over that of the print [1]."""

    name: str
    E: float
    poisson: float
    relative_density: float = 1.0


@dataclass(frozen=True, eq=False)
class CellMaterial:
    """E [MPa], Poisson's ratio and the density over that of the print [1]: one number, or one for each cell."""

    E: float | Floats
    poisson: float | Floats
    relative_density: float | Floats = 1.0


def cells_of(mesh: Mesh, name: str) -> Ints:
    """Return the cells of a named region; raises SolveError where the mesh has none."""
    cells = (mesh.subdomains or {}).get(name)
    if cells is None or not len(cells):
        msg = f"housing: the mesh has no region {name!r}; mesh the housing with its strips"
        raise SolveError(msg)
    return np.asarray(cells)


def cell_material(mesh: Mesh, E: float, poisson: float, insets: Sequence[Inset]) -> CellMaterial:
    """Return the material of each cell: that of the print [MPa] but where an inset lies; raises SolveError."""
    if not insets:
        return CellMaterial(E, poisson)
    moduli = np.full(mesh.nelements, E)
    ratios = np.full(mesh.nelements, poisson)
    densities = np.ones(mesh.nelements)
    for inset in insets:
        cells = cells_of(mesh, inset.name)
        moduli[cells] = inset.E
        ratios[cells] = inset.poisson
        densities[cells] = inset.relative_density
    return CellMaterial(moduli, ratios, densities)
