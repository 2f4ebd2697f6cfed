"""The cheap model of a candidate: contact, and springs as they were sized, which lean as their housing lets them."""

from collections.abc import Collection

from pipeline.evaluate import PARTS, refuse_unsolvable
from pipeline.options import RunOptions
from pipeline.reading.pressed_sensor import PressedSensor
from pipeline.springs.fitted_springs import ideal_springs, leaning_springs
from pipeline.springs.sizing import spring_sizing
from pipeline.study.scenes import scene_compliance, unit_scene
from sensor.design.parameters import Design
from solve.fruit.compliance import FruitCompliance


def sized_sensor(
    design: Design,
    tolerance: float,
    *,
    parts: Collection[str] = PARTS,
    contact: FruitCompliance | None = None,
) -> PressedSensor:
    """Return a sensor on springs as they were sized, its contact solved to a tolerance of theirs [1] unless given.

    Springs lean where a part is to be evaluated that feels it. Raises InputError, before a solve, for a scene or a pose
    that cannot be solved, MeshError or SolveError.
    """
    if parts:
        refuse_unsolvable(design)
    if contact is None:
        contact = scene_compliance(unit_scene(design), tolerance)
    sizing = spring_sizing(design, contact, RunOptions())
    springs = leaning_springs(design, sizing) if parts else ideal_springs(design, sizing)
    return PressedSensor(design=design, contact=contact, sizing=sizing, springs=springs)
