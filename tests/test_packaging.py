"""The lock is complete and names no place to download from; the make commands of the documents exist."""

import ast
import functools
import hashlib
import re
import sys
import tomllib
from importlib.metadata import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
PACKAGES = ("sensor", "cad", "mesh", "solve", "pipeline", "instrument", "twintip")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
EXTRAS = PROJECT["optional-dependencies"]

PIN = re.compile(r"(?P<name>[A-Za-z0-9._-]+)==(?P<version>[0-9][A-Za-z0-9.+!]*)")
DISTRIBUTION = {
    "OCP": "cadquery",
    "python_calamine": "python-calamine",
    "skfem": "scikit-fem",
    "vtkmodules": "pyvista",
}
NEEDED_BY_TRIMESH = {"rtree"}


def pins(text):
    """Return version by name; raises ValueError for a line that is more, or less, than a pinned version."""
    found = {}
    for line in text.splitlines():
        if line and not line.startswith("#"):
            match = PIN.fullmatch(line)
            if match is None:
                msg = f"{line!r}: must be name==version"
                raise ValueError(msg)
            found[canonicalize_name(match["name"])] = match["version"]
    return found


def locked():
    """Return what the lock pins."""
    return pins((ROOT / "requirements.lock").read_text(encoding="utf-8"))


def make_targets():
    """Return the targets of the Makefile."""
    return set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), flags=re.MULTILINE))


@functools.cache
def imported_distributions():
    """Return the distributions that the packages of the product import at the top of a module or inside a function."""
    names = set()
    for path in (path for package in PACKAGES for path in (ROOT / package).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                names |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                names.add((node.module or "").partition(".")[0])
    return {DISTRIBUTION.get(name, name) for name in names - sys.stdlib_module_names - set(PACKAGES)}


def test_lock_holds_pinned_versions_and_no_address():
    text = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    assert pins(text)
    assert re.findall(r"https?:|file:|index|find-links| @ |^\s*-", text, flags=re.MULTILINE) == []


@pytest.mark.parametrize(
    "line", ["numpy", "numpy>=2", "numpy @ file:///numpy.whl", "--index-url x", "-e .", "numpy==2.4 --hash=sha256:0"]
)
def test_planted_line_in_lock_is_refused(line):
    with pytest.raises(ValueError, match=r"must be name==version"):
        pins(f"scipy==1.17.1\n{line}\n")


@pytest.mark.parametrize("text", [*PROJECT["dependencies"], *EXTRAS["dev"]])
def test_dependency_is_locked_inside_its_range(text):
    requirement = Requirement(text)
    assert requirement.specifier
    assert requirement.specifier.contains(locked()[canonicalize_name(requirement.name)])


def test_own_packages_are_never_asked_of_an_index():
    """The names sensor, cad, solve and pipeline belong to other people's projects there."""
    groups = [PROJECT["dependencies"], *EXTRAS.values()]
    asked = {canonicalize_name(Requirement(text).name) for group in groups for text in group}
    assert (asked | locked().keys()) & {*PACKAGES, "twintip"} == set()


def test_every_import_is_declared():
    wanted = [text for name, texts in EXTRAS.items() if name != "dev" for text in texts]
    declared = {Requirement(text).name for text in [*PROJECT["dependencies"], *wanted]}
    assert imported_distributions() - declared == set()


def test_every_dependency_is_imported():
    declared = {Requirement(text).name for text in PROJECT["dependencies"]}
    assert declared - NEEDED_BY_TRIMESH - imported_distributions() == set()


def noticed_licences(text):
    """Return the licence by package in the table of NOTICE."""
    return dict(re.findall(r"^\| ([\w-]+) +\| ([\w.-]+) +\| \S", text, flags=re.MULTILINE)[1:])


def wrong_licences(licences):
    """Return the packages whose installed metadata does not name the family of their licence, as BSD or GPL."""
    fields = ("License-Expression", "License", "Classifier")
    told = {name: " ".join(map(str, (metadata(name).get_all(field) for field in fields))) for name in licences}
    return [name for name, licence in licences.items() if licence.partition("-")[0] not in told[name]]


def test_notice_has_the_licence_of_each_dependency():
    licences = noticed_licences((ROOT / "NOTICE").read_text(encoding="utf-8"))
    assert licences.keys() == {Requirement(text).name for text in [*PROJECT["dependencies"], *EXTRAS["cluster"]]}
    assert wrong_licences(licences) == []
    assert wrong_licences({"gmsh": "MIT", "rich": "MIT"}) == ["gmsh"]


def test_documented_make_commands_are_targets():
    pages = (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md")))
    text = "".join(page.read_text(encoding="utf-8") for page in pages)
    shown = set(re.findall(r"(?:^    |`)make ([a-z-]+)\b", text, flags=re.MULTILINE))
    assert {"run", "test"} <= shown
    assert shown <= make_targets()


def test_ci_runs_make_targets():
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    called = re.findall(r"^ *make ([a-z-]+)$", script, flags=re.MULTILINE)
    assert called == ["setup", "design", "test-all"]
    assert set(called) <= make_targets()


def test_workflow_checks_each_push_and_runs_studies_each_night():
    lines = (ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8").splitlines()
    runs = [line.partition("run: ")[2] for line in lines if "run: " in line]
    assert {"bash .ci/run", "make test-studies"} <= set(runs)
    assert [line for line in lines if line.strip().startswith("- cron:")] != []
    assert "    if: github.event_name == 'schedule'" in lines


def test_version_is_the_same_wherever_it_stands():
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    newest, date = re.findall(r"^## ([\d.]+) - ([\d-]+)$", changes, flags=re.MULTILINE)[0]
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert newest == PROJECT["version"]
    assert f'\nversion: "{newest}"\ndate-released: "{date}"\n' in citation


def test_hooks_before_a_commit_are_the_checks_of_make_lint():
    text = (ROOT / "Makefile").read_text(encoding="utf-8")
    (recipe,) = re.findall(r"^lint: setup\n((?:\t.+\n)+)", text, flags=re.MULTILINE)
    (workers,) = re.findall(r"^WORKERS \?= (\d+)$", text, flags=re.MULTILINE)
    checks = re.findall(r"^\t\$\(BIN\)/(.+)$", recipe.replace("$(WORKERS)", workers), flags=re.MULTILINE)
    hooks = (ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8")
    assert re.findall(r"entry: \.venv/bin/(.+)", hooks) == checks
    assert hooks.count("language: system") == hooks.count("- id:") == len(checks)
    assert "http" not in hooks


def test_only_the_quick_tests_of_make_leave_slow_ones_out():
    """`make test` is for the desk, `make test-all`, which .ci/run calls, for what is accepted, studies by hand."""
    text = (ROOT / "Makefile").read_text(encoding="utf-8")
    recipes = dict(re.findall(r"^(test[a-z-]*):.*\n\t(.+)$", text, flags=re.MULTILINE))
    every = "$(ONE_THREAD) $(BIN)/pytest -n $(WORKERS) --dist worksteal -m "
    assert recipes["test"] == f'{every}"not slow and not study"'
    assert recipes["test-all"] == f'{every}"not study"'
    assert recipes["test-studies"] == f"{every}study"


LIBRARIES = ROOT / "pipeline" / "report" / "page" / "libraries"


@pytest.mark.parametrize("path", sorted(LIBRARIES.glob("*.js")), ids=lambda path: path.name)
def test_library_of_the_page_is_the_one_that_notice_names(path):
    """What a page carries is what its authors publish, with its licence."""
    notice = (ROOT / "NOTICE").read_text(encoding="utf-8")
    (digest,) = re.findall(rf"^{re.escape(path.name)} .*\n +sha256 ([0-9a-f]{{64}})$", notice, flags=re.MULTILINE)
    assert hashlib.sha256(path.read_bytes()).hexdigest() == digest
    assert path.with_name(path.name.replace(".min.js", ".LICENSE")).is_file()
