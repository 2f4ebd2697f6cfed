"""A file that ends the process which reads it is a failed verdict; 100 hostile files by seed (slow)."""

import json
import random
import re
import select
import struct
import subprocess
import time
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh

from cad.checks.triangle_checks import library_mesh
from cad.files.step import write_step
from cad.files.stl import triangles
from cad.files.threemf import write_3mf
from cad.parts.housing_solid import housing_part
from cad.parts.pose import print_pose
from cad.parts.sensor import Body
from cad.quantity import InputError
from pipeline.report.check import limited_check
from pipeline.report.check.limited_check import verdicts_apart

LINE = json.dumps({"verdict": {
    "name": "files.unchanged", "value": 0.0, "unit": "1", "limit": 0.0, "tolerance": 0.0, "passed": True,
    "reference": "",
}})  # fmt: skip
ENDS = {
    "import os; os.kill(os.getpid(), 11)": "ended the process by SIGSEGV",
    "import os; os.abort()": "ended the process by SIGABRT",
    "import time; time.sleep(600)": "took more than 1 s",
    "while True: pass": "took more than 1 s",
    "import os; os._exit(3)": "failed",
    "raise ValueError('no part [/b]')": r"failed (ValueError: no part [/b])",
    "x = [0]\nwhile True: x = x + x": "failed (MemoryError)",
}


class Awaited(subprocess.Popen):
    """A process whose seconds count from its first output, so that no test hangs on how fast a process starts."""

    def communicate(self, *words, **limits):
        select.select([self.stdout], [], [], 600.0)
        return super().communicate(*words, **limits)


@pytest.mark.parametrize("program", ENDS)
def test_end_of_the_process_is_a_failed_verdict_after_those_it_had(program, tmp_path, monkeypatch):
    limited = "import resource; resource.setrlimit(resource.RLIMIT_DATA, (1 << 28, 1 << 28))"
    text = f"# {{path}}\n{limited}\nprint({LINE.replace('{', '{{').replace('}', '}}')!r}, flush=True)\n{program}"
    monkeypatch.setattr(limited_check, "_PROGRAM", text)
    if "took more" in ENDS[program]:
        monkeypatch.setattr(limited_check, "SECONDS", 1)
        monkeypatch.setattr(limited_check.subprocess, "Popen", Awaited)
    first, last = verdicts_apart(tmp_path / "part.step", "fdm-petg")
    assert (first.name, first.passed) == ("files.unchanged", True)
    assert (last.name, last.passed) == ("geometry.readable", False)
    assert last.reference.startswith(f"reading part.step {ENDS[program]}")


def test_refusal_of_the_process_is_one_of_the_command(tmp_path, monkeypatch):
    monkeypatch.setattr(limited_check, "_PROGRAM", '# {path}\nprint(\'{{"refused": "PATH: no"}}\')')
    with pytest.raises(InputError, match="PATH: no"):
        verdicts_apart(tmp_path, None)


def test_its_temporary_files_go_with_it(tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(limited_check.tempfile, "tempdir", None)
    monkeypatch.setattr(limited_check, "SECONDS", 1)
    monkeypatch.setattr(limited_check.subprocess, "Popen", Awaited)
    made = "open(tempfile.mkdtemp() + '/x', 'w').close()\nprint('{{}}', flush=True)"
    program = f"# {{path}}\nimport os, tempfile, time\n{made}\ntime.sleep(600)"
    monkeypatch.setattr(limited_check, "_PROGRAM", program)
    verdicts_apart(tmp_path / "part.step", "fdm-petg")
    assert list(tmp_path.iterdir()) == []


@pytest.fixture(scope="module")
def parts(tmp_path_factory) -> Path:
    """Return a folder with the default housing as STEP, STL and 3MF."""
    from stand_ins import default_housing

    folder = tmp_path_factory.mktemp("parts")
    solid = print_pose(housing_part(default_housing()).shape)
    write_step((Body(name="housing", shape=solid, colour=(0.5, 0.5, 0.5)),), folder / "part.step", "part")
    mesh = triangles(solid)
    library_mesh(mesh).export(folder / "part.stl")
    write_3mf({"part": mesh}, folder / "part.3mf")
    return folder


def rotted(data: bytes, rng: random.Random) -> bytes:
    """Flip one bit in each of 40 bytes."""
    bits = bytearray(data)
    for _ in range(40):
        bits[rng.randrange(len(bits))] ^= 1 << rng.randrange(8)
    return bytes(bits)


def cut(data: bytes, rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data) // 10, len(data))]


def shuffled(data: bytes, rng: random.Random) -> bytes:
    """Exchange two pieces of 1 kB."""
    a, b = sorted(rng.sample(range(0, len(data) - 2048, 1024), 2))
    return data[:a] + data[b : b + 1024] + data[a + 1024 : b] + data[a : a + 1024] + data[b + 1024 :]


def noise(data: bytes, rng: random.Random) -> bytes:
    return rng.randbytes(len(data))


def in_step(pattern: str, other: Callable[[re.Match[str], random.Random], str], share: float):
    """Return a change of a share of the matches in a STEP file."""

    def change(data: bytes, rng: random.Random) -> bytes:
        text = data.decode("ascii")
        return re.sub(pattern, lambda found: other(found, rng) if rng.random() < share else found[0], text).encode()

    return change


def in_stl(change: Callable[[np.ndarray, random.Random], np.ndarray]):
    """Return a change of the corners, shape (triangles, 3, 3), of an STL file."""

    def changed(data: bytes, rng: random.Random) -> bytes:
        mesh = trimesh.load_mesh(trimesh.util.wrap_as_stream(data), file_type="stl", process=False)
        corners = change(np.array(mesh.triangles), rng).astype("<f4")
        records = (bytes(12) + corner.tobytes() + b"\0\0" for corner in corners)
        return bytes(80) + struct.pack("<I", len(corners)) + b"".join(records)

    return changed


def with_value(value: float):
    def change(corners: np.ndarray, rng: random.Random) -> np.ndarray:
        corners[rng.randrange(len(corners)), rng.randrange(3), rng.randrange(3)] = value
        return corners

    return in_stl(change)


def in_3mf(pattern: str, other: Callable[[re.Match[str], random.Random], str], count: int = 20):
    """Return a change of the first matches in the model of a 3MF file."""

    def change(data: bytes, rng: random.Random) -> bytes:
        with zipfile.ZipFile(trimesh.util.wrap_as_stream(data)) as package:
            files = {name: package.read(name) for name in package.namelist()}
        model = files["3D/3dmodel.model"].decode()
        files["3D/3dmodel.model"] = re.sub(pattern, lambda found: other(found, rng), model, count=count).encode()
        stream = trimesh.util.wrap_as_stream(b"")
        with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as package:
            for name, content in files.items():
                package.writestr(name, content)
        return stream.getvalue()

    return change


POINT = r"CARTESIAN_POINT\('',\([^)]*\)\)"
LAUGHS = '<!DOCTYPE m [<!ENTITY a "ha">' + "".join(
    f'<!ENTITY {b} "{10 * f"&{a};"}">' for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)
HOSTILE = {
    "bit rot.step": rotted,
    "cut.step": cut,
    "shuffled.step": shuffled,
    "noise.step": noise,
    "NaN.step": in_step(POINT, lambda *_: "CARTESIAN_POINT('',(NAN,1.,1.))", 0.02),
    "huge.step": in_step(POINT, lambda *_: "CARTESIAN_POINT('',(1.E300,1.,1.))", 0.02),
    "moved.step": in_step(POINT, lambda _, rng: f"CARTESIAN_POINT('',({rng.uniform(-99, 99)},0.,0.))", 0.02),
    "rewired.step": in_step(r"(?<!^)#\d+", lambda _, rng: f"#{rng.randint(1, 2000)}", 0.01),
    "rewired much.step": in_step(r"(?<!^)#\d+", lambda _, rng: f"#{rng.randint(1, 2000)}", 0.2),
    "without lines.step": in_step(r"#\d+ = [^;]*;\n", lambda *_: "", 0.02),
    "bit rot.stl": rotted,
    "cut.stl": cut,
    "shuffled.stl": shuffled,
    "noise.stl": noise,
    "NaN.stl": with_value(float("nan")),
    "infinite.stl": with_value(float("inf")),
    "huge.stl": with_value(1e38),
    "inside out.stl": in_stl(lambda corners, _: corners[:, ::-1]),
    "one turned.stl": in_stl(lambda corners, rng: np.concatenate([corners[:1, ::-1], corners[1 + rng.randrange(1) :]])),
    "count of four billion.stl": lambda data, _: data[:80] + b"\xff" * 4 + data[84:],
    "bit rot.3mf": rotted,
    "cut.3mf": cut,
    "negative.3mf": in_3mf(r'v1="(\d+)"', lambda found, _: f'v1="-{found[1]}"'),
    "wrapped.3mf": in_3mf(r'v1="(\d+)"', lambda found, _: f'v1="-{2**32 - int(found[1])}"', 10**6),
    "beyond.3mf": in_3mf(r'v1="(\d+)"', lambda _, rng: f'v1="{rng.randint(10**6, 10**9)}"'),
    "NaN.3mf": in_3mf(r'<vertex x="[^"]*"', lambda *_: '<vertex x="nan"'),
    "huge.3mf": in_3mf(r'<vertex x="[^"]*"', lambda *_: '<vertex x="1e39"'),
    "inside out.3mf": in_3mf(r'v1="(\d+)" v2="(\d+)"', lambda found, _: f'v1="{found[2]}" v2="{found[1]}"', 10**6),
    "laughs.3mf": in_3mf(r"<model", lambda *_: LAUGHS + "]><model", 1),
    "bomb.3mf": in_3mf(r"</vertices>", lambda *_: "</vertices>" + " " * (1 << 28), 1),
}
HARMLESS = ("bit rot", "shuffled", "moved", "without lines", "rewired")
"""What may hit a name, a colour or a place that keeps the part whole."""
SEEDS = (1, 2, 3, 4)


@pytest.mark.study
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_file_ends_in_verdicts(name, seed, parts, tmp_path):
    """Of 120 files; the whole of them is read by `check` itself, in the process that it starts."""
    path, rng = tmp_path / name, random.Random(seed)
    path.write_bytes(HOSTILE[name]((parts / f"part{path.suffix}").read_bytes(), rng))
    started = time.perf_counter()
    verdicts = verdicts_apart(path, "fdm-petg")
    assert time.perf_counter() - started < limited_check.SECONDS + 10.0
    assert verdicts
    if not name.startswith(HARMLESS):
        assert [verdict.name for verdict in verdicts if verdict.passed is False]


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".step", ".stl", ".3mf"])
def test_whole_file_is_no_hostile_one(suffix, parts):
    assert [verdict for verdict in verdicts_apart(parts / f"part{suffix}", "fdm-petg") if verdict.passed is False] == []
