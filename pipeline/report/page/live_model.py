"""What the sliders of the page compute with: the numbers of the report, and the same law in Python.

Where flat sharp tips meet a flat fruit, forces follow from the compliance of fruit and springs for every modulus,
travel and stiffness; elsewhere from the table of the report, between its rows.
"""

import math
from dataclasses import asdict, dataclass, fields

import numpy as np

from cad.theory.contrast_law import ContrastLaw, ReadingError, read_modulus
from cad.theory.hertz import mean_relative_curvature
from cad.theory.two_spring_law import SOFTEST, Springs, fruit_stiffness
from cad.tips.layouts import SpringGroups
from pipeline.report.stored import StoredReport
from pipeline.response.scene_press import LINEAR_MODULI, TRAVELS, scene_of
from pipeline.storage.plain import Plain
from solve.arrays import Floats
from solve.contact.linear_response import linear_response

_JUDGED = ("P_max", "NL", "P_displacement_independent")


@dataclass(frozen=True, kw_only=True, eq=False)
class LiveModel:
    """The numbers behind the sliders.

    S [1/mm] and C [mm/N] have shape (tips, tips); `along` [mm] is where each tip stands from their middle, `ahead` [mm]
    how far before the foremost; `soft` says which tips are on the soft springs. `K_m_over_E` [mm] and `stiffness_ratio`
    [1] are those of the two-spring law. `linear` says that forces follow from S and C. `contrast` reads three or more
    tips, None for a pair.
    """

    linear: bool
    S: Floats
    C: Floats
    groups: SpringGroups
    along: Floats
    ahead: tuple[float, ...]
    K_m_over_E: float
    stiffness_ratio: float
    contrast: ContrastLaw | None

    @property
    def springs(self) -> Springs:
        """Return the soft and the stiff spring [N/mm]."""
        own = [1.0 / float(self.C[kind[0], kind[0]]) for kind in (self.groups.low, self.groups.high)]
        return Springs(**{field.name: K for field, K in zip(fields(Springs), own, strict=True)})

    @property
    def by_ratio(self) -> bool:
        """Say whether the modulus is read from the force ratio, and not from the contrast of three or more tips."""
        return self.contrast is None

    def forces(self, E: float, travel: float, tilt_deg: float) -> Floats:
        """Return the force of each tip [N], shape (tips,), at modulus E [MPa], travel [mm] and tilt [deg]."""
        ahead = np.array(self.ahead) + self.along * math.tan(math.radians(tilt_deg))
        found = linear_response(self.S, self.C, [E], [travel], ahead.tolist(), groups=self.groups)
        return np.asarray(found.F[0, 0])

    def modulus_read(self, E: float, travel: float, tilt_deg: float) -> float:
        """Return the modulus that the sensor reads [MPa], nan where it has no reading."""
        F = self.forces(E, travel, tilt_deg)
        try:
            if self.contrast is not None:
                return read_modulus(self.contrast, F.tolist())
            if not (F > 0.0).all():
                return math.nan
            ratio = float(F[list(self.groups.high)].mean() / F[list(self.groups.low)].mean())
            return fruit_stiffness(self.springs, ratio, self.stiffness_ratio) / self.K_m_over_E
        except (ReadingError, ValueError):
            return math.nan


def live_model(report: StoredReport) -> LiveModel:
    """Return the model of a report; raises InputError as its scene does."""
    design = report.design
    tips = design.tips
    contact = report.compliance
    pair = contact.per_spring(*tips.spring_groups)
    level_by_weight = design.press.attitude == "side" or report.housing is None
    x = np.array([tip.x_mm for tip in report.tips])
    return LiveModel(
        linear=scene_of(design).linear and level_by_weight and contact.skin is None,
        S=contact.S,
        C=np.array(report.read_out.springs_mm_per_N),
        groups=tips.spring_groups,
        along=x - x.mean(),
        ahead=tips.height_offset_mm,
        K_m_over_E=pair.K_m_over_E(),
        stiffness_ratio=pair.stiffness_ratio(),
        contrast=report.read_out.contrast,
    )


def live_data(report: StoredReport, model: LiveModel) -> Plain:
    """Return what the page's own script needs, as plain data; units are mm, N, MPa, stiffness in N/mm."""
    design = report.design
    tips = design.tips
    middle = len(design.fruit.E_MPa) // 2
    return {
        "linear": model.linear,
        "S": model.S.tolist(),
        "C": model.C.tolist(),
        "springs": list(tips.springs),
        "names": [tip.name for tip in report.tips],
        "soft": list(model.groups.low),
        "stiff": list(model.groups.high),
        "along": model.along.tolist(),
        "ahead": list(model.ahead),
        "K_m_over_E": model.K_m_over_E,
        "stiffness_ratio": model.stiffness_ratio,
        "contrast": None if model.contrast is None else asdict(model.contrast),
        "face": tips.face_mm2,
        "dome": _dome(report),
        "start": {"E": design.fruit.E_MPa[middle], "travel": design.press.travel_mm},
        "scene": {"travels": TRAVELS, "moduli": LINEAR_MODULI, "softest": SOFTEST},
        **_asked(report),
        "table": _table(report),
    }


def _asked(report: StoredReport) -> Plain:
    """Return what is asked of the sensor: its range, the targets and tolerances judged, what the fruit stands."""
    fruit = report.design.fruit
    judged = {}
    for verdict in report.verdicts:
        if verdict.name in _JUDGED:
            judged[verdict.name] = {
                "limit": verdict.limit,
                "tolerance": verdict.tolerance,
                "relative": verdict.relative,
            }
    return {
        "E_max": fruit.E_max_MPa,
        "definition": report.design.nominal_targets.NL_definition,
        "judged": judged,
        "bruise": {"E": list(fruit.E_MPa), "limit": list(fruit.bruise_limits_MPa)},
    }


def _table(report: StoredReport) -> Plain:
    rows = report.response
    return {
        "E": [row.E_MPa for row in rows],
        "x": list(rows[0].x_mm),
        "F": [[list(force) for force in row.tip_forces] for row in rows],
        "P": [list(row.P) for row in rows],
    }


def _dome(report: StoredReport) -> Plain | None:
    """Return relative radius [mm] and Poisson's ratio, which the contact radius of a dome follows from; else None."""
    radius = report.design.tips.dome_radius_mm
    fruit = report.design.fruit
    if radius is None:
        return None
    return {"radius": mean_relative_curvature(radius, *fruit.radii_mm), "poisson": fruit.poisson}
