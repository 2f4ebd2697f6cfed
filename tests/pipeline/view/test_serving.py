"""The served scene in a real browser: sliders change state and picture, strangers and other addresses get nothing."""

import io
import os
import re
import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path

import numpy as np
import pytest
from browser import browser, needs_chromium
from PIL import Image

from pipeline.cli import main
from pipeline.report.stored import read_report
from pipeline.view.loaded_sensor import forces_at

ROOT = Path(__file__).parents[3]
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def served(run_with_fields):
    """Yield the address that a server prints and its process, ended by SIGTERM."""
    with started(run_with_fields) as server:
        address = server.stdout.readline().strip()
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+/index\.html\?token=[\w-]{40,}", address), server.stderr.read()
        answered(address)
        yield address, server
        server.send_signal(signal.SIGTERM)
        assert server.wait(timeout=30) == 143
        assert "Traceback" not in server.stderr.read()


def started(folder):
    """Start a server."""
    command = [sys.executable, "-m", "pipeline", "view", str(folder), "--serve"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT, env=environment
    )


def answered(address, headers=None, tries=100):
    """Return the status of an answer, waiting for a server that is not there yet."""
    for _ in range(tries):
        try:
            with urllib.request.urlopen(urllib.request.Request(address, headers=headers or {}), timeout=5) as answer:
                return answer.status
        except urllib.error.HTTPError as error:
            return error.code
        except OSError:
            continue
    raise AssertionError(address)


def test_page_is_for_who_has_the_token(served):
    address, _ = served
    bare = address.partition("?")[0]
    assert answered(address) == 200
    assert answered(bare) == 403
    assert answered(f"{bare}?token=guess") == 403
    assert answered(address, {"Origin": "http://example.org"}) == 403
    assert answered(address, {"Host": "example.org"}) == 403


def test_nothing_else_is_listened_to(served):
    """The port answers on 127.0.0.1 alone: another address of the same machine refuses."""
    port = int(served[0].split(":")[2].partition("/")[0])
    with socket.create_connection(("127.0.0.1", port), timeout=5):
        pass
    for other in ("127.0.0.2", socket.gethostbyname(socket.gethostname())):
        if other != "127.0.0.1":
            with pytest.raises(OSError, match=r"refused|timed out"), socket.create_connection((other, port), timeout=5):
                pass


@needs_chromium
def test_slider_changes_state_and_picture(served, run_with_fields):
    report = read_report(run_with_fields)
    address, _ = served
    host, asked = address.partition("/index.html")[0], []
    with browser() as opened:
        tab = opened.new_page(viewport={"width": 1280, "height": 860})
        tab.on("request", lambda request: asked.append(request.url))
        tab.goto(address)
        picture = tab.locator("img").first
        picture.wait_for(timeout=30_000)
        tab.wait_for_timeout(3000)
        before = shown(tab)
        thumb = tab.locator(".slider-E_MPa .v-slider-thumb")
        thumb.focus()
        thumb.press("Home")
        least = min(row.E_MPa for row in report.response)
        tab.wait_for_function(f"window.trame.state.get('E_MPa') === {least}", timeout=10_000)
        tab.wait_for_timeout(5000)
        softer = shown(tab)
        tab.evaluate("window.trame.state.set('cut_axis', 'y')")
        tab.wait_for_timeout(5000)
        cut = shown(tab)
        # the probe says the displacement of the low tip: its force over its stiffness
        tab.evaluate("window.trame.state.set('cut_axis', '')")
        tab.evaluate("window.trame.state.set('field', 'total_displacement_mm')")
        x = -0.5 * report.design.tips.spacing_mm
        tab.evaluate(f"['x', 'y', 'z'].forEach((a, i) => window.trame.state.set('probe_' + a, [{x}, 0.1, 0.2][i]))")
        tab.wait_for_timeout(4000)
        tab.locator(".probe").click()
        tab.locator(".probed", has_text="displacement").wait_for(timeout=15_000)
        said = tab.locator(".probed").inner_text()
    assert [url for url in asked if not url.startswith((host, "data:", "blob:"))] == []
    assert different(before, softer) > 1e-3
    assert different(softer, cut) > 1e-3
    force = forces_at(report.response, least, report.design.press.travel_mm)[0]
    K = 1e-3 * report.springs["low"].stiffness_N_per_m
    assert float(re.search(r"\[mm\] ([\d.]+)$", said)[1]) == pytest.approx(force / K, rel=0.02)


@needs_chromium
def test_page_of_another_origin_gets_no_websocket(served):
    """A page from elsewhere that knows the address: its requests and its websocket carry an Origin, and no cookie."""
    address, _ = served
    port = address.split(":")[2].partition("/")[0]
    script = f"""(token) => new Promise((done) => {{
        const socket = new WebSocket('ws://127.0.0.1:{port}/ws' + token);
        socket.onopen = () => done('open'); socket.onerror = () => done('refused'); }})"""
    with browser() as opened:
        tab = opened.new_page()
        tab.goto("about:blank")
        assert tab.evaluate(script, "") == "refused"
        assert tab.evaluate(script, "?" + address.partition("?")[2]) == "refused"


def shown(tab) -> np.ndarray:
    area = tab.locator("main").screenshot()
    return np.asarray(Image.open(io.BytesIO(area)).convert("RGB")).astype(int)


def different(one: np.ndarray, other: np.ndarray) -> float:
    """Return the share of points that differ to the eye."""
    return float(np.mean(np.abs(one - other).max(axis=2) > 30))


def test_ctrl_c_ends_it_with_130(run_with_fields):
    with started(run_with_fields) as server:
        answered(server.stdout.readline().strip())
        server.send_signal(signal.SIGINT)
        assert server.wait(timeout=30) == 130
        assert server.stderr.read().splitlines()[-1] == "pipeline: interrupted"


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--port", "8080"], "--port = 8080: must be given with --serve"),
        (["--host", "0.0.0.0"], "--host = '0.0.0.0': must be given with --serve"),
        (["--serve", "--port", "70000"], "--port = 70000: must be 0 to 65535"),
        (["--serve", "--host", "192.0.2.1"], "must be an address of this machine and a port that is free"),
        (["--serve", "--host", 70 * "\u00fc"], "must be an address of this machine and a port that is free"),
        (["--serve", "--host", "a..b"], "must be an address of this machine and a port that is free"),
        (["--serve", "--png", "x"], "--serve = 'given with another flag': must be alone"),
    ],
)
def test_wrong_flags_are_refused(flags, words, stand_in_folder, capsys):
    assert main(["view", str(stand_in_folder), *flags]) == 2
    assert words in capsys.readouterr().err
