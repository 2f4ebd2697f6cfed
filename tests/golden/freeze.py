"""What the commands answer for frozen scenes: exit codes, names of files and every number that they print.

`python tests/golden/freeze.py NAME...` writes the goldens of the named scenes (all without a name). Do that only for a
correction, and say in the commit which number moved and why.
"""

import contextlib
import io
import json
import os
import platform
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from sensor.arrays import Floats
from twintip import cli

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
NUMBERS = HERE / "numbers"

RUNS: dict[str, list[str]] = {
    "paper": ["--nl", "0.05"],
    "mango": ["--design", "mango"],
    "fouly": ["--design", "docs/examples/fouly.toml"],
    "paper-on-mango": ["--design", "paper-on-mango"],
    "pla": ["--process", "fdm-pla"],
    "nylon": ["--process", "sls-pa12"],
    "resin": ["--process", "sla-resin"],
    "steel": ["--process", "dmls-17-4ph"],
    "tilted": ["--set", "press.tilt_deg=0.5"],
    "curved": [
        *("--set", "fruit.shape=ellipsoid", "--set", "fruit.radius_mm=35", "--set", "fruit.radius_across_mm=30"),
        *("--set", "fruit.height_mm=", "--set", "fruit.thickness_mm=12"),
    ],
    "unprintable": ["--nl", "0.002"],
}
"""The flags of `pipeline run` by the name of the scene."""

NOT_FROZEN = ("seconds", "cpu_seconds", "versions", "digest", "sha256", "dofs", "notes", "remedy", "status", "files")
"""Keys whose values are times, versions or texts."""

LONGEST = 12
"""Of a longer list of numbers the first, the last and ten between stand for all."""


def command(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run one command of the pipeline in a process of its own."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    line = [sys.executable, "-m", "twintip", *arguments]
    return subprocess.run(line, cwd=ROOT, env=environment, capture_output=True, encoding="utf-8", check=False)


def here(*arguments: str) -> tuple[int, str]:
    """Run a command that solves nothing in this process; return its exit code and what it printed."""
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        code = cli.main(arguments)
    return code, printed.getvalue()


def frozen(name: str, folder: Path) -> dict[str, Any]:
    """Return what a scene answers, files written into an empty folder."""
    out = folder / name
    ended = command("run", *RUNS[name], "--out", str(out))
    if ended.returncode not in (0, 1):
        raise RuntimeError(ended.stderr)
    answer = answer_of_run(ended.returncode, out)
    if name == "paper":
        made = folder / "made"
        answer["design exit"] = command("design", "--out", str(made)).returncode
        answer["design files"] = sorted(path.name for path in made.iterdir())
    if name in ("paper", "mango"):
        answer["measured"] = measured(out, folder)
    return answer


def answer_of_run(code: int, out: Path) -> dict[str, Any]:
    """Return what a run answers by its exit code and its output folder."""
    report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    return {
        "exit": code,
        "files": sorted(path.name for path in out.iterdir()),
        "response.csv": (out / "response.csv").read_text(encoding="utf-8").splitlines()[0],
        "numbers": numbers(report),
        "bar": error_bar(report),
    }


def measured(out: Path, folder: Path) -> dict[str, Any]:
    """Return what calibrating a unit of the scene and reading forces with it gives."""
    report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    weights = folder / f"{out.name}-weights.csv"
    lines = ["tip,weight_g,deflection_mm"]
    for tip in report["tips"]:
        kind = report["flexures"][tip["spring"]]["stiffness_N_per_m"]
        for grams in (10.0, 20.0, 30.0):
            lines.append(f"{tip['name']},{grams},{1.03 * 9.80665e-3 * grams / kind * 1e3:.9f}")
    weights.write_text("\n".join(lines) + "\n", encoding="utf-8")
    unit = folder / f"{out.name}-unit.toml"
    exit_code, _ = here("calibrate", str(out), str(weights), "--out", str(unit))
    readings = []
    for row in report["response"]:
        press = np.array(row.get("F_N") or [row["F_l_N"], row["F_h_N"]], dtype=float).T
        asked = ["--forces", ",".join(f"{force:.9g}" for force in press[-1])]
        if len(report["tips"]) > len("lh"):
            asked = [str(_press_file(folder / f"{out.name}-press.csv", press))]
        readings.append(here("read", str(out), *asked, "--unit", str(unit), "--json"))
    return {
        "calibrate exit": exit_code,
        "unit.toml": numbers(tomllib.loads(unit.read_text(encoding="utf-8"))),
        "read exit": [code for code, _ in readings],
        "read": [numbers(json.loads(printed)) for _, printed in readings],
    }


def _press_file(path: Path, press: Floats) -> Path:
    """Write forces [N], (samples, tips), as the log of a press; return its path."""
    lines = [",".join(["t_s", *(f"F_{tip}_N" for tip in range(1, press.shape[1] + 1))])]
    lines += [",".join(f"{value:.9g}" for value in (index, *row)) for index, row in enumerate(press.tolist())]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def numbers(value: Any, key: str = "") -> dict[str, Any]:
    """Return every number, truth value, None and name in a tree by its path."""
    found: dict[str, Any] = {}
    if isinstance(value, dict):
        for name, inside in value.items():
            if name not in NOT_FROZEN:
                found.update(numbers(inside, f"{key}.{name}".strip(".")))
    elif isinstance(value, list):
        step = max(1, len(value) // (LONGEST - 1))
        chosen = [*range(0, len(value) - 1, step), len(value) - 1] if len(value) > LONGEST else range(len(value))
        found[f"{key}.length"] = len(value)
        for index in chosen:
            found.update(numbers(value[index], f"{key}.{index}"))
    elif not isinstance(value, str) or key.endswith((".name", ".spring", ".effect", ".unit")):
        found[key] = value
    return found


def error_bar(report: dict[str, Any]) -> float:
    """Return the relative error that the report itself gives its forces: of the contact and of both springs."""
    springs = [spring.get("error_percent") or 0.0 for spring in report.get("flexures", {}).values()]
    return 1e-2 * ((report["contact"]["error_percent"] or 0.0) + sum(springs))


def machine() -> str:
    """Name what the last digits of a number depend on: processor, linear-algebra kernel and threads."""
    model = platform.processor() or platform.machine()
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8").partition("\n\n")[0]
        told = {key.strip(): value.strip() for key, _, value in (line.partition(":") for line in text.splitlines())}
        # Processors of one name have kernels of their own generation, which family and model tell.
        model = f"{told['model name']} {told['cpu family']}.{told['model']}"
    except (OSError, KeyError):
        pass
    kernel = os.environ.get("OPENBLAS_CORETYPE", "own")
    return f"{model}, kernel {kernel}, {os.cpu_count()} cores"


def main() -> None:
    """Write the goldens of the scenes named on the command line."""
    NUMBERS.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        for name in sys.argv[1:] or RUNS:
            answer = {"machine": machine(), **frozen(name, Path(folder))}
            text = json.dumps(answer, indent=0)
            (NUMBERS / f"{name}.json").write_text(text + "\n", encoding="utf-8")
            print(name, answer["exit"], len(answer["numbers"]))


if __name__ == "__main__":
    main()
