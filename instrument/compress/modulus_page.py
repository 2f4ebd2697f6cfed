"""The HTML page of compression tests, with plots of force against travel and of plate stress against strain."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from instrument.compress.modulus import CompressionResult
from pipeline.report.page.page_template import FIGURES, render_page
from pipeline.storage.plain import Plain

_MOST_POINTS = 400  # maximum number of points of a curve on the page; more would overlap
_STEPS = 100  # number of points of the fitted law


def modulus_page(results: Sequence[CompressionResult]) -> str:
    """Return the HTML page that shows all results."""
    tests_per_file = Counter(result.file for result in results)
    tests = [_plot_data(result, only_specimen=tests_per_file[result.file] == 1) for result in results]
    return render_page("modulus.html.j2", (*FIGURES, "modulus.js"), {"tests": tests}, results=results)


def _plot_data(result: CompressionResult, *, only_specimen: bool) -> Plain:
    """Return the data of one test for the plots of the page, as modulus.js expects them.

    The data are travel [mm], force [N], the fitted force law, strain [%] and plate stress [MPa]. Of the measured
    points, at most `_MOST_POINTS` at equal distances remain. The test is named after its file. The name of its specimen
    is appended unless it is the `only_specimen` of the file.
    """
    curve = result.curve
    geometry = result.geometry
    # A short curve has fewer points than indices, so some indices occur twice.
    indices = np.unique(np.linspace(0, len(curve.travel) - 1, _MOST_POINTS).astype(int))
    travel = curve.travel[indices]
    force = curve.force[indices]
    law_travel = np.linspace(float(curve.travel[0]), result.range_end_mm, _STEPS)
    law_force = result.fit.force(law_travel, float(curve.force.max()))
    secant = result.secants[0]  # the paper's modulus
    stem = Path(result.file).stem
    return {
        "name": stem if only_specimen else f"{stem} {result.specimen}",
        "travel": travel.tolist(),
        "force": force.tolist(),
        "law": {"travel": law_travel.tolist(), "force": law_force.tolist()},
        "touch": result.first_touch_mm,
        "failure": result.failure_mm,
        "strain": (100.0 * (travel - result.first_touch_mm) / geometry.height_mm).tolist(),
        "stress": ((force - result.fit.zero_line(travel)) / geometry.plate_area_mm2).tolist(),
        "secant": {"strain": secant.strain_percent, "E": secant.E_secant_MPa},
        "E": result.E_MPa,
        "u_percent": result.u_percent,
    }
