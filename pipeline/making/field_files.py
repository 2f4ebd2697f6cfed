"""VTU files of meshes and fields: the housing under its forces at full travel, and the fruit under the tips.

The housing is also written as a CalculiX deck.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mesh.housing.sweep import flexure_mesh
from pipeline.making.flexure_deck import NAME, write_flexure_deck
from pipeline.options import RunOptions
from pipeline.reading.pressed_sensor import PressedSensor
from pipeline.response.scene_press import ScenePress, scene_of
from pipeline.springs.fitted_springs import FittedSprings
from pipeline.springs.mounts import mount_layers
from pipeline.storage.vtu import write_vtu
from sensor.quantity import InputError
from solve.contact.fruit_fields import fruit_fields
from solve.contact.pressure import footprint_pressure
from solve.elasticity import NodalFields
from solve.housing.clamped_half import ClampedHalf, clamped_half
from solve.housing.housing_fields import fields_in, most_strained_node
from solve.housing.stiffness import displacements, leaf_faces
from solve.linear import SolveError

FLEXURE = "flexure.vtu"
FRUIT = "fruit.vtu"
# Row and column indices of the components xx, yy, zz, xy, yz, xz of a symmetric tensor, in the order of VTU files.
_ROWS = (0, 1, 2, 0, 1, 0)
_COLUMNS = (0, 1, 2, 1, 2, 2)


def write_fields(sensor: PressedSensor, press: ScenePress, options: RunOptions, folder: Path) -> tuple[str, ...]:
    """Write the mesh of the half housing y >= 0 [mm] to flexure.vtu, and fields if `options.fields` is set.

    The other half is its mirror image. With `options.fields`, three files are written to `folder`:

    - The file flexure.vtu holds the fields of the housing under the tip forces at full travel. The verdicts on the root
      strains use the same forces. It also has an array for each spring, which is 1 at the node with the largest strain
      on its leaves, and 0 elsewhere.
    - The file flexure.inp is the CalculiX deck of the housing.
    - The file fruit.vtu holds the fields of the fruit under the forces of the scene.

    The fields at the nodes are displacement [mm], stress and von Mises stress [MPa], and largest principal strain [1].
    Without a housing, only fruit.vtu is written. If the housing cannot be solved, no fields are written. If the fruit
    cannot be solved, fruit.vtu is not written. Returns the reason as a tuple of one text, or an empty tuple if all
    files are written. Raises OSError if a file cannot be written.
    """
    springs = sensor.springs
    if not options.fields:
        if springs.housing is not None:
            write_vtu(folder / FLEXURE, flexure_mesh(springs.housing), {}, half_at_y=0.0)
        return ()
    try:
        _write_flexure(springs, folder)
    except SolveError as error:
        return (f"the fields of the housing and the fruit are not written: {error}",)
    scene = scene_of(sensor.design, press.scene.height_offset_mm)
    E = float(press.at_largest_E.E[-1])  # modulus of the firmest fruit [MPa]
    try:
        pressure = footprint_pressure(scene, sensor.contact, sensor.C, E, scene.press.travel_mm)
        mesh, fields = fruit_fields(scene.fruit, pressure)
    except (InputError, SolveError) as error:
        return (f"fruit.vtu is not written: {error}",)
    write_vtu(folder / FRUIT, mesh, field_arrays(fields))
    return ()


def _write_flexure(springs: FittedSprings, folder: Path) -> None:
    """Write the fields and the CalculiX deck of a housing under the tip forces at full travel, if there is a housing.

    The node with the largest strain on the leaves of each spring is marked. Raises SolveError if the housing cannot be
    solved.
    """
    if springs.housing is None:
        return
    process = springs.process
    mesh = flexure_mesh(springs.housing)
    half = clamped_half(mesh, process.E_MPa, process.poisson, mount_layers(springs.housing))
    write_flexure_deck(springs, half, folder / NAME)
    fields = fields_at_full_travel(springs, half)
    marks = {}  # for each spring, an array that is 1 at the node with the largest strain on its leaves, 0 elsewhere
    for name in springs.springs:
        mark = np.zeros(len(fields.displacement))  # one value per node
        mark[most_strained_node(mesh, leaf_faces(name), fields)] = 1.0
        marks[f"{name}_largest_strain_place"] = mark
    write_vtu(folder / FLEXURE, mesh, {**field_arrays(fields), **marks}, half_at_y=0.0)


def fields_at_full_travel(springs: FittedSprings, half: ClampedHalf) -> NodalFields:
    """Return the fields in half of a housing under the tip forces at full travel, as in the check of the root strains.

    The force on a tip is the stiffness of its spring times its deflection at full travel. Raises SolveError if the
    housing cannot be solved.
    """
    pairs = zip(springs.springs.values(), springs.deflections, strict=True)
    forces = np.array([spring.stiffness * deflection for spring, deflection in pairs])  # low tip, high tip [N]
    process = springs.process
    # `displacements` has a column for a force of 1 N on each tip
    return fields_in(half.basis.mesh, process.E_MPa, process.poisson, displacements(half) @ forces)


def field_arrays(fields: NodalFields) -> dict[str, NDArray[np.float64]]:
    """Return the arrays of a VTU file for these fields, keyed by names that contain the units.

    The components of the stress tensor are xx, yy, zz, xy, yz, xz.
    """
    return {
        "displacement_mm": fields.displacement,
        "von_mises_MPa": fields.von_mises,
        "largest_principal_strain": fields.largest_principal_strain,
        "stress_MPa": fields.stress[_ROWS, _COLUMNS].T,
    }
