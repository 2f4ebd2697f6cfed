"""The contact of a point on tips of side 1: what all points that differ by their size alone share.

The compliance S of a linear body depends on ratios of lengths and on Poisson's ratio alone: S of a scene that is
larger by a factor is smaller by it, and its indentation is over E.
"""

import dataclasses
import functools
from dataclasses import dataclass
from typing import Any, TypeVar

from cad.design.fruit import Fruit
from cad.design.parameters import Design
from cad.design.tips import Tips
from cad.quantity import InputError
from pipeline.options import CONTACT_SHARE
from pipeline.stages.level_contact import level_compliance
from pipeline.study.levels.direct_solve import direct_solve
from solve.fruit.compliance import FruitCompliance

Record = TypeVar("Record", Fruit, Tips)

_DIGITS = 12  # of a ratio: scenes that differ by round-off are one
_SCENES_KEPT = 256


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
    fruit, tips, scale = _neutral_fruit(design.fruit), _neutral_tips(design.tips), design.tips.side_mm
    try:
        return UnitScene(fruit=_over(fruit, scale), tips=_over(tips, scale), scale=scale)
    except InputError:
        return UnitScene(fruit=fruit, tips=tips, scale=1.0)


def _neutral_fruit(fruit: Fruit) -> Fruit:
    """Return the fruit with the default of every key that the compliance times E does not depend on."""
    kept = Fruit()
    return dataclasses.replace(
        fruit, E_MPa=kept.E_MPa, E_max_MPa=kept.E_max_MPa, bruise_limit_MPa=None, poisson_spread=kept.poisson_spread
    )


def _neutral_tips(tips: Tips) -> Tips:
    return dataclasses.replace(tips, gap_mm=0.0, socket="none")


def _over(record: Record, scale: float) -> Record:
    """Return a record with every length over a scale [mm]."""
    lengths: dict[str, Any] = {
        item.name: float(f"{value / scale:.{_DIGITS}g}")
        for item in dataclasses.fields(record)
        if item.name.endswith("_mm") and (value := getattr(record, item.name)) is not None
    }
    return dataclasses.replace(record, **lengths)


def scene_compliance(scene: UnitScene, tolerance: float) -> FruitCompliance:
    """Return the compliance of the fruit under the tips in their size [1/mm], the unit scene solved once a process.

    `tolerance` [1] is that of the springs, as for a run. Raises InputError, MeshError or SolveError.
    """
    unit = _unit_compliance(scene, CONTACT_SHARE * tolerance)
    if scene.scale == 1.0:
        return unit
    return dataclasses.replace(unit, S=unit.S / scene.scale, shape_change=unit.shape_change / scene.scale)


@functools.lru_cache(maxsize=_SCENES_KEPT)
def _unit_compliance(scene: UnitScene, tolerance: float) -> FruitCompliance:
    return level_compliance(scene.fruit, scene.tips, "auto", tolerance, direct_solve)
