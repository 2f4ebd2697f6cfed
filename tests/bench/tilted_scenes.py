"""Random tilted scenes judged by direct finite elements: rigid tips that lower and turn with the sensor.

All faces touch whole at full travel, so that the displacement under each tip is known but for what its spring gives:
three graded meshes of the half y >= 0 answer a unit press of each tip and a unit turn of all, and the forces follow
from the balance with the springs. Nothing of the contact engine is used.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from skfem import ElementTetP2, Mesh

from cad.design.fruit import Fruit
from cad.design.tips import Press, Tips
from cad.parts.fruit import fruit_half
from mesh.fruit import REFINEMENTS, fruit_mesh
from pipeline.bench.hard.reference_check import ReferenceCheck
from pipeline.response.contact import contact_compliance
from solve.contact.pressure import footprint_pressure
from solve.contact.response import scene_response
from solve.contact.scene import Scene
from solve.elasticity import stiffness_matrix, vector_basis
from solve.error_estimate import richardson
from solve.fruit.direct import EDGE_RATE, FACES, SIDE, VERTICAL, outline_size
from solve.linear import factorised

SOURCE = "direct FE of tips that turn, three meshes"


@dataclass(frozen=True)
class TiltedScene:
    """A flat fruit under sharp tips that press with a tilt: modulus [MPa], compliance of the springs [mm/N]."""

    fruit: Fruit
    tips: Tips
    press: Press
    E: float
    C: np.ndarray


def random_tilted(rng: np.random.Generator) -> TiltedScene:
    """Draw a scene; whether its faces touch whole is seen where it is solved."""
    side = float(np.exp(rng.uniform(np.log(0.7), np.log(4.0))))
    spacing = side * float(rng.uniform(2.0, 7.0))
    fruit = Fruit(
        length_mm=spacing + side * float(rng.uniform(5.0, 10.0)),
        width_mm=side * float(rng.uniform(5.0, 12.0)),
        height_mm=side * float(rng.uniform(3.0, 9.0)),
        poisson=float(rng.uniform(0.1, 0.45)),
    )
    travel = side * float(rng.uniform(0.2, 0.6))
    steepest = math.degrees(math.atan(0.5 * travel / (0.5 * spacing + side)))
    return TiltedScene(
        fruit=fruit,
        tips=Tips(side_mm=side, spacing_mm=spacing),
        press=Press(travel_mm=travel, tilt_deg=float(rng.uniform(0.2, 1.0)) * steepest),
        E=float(rng.uniform(0.5, 3.5)),
        C=np.diag([1.0 / (side * rng.uniform(0.5, 2.0)), 1.0 / (side * rng.uniform(5.0, 30.0))]),
    )


def tilted_checks(scene: TiltedScene) -> tuple[ReferenceCheck, ...] | None:
    """Return the force ratio and the force of the low tip against direct FE; None where a face does not touch whole."""
    compliance = contact_compliance(scene.fruit, scene.tips)
    where, travel = Scene(fruit=scene.fruit, tips=scene.tips, press=scene.press), scene.press.travel_mm
    pressure = footprint_pressure(where, compliance, scene.C, scene.E, travel)
    if not (pressure.cell_forces > 0.0).all():
        return None
    response = scene_response(where, compliance, scene.C, [scene.E], [travel])
    part = fruit_half(scene.fruit, scene.tips)
    meshes = [fruit_mesh(part, scene.fruit, scene.tips, scale) for scale in REFINEMENTS]
    forces = np.array([_forces(mesh, scene) for mesh in meshes])
    sizes = [outline_size(mesh) for mesh in meshes]
    P, low = (richardson(values.tolist(), sizes, EDGE_RATE) for values in (forces[:, 1] / forces[:, 0], forces[:, 0]))
    return tuple(
        ReferenceCheck(
            name=name,
            value=value,
            error=error * value,
            reference=limit.value,
            reference_error=limit.error,
            source=SOURCE,
        )
        for name, value, error, limit in (
            ("P tilted", float(response.P[0, 0]), float(response.P_error[0, 0]), P),
            ("F_l tilted", float(response.F[0, 0, 0]), float(response.F_error[0, 0]), low),
        )
    )


def _forces(mesh: Mesh, scene: TiltedScene) -> np.ndarray:
    """Return the forces of both tips [N] on one mesh of the half."""
    basis = vector_basis(mesh, ElementTetP2(), order=2)
    K = stiffness_matrix(basis, 1.0, scene.fruit.poisson)
    under = [basis.get_dofs(face).all([f"u^{VERTICAL}"]) for face in FACES]
    base, plane = basis.get_dofs("base").all(), basis.get_dofs(SIDE).all(["u^2"])
    factor = factorised(K, np.concatenate([base, plane, *under]))
    x = basis.doflocs[0][factor.fixed]
    loads = [np.where(np.isin(factor.fixed, dofs), 1.0, 0.0) for dofs in under]
    turned = sum(load * (x - centre) for load, centre in zip(loads, scene.tips.centres_mm, strict=True))
    reactions = K @ factor.solve(np.zeros((basis.N, 3)), np.column_stack([*loads, turned]))
    stiffness = 2.0 * scene.E * np.array([reactions[dofs].sum(axis=0) for dofs in under])
    slope = math.tan(math.radians(scene.press.tilt_deg))
    centres = np.array(scene.tips.centres_mm)
    travels = scene.press.travel_mm + (centres - centres.mean()) * slope
    given = stiffness[:, :2] @ travels + stiffness[:, 2] * slope
    return np.linalg.solve(np.eye(2) + stiffness[:, :2] @ scene.C, given)


def tilted_scenes(count: int, seed: int) -> Iterator[Sequence[ReferenceCheck]]:
    """Yield the checks of a number of scenes whose faces touch whole."""
    rng, found = np.random.default_rng(seed), 0
    while found < count:
        checks = tilted_checks(random_tilted(rng))
        if checks is not None:
            found += 1
            yield checks
