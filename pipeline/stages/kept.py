"""The dear stages with their results kept by content: a changed target redoes only what depends on it."""

from dataclasses import asdict
from typing import Any

import numpy as np

from cad.design.parameters import Design
from cad.parts.housing import Housing
from cad.theory.flexure import Flexure
from pipeline.fit.leaf_lengths import FittedFlexures
from pipeline.fit.pins import fit_made
from pipeline.stages.contact import contact_compliance
from pipeline.storage.cache import remembered
from solve.fruit.compliance import Compliance
from solve.housing.stiffness import HousingStiffness

_NO_MATTER = {"E_max_MPa", "E_MPa", "bruise_limit_MPa", "gap_mm"}  # the compliance times E does not depend on them


def kept_contact(design: Design, method: str, tolerance: float) -> Compliance:
    """Return the compliance of the fruit under both tips, its error at most the tolerance where a mesh has it.

    It is solved unless it is kept.
    """
    inputs = {**asdict(design.fruit), **{f"tip {key}": value for key, value in asdict(design.tips).items()}}
    needed = {key: value for key, value in inputs.items() if key.removeprefix("tip ") not in _NO_MATTER}
    found = remembered(
        "contact",
        {**needed, "method": method, "tolerance": tolerance},
        lambda: asdict(contact_compliance(design.fruit, design.tips, method, tolerance)),
    )
    (a, b), (c, d) = found.pop("S")
    return Compliance(S=((a, b), (c, d)), **found)


def kept_flexures(
    guess: Housing, targets: tuple[float, float], material: tuple[float, float], tolerance: float
) -> FittedFlexures:
    """Return the housing fitted to both stiffnesses [N/mm from mm, and E in MPa and nu], solved unless it is kept."""
    inputs = {"guess": asdict(guess), "targets": targets, "material": material, "tolerance": tolerance}
    found = remembered("flexures", inputs, lambda: _plain(fit_made(guess, targets, material, tolerance)))
    return FittedFlexures(
        housing=housing_from(found["housing"]),
        stiffness=_stiffness(found["stiffness"]),
        solves=tuple(found["solves"]),
        seconds=found["seconds"],
    )


def housing_from(data: dict[str, Any]) -> Housing:
    """Return the housing [mm] that plain nested dimensions describe."""
    low, high = (Flexure(**data[key]) for key in ("low", "high"))
    return Housing(low=low, high=high, **{key: value for key, value in data.items() if key not in ("low", "high")})


def _plain(fitted: FittedFlexures) -> dict[str, Any]:
    plain = asdict(fitted)
    plain["stiffness"]["C"] = fitted.stiffness.C.tolist()
    return plain


def _stiffness(data: dict[str, Any]) -> HousingStiffness:
    pairs: dict[str, Any] = {
        key: tuple(value) if isinstance(value, list) else value for key, value in data.items() if key != "C"
    }
    return HousingStiffness(C=np.array(data["C"]), **pairs)
