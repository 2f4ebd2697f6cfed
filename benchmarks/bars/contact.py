"""Hard cases for the compliance of the fruit under the tips, and their references."""

import dataclasses
from functools import partial

from benchmarks.bars.check import ReferenceCheck, make_checks, try_reference
from benchmarks.contact import BENCH, compliance_values, relative_errors
from benchmarks.harness import Reference
from pipeline.options import CONTACT_FRACTION, DEFAULT_TOLERANCE
from pipeline.response.contact import contact_compliance
from reference.direct_fruit import direct_compliance
from reference.fruit_meshes import REFINEMENTS, fruit_mesh, solved_block
from sensor.design.fruit import Fruit
from sensor.design.tips import Tips
from solve.fruit.box import Grading
from solve.fruit.compliance import FruitCompliance
from solve.fruit.split import MOST_DOFS, contact_footprints, footprint_compliance, mesh_dofs
from solve.linear import SolveError

FOUR_TIMES = 3.9  # smallest ratio of dofs that is accepted as four times as many
DIRECT_ERROR = 1e-2  # largest relative error of a reference by direct FE
# Gradings of meshes that are finer than the meshes of the product, from coarse to fine.
FINER = tuple(Grading(step, (0.7, 0.21, 0.063, 0.0189, 0.0081)) for step in (0.42, 0.36, 0.3, 0.25, 0.2))
BLOCK, TIPS = Fruit(), Tips()
TOLERANCE = CONTACT_FRACTION * DEFAULT_TOLERANCE


def truth_checks(truth: Reference, fruit: Fruit = BLOCK, tolerance: float = TOLERANCE) -> tuple[ReferenceCheck, ...]:
    """Return the checks of s11 - s12 and s11 [1/mm] of the paper's pair against known values.

    The compliance is solved to a relative `tolerance` [1].
    """
    return _check_pair(contact_compliance(fruit, TIPS, tolerance), truth)


def compliance_checks(
    fruit: Fruit = BLOCK, tips: Tips = TIPS, tolerance: float = TOLERANCE
) -> tuple[ReferenceCheck, ...]:
    """Return the checks of s11 - s12 and s11 [1/mm] against the finer solution from `contact_reference`.

    The compliance is solved to a relative `tolerance` [1]. Raises InputError or SolveError if the compliance cannot be
    solved. If only the reference cannot be solved, the checks have no reference.
    """
    compliance = contact_compliance(fruit, tips, tolerance)
    return _check_pair(compliance, try_reference(partial(contact_reference, fruit, tips, compliance)))


def direct_checks(fruit: Fruit, tips: Tips = TIPS) -> tuple[ReferenceCheck, ...]:
    """Return the checks of s11 - s12 and s11 [1/mm] against a direct finite-element (FE) solution.

    Raises SolveError if the relative error of direct FE exceeds `DIRECT_ERROR`.
    """
    reference = _direct_reference(fruit, tips)
    if reference.relative_error > DIRECT_ERROR:
        bound = f"must be at most {DIRECT_ERROR:g}"
        msg = f"relative error of direct FE = {reference.relative_error:.2g}: {bound}. Use finer meshes."
        raise SolveError(msg)
    return _check_pair(contact_compliance(fruit, tips), reference)


def _check_pair(compliance: FruitCompliance, reference: Reference) -> tuple[ReferenceCheck, ...]:
    """Return the checks of s11 - s12 and s11 [1/mm]; the source names the methods of both sides."""
    source = f"{compliance.info.method.partition(',')[0]} against {reference.source}"
    named_reference = dataclasses.replace(reference, source=source)
    return make_checks(BENCH.values, compliance_values(compliance.S), relative_errors(compliance), named_reference)


def contact_reference(fruit: Fruit, tips: Tips, compliance: FruitCompliance) -> Reference:
    """Return s11 - s12 and s11 [1/mm], solved by the product's own method with four times the dofs.

    `compliance` is the solution that is checked. The first mesh of `FINER` with enough dofs is used, and its values
    are taken as exact. If every such mesh needs too much memory, direct FE is used instead.
    """
    footprints = contact_footprints(fruit, tips)
    for grading in FINER:
        if FOUR_TIMES * compliance.info.dofs <= mesh_dofs(fruit, footprints, grading) <= MOST_DOFS:
            finer = footprint_compliance(fruit, footprints, grading)
            return Reference(values=compliance_values(finer.S), errors=(), source=f"split, {finer.dofs} dofs")
    return _direct_reference(fruit, tips)


def _direct_reference(fruit: Fruit, tips: Tips) -> Reference:
    """Return the reference by direct FE on three meshes, with its own error bar."""
    part = solved_block(fruit, tips)
    meshes = [fruit_mesh(part, fruit, tips, refinement) for refinement in REFINEMENTS]
    compliance = direct_compliance(meshes, fruit.poisson)
    error = relative_errors(compliance)[0]
    values = compliance_values(compliance.S)
    source = f"direct FE, {compliance.info.dofs} dofs"
    return Reference(values=values, errors=tuple(error * value for value in values), source=source)
