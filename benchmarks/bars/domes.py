"""Forces of a square of domes on a ball and their error bars, compared with finite elements at finite strain."""

import functools
from collections.abc import Sequence

import numpy as np

from benchmarks.bars.check import ReferenceCheck, make_checks
from benchmarks.harness import ROOT, Reference
from pipeline.options import load_design
from pipeline.response.contact import contact_compliance
from pipeline.response.scene_press import scene_of
from reference.stored import stored
from solve.contact.pose_forces import Pose, Stand, pose_forces
from solve.contact.scene import Scene
from solve.fruit.compliance import FruitCompliance

BALL = ROOT / "tests" / "designs" / "ball.toml"
TRAVEL_MM, RADIUS_MM = 0.5, 35.0
LOW, HIGH = 0.15, 1.6  # stiffness of the low and the high springs [N/mm]
SPRINGS = np.diag([1.0 / LOW, 1.0 / HIGH] * 2)  # compliance [mm/N] of the four springs, in the order of `TIPS`
TIPS = ("F_l1", "F_h1", "F_l2", "F_h2")
SOLIDS = {press["name"]: press for press in stored("pressed_domes")}
# Relative error of forces extrapolated from two meshes; for a level press at 1 MPa, another code differs by 5e-4.
SOLIDS_ERROR = 1e-3


@functools.cache
def ball() -> tuple[Scene, FruitCompliance]:
    """Return the scene of the stored forces, and the compliance of its fruit, cached for all cases."""
    design = load_design(BALL, {"press.travel_mm": TRAVEL_MM})
    return scene_of(design), contact_compliance(design.fruit, design.tips, tolerance=2.5e-4)


def dome_checks(
    E: float,
    tip_indices: Sequence[int],
    truth: Reference,
    radius: float = RADIUS_MM,
    tilt_deg: tuple[float, float] = (0.0, 0.0),
    off_centre_mm: tuple[float, float] = (0.0, 0.0),
) -> tuple[ReferenceCheck, ...]:
    """Return the checks of the forces [N] on a ball of modulus E [MPa] and `radius` [mm].

    `tip_indices` are the indices of the tips whose forces are in `truth`. `tilt_deg` and `off_centre_mm` are along the
    tips and across.
    """
    scene, compliance = ball()
    stand = Stand(radii_mm=(radius, radius), tilt_deg=tuple(tilt_deg), off_centre_mm=tuple(off_centre_mm))
    solution = pose_forces(scene, compliance, SPRINGS, [Pose(E=E, travel=TRAVEL_MM, stand=stand)])
    F = solution.F[0, tip_indices]
    return make_checks([TIPS[tip] for tip in tip_indices], F, (solution.F_error[0, tip_indices] / F).tolist(), truth)


def solid_checks(solids: str, diagonal: Sequence[float], tip_indices: Sequence[int]) -> tuple[ReferenceCheck, ...]:
    """Return the checks of the forces [N] against a stored press, which was solved with solid elements.

    `solids` is the name of the stored press, and `tip_indices` are the indices of the tips whose forces are stored. The
    press is tilted and shifted along a diagonal of the square, whose signs of x and y are `diagonal`.
    """
    press = SOLIDS[solids]["press"]
    forces = np.array(SOLIDS[solids]["extrapolated_N"])
    truth = Reference(
        values=tuple(forces.tolist()),
        errors=tuple((SOLIDS_ERROR * forces).tolist()),
        source="solids at finite strain, two meshes extrapolated",
    )
    x, y = np.sqrt(0.5) * np.array(diagonal)  # unit vector along the diagonal
    tilt, off_centre = ((press[key] * x, press[key] * y) for key in ("tilt_deg", "off_centre"))
    return dome_checks(press["E"], tip_indices, truth, press["radius"], tilt, off_centre)
