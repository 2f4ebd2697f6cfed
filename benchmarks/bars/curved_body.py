"""The change of compliance due to the shape of a fruit and its error bar, compared with direct finite elements."""

import functools
from dataclasses import replace

from benchmarks.bars.check import ReferenceCheck, make_checks
from benchmarks.contact import BENCH, compliance_values
from benchmarks.harness import Reference
from sensor.arrays import Floats
from sensor.design.fruit import Fruit
from sensor.design.tips import Tips
from solve.fruit.body_lines import BodySteps
from solve.fruit.curved_body import SAFETY, STEPS, ShapeChange, shape_change
from solve.fruit.footprints import Footprint
from solve.fruit.split import LEVELS, contact_footprints, footprint_compliance, relative_changes

PAIR = contact_footprints(Fruit(), Tips())


@functools.cache
def change_on(fruit: Fruit, footprints: tuple[Footprint, ...], steps: BodySteps, along_normals: bool) -> ShapeChange:
    """Return the change of the compliance under footprints on one mesh; it is cached, because several cases use it."""
    return shape_change(fruit, footprints, steps, along_normals)


def pair_change(fruit: Fruit, along_normals: bool = False) -> ShapeChange:
    """Return the change of the compliance under the paper's pair of tips, on the meshes of the product."""
    return change_on(fruit, PAIR, STEPS, along_normals)


@functools.cache
def block_compliance(fruit: Fruit) -> Floats:
    """Return the compliance of the block of a fruit under the paper's pair [1/mm]."""
    return footprint_compliance(fruit.equivalent_block, PAIR, LEVELS[0]).S


def relative_bars(shape_effect: ShapeChange, S: Floats) -> Floats:
    """Return the error bars of a change, relative to the compliance S [1], in the order of `relative_changes`."""
    mesh_errors = SAFETY * relative_changes(shape_effect.mesh_difference, S)
    return mesh_errors + relative_changes(shape_effect.closed_form_error, S)


def body_checks(fruit: Fruit, truth: Reference, along_normals: bool = False) -> tuple[ReferenceCheck, ...]:
    """Return the check of s11 - s12 [1/mm] of a curved fruit.

    `truth` is the change of s11 - s12 from the equivalent block to the shape of the fruit. With `along_normals`, the
    tips press along the normals of the skin, as domes do.
    """
    shape_effect, S = pair_change(fruit, along_normals), block_compliance(fruit)
    block_value, _ = compliance_values(S)
    value, _ = compliance_values(S + shape_effect.change)
    # `relative_bars` is relative to the block, and a check expects a bar relative to the value.
    bar = relative_bars(shape_effect, S)[0] * block_value / value
    expected = replace(truth, values=(block_value + truth.values[0],))
    return make_checks(BENCH.values[:1], (value,), (float(bar),), expected)
