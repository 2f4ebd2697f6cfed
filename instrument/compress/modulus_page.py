"""The page of compression tests: force over travel with the fitted law, and stress over strain as in the paper."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from instrument.compress.modulus import CompressionResult
from pipeline.report.page.page_template import FIGURES, render_page
from pipeline.storage.plain import Plain

_MOST_POINTS = 400  # points of a curve on the page; more would overlap
_STEPS = 100


def modulus_page(results: Sequence[CompressionResult]) -> str:
    """Return the page of all results."""
    files = Counter(result.file for result in results)
    tests = [_test(result, alone=files[result.file] == 1) for result in results]
    return render_page("modulus.html.j2", (*FIGURES, "modulus.js"), {"tests": tests}, results=results)


def _test(result: CompressionResult, *, alone: bool) -> Plain:
    """Return the plot data of a test: travel [mm], force [N], the fitted law, strain and stress.

    A test is named after its file if it is `alone` in it, and otherwise after file and specimen.
    """
    curve = result.curve
    geometry = result.geometry
    shown = np.unique(np.linspace(0, len(curve.travel) - 1, _MOST_POINTS).astype(int))
    travel = curve.travel[shown]
    force = curve.force[shown]
    fitted = np.linspace(float(curve.travel[0]), result.range_end_mm, _STEPS)
    secant = result.secants[0]
    stem = Path(result.file).stem
    return {
        "name": stem if alone else f"{stem} {result.specimen}",
        "travel": travel.tolist(),
        "force": force.tolist(),
        "law": {"travel": fitted.tolist(), "force": result.fit.force(fitted, float(curve.force.max())).tolist()},
        "touch": result.first_touch_mm,
        "failure": result.failure_mm,
        "strain": (100.0 * (travel - result.first_touch_mm) / geometry.height_mm).tolist(),
        "stress": ((force - result.fit.zero_line(travel)) / geometry.plate_area_mm2).tolist(),
        "secant": {"strain": secant.strain_percent, "E": secant.E_secant_MPa},
        "E": result.E_MPa,
        "u_percent": result.u_percent,
    }
