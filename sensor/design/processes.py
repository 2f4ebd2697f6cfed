"""Print processes and their materials, from processes.toml or from a file of the user. Each number has a source."""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from sensor.input_file import read_toml
from sensor.quantity import (
    LENGTH,
    MODULUS,
    Bounds,
    InputError,
    Sourced,
    choice,
    quantity,
    text_field,
    validation_error,
)
from sensor.theory.creep import CreepLaw

_FRACTION = Bounds(above=0.0, below=1.0)
# Random prints deviate by up to 4.3 standard deviations. This limit keeps their modulus and leaf thicknesses positive.
_SCATTER = Bounds(above=0.0, at_most=0.23)
_MAX_THICKNESS_ERROR = 0.45  # maximum thickness error (two sigma), as a fraction of the thickness of the thinnest leaf
_DENSITY = Bounds(above=0.0, at_most=30.0)  # osmium, the densest element, has 22.6
_MAX_NAME_LENGTH = 64
_LAYER_ROUND_OFF = 1e-6  # tolerance for the round-off error of a number of layers
FOOT_MM = 0.15
"""Width by which the first layer spreads on each side of a leaf [mm], by judgement for one layer of 0.2 mm."""
KINDS = ("fdm", "sla", "sls", "dmls", "other")


@dataclass(frozen=True, kw_only=True)
class Process(Sourced):
    """A print process for the housing: its material, the limits of the machine, and suitable leaf thicknesses.

    `E_scatter` is the standard deviation of E from print to print, as a fraction of E. `strain_limit` applies to cyclic
    bending. `accuracy_mm` is the tolerance of the thickness of a thin wall, plus or minus two standard deviations.
    `overhang_deg` is the largest slope from the vertical that needs no support. `line_width_mm` and `layer_mm` are None
    if the process has no lines or layers. `kind` selects the instructions on supports, washing, heat and powder on the
    fabrication sheet.
    """

    LABEL: ClassVar[str] = "process"

    material: str = text_field()
    kind: str = choice(KINDS, default="other")
    E_MPa: float = quantity("MPa", MODULUS, meaning="modulus of the material")
    E_scatter: float = quantity(
        "1", _SCATTER, meaning="standard deviation of the modulus from print to print, as a fraction of E"
    )
    E_per_K: float | None = quantity(
        "1/K",
        Bounds(at_least=-0.1, at_most=0.1),
        default=None,
        meaning="change of the modulus per kelvin near 23 C, as a fraction of E; required by [readout]",
    )
    creep_per_decade: float | None = quantity(
        "1",
        Bounds(above=0.0, below=1.0),
        default=None,
        meaning="growth of the compliance in each decade of time under a load, as a fraction of the compliance; "
        "not set for metals",
    )
    creep_scatter: float | None = quantity(
        "1",
        Bounds(at_least=0.0, at_most=0.5),
        default=None,
        meaning="standard deviation of this growth from print to print",
    )
    poisson: float = quantity("1", Bounds(above=-1.0, below=0.5), meaning="Poisson's ratio")
    strain_limit: float = quantity("1", _FRACTION, meaning="largest strain at the root of a leaf in repeated bending")
    density_g_per_cm3: float = quantity("g/cm3", _DENSITY, meaning="density")
    min_wall_mm: float = quantity("mm", LENGTH, meaning="thinnest wall that the process can print")
    min_gap_mm: float = quantity("mm", LENGTH, meaning="narrowest gap that stays open when printed")
    fillet_mm: float = quantity("mm", LENGTH, meaning="fillet radius of inner corners")
    overhang_deg: float = quantity(
        "deg",
        Bounds(above=0.0, at_most=90.0),
        meaning="largest slope from the vertical that can be printed without support",
    )
    accuracy_mm: float = quantity(
        "mm", LENGTH, meaning="tolerance of the thickness of a thin wall: plus or minus, two standard deviations"
    )
    line_width_mm: float | None = quantity("mm", LENGTH, default=None, meaning="width of a printed line")
    layer_mm: float | None = quantity("mm", LENGTH, default=None, meaning="height of a layer")
    leaf_thickness_low_mm: float = quantity("mm", LENGTH, meaning="thickness of the leaves of the low spring")
    leaf_thickness_high_mm: float = quantity("mm", LENGTH, meaning="thickness of the leaves of the high spring")
    depth_mm: float = quantity("mm", LENGTH, meaning="depth of the plate, which is the width of the leaves")

    def __post_init__(self) -> None:
        """Raise InputError for an invalid field, for a number without a source, or for a contradiction.

        Both creep keys must be given, or neither. The accuracy must suit the thinnest leaf.
        """
        check_process_name(self.name)
        super().__post_init__()
        if (self.creep_per_decade is None) != (self.creep_scatter is None):
            missing = "creep_scatter" if self.creep_scatter is None else "creep_per_decade"
            bound = "given together with the other creep key"
            name = f"process {self.name}.{missing}"
            raise validation_error(name, None, "1", bound, "give both, or omit both")
        max_error = _MAX_THICKNESS_ERROR * min(self.leaf_thicknesses_mm)
        if self.accuracy_mm > max_error:
            name = f"process {self.name}.accuracy_mm"
            bound = f"at most {max_error:g} mm, {_MAX_THICKNESS_ERROR:g} of the thickness of the thinnest leaf"
            hint = "choose thicker leaves, or a more accurate process"
            raise validation_error(name, self.accuracy_mm, "mm", bound, hint)

    @property
    def thinnest_leaf_mm(self) -> float:
        """Return the smallest leaf thickness [mm] for which the thickness error is acceptable."""
        return self.accuracy_mm / _MAX_THICKNESS_ERROR

    @property
    def is_metal(self) -> bool:
        """Return whether the process prints metal."""
        return self.kind == "dmls"

    @property
    def creep(self) -> CreepLaw:
        """Return the creep law of prints. If the process has no creep keys, as for metals, its prints do not creep."""
        return CreepLaw(self.creep_per_decade or 0.0, self.creep_scatter or 0.0)

    @property
    def leaf_thicknesses_mm(self) -> tuple[float, float]:
        """Return the thicknesses of the leaves of the low and of the high spring [mm]."""
        return self.leaf_thickness_low_mm, self.leaf_thickness_high_mm

    def printed_depth_mm(self, depth: float) -> float:
        """Return the depth [mm] that a slicer makes of a plate whose depth in the design is `depth` [mm].

        A slicer prints the nearest whole number of layers. At the middle of two numbers it prints either one, and the
        larger one is returned. The depth is returned unchanged if the process is not FDM or has no layer height.
        """
        if self.kind != "fdm" or self.layer_mm is None:
            return depth
        layer_count = max(1, math.floor(depth / self.layer_mm + 0.5 + _LAYER_ROUND_OFF))
        printed_depth = layer_count * self.layer_mm
        return depth if math.isclose(printed_depth, depth, rel_tol=_LAYER_ROUND_OFF) else printed_depth


def check_process_name(name: object) -> None:
    """Raise InputError unless the value can be the name of a process."""
    text = name if isinstance(name, str) else ""
    if not text.replace("-", "").replace("_", "").isalnum() or not text.isascii() or len(text) > _MAX_NAME_LENGTH:
        bound = f"1 to {_MAX_NAME_LENGTH} letters, digits, - or _"
        raise validation_error("print.process", name, "", bound, "choose a name that can be part of a file name")


PROCESSES = Process.from_tables(read_toml(Path(__file__).with_name("processes.toml"), "processes"))


def parse_process(name: str, table: object) -> Process:
    """Build a custom print process from a table of its numbers and their sources, which the user has written.

    Raises InputError if a known process has this name, if a key is unknown, or if a number is invalid.
    """
    if name in PROCESSES:
        raise validation_error(
            "print.process", name, "", "a name that no known process has", "give your own process another name"
        )
    check_process_name(name)
    return Process.from_table(name, table)


def read_process_file(path: Path) -> Mapping[str, Mapping[str, Any]]:
    """Read the process tables of a TOML file. The result has the names of the processes as keys.

    Raises InputError if the file cannot be read, or if one of its processes is invalid.
    """
    tables = read_toml(path, "print.process_file")
    for name, table in tables.items():
        try:
            parse_process(name, table)  # only checks the table
        except InputError as error:
            # The message names the file, because the error is not in the design file.
            msg = f"print.process_file = {path.name!r}: {error}"
            raise InputError(msg, field=error.field, value=error.value, bound=error.bound) from error
    return tables


def process_as_table(process: Process) -> Mapping[str, Any]:
    """Return a process as a table of a process file, without the keys that are not set."""
    table = dataclasses.asdict(process)
    del table["name"], table["sources"]
    table["sources"] = dict(process.sources)  # write the sources last
    return {key: value for key, value in table.items() if value is not None}
