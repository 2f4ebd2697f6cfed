"""The served scene in a real browser: sliders change state and picture, strangers and other addresses get nothing."""

import os
import re
import signal
import socket
import subprocess
import sys
import threading
import urllib.error
import urllib.request
from contextlib import contextmanager
from pathlib import Path

import pytest
from browser import SECONDS, browser, needs_chromium, still_picture

from pipeline.cli import main
from pipeline.report.stored import read_report
from pipeline.view.loaded_sensor import forces_at

ROOT = Path(__file__).parents[3]
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def served(run_with_fields, tmp_path_factory):
    """Yield the address that a server prints; it is ended by SIGTERM."""
    said = tmp_path_factory.mktemp("served") / "stderr"
    with started(run_with_fields, said) as (server, address):
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+/index\.html\?token=[\w-]{40,}", address), said.read_text()
        yield address
        server.send_signal(signal.SIGTERM)
        assert server.wait(timeout=SECONDS) == 143
        assert "Traceback" not in said.read_text(encoding="utf-8")


@contextmanager
def started(folder, said):
    """Start a server and yield it with the line that it prints; a server that did not end is killed."""
    command = [sys.executable, "-m", "pipeline", "view", str(folder), "--serve"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with said.open("w") as stderr:
        server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=stderr, text=True, cwd=ROOT, env=environment)
    late = threading.Timer(SECONDS, server.kill)
    try:
        late.start()
        address = server.stdout.readline().strip()
        late.cancel()
        yield server, address
    finally:
        late.cancel()
        server.kill()
        server.communicate(timeout=SECONDS)


def answered(address, headers=None):
    """Return the status of an answer."""
    try:
        with urllib.request.urlopen(urllib.request.Request(address, headers=headers or {}), timeout=SECONDS) as answer:
            return answer.status
    except urllib.error.HTTPError as error:
        return error.code


def test_page_is_for_who_has_the_token(served):
    bare = served.partition("?")[0]
    assert answered(served) == 200
    assert answered(bare) == 403
    assert answered(f"{bare}?token=guess") == 403
    assert answered(served, {"Origin": "http://example.org"}) == 403
    assert answered(served, {"Host": "example.org"}) == 403


def test_nothing_else_is_listened_to(served):
    """The port answers on 127.0.0.1 alone: another address of the same machine refuses."""
    port = int(served.split(":")[2].partition("/")[0])
    with socket.create_connection(("127.0.0.1", port), timeout=5):
        pass
    for other in {"127.0.0.2", own_address()} - {"127.0.0.1"}:
        with pytest.raises(OSError, match=r"refused|timed out"), socket.create_connection((other, port), timeout=5):
            pass


def own_address():
    """Return the address of this machine's name; a machine without one has the loopback alone."""
    try:
        return socket.gethostbyname(socket.gethostname())
    except OSError:
        return "127.0.0.1"


@needs_chromium
def test_slider_changes_state_and_picture(served, run_with_fields):
    report = read_report(run_with_fields)
    host, asked = served.partition("/index.html")[0], []
    with browser() as opened:
        tab = opened.new_page(viewport={"width": 1280, "height": 860})
        tab.on("request", lambda request: asked.append(request.url))
        area = tab.locator("main")
        tab.goto(served)
        tab.locator("img").first.wait_for(timeout=1000 * SECONDS)
        first = still_picture(area)
        thumb = tab.locator(".slider-E_MPa .v-slider-thumb")
        thumb.focus()
        thumb.press("Home")
        least = min(row.E_MPa for row in report.response)
        tab.wait_for_function(f"window.trame.state.get('E_MPa') === {least}", timeout=1000 * SECONDS)
        softer = still_picture(area, first)
        tab.evaluate("window.trame.state.set('cut_axis', 'y')")
        cut = still_picture(area, softer)
        tab.evaluate("window.trame.state.set('cut_axis', '')")
        whole = still_picture(area, cut)
        tab.evaluate("window.trame.state.set('field', 'total_displacement_mm')")
        still_picture(area, whole)
        # the probe says the displacement of the low tip: its force over its stiffness
        x = -0.5 * report.design.tips.spacing_mm
        tab.evaluate(f"['x', 'y', 'z'].forEach((a, i) => window.trame.state.set('probe_' + a, [{x}, 0.1, 0.2][i]))")
        tab.wait_for_timeout(1000)
        tab.locator(".probe").click()
        tab.locator(".probed", has_text="displacement").wait_for(timeout=1000 * SECONDS)
        said = tab.locator(".probed").inner_text()
    assert [url for url in asked if not url.startswith((host, "data:", "blob:"))] == []
    force = forces_at(report.response, least, report.design.press.travel_mm)[0]
    K = 1e-3 * report.springs["low"].stiffness_N_per_m
    assert float(re.search(r"\[mm\] ([\d.]+)$", said)[1]) == pytest.approx(force / K, rel=0.02)


@needs_chromium
def test_page_of_another_origin_gets_no_websocket(served):
    """A page from elsewhere that knows the address: its requests and its websocket carry an Origin, and no cookie."""
    port = served.split(":")[2].partition("/")[0]
    script = f"""(token) => new Promise((done) => {{
        const socket = new WebSocket('ws://127.0.0.1:{port}/ws' + token);
        socket.onopen = () => done('open'); socket.onerror = () => done('refused'); }})"""
    with browser() as opened:
        tab = opened.new_page()
        tab.goto("about:blank")
        assert tab.evaluate(script, "") == "refused"
        assert tab.evaluate(script, "?" + served.partition("?")[2]) == "refused"


def test_ctrl_c_ends_it_with_130(run_with_fields, tmp_path):
    said = tmp_path / "stderr"
    with started(run_with_fields, said) as (server, address):
        assert answered(address) == 200
        server.send_signal(signal.SIGINT)
        assert server.wait(timeout=SECONDS) == 130
        assert said.read_text(encoding="utf-8").splitlines()[-1] == "pipeline: interrupted"


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
