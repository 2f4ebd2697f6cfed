"""Hard scenes for the compliance of the fruit, and the references they are held against."""

import dataclasses
from functools import partial

from benchmarks.contact import BENCH, pair_and_own, relative_errors
from benchmarks.hard.reference_check import ReferenceCheck, attempted, checks
from benchmarks.harness import Reference
from cad.parts.fruit import solved_block
from mesh.fruit import REFINEMENTS, fruit_mesh
from pipeline.options import CONTACT_FRACTION, DEFAULT_TOLERANCE
from pipeline.response.contact import contact_compliance
from sensor.design.fruit import Fruit
from sensor.design.tips import Tips
from solve.fruit.box import Grading
from solve.fruit.compliance import FruitCompliance
from solve.fruit.direct import direct_compliance
from solve.fruit.split import LEVELS, MOST_DOFS, footprint_compliance, mesh_dofs, tip_footprints

FOUR_TIMES = 3.9
FINER = tuple(Grading(step, (0.7, 0.21, 0.063, 0.0189, 0.0081)) for step in (0.42, 0.36, 0.3, 0.25, 0.2))
# Where the split is outside its stated domain, yet tells a direct result's error: gap to a side face and spacing, in
# sides; its own error there is the step between its two finest gradings, and at close tips 7e-3 besides.
LEAST_GAP, LEAST_SPACING = 0.9, 1.04
CLOSE, CLOSE_ERROR = 1.2, 7e-3
BLOCK, TIPS = Fruit(), Tips()
TOLERANCE = CONTACT_FRACTION * DEFAULT_TOLERANCE


def paper_checks(method: str, tolerance: float = TOLERANCE) -> tuple[ReferenceCheck, ...]:
    """Return the checks of the paper's block to a relative tolerance [1] by digits that this project did not make."""
    reference = dataclasses.replace(BENCH.reference, source="two independent methods")
    return _checked(contact_compliance(BLOCK, TIPS, method, tolerance), reference)


def compliance_checks(
    fruit: Fruit = BLOCK, tips: Tips = TIPS, method: str = "auto", tolerance: float = TOLERANCE
) -> tuple[ReferenceCheck, ...]:
    """Return the checks of s11 - s12 and s11 [1/mm] to a relative tolerance [1]; raises what the solvers raise."""
    compliance = contact_compliance(fruit, tips, method, tolerance)
    return _checked(compliance, attempted(partial(contact_reference, fruit, tips, compliance)))


def _checked(compliance: FruitCompliance, reference: Reference) -> tuple[ReferenceCheck, ...]:
    source = f"{compliance.info.method.partition(',')[0]} against {reference.source}"
    judged = dataclasses.replace(reference, source=source)
    return checks(BENCH.values, pair_and_own(compliance.S), relative_errors(compliance), judged)


def contact_reference(fruit: Fruit, tips: Tips, compliance: FruitCompliance) -> Reference:
    """Return s11 - s12 and s11 [1/mm] by a finer solve, or by the other method.

    A result of the split is judged by the split on four times the dofs, or by direct FE where that takes too much
    memory; a direct one by the split where it can judge, else on meshes twice as fine at the edges.
    """
    footprints = tip_footprints(tips)
    if compliance.info.method == "split":
        for grading in FINER:
            if FOUR_TIMES * compliance.info.dofs <= mesh_dofs(fruit, footprints, grading) <= MOST_DOFS:
                finer = footprint_compliance(fruit, footprints, grading)
                return Reference(values=pair_and_own(finer.S), errors=(), source=f"split, {finer.dofs} dofs")
        return _by_direct_elements(fruit, tips, 1.0)
    gap = min(0.5 * fruit.length_mm - 0.5 * tips.spacing_mm - abs(tips.offset_mm), 0.5 * fruit.width_mm)
    can_judge = gap >= (LEAST_GAP + 0.5) * tips.side_mm and tips.spacing_mm >= LEAST_SPACING * tips.side_mm
    if can_judge and fruit.height_mm >= tips.side_mm:
        return _by_split(fruit, tips, CLOSE_ERROR if tips.spacing_mm < CLOSE * tips.side_mm else 0.0)
    return _by_direct_elements(fruit, tips, 0.5)


def _by_split(fruit: Fruit, tips: Tips, error: float) -> Reference:
    """Return the split beyond its domain, whose step between two gradings adds to its relative error [1]."""
    fine, finest = (footprint_compliance(fruit, tip_footprints(tips), grading) for grading in (LEVELS[1], FINER[0]))
    values = pair_and_own(finest.S)
    error += abs(values[0] / pair_and_own(fine.S)[0] - 1.0)
    source = f"split beyond its domain, {finest.dofs} dofs"
    return Reference(values=values, errors=tuple(error * value for value in values), source=source)


def _by_direct_elements(fruit: Fruit, tips: Tips, scale: float) -> Reference:
    """Return direct FE on its family of meshes: made finer without an error, else with its own error bar."""
    part = solved_block(fruit, tips)
    meshes = [fruit_mesh(part, fruit, tips, scale * refinement) for refinement in REFINEMENTS]
    compliance = direct_compliance(meshes, fruit.poisson)
    error = relative_errors(compliance)[0] if scale == 1.0 else 0.0
    values, source = pair_and_own(compliance.S), f"direct FE, {compliance.info.dofs} dofs"
    return Reference(values=values, errors=tuple(error * value for value in values), source=source)
