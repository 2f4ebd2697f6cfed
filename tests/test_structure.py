"""Sizes and words that keep a file readable, and statements that product code does without.

The numbers are those of `python tests/metrics.py`.
"""

import ast
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import UnionType

import metrics
import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = metrics.PACKAGES
MAX_FILE_LINES = 250
MAX_FUNCTION_NODES = 250
MAX_NODES_A_LINE = 16
"""At the 90th percentile of the lines of a package."""
MAX_ARGUMENTS = 6
LEAST_DOCUMENTED = 0.95
MAX_LOOSE_DICTS = 12
TOO_WIDE = {"Exception", "BaseException"}
TRANSLATES_GMSH = "mesh/session.py:"
"""The one place that may catch Exception, if it raises again: gmsh raises that bare class and no other."""

TWO_TIPS: dict[str, str] = {
    "cad/theory/two_spring_law.py": "the law of two springs",
    "cad/design/parameters.py": "a design file names K_l and K_h, and a pair of tips by its spacing",
    "cad/design/tips.py": "the two kinds of springs have names; how many tips there are is the layout's",
    "cad/design/processes.py": "a process has a leaf thickness for soft and one for stiff springs",
    "cad/parts/housing.py": "one plate carries two arms; report.json has their dimensions by name",
    "cad/parts/fruit.py": "the faces of a pair on the fruit have names",
    "solve/housing/stiffness.py": "the default names of two springs, in one place",
    "pipeline/stages/sizing.py": "two targets size two springs",
    "pipeline/stages/springs.py": "K_l and K_h are handed to the law",
    "pipeline/verdicts/characteristic.py": "P and NL are those of two springs",
    "pipeline/report/mapping.py": "keys of report.json: K_l, K_h, F_l, F_h",
    "pipeline/uncertainty/causes.py": "what moves P and NL moves two springs",
}
"""The files that may assume two tips, each with its reason; at most 12."""
MAX_TWO_TIPS = 12

EXCESS: dict[str, dict[str, int]] = {
    "cad": {"long_files": 1, "grown_functions": 3, "two_tips": 4},
    "mesh": {"grown_functions": 1, "dense_packages": 1, "two_tips": 2},
    "solve": {"dense_packages": 1},
    "pipeline": {"grown_functions": 2, "two_tips": 12},
}
"""How many faults of each rule a package still has; the numbers only fall."""

Function = ast.FunctionDef | ast.AsyncFunctionDef
Rule = Callable[[Path], list[str]]


def _nodes(root: Path, kind: type[ast.AST] | UnionType) -> Iterator[tuple[str, ast.AST]]:
    """Yield every syntax node of a kind in the four packages with the place where it stands."""
    for path in metrics.sources(root):
        file = path.relative_to(root)
        for node in metrics.nodes(path.read_text(encoding="utf-8")):
            if isinstance(node, kind):
                yield f"{file}:{node.lineno}", node


def long_files(root: Path) -> list[str]:
    """Fault every file over 250 lines."""
    counts = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in metrics.sources(root)}
    return [f"{path.relative_to(root)}: {count} lines" for path, count in counts.items() if count > MAX_FILE_LINES]


def grown_functions(root: Path) -> list[str]:
    """Fault every function of more than 250 syntax nodes, its docstring not counted: folding lines does not help."""
    return [
        f"{function.place} {function.name}: {function.nodes} nodes"
        for function in metrics.functions(root)
        if function.nodes > MAX_FUNCTION_NODES
    ]


def dense_packages(root: Path) -> list[str]:
    """Fault every package in which a tenth of the lines have more than 16 syntax nodes."""
    found = []
    for package in PACKAGES:
        paths = [path for path in metrics.sources(root) if path.relative_to(root).parts[0] == package]
        dense = metrics.quantile([count for path in paths for count in metrics.nodes_by_line(path)], 0.9)
        if dense > MAX_NODES_A_LINE:
            found.append(f"{package}/: {dense} nodes a line at the 90th percentile")
    return found


def folded_code(root: Path) -> list[str]:
    """Fault every `# fmt: skip` on anything but data bound to a name in capitals."""
    return metrics.folded_code(root)


def undocumented(root: Path) -> list[str]:
    """Fault every public numeric function whose docstring names neither unit nor shape, where they are over 5 %."""
    numeric = [function for function in metrics.functions(root) if function.public and function.numeric]
    missing = [function for function in numeric if not function.documented]
    if len(missing) <= (1.0 - LEAST_DOCUMENTED) * len(numeric):
        return []
    return [f"{function.place} {function.name}: no unit in brackets and no shape" for function in missing]


def loose_dicts(root: Path) -> list[str]:
    """Fault every file that names `dict[str, Any]`, where there are more than 12: a dataclass says what is in it."""
    counts = {path: path.read_text(encoding="utf-8").count("dict[str, Any]") for path in metrics.sources(root)}
    if sum(counts.values()) <= MAX_LOOSE_DICTS:
        return []
    return [f"{path.relative_to(root)}: dict[str, Any] {count} times" for path, count in counts.items() if count]


def two_tips(root: Path) -> list[str]:
    """Fault every file in which the number of tips is assumed to be two, but for those with a reason."""
    return [
        f"{path}: assumes two tips; write for any number" for path in metrics.pair_files(root) if path not in TWO_TIPS
    ]


def many_arguments(root: Path) -> list[str]:
    """Fault every function with more than 6 arguments, `self` and `cls` not counted."""
    found = []
    for place, node in _nodes(root, Function):
        a = node.args
        every = [*a.posonlyargs, *a.args, *a.kwonlyargs, *filter(None, (a.vararg, a.kwarg))]
        count = sum(argument.arg not in ("self", "cls") for argument in every)
        if count > MAX_ARGUMENTS:
            found.append(f"{place} {node.name}: {count} arguments")
    return found


def assert_statements(root: Path) -> list[str]:
    """Fault every assert: it vanishes under `python -O`."""
    return [f"{place} asserts" for place, _ in _nodes(root, ast.Assert)]


def wide_handlers(root: Path) -> list[str]:
    """Fault every handler that catches everything, bare or as Exception."""
    handlers = _nodes(root, ast.ExceptHandler)
    return [
        f"{place} catches {'everything' if node.type is None else ast.unparse(node.type)}"
        for place, node in handlers
        if _is_wide(node.type) and not (place.startswith(TRANSLATES_GMSH) and isinstance(node.body[-1], ast.Raise))
    ]


def _is_wide(kind: ast.expr | None) -> bool:
    if kind is None:
        return True
    return bool(TOO_WIDE & {getattr(part, "id", getattr(part, "attr", "")) for part in ast.walk(kind)})


def beyond(faults: list[str], rule: str, excess: Mapping[str, Mapping[str, int]]) -> list[str]:
    """Return the faults of the packages that have more of them than they still may."""
    package_of = {fault: fault.partition("/")[0] for fault in faults}
    counts = Counter(package_of.values())
    allowed = {package: excess.get(package, {}).get(rule, 0) for package in counts}
    return [fault for fault in faults if counts[package_of[fault]] > allowed[package_of[fault]]]


def numeric(docstring: str, count: int = 1) -> str:
    """Return public functions of a number with a docstring."""
    one = f'(x: float) -> float:\n    """{docstring}"""\n    return x\n'
    return "\n".join(f"def f{number}{one}" for number in range(count))


NODES_4 = "    x = 1\n"
PLANTED: list[tuple[Rule, str, str]] = [
    (long_files, "x = 1\n" * 251, "cad/planted.py: 251 lines"),
    (grown_functions, "def grown():\n" + NODES_4 * 63, "cad/planted.py:1 grown: 252 nodes"),
    (grown_functions, "def grown():\n    x = [" + "0, " * 250 + "]\n", "grown: 255 nodes"),
    (grown_functions, "class A:\n    async def grown(self):\n" + ("    " + NODES_4) * 63, "grown: 252 nodes"),
    (dense_packages, f"x = [{'0, ' * 20}]\n", "cad/: 23 nodes a line at the 90th percentile"),
    (folded_code, "def f():\n    return g(1,\n        2)  # fmt: skip\n", "cad/planted.py:2"),
    (folded_code, "table = [\n    1, 2,\n]  # fmt: skip\n", "cad/planted.py:1"),
    (undocumented, numeric("Return x."), "cad/planted.py:1 f0: no unit in brackets and no shape"),
    (loose_dicts, "x: dict[str, Any]\n" * 13, "cad/planted.py: dict[str, Any] 13 times"),
    (two_tips, "def f(x):\n    low, high = x\n", "cad/planted.py: assumes two tips"),
    (two_tips, "for tip in (0, 1):\n    print(1 - tip)\n", "cad/planted.py: assumes two tips"),
    (many_arguments, "def greedy(a, b, c, /, d, *e, f, **g):\n    pass\n", "greedy: 7 arguments"),
    (many_arguments, "class A:\n    def greedy(self, a, b, c, d, e, f, g):\n        pass\n", "greedy: 7 arguments"),
    (assert_statements, "def f(x):\n    assert x > 0\n", "cad/planted.py:2"),
    (wide_handlers, "try:\n    x = 1\nexcept:\n    pass\n", "cad/planted.py:3 catches everything"),
    (wide_handlers, "try:\n    x = 1\nexcept Exception as error:\n    raise\n", "catches Exception"),
    (wide_handlers, "try:\n    x = 1\nexcept (OSError, Exception):\n    pass\n", "catches (OSError, Exception)"),
    (wide_handlers, "try:\n    x = 1\nexcept builtins.BaseException:\n    pass\n", "BaseException"),
]
RULES = sorted({rule for rule, _, _ in PLANTED}, key=lambda rule: rule.__name__)


@pytest.fixture(autouse=True, scope="module")
def _trees_forgotten() -> Iterator[None]:
    """Parse each file once for all rules, and keep none of the trees after them."""
    yield
    metrics.nodes.cache_clear()


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.__name__)
def test_repository_keeps_the_rule(rule: Rule) -> None:
    assert beyond(rule(ROOT), rule.__name__, EXCESS) == []


@pytest.mark.parametrize(("rule", "text", "fault"), PLANTED)
def test_planted_fault_is_found(rule: Rule, text: str, fault: str, plant: Callable[[Mapping[str, str]], Path]) -> None:
    found = rule(plant({"cad/planted.py": text}))
    assert len(found) == 1
    assert fault in found[0]
    assert beyond(found, rule.__name__, {}) == found


def test_excess_is_of_one_rule_in_one_package() -> None:
    faults = ["cad/a.py:1 f: 251 nodes", "cad/b.py:1 g: 300 nodes", "mesh/c.py:1 h: 251 nodes"]
    allowed = {"cad": {"grown_functions": 2}, "mesh": {"long_files": 1}}
    assert beyond(faults, "grown_functions", allowed) == faults[2:]
    allowed = {"cad": {"grown_functions": 1}, "mesh": {"grown_functions": 1}}
    assert beyond(faults, "grown_functions", allowed) == faults[:2]


def test_excess_and_reasons_are_of_rules_and_files_that_exist() -> None:
    assert EXCESS.keys() <= set(PACKAGES)
    assert {rule for rules in EXCESS.values() for rule in rules} <= {rule.__name__ for rule in RULES}
    assert len(TWO_TIPS) <= MAX_TWO_TIPS
    assert [path for path, reason in TWO_TIPS.items() if not reason or not (ROOT / path).is_file()] == []


def test_gmsh_errors_may_be_translated_but_not_swallowed(plant: Callable[[Mapping[str, str]], Path]) -> None:
    caught = "try:\n    x = 1\nexcept Exception as error:\n    "
    assert wide_handlers(plant({"mesh/session.py": caught + "raise ValueError from error\n"})) == []
    assert wide_handlers(plant({"mesh/session.py": caught + "pass\n"})) == ["mesh/session.py:3 catches Exception"]
    assert wide_handlers(plant({"mesh/session.py": "", "mesh/volume.py": caught + "raise\n"})) != []


def test_limits_themselves_are_kept(plant: Callable[[Mapping[str, str]], Path]) -> None:
    nodes_250 = NODES_4 * 62 + "    pass\n" * 2
    root = plant(
        {
            "cad/function.py": f'def full(a, b, c, d, e, f):\n    """Words do not count."""\n{nodes_250}',
            "cad/file.py": "x = 1\n" * 250,
            "cad/documented.py": numeric("Return x [mm].", 18)
            + numeric("Return x, shape (n,).")
            + numeric("Return x."),
            "cad/table.py": "TABLE = [\n    1, 2,\n]  # fmt: skip\n",
            "cad/hidden.py": "def _f(x: float) -> float:\n    return x\n",
            "mesh/dense.py": f"x = [{'0, ' * 13}]\n",
            "solve/dicts.py": "x: dict[str, Any]\n" * 12,
        }
    )
    assert [fault for rule in RULES for fault in rule(root)] == []
