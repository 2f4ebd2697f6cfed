"""A design from the command line: a named preset or a file, settings laid on top, and the options of a run."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from cad.design.design_file import design_from_mapping, overridden, read_design
from cad.design.parameters import Design
from cad.quantity import fault, nearest
from pipeline.accuracy import DEFAULT_TOLERANCE, TOLERANCES

DESIGNS = Path(__file__).parents[1] / "designs"
DEFAULT_DESIGN = "paper"
FRUIT_STIFFNESSES = ("contact", "hayes")
CONTACT_METHODS = ("auto", "split", "direct")


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """What a run is asked for besides its design: where to write, which fruit stiffness, which contact method.

    `tolerance` is the relative error allowed to both stiffnesses of the springs.
    """

    out: Path
    fruit_stiffness: Literal["contact", "hayes"] = "contact"
    contact_method: Literal["auto", "split", "direct"] = "auto"
    fields: bool = False
    tolerance: float = DEFAULT_TOLERANCE

    def __post_init__(self) -> None:
        """Refuse words that name no stiffness or method, and a tolerance that no mesh or no verdict is made for."""
        if not TOLERANCES.hold(self.tolerance):
            raise fault("--tol", self.tolerance, "1", str(TOLERANCES), f"the default is {DEFAULT_TOLERANCE:g}")
        for flag, value, known in (
            ("--fruit-stiffness", self.fruit_stiffness, FRUIT_STIFFNESSES),
            ("--contact-method", self.contact_method, CONTACT_METHODS),
        ):
            if value not in known:
                raise fault(flag, value, "", f"one of {', '.join(known)}", f"did you mean {nearest(value, known)}?")


def design_path(design: str) -> Path:
    """Return the file of a preset's name, or the path itself; raises InputError for a name that is no preset."""
    if design.endswith(".toml") or os.sep in design:
        return Path(design)
    known = tuple(sorted(path.stem for path in DESIGNS.glob("*.toml")))
    if design not in known:
        remedy = f"did you mean {nearest(design, known)}?" if known else "give a path"
        raise fault("--design", design, "", f"one of {', '.join(known)}, or a path that ends in .toml", remedy)
    return DESIGNS / f"{design}.toml"


def load_design(design: str, settings: Mapping[str, str]) -> Design:
    """Return the design of a preset or a file with `table.key` settings on top; raises InputError.

    A file that gives no name is named for itself.
    """
    path = design_path(design)
    return design_from_mapping(overridden({"name": path.stem, **read_design(path)}, settings))
