"""Sizes that keep a file readable, and statements that product code does without."""

import ast
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("cad", "mesh", "solve", "pipeline")
MAX_FUNCTION_LINES = 60
MAX_FILE_LINES = 300
MAX_ARGUMENTS = 6
TOO_WIDE = {"Exception", "BaseException"}
TRANSLATES_GMSH = "mesh/session.py:"
"""The one place that may catch Exception, if it raises again: gmsh raises that bare class and no other."""

Function = ast.FunctionDef | ast.AsyncFunctionDef
Rule = Callable[[Path], list[str]]


def _nodes(root: Path) -> Iterator[tuple[str, ast.AST]]:
    """Yield every syntax node of the four packages with the place where it stands."""
    for package in PACKAGES:
        for path in sorted((root / package).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                yield f"{path.relative_to(root)}:{getattr(node, 'lineno', 0)}", node


def long_files(root: Path) -> list[str]:
    """Fault every file over 300 lines."""
    counts = {
        path: len(path.read_text(encoding="utf-8").splitlines())
        for package in PACKAGES
        for path in (root / package).rglob("*.py")
    }
    return [f"{path.relative_to(root)}: {count} lines" for path, count in counts.items() if count > MAX_FILE_LINES]


def long_functions(root: Path) -> list[str]:
    """Fault every function over 60 lines, docstring included."""
    lengths = [
        (place, node.name, (node.end_lineno or node.lineno) - node.lineno + 1)
        for place, node in _nodes(root)
        if isinstance(node, Function)
    ]
    return [f"{place} {name}: {length} lines" for place, name, length in lengths if length > MAX_FUNCTION_LINES]


def many_arguments(root: Path) -> list[str]:
    """Fault every function with more than 6 arguments, `self` and `cls` not counted."""
    found = []
    for place, node in _nodes(root):
        if isinstance(node, Function):
            a = node.args
            every = [*a.posonlyargs, *a.args, *a.kwonlyargs, *filter(None, (a.vararg, a.kwarg))]
            count = sum(argument.arg not in ("self", "cls") for argument in every)
            if count > MAX_ARGUMENTS:
                found.append(f"{place} {node.name}: {count} arguments")
    return found


def assert_statements(root: Path) -> list[str]:
    """Fault every assert: it vanishes under `python -O`."""
    return [place for place, node in _nodes(root) if isinstance(node, ast.Assert)]


def wide_handlers(root: Path) -> list[str]:
    """Fault every handler that catches everything, bare or as Exception."""
    handlers = [(place, node) for place, node in _nodes(root) if isinstance(node, ast.ExceptHandler)]
    return [
        f"{place} catches {'everything' if node.type is None else ast.unparse(node.type)}"
        for place, node in handlers
        if _is_wide(node.type) and not (place.startswith(TRANSLATES_GMSH) and isinstance(node.body[-1], ast.Raise))
    ]


def _is_wide(kind: ast.expr | None) -> bool:
    if kind is None:
        return True
    return bool(TOO_WIDE & {getattr(part, "id", getattr(part, "attr", "")) for part in ast.walk(kind)})


_BODY = "    pass\n"
PLANTED: list[tuple[Rule, str, str]] = [
    (long_files, "x = 1\n" * 301, "cad/planted.py: 301 lines"),
    (long_functions, "def grown():\n" + _BODY * 60, "cad/planted.py:1 grown: 61 lines"),
    (long_functions, "class A:\n    async def grown(self):\n" + ("    " + _BODY) * 60, "grown: 61 lines"),
    (many_arguments, "def greedy(a, b, c, /, d, *e, f, **g):\n    pass\n", "greedy: 7 arguments"),
    (many_arguments, "class A:\n    def greedy(self, a, b, c, d, e, f, g):\n        pass\n", "greedy: 7 arguments"),
    (assert_statements, "def f(x):\n    assert x > 0\n", "cad/planted.py:2"),
    (wide_handlers, "try:\n    x = 1\nexcept:\n    pass\n", "cad/planted.py:3 catches everything"),
    (wide_handlers, "try:\n    x = 1\nexcept Exception as error:\n    raise\n", "catches Exception"),
    (wide_handlers, "try:\n    x = 1\nexcept (OSError, Exception):\n    pass\n", "catches (OSError, Exception)"),
    (wide_handlers, "try:\n    x = 1\nexcept builtins.BaseException:\n    pass\n", "BaseException"),
]
RULES = sorted({rule for rule, _, _ in PLANTED}, key=lambda rule: rule.__name__)


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.__name__)
def test_repository_keeps_the_rule(rule: Rule) -> None:
    assert rule(ROOT) == []


@pytest.mark.parametrize(("rule", "text", "fault"), PLANTED)
def test_planted_fault_is_found(rule: Rule, text: str, fault: str, plant: Callable[[Mapping[str, str]], Path]) -> None:
    found = rule(plant({"cad/planted.py": text}))
    assert len(found) == 1
    assert fault in found[0]


def test_gmsh_errors_may_be_translated_but_not_swallowed(plant: Callable[[Mapping[str, str]], Path]) -> None:
    caught = "try:\n    x = 1\nexcept Exception as error:\n    "
    assert wide_handlers(plant({"mesh/session.py": caught + "raise ValueError from error\n"})) == []
    assert wide_handlers(plant({"mesh/session.py": caught + "pass\n"})) == ["mesh/session.py:3 catches Exception"]
    assert wide_handlers(plant({"mesh/session.py": "", "mesh/volume.py": caught + "raise\n"})) != []


def test_limits_themselves_are_kept(plant: Callable[[Mapping[str, str]], Path]) -> None:
    at_limit = "def full(a, b, c, d, e, f):\n" + _BODY * 59
    root = plant({"cad/function.py": at_limit, "cad/file.py": "x = 1\n" * 300})
    assert [fault for rule in RULES for fault in rule(root)] == []
