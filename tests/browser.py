"""A browser without a window, for tests of what users see in one."""

import io
import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Locator, sync_playwright

CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
SECONDS = 240  # until a page or a server is taken to hang
NONE = "no Chromium: set CHROMIUM to its path"
needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason=NONE)
_QUIET = (
    "--no-sandbox", "--disable-gpu", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic",
    "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync",
)  # fmt: skip


@contextmanager
def browser() -> Iterator[Browser]:
    """Open a browser that asks nobody for anything on its own; one at a time, as Playwright has one loop a process."""
    if CHROMIUM is None:
        pytest.skip(NONE)
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=CHROMIUM, args=list(_QUIET))
        try:
            yield opened
        finally:
            opened.close()


def different(one: np.ndarray, other: np.ndarray) -> float:
    """Return the share of points that differ to the eye; pictures of two sizes differ everywhere."""
    if one.shape != other.shape:
        return 1.0
    return float(np.mean(np.abs(one - other).max(axis=2) > 30))


def still_picture(area: Locator, before: np.ndarray | None = None) -> np.ndarray:
    """Return what an area shows once it stands still and is not as before, shape (height, width, 3)."""
    last, until = _shown(area), time.monotonic() + SECONDS
    while time.monotonic() < until:
        area.page.wait_for_timeout(1000)
        last, now = _shown(area), last
        if different(last, now) < 1e-5 and (before is None or different(before, last) > 1e-3):
            return last
    pytest.fail("the picture did not change, or did not come to rest")


def _shown(area: Locator) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(area.screenshot())).convert("RGB")).astype(int)
