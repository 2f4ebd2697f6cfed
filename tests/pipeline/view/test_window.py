"""The window under a virtual display shows every part of it: bodies, bars, the chart and all titles."""

import os
import shutil
import subprocess
import sys
import threading
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).parents[3]
needs_display = pytest.mark.skipif(shutil.which("Xvfb") is None, reason="Xvfb is not installed")
SCRIPT = """
import sys
from pathlib import Path
from pipeline.view.pictures import pictures
from pipeline.view.window import window_of

window = window_of(pictures(Path(sys.argv[1])), "stand-in")
window.show(auto_close=False, interactive=False)
window.screenshot(sys.argv[2])
window.close()
"""
ROWS, COLUMNS = 2, 3
SECONDS = 600  # until the window is taken to hang


@contextmanager
def virtual_display():
    """Yield the name of a screen that nobody sees; the server takes a free number and says it once it listens."""
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", "1", "-screen", "0", "1600x1000x24", "-nolisten", "tcp"],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    late = threading.Timer(SECONDS, server.kill)
    try:
        late.start()
        number = server.stdout.readline().strip()
        late.cancel()
        yield f":{number}"
    finally:
        late.cancel()
        server.kill()
        server.communicate(timeout=SECONDS)


@pytest.fixture(scope="module")
def parts(stand_in_folder, tmp_path_factory):
    """Return the six parts of the window as it stands on a virtual screen, shape (height, width, 3)."""
    path = tmp_path_factory.mktemp("window") / "window.png"
    command = [sys.executable, "-c", SCRIPT, str(stand_in_folder), str(path)]
    with virtual_display() as display:
        subprocess.run(command, cwd=ROOT, env={**os.environ, "DISPLAY": display}, check=True, timeout=SECONDS)
    whole = np.asarray(Image.open(path).convert("RGB")).astype(int)
    height, width = whole.shape[0] // ROWS, whole.shape[1] // COLUMNS
    return [
        whole[row * height : (row + 1) * height, column * width : (column + 1) * width]
        for row in range(ROWS)
        for column in range(COLUMNS)
    ]


def dark(part):
    return float(np.mean(part.max(axis=2) < 100))


@needs_display
@pytest.mark.slow
def test_each_part_has_a_title_and_something_below_it(parts):
    for part in parts:
        title, body = part[: len(part) // 8], part[len(part) // 8 :]
        assert dark(title) > 2e-3  # letters
        assert np.mean(np.abs(body - body[-1, 0]).max(axis=2) > 20) > 0.02


@needs_display
@pytest.mark.slow
def test_each_field_has_its_bar_of_colours_and_the_chart_its_curve(parts):
    """The darkest red of a bar in the lowest fifth; the blue of the curve, over more than half of the chart's width."""
    *_, low, high, fruit, chart = parts
    for part in (low, high, fruit):
        lowest = part[-len(part) // 5 :]
        assert np.mean((lowest[..., 0] > 100) & (lowest[..., 1] < 30) & (lowest[..., 2] < 60)) > 1e-3
    blue = (chart[..., 2] > chart[..., 0] + 60) & (chart[..., 2] > chart[..., 1] + 20)
    assert np.mean(blue.any(axis=0)) > 0.5
