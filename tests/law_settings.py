"""Random settings of the sliders, and the forces that Python gives at them by the solvers of a run."""

from dataclasses import replace

import numpy as np

from pipeline.response.scene_press import pressed_at, scene_of
from solve.contact.domes.law import domes_on
from solve.contact.linear_response import linear_response
from solve.contact.poses import Pose, posed_scene

SETTINGS = 3000


def random_settings(page, rng, count):
    """Return settings over the whole range of the sliders of a page, drawn evenly; stepped sliders stand on a step."""
    law = page.evaluate("() => ({ sliders: window.twintip.law.sliders, start: window.twintip.law.start })")
    columns = {}
    for slider in law["sliders"]:
        values = rng.uniform(slider["min"], slider["max"], count)
        if "step" in slider:
            values = np.round(values / slider["step"]) * slider["step"]
        columns[slider["key"]] = values.tolist()
    settings = []
    for i in range(count):
        setting = {**law["start"], **{key: values[i] for key, values in columns.items() if not key.startswith("K-")}}
        setting["K"] = {kind: 1e-3 * columns[f"K-{kind}"][i] for kind in ("low", "high") if f"K-{kind}" in columns}
        if not setting["K"]:
            setting["K"] = law["start"]["K"]
        settings.append(setting)
    return settings


def compliance_of(result, setting):
    """Return the compliance of the springs at a setting [mm/N], shape (tips, tips)."""
    C = result.springs.C.copy()
    np.fill_diagonal(C, [1.0 / setting["K"][spring] for spring in result.design.tips.springs])
    return C


def forces_by_python(result, kind, settings):
    """Return the forces of all tips [N] at settings, shape (settings, tips)."""
    scene = scene_of(result.design, result.press.height_offsets, result.springs.sideways)
    if kind == "table":
        by_travel = {}
        for travel in {setting["travel"] for setting in settings}:
            chosen = [setting["E"] for setting in settings if setting["travel"] == travel]
            pressed = replace(scene, press=replace(scene.press, travel_mm=travel))
            by_travel[travel] = iter(pressed_at(pressed, result.contact, result.springs.C, chosen, 1).F[:, 0])
        return np.array([next(by_travel[setting["travel"]]) for setting in settings])
    found = []
    x = np.array([x for x, _ in result.design.tips.places_mm])
    for setting in settings:
        C = compliance_of(result, setting)
        if kind == "linear":
            heights = np.array(scene.height_offsets_mm) + (x - x.mean()) * np.tan(np.radians(setting["tilt"]))
            response = linear_response(result.contact.S, C, [setting["E"]], [setting["travel"]], heights.tolist())
            found.append(response.F[0, 0])
            continue
        pose = Pose(
            E=setting["E"],
            travel=setting["travel"],
            tilt_deg=(setting["tilt"], scene.press.roll_deg),
            off_centre_mm=(setting["place"], 0.0),
            radius_mm=setting["radius"],
        )
        posed = posed_scene(scene, pose)
        domes = domes_on(scene, result.contact, C, [posed], np.array([setting["E"]]), np.array([setting["travel"]]))
        found.append(domes.F[0])
    return np.array(found)


def modulus_errors(page, result, settings):
    """Return by how much forces of the browser are off those of Python, as an error of the modulus [1], (settings,).

    An error of a force is one of the modulus by what the force moves with it: |dE / E| = |dF / F| / |d ln F / d ln E|,
    the least over the tips that touch; a force below a millionth of the largest counts as none.
    """
    kind = page.evaluate("() => window.twintip.law.data.kind")
    of_browser = np.array(page.evaluate("all => all.map(window.twintip.law.forces)", settings), dtype=float)
    firmer = [{**setting, "E": setting["E"] * (1.0 + 1e-4)} for setting in settings]
    slopes = np.array(page.evaluate("all => all.map(window.twintip.law.forces)", firmer), dtype=float) - of_browser
    of_python = forces_by_python(result, kind, settings)
    off = np.abs(of_browser - of_python)
    touching = of_python > 1e-6 * of_python.max(axis=1, keepdims=True)
    assert (of_browser[~touching] <= 2e-6 * of_python.max()).all()
    moved = np.where(touching, np.abs(slopes) / 1e-4, 1.0)
    return np.where(touching, off / moved, 0.0).max(axis=1)
