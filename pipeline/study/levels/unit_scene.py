"""The contact of a point on tips of side 1: what all points that differ by their size alone share.

The compliance S of a linear body depends on ratios of lengths and on Poisson's ratio alone: S of a scene that is
larger by a factor is smaller by it, and its indentation is over E.
"""

import dataclasses
import functools
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
# What the compliance times E does not depend on, as every scene has it.
_TIPS: Plain = {"gap_mm": 0.0, "socket": "none"}
_FRUIT: Plain = {
    **{key: getattr(Fruit(), key) for key in ("E_MPa", "E_max_MPa", "poisson_spread")},
    "bruise_limit_MPa": None,
}


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


def unit_scene(design: Design) -> UnitScene:
    """Return the scene of a design on tips of side 1 mm; one whose ratios no design file takes keeps its size."""
    fruit, tips, scale = design.fruit, design.tips, design.tips.side_mm
    try:
        over = _lengths_over(fruit, scale), _lengths_over(tips, scale)
        return UnitScene(fruit=replace(fruit, **over[0] | _FRUIT), tips=replace(tips, **over[1] | _TIPS), scale=scale)
    except InputError:
        return UnitScene(fruit=replace(fruit, **_FRUIT), tips=replace(tips, **_TIPS), scale=1.0)


def _lengths_over(record: Fruit | Tips, scale: float) -> Plain:
    """Return every length of a record over a scale [mm]."""
    return {
        item.name: float(f"{value / scale:.{_DIGITS}g}")
        for item in dataclasses.fields(record)
        if item.name.endswith("_mm") and (value := getattr(record, item.name)) is not None
    }


def scene_compliance(scene: UnitScene, tolerance: float) -> FruitCompliance:
    """Return the compliance of the fruit under the tips in their size [1/mm], the unit scene solved once a process.

    `tolerance` [1] is that of the springs, as for a run. Raises InputError, MeshError or SolveError.
    """
    unit = _unit_compliance(scene, CONTACT_SHARE * tolerance)
    if scene.scale == 1.0:
        return unit
    return replace(unit, S=unit.S / scene.scale, shape_change=unit.shape_change / scene.scale)


@functools.lru_cache(maxsize=_SCENES_KEPT)
def _unit_compliance(scene: UnitScene, tolerance: float) -> FruitCompliance:
    return contact_compliance(scene.fruit, scene.tips, "auto", tolerance)
