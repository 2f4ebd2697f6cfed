"""The fields that can be drawn on a mesh, their names with units, and the range of their colours."""

from dataclasses import dataclass
from typing import Any

import numpy as np

Mesh = Any  # a PyVista data set: its decorated methods have no types that strict mode takes

DISPLACEMENT = "displacement_mm"
STRAIN = "largest_principal_strain"


@dataclass(frozen=True, kw_only=True)
class Field:
    """A number at every node: the array that holds it, and its title with the unit."""

    array: str
    title: str

    def range_on(self, mesh: Mesh) -> tuple[float, float]:
        """Return the range of colours, in the unit of the field: from 0, or the least value below, to the largest."""
        values = np.asarray(mesh.point_data[self.array])
        return min(0.0, float(values.min())), float(values.max())


VON_MISES = Field(array="von_mises_MPa", title="von Mises stress [MPa]")
TOTAL_DISPLACEMENT = Field(array="total_displacement_mm", title="displacement [mm]")
LARGEST_STRAIN = Field(array=STRAIN, title="largest principal strain [1]")
SHARE_OF_LIMIT = Field(array="strain_over_limit", title="strain / limit of the process [1]")
VERTICAL_PRESSURE = Field(array="vertical_pressure_MPa", title="pressure along the press [MPa]")

FLEXURE_FIELDS = (VON_MISES, SHARE_OF_LIMIT, LARGEST_STRAIN, TOTAL_DISPLACEMENT)
FRUIT_FIELDS = (VERTICAL_PRESSURE, VON_MISES, LARGEST_STRAIN, TOTAL_DISPLACEMENT)

_STRESS = "stress_MPa"
_ZZ = 2  # of xx, yy, zz, xy, yz, xz


def add_derived_fields(mesh: Mesh, strain_limit: float | None = None) -> None:
    """Add what follows from the arrays of a VTU file: total displacement, pressure, strain over the limit [1]."""
    data = mesh.point_data
    data[TOTAL_DISPLACEMENT.array] = np.linalg.norm(data[DISPLACEMENT], axis=1)
    if _STRESS in data:
        data[VERTICAL_PRESSURE.array] = -np.asarray(data[_STRESS])[:, _ZZ]
    if strain_limit is not None and STRAIN in data:
        data[SHARE_OF_LIMIT.array] = np.asarray(data[STRAIN]) / strain_limit


def fields_on(mesh: Mesh, fields: tuple[Field, ...]) -> tuple[Field, ...]:
    """Return those fields that a mesh holds."""
    return tuple(field for field in fields if field.array in mesh.point_data)
