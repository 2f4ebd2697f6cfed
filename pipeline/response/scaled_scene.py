"""Contact scenes scaled to tips of side 1 mm, so that designs that differ only in size or modulus share a solution.

Let S be the compliance matrix of a linear body multiplied by E. S depends only on the size of the body, the ratios of
its lengths and Poisson's ratio. S is inversely proportional to the size.
"""

import dataclasses
import functools
from dataclasses import dataclass, replace
from typing import TypeVar

from pipeline.options import CONTACT_FRACTION
from pipeline.response.contact import IRRELEVANT_VALUES, contact_compliance, contact_scene
from pipeline.storage.cache import load_or_compute
from pipeline.storage.plain import Plain
from sensor.design.fruit import Fruit
from sensor.design.parameters import Design
from sensor.design.tips import Tips
from sensor.quantity import InputError
from solve.fruit.compliance import FruitCompliance

Record = TypeVar("Record", Fruit, Tips)

_DIGITS = 12  # significant digits of a ratio of lengths, so that scenes that differ only by round-off are equal
_CACHED_SCENES = 256  # number of solutions that this process keeps in memory
_FIELDS_WITHOUT_EFFECT = {*IRRELEVANT_VALUES["fruit"], *IRRELEVANT_VALUES["tips"]}


@dataclass(frozen=True, kw_only=True)
class ScaledScene:
    """Fruit and tips, with all lengths that affect the contact divided by the side of a tip.

    `scale` [mm] is the side of a tip. Comparisons ignore the scale, so that scenes of the same shape are equal whatever
    their size.
    """

    fruit: Fruit
    tips: Tips
    scale: float = dataclasses.field(compare=False)


def unit_scene(design: Design) -> ScaledScene:
    """Return the contact scene of a design, scaled to tips of side 1 mm.

    The scene is not scaled (scale 1) if a length would then be outside the bounds of a design.
    """
    fruit, tips = contact_scene(design)
    scale = tips.side_mm
    try:
        return ScaledScene(fruit=_divide_lengths(fruit, scale), tips=_divide_lengths(tips, scale), scale=scale)
    except InputError:  # raised by `Fruit` or `Tips` for a length outside its bounds
        return ScaledScene(fruit=fruit, tips=tips, scale=1.0)


def _divide_lengths(record: Record, scale: float) -> Record:
    """Return a record with its lengths divided by `scale` [mm]; lengths that do not affect the contact are kept.

    The names of all lengths end in "_mm".
    """
    lengths: Plain = {}
    for item in dataclasses.fields(record):
        value = getattr(record, item.name)
        if item.name.endswith("_mm") and value is not None and item.name not in _FIELDS_WITHOUT_EFFECT:
            lengths[item.name] = float(f"{value / scale:.{_DIGITS}g}")
    return replace(record, **lengths)


def scene_compliance(scene: ScaledScene, tolerance: float) -> FruitCompliance:
    """Return E times the compliance of the fruit under the tips [1/mm], at the original size of the scene.

    Each scaled scene is solved only once. `tolerance` [1] is the relative tolerance of the spring stiffnesses; the
    tolerance of the contact is a fraction of it, as in a run. Raises InputError, MeshError or SolveError.
    """
    scaled = _unit_compliance(scene, CONTACT_FRACTION * tolerance)
    if scene.scale == 1.0:
        return scaled
    # S and its changes have the unit 1/mm, so they are inversely proportional to the scale.
    skin = None if scaled.skin is None else replace(scaled.skin, S=scaled.skin.S / scene.scale)
    return replace(scaled, S=scaled.S / scene.scale, shape_change=scaled.shape_change / scene.scale, skin=skin)


@functools.lru_cache(maxsize=_CACHED_SCENES)
def _unit_compliance(scene: ScaledScene, tolerance: float) -> FruitCompliance:
    """Return E times the compliance in a scaled scene [1/mm], cached in this process and on disk."""
    solve = functools.partial(contact_compliance, scene.fruit, scene.tips, tolerance)
    return load_or_compute(
        "contact", {"fruit": scene.fruit, "tips": scene.tips, "tol": tolerance}, solve, FruitCompliance
    )
