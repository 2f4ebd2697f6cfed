"""The product's rows in the benchmarks of speed against error, checked by the references of these benchmarks."""

import itertools

from benchmarks import contact, flexure, unilateral
from benchmarks.bars.check import ReferenceCheck, make_checks
from benchmarks.harness import Reference

BENCHES = {
    "contact": (contact.BENCH, contact.split_rows),
    "unilateral contact": (unilateral.BENCH, unilateral.product_rows),
    "flexures": (flexure.BENCH, flexure.product_rows),
}


def bench_checks(bench: str, rows: int) -> tuple[ReferenceCheck, ...]:
    """Return a check of the first value in each of the first `rows` rows of the product in a bench.

    `bench` is a key of `BENCHES`. Only the first value of a row has an error bar.
    """
    task, product_rows = BENCHES[bench]
    true, error = task.reference.values[0], task.reference.errors[0]
    checks: list[ReferenceCheck] = []
    for row in itertools.islice(product_rows(), rows):
        value = (1.0 + row.errors[0]) * true  # a row holds only the relative error of its value
        error_bar = row.error_bar or 0.0  # an error bar of 0 is counted as wrong
        reference = Reference(values=(true,), errors=(error,), source=f"{row.mesh} against {task.reference.source}")
        checks += make_checks((task.values[0],), (value,), (error_bar,), reference)
    return tuple(checks)
