"""What the sliders of the page compute with: the numbers of the law that gives forces in a scene.

Flat level tips on flat fruit follow from the compliances of fruit and springs for every setting, domes on a sphere or a
plane from Hertz's law on the same compliances; other scenes from the presses that were solved.
"""

import math
from dataclasses import asdict

import numpy as np

from cad.theory.hertz import mean_relative_radius
from cad.theory.two_spring_law import SOFTEST
from pipeline.report.stored import StoredReport
from pipeline.response.scene_press import LINEAR_MODULI, TRAVELS, ScenePress, scene_of
from pipeline.result import SensorResult
from pipeline.storage.plain import Plain
from solve.contact.domes.body import dome_body
from solve.contact.domes.large_strain import DEEPEST, NEO_HOOKE, coefficients
from solve.contact.scene import Scene
from solve.fruit.compliance import FruitCompliance

_JUDGED = ("P_max", "NL", "P_displacement_independent")


def law_data(report: StoredReport, result: SensorResult) -> Plain:
    """Return what law.js reads; lengths in mm, forces in N, moduli in MPa, compliance in mm/N, angles in deg."""
    design = report.design
    contact = result.contact
    tips = design.tips
    fruit = design.fruit
    scene = scene_of(design, result.press.height_offsets, result.springs.sideways)
    pair = contact.per_spring(*tips.spring_groups)
    x, y = np.array(tips.axes_mm).T
    contrast = report.read_out.contrast
    return {
        "kind": "table" if contact.skin is not None else _kind_of(scene),
        "S": contact.S.tolist(),
        "C": [list(row) for row in report.read_out.springs_mm_per_N],
        "springs": list(tips.springs),
        "low": list(tips.spring_groups.low),
        "high": list(tips.spring_groups.high),
        "x": x.tolist(),
        "y": y.tolist(),
        "heights": list(scene.height_offsets_mm),
        "tilt": design.press.tilt_deg,
        "roll": design.press.roll_deg,
        "travel": design.press.travel_mm,
        "K_m_over_E": pair.K_m_over_E(),
        "stiffness_ratio": pair.stiffness_ratio(),
        "poisson": fruit.poisson,
        "face": tips.face_mm2,
        "E": list(fruit.E_MPa),
        "E_max": fruit.E_max_MPa,
        "definition": design.nominal_targets.NL_definition,
        "bruise": list(fruit.bruise_limits_MPa),
        "contrast": None if contrast is None else asdict(contrast),
        "lean": report.read_out.lean_mm_per_N,
        "level": [asdict(row) for row in report.read_out.level],
        "full_scale": list(report.read_out.full_scale_N),
        "scene": {"travels": TRAVELS, "moduli": LINEAR_MODULI, "softest": SOFTEST},
        "dome": _dome(scene, contact),
        "reading": _reading(report),
        "judged": _judged(report),
        "table": _table(result.press),
    }


def _kind_of(scene: Scene) -> str:
    """Return by what the browser finds forces: the linear law, that of domes, or the table."""
    if scene.linear:
        return "linear"
    radius, across = scene.fruit.radii_mm
    dome = scene.tips.dome_radius_mm
    return "domes" if dome is not None and radius == across else "table"


def _reading(report: StoredReport) -> Plain | None:
    """Return what a reading has to stand; the noise of a named read-out is the largest share of a full scale [%]."""
    reading = report.design.reading
    if reading is None:
        return None
    keys = asdict(reading)
    signal = report.read_out.signal
    if signal is not None:
        shares = zip(signal.errors_N, report.read_out.full_scale_N, strict=True)
        keys["noise_percent"] = max(100.0 * noise / full_scale for noise, full_scale in shares)
    return keys


def _dome(scene: Scene, contact: FruitCompliance) -> Plain | None:
    """Return domes and the body under them; None for other tips."""
    dome = scene.tips.dome_radius_mm
    if dome is None:
        return None
    radius = scene.fruit.radii_mm[0]
    body = dome_body(scene, contact, np.array([radius]))
    return {
        "radius": dome,
        "fruit_radius": radius if math.isfinite(radius) else None,
        "strain": coefficients(NEO_HOOKE, body.poisson),
        "deepest": DEEPEST,
        "relative_radius": mean_relative_radius(dome, *scene.fruit.radii_mm),
        "remainder": body.remainder[0].tolist(),
        "shape_change": contact.shape_change.tolist(),
        "sideways": None if scene.sideways is None else scene.sideways.compliance.tolist(),
        "built": list(scene.tips.height_offset_mm),
        "beside": [list(point) for point in scene.tips.beside_mm],
        "half_face": 0.5 * scene.tips.side_mm,
        "printed": scene.tips.socket == "none",
    }


def _judged(report: StoredReport) -> Plain:
    """Return targets and tolerances of the verdicts that follow from the forces alone."""
    judged = {}
    for verdict in report.verdicts:
        if verdict.name in _JUDGED:
            keys = ("limit", "tolerance", "relative")
            judged[verdict.name] = {key: getattr(verdict, key) for key in keys}
    return judged


def _table(press: ScenePress) -> Plain:
    """Return the presses at six travels over equal steps of the modulus, but for what stands for the softest fruit."""
    curve = press.curve
    return {"E": curve.E[1:].tolist(), "x": curve.x.tolist(), "F": np.moveaxis(curve.F[1:], 2, 1).tolist()}
