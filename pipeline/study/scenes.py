"""The contact scene of a design on tips of side 1: designs that differ by size or modulus alone share its solution.

The compliance S of a linear body depends on ratios of lengths and on Poisson's ratio alone: S of a scene that is
larger by a factor is smaller by it, and its indentation is over E.
"""

import dataclasses
import functools
from collections.abc import Iterable
from dataclasses import dataclass, replace

from cad.design.fruit import Fruit
from cad.design.parameters import Design
from cad.design.tips import Tips
from cad.quantity import InputError
from pipeline.options import CONTACT_SHARE
from pipeline.response.contact import contact_compliance
from pipeline.storage.plain import Plain
from solve.fruit.compliance import FruitCompliance

_DIGITS = 12  # of a ratio: scenes that differ by round-off are one
_SCENES_KEPT = 256
# What the compliance times E does not depend on, with the same value in every scene.
_TIPS: Plain = {"gap_mm": 0.0, "socket": "none"}
_FRUIT: Plain = {
    "E_MPa": Fruit().E_MPa,
    "E_max_MPa": Fruit().E_max_MPa,
    "poisson_spread": Fruit().poisson_spread,
    "bruise_limit_MPa": None,
}
_BESIDE_CONTACT = {*(f"tips.{key}" for key in _TIPS), *(f"fruit.{key}" for key in _FRUIT)}


@dataclass(frozen=True, kw_only=True)
class UnitScene:
    """Fruit and tips with all lengths over the side of a tip [1], but for what contact does not depend on.

    `scale` [mm] is that side; scenes of one shape compare equal, whatever their size.
    """

    fruit: Fruit
    tips: Tips
    scale: float = dataclasses.field(compare=False)

    def __hash__(self) -> int:
        """Return one number for scenes that compare equal."""
        return hash((self.fruit, self.tips))


def move_contact(keys: Iterable[str]) -> bool:
    """Say whether any of some keys of the design file moves the solution of contact."""
    return any(key.startswith(("fruit.", "tips.")) and key not in _BESIDE_CONTACT for key in keys)


def unit_scene(design: Design) -> UnitScene:
    """Return the scene of a design on tips of side 1 mm; one whose ratios no design file takes keeps its size."""
    scale = design.tips.side_mm
    try:
        fruit = replace(design.fruit, **_lengths_over(design.fruit, scale), **_irrelevant(design.fruit))
        tips = replace(design.tips, **_lengths_over(design.tips, scale) | _TIPS)
    except InputError:
        scale = 1.0
        fruit = replace(design.fruit, **_irrelevant(design.fruit))
        tips = replace(design.tips, **_TIPS)
    return UnitScene(fruit=fruit, tips=tips, scale=scale)


def _irrelevant(fruit: Fruit) -> Plain:
    """Return the one value of what contact does not depend on; of flesh under a skin the moduli do count."""
    return _FRUIT if fruit.skin_mm is None else {**_FRUIT, "E_MPa": fruit.E_MPa, "E_max_MPa": fruit.E_max_MPa}


def _lengths_over(record: Fruit | Tips, scale: float) -> Plain:
    """Return every length of a record over a scale [mm]."""
    lengths = {}
    for item in dataclasses.fields(record):
        value = getattr(record, item.name)
        if item.name.endswith("_mm") and value is not None:
            lengths[item.name] = float(f"{value / scale:.{_DIGITS}g}")
    return lengths


def scene_compliance(scene: UnitScene, tolerance: float, method: str = "auto") -> FruitCompliance:
    """Return the compliance of the fruit under the tips in their size [1/mm], the unit scene solved once a process.

    `tolerance` [1] is that of the springs, as for a run. Raises InputError, MeshError or SolveError.
    """
    unit = _unit_compliance(scene, CONTACT_SHARE * tolerance, method)
    if scene.scale == 1.0:
        return unit
    skin = unit.skin and replace(unit.skin, S=unit.skin.S / scene.scale)
    return replace(unit, S=unit.S / scene.scale, shape_change=unit.shape_change / scene.scale, skin=skin)


@functools.lru_cache(maxsize=_SCENES_KEPT)
def _unit_compliance(scene: UnitScene, tolerance: float, method: str) -> FruitCompliance:
    return contact_compliance(scene.fruit, scene.tips, method, tolerance)
