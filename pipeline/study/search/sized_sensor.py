"""The cheap model of a candidate: contact, and springs as they were sized, which lean as their housing lets them."""

from collections.abc import Collection
from dataclasses import dataclass

from pipeline.evaluate import PARTS, check_targets, refuse_unsolvable
from pipeline.options import RunOptions
from pipeline.result import Evaluation
from pipeline.springs.fitted_springs import FittedSprings, ideal_springs, leaning_springs
from pipeline.springs.sizing import SpringSizing, spring_sizing
from pipeline.study.scenes import scene_compliance, unit_scene
from sensor.design.parameters import Design
from solve.fruit.compliance import FruitCompliance


@dataclass(frozen=True, kw_only=True)
class SizedSensor:
    """A design with its contact and its springs exactly as they were sized or given; no spring is fitted."""

    design: Design
    contact: FruitCompliance
    sizing: SpringSizing
    springs: FittedSprings
    parts: Collection[str]

    def evaluation(self) -> Evaluation:
        """Return the verdicts that its parts decide; raises as `check_targets`."""
        return check_targets(
            self.design, contact=self.contact, sizing=self.sizing, springs=self.springs, parts=self.parts
        )


def sized_sensor(
    design: Design,
    tolerance: float,
    *,
    parts: Collection[str] = PARTS,
    method: str = "auto",
    contact: FruitCompliance | None = None,
) -> SizedSensor:
    """Return the cheap model of a design, the contact solved to the tolerance of its springs [1] unless it is given.

    Springs lean where a part is evaluated that feels it. Raises InputError, before a solve, for a scene or a pose that
    cannot be solved, MeshError or SolveError.
    """
    if parts:
        refuse_unsolvable(design)
    if contact is None:
        contact = scene_compliance(unit_scene(design), tolerance, method)
    sizing = spring_sizing(design, contact, RunOptions())
    springs = leaning_springs(design, sizing) if parts else ideal_springs(design, sizing)
    return SizedSensor(design=design, contact=contact, sizing=sizing, springs=springs, parts=parts)
