"""The product's rows of each bench of speed against error, whose first value has the error bar."""

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
    """Return the checks of the first rows of a bench, which belong to the product."""
    of_bench, measured = BENCHES[bench]
    true, error = of_bench.reference.values[0], of_bench.reference.errors[0]
    every: list[ReferenceCheck] = []
    for row in itertools.islice(measured(), rows):
        judge = Reference(values=(true,), errors=(error,), source=f"{row.mesh} against {of_bench.reference.source}")
        every += make_checks((of_bench.values[0],), ((1.0 + row.errors[0]) * true,), (row.error_bar or 0.0,), judge)
    return tuple(every)
