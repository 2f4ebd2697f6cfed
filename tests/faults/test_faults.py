"""The planted faults apply to the product as it is, and name tests that there are."""

import ast
import functools
import re

import pytest
from faults.patches import PRODUCT, ROOT, Change, Fault, faults, planted

FAULTS = faults()


@functools.cache
def names_in(path):
    """Return the names of the tests in a file: functions, and state machines that are assigned."""
    tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
    assigned = [target for node in tree.body if isinstance(node, ast.Assign) for target in node.targets]
    functions = [node.name for node in tree.body if isinstance(node, ast.FunctionDef)]
    return {*functions, *(target.id for target in assigned if isinstance(target, ast.Name))}


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_fault_applies_to_the_product_and_names_its_tests(fault):
    for path, text in planted(fault, ROOT).items():
        assert path.relative_to(ROOT).parts[0] in PRODUCT
        assert text != path.read_text(encoding="utf-8")
        compile(text, path, "exec")
    assert fault.tests
    for test in fault.tests:
        path, name, *_ = re.split(r"::|\[", test)
        assert name in names_in(path)


@pytest.mark.parametrize("before", ["ROOT = None\n", "import ast\n\n\n"])
def test_lines_that_are_not_found_once_are_refused(before):
    change = Change(path="sensor/verdict.py", before=before, after="")
    with pytest.raises(ValueError, match="found 0 times"):
        planted(Fault(name="none", meaning="", tests=(), changes=(change,)), ROOT)
