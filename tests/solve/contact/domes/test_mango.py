"""Domes on a mango's ball of 35 mm against contact by finite elements that share nothing with the law.

The forces are of true balls at finite strain, neo-Hooke, on the true piece of fruit, by mixed elements in another code.
"""

import numpy as np
import pytest
from squares import BALL

from pipeline.options import load_design
from pipeline.response.contact import contact_compliance
from pipeline.response.scene_press import scene_of
from reference.stored import stored
from solve.contact.domes.body import dome_body
from solve.contact.domes.geometry import dome_poses
from solve.contact.domes.law import dome_forces
from solve.contact.poses import Pose, Stand, pose_forces

LOW, HIGH = 0.15, 1.6  # stiffness [N/mm]
SPRINGS = np.diag([1.0 / LOW, 1.0 / HIGH] * 2)
HIGH_N = {0.5: 0.32776, 1.0: 0.43922, 3.5: 0.60598}
# Linear 27-node hexahedra of the piece, 24k dofs, under loads of normal distribution with a deviation of 0.7 mm: what
# curvature adds to the compliance between neighbours and across; from 20k to 38k dofs they move by 3e-6 and 2e-6.
NEIGHBOUR_CHANGE = -0.02756043 + 0.02876697
OPPOSITE_CHANGE = -0.02654397 + 0.02752876
NEIGHBOUR = 0.0361  # times E [1/mm]


@pytest.fixture(scope="module")
def mango():
    """Return the design as the forces were found, by 0.5 mm on 1600 N/m, and the compliance of its fruit."""
    design = load_design(BALL, {"press.travel_mm": 0.5})
    return design, contact_compliance(design.fruit, design.tips, tolerance=2.5e-4)


def test_level_forces_are_within_their_bars(mango):
    design, compliance = mango
    moduli = np.array(list(HIGH_N))
    scene = scene_of(design)
    travel = np.full(len(moduli), design.press.travel_mm)
    poses = dome_poses([scene] * len(moduli), travel)
    found = dome_forces(poses, moduli, SPRINGS, dome_body(scene, compliance, [scene.fruit] * len(moduli)))
    off = found.F[:, [1, 3]] - np.array(list(HIGH_N.values()))[:, None]
    assert np.all(np.abs(off) < found.error[:, [1, 3]])
    assert np.all(found.error[:, [1, 3]] < 0.0035 * found.F[:, [1, 3]])


def test_curvature_adds_to_what_neighbours_give_way(mango):
    """To 0.12 % of the compliance between neighbours: the loads are 0.8 mm wide, not points."""
    change = mango[1].shape_change
    assert change[0, 1] == pytest.approx(NEIGHBOUR_CHANGE, abs=1.2e-3 * NEIGHBOUR)
    assert change[0, 2] == pytest.approx(OPPOSITE_CHANGE, abs=1.2e-3 * NEIGHBOUR)


def test_tip_that_is_lifted_most_is_within_its_bar(mango):
    """R 28 mm, 4 deg and 1 mm off along a diagonal: the high tip that is lifted bears 0.04523 N at 1 MPa.

    The law is 0.7 mN low there, 1.5 % of this force: 0.24 mN are the body's, which is solved at the feet of the level
    press on the fruit's own radius alone. Its bar is 2.9 %.
    """
    design, compliance = mango
    share = np.sqrt(0.5)
    pose = Pose(
        E=1.0,
        travel=design.press.travel_mm,
        stand=Stand(radii_mm=(28.0, 28.0), tilt_deg=(4.0 * share, -4.0 * share), off_centre_mm=(-share, share)),
    )
    found = pose_forces(scene_of(design), compliance, SPRINGS, [pose])
    assert found.F[0, 3] == pytest.approx(0.04523, abs=found.F_error[0, 3])
    assert found.F_error[0, 3] < 0.03 * found.F[0, 3]


PRESSES = {press["name"]: press for press in stored("pressed_domes")}
OF_TIPS = {  # the diagonal of a press, and its solved tips
    "level": ((1.0, -1.0), [1, 0]),  # from the middle to the high tip that is lowered
    "lifted by tilt and place": ((1.0, -1.0), [1, 0, 3]),
    "tilted to its own side": ((1.0, -1.0), [1, 0, 3]),
    "low tip lifted from soft flesh": ((1.0, 1.0), [2, 1, 0]),
}
OWN = 1e-3  # of a force: what two meshes leave; level at 1 MPa they find 5e-4 less than the other code


@pytest.mark.parametrize("name", PRESSES)
def test_forces_in_poses_are_those_of_solids(mango, name):
    """With the level forces at 0.5 and 3.5 MPa these are six poses; every tip is compared."""
    design, compliance = mango
    diagonal, solved = OF_TIPS[name]
    press = PRESSES[name]["press"]
    x, y = np.sqrt(0.5) * np.array(diagonal)
    pose = Pose(
        E=press["E"],
        travel=press["travel"],
        stand=Stand(
            radii_mm=(press["radius"], press["radius"]),
            tilt_deg=(press["tilt_deg"] * x, press["tilt_deg"] * y),
            off_centre_mm=(press["off_centre"] * x, press["off_centre"] * y),
        ),
    )
    found = pose_forces(scene_of(design), compliance, SPRINGS, [pose])
    expected = np.array(PRESSES[name]["extrapolated_N"])
    off = np.abs(found.F[0, solved] - expected)
    assert np.all(off < found.F_error[0, solved] + OWN * expected)
