"""The options of a run, and functions that load its design from a preset or a file, with settings."""

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Literal

from cad.files.file_date import DATE_VARIABLE
from pipeline.storage.versions import code_digest, pages_digest, run_packages
from sensor.design.design_file import design_as_mapping
from sensor.design.design_tables import DesignTables, settings_of_texts
from sensor.design.parameters import Design
from sensor.gone import refuse_removed
from sensor.input_file import path_of, read_toml
from sensor.quantity import (
    Bounds,
    check_fields,
    check_type,
    choice,
    nearest,
    python_numbers,
    quantity,
    validation_error,
)
from sensor.tips.layouts import LAYOUTS

DEFAULT_DESIGN = "paper"  # name of the preset of a run without a design
FRUIT_STIFFNESSES = ("contact", "hayes")

TOLERANCES = Bounds(at_least=1e-4, at_most=0.1)
# The verdicts on K_l and K_h use this tolerance, so they remain undecided if a run has a larger one.
DEFAULT_TOLERANCE = 1e-3
ROUGH_TOLERANCE = 0.02  # at this tolerance and above, springs and contact are each solved on a single coarse mesh
CONTACT_FRACTION = 0.25  # fraction of the tolerance allowed for the contact, which costs less to solve than the springs

# The presets are in this package if it is installed, and beside it in a checkout of the repository.
_SHIPPED = Path(__file__).parent / "designs"
_CHECKOUT = Path(__file__).parents[1] / "designs"
DESIGNS = _SHIPPED if _SHIPPED.is_dir() else _CHECKOUT


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """The options of a run, in addition to its design: the output folder, the accuracy, and further files.

    Parameters
    ----------
    out : str or Path, optional
        The output folder. By default, no file is written.
    fruit_stiffness : "contact" or "hayes", optional
        Whether the springs are sized from the solved contact, or from the paper's formula for a flat round tip.
    fields : bool, optional
        Whether to write displacement and stress to the VTU files.
    fabrication : bool, optional
        Whether to write the files for fabrication, like `pipeline design`.
    tolerance : float, optional
        Relative tolerance of the stiffness of both springs [1].
    force : bool, optional
        Whether to use a folder that contains files of a different origin; they are renamed to NAME.bak.
    look : bool, optional
        Whether to omit the solids and the files of parts.

    Raises
    ------
    InputError
        If an option is outside its bounds, or `fields` or `fabrication` is given with `look`.

    Examples
    --------
    >>> twintip.RunOptions(tolerance=0.02, look=True).rough
    True
    """

    out: str | Path | None = None
    fruit_stiffness: Literal["contact", "hayes"] = choice(
        FRUIT_STIFFNESSES, default="contact", flag="--fruit-stiffness"
    )
    fields: bool = False
    fabrication: bool = False
    tolerance: float = quantity(
        "1", TOLERANCES, default=DEFAULT_TOLERANCE, hint=f"the default is {DEFAULT_TOLERANCE:g}", flag="--tol"
    )
    force: bool = False
    look: bool = False

    def __post_init__(self) -> None:
        """Store `out` as a path; raise InputError for an invalid option, or one that `look` does not have."""
        if self.out is not None:
            object.__setattr__(self, "out", path_of(self.out, "out"))
        check_fields(self, "options")
        for flag, given in (("--fields", self.fields), ("fabrication", self.fabrication)):
            if self.look and given:
                raise validation_error(flag, "given", "", "omitted if --look is given", "make a whole run")

    @property
    def folder(self) -> Path | None:
        """Return `out` as a path; None if no file is written."""
        return None if self.out is None else Path(self.out)

    @property
    def command(self) -> str:
        """Return the command line that repeats the run in its output folder, which holds `design.toml`."""
        parts = ["pipeline", "design" if self.fabrication else "run", "--design design.toml"]
        parts += [f"--fruit-stiffness {self.fruit_stiffness}", f"--tol {self.tolerance:g}"]
        parts += ["--fields"] if self.fields else []
        parts += ["--look"] if self.look else []
        return " ".join(parts)

    @property
    def rough(self) -> bool:
        """Return whether the tolerance requests a rough answer, which is accurate to a few per cent."""
        return self.tolerance >= ROUGH_TOLERANCE

    @property
    def contact_tolerance(self) -> float:
        """Return the relative tolerance of the fruit's compliance [1], which is a fraction of the run's tolerance."""
        return CONTACT_FRACTION * self.tolerance


def check_can_be_made(design: Design, options: RunOptions) -> None:
    """Raise InputError if files for fabrication are requested but the layout of the tips has no housing."""
    if options.fabrication and not design.tips.tip_layout.has_housing:
        bound = f"{' or '.join(name for name, layout in LAYOUTS.items() if layout.has_housing)} for pipeline design"
        hint = "a line has no housing; use pipeline run"
        raise validation_error("tips.layout", design.tips.layout, "", bound, hint)


def preset_names() -> tuple[str, ...]:
    """Return the names of the designs that are shipped with the program, in alphabetical order."""
    return tuple(sorted(path.stem for path in DESIGNS.glob("*.toml")))


def design_path(design: str | Path, name: str = "--design") -> Path:
    """Return the path of a design file, given as a path or as the name of a preset.

    A string is treated as a path if it ends in .toml or contains a path separator, and otherwise as a preset. Raises
    InputError if there is no such preset; whether a path exists is not checked. `name` is the flag or argument that the
    message names.
    """
    path = path_of(design, name)
    if not isinstance(design, str) or design.endswith(".toml") or os.sep in design:
        return path
    presets = preset_names()
    refuse_removed(f"preset {design}")  # raises InputError with the replacement if this preset was removed
    if design not in presets:
        hint = f"did you mean {nearest(design, presets)}?" if presets else "give a path"
        raise validation_error(name, design, "", f"one of {', '.join(presets)}, or a path that ends in .toml", hint)
    return DESIGNS / f"{design}.toml"


def load_design(
    design: str | Path = DEFAULT_DESIGN, settings: Mapping[str, object] | None = None, name: str = "--design"
) -> Design:
    """Load the design of a preset or of a design file, with changes to its keys.

    The default name of a design is the name of its file.

    Parameters
    ----------
    design : str or Path, optional
        The name of a preset, such as "mango", or the path of a design file.
    settings : mapping, optional
        New values of keys, such as `{"targets.NL": 0.06}`: numbers, lists, or their text in TOML. None or "" removes a
        key.
    name : str, optional
        The flag or argument that error messages name.

    Returns
    -------
    Design
        The design, with all keys checked.

    Raises
    ------
    InputError
        If there is no such preset or file, a key is unknown, or a value is not allowed.

    Examples
    --------
    >>> twintip.load_design("paper", {"targets.NL": 0.06}).targets.NL
    0.06
    """
    return design_tables(design, settings, name).design()


def design_tables(
    design: str | Path, settings: Mapping[str, object] | None = None, name: str = "--design"
) -> DesignTables:
    """Load the tables of a preset or of a design file, with values replaced by settings.

    The tables may be incomplete, because a study adds further settings before it makes a design of them. The parameters
    are the same as for `load_design`. Raises InputError like `load_design`, except for errors that only a complete
    design can have.
    """
    path = design_path(design, name)
    if settings is not None:
        check_type("settings", settings, Mapping, "a mapping", "write for instance {'targets.NL': 0.06}")
    texts = {key: setting_text(key, value) for key, value in (settings or {}).items()}
    contents = {"name": path.stem, **read_toml(path, name)}  # a name in the file replaces the name of the file
    tables = DesignTables.from_file(contents, path.parent)
    return tables.with_settings(settings_of_texts(texts))


def setting_text(key: str, value: object) -> str:
    """Return the value of a design key as text in TOML, as for the flag `--set`; empty for None, which removes the key.

    A string is returned unchanged. Raises InputError for a value that is not finite, or whose type does not occur in
    designs. The message names the `key`.
    """
    if value is None or isinstance(value, str):
        return value or ""
    try:
        # Numbers, booleans and lists have the same form in JSON and TOML.
        return json.dumps(python_numbers(value), allow_nan=False)
    except (TypeError, ValueError) as error:
        raise validation_error(
            key, str(value), "", "a finite number, a list of numbers, or text", "write it as in a design file"
        ) from error


def run_key(design: Design, options: RunOptions) -> str:
    """Return a digest of all inputs that determine the files of a run: design, options, program and packages.

    If the report in a folder has the same key, the folder is up to date, and the run need not be repeated.
    """
    inputs = {
        "design": design_as_mapping(design),
        "options": asdict(replace(options, out=None, force=False)),  # `out` and `force` do not change files
        "date": os.environ.get(DATE_VARIABLE),  # the date that is written into files
        "packages": run_packages(),
        "code": code_digest(),
        "pages": pages_digest(),
    }
    return hashlib.sha256(json.dumps(inputs, sort_keys=True).encode()).hexdigest()
