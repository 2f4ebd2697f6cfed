"""Hard presses and targets: travel, modulus, tilt, springs of very different stiffness, and the law that sizes them."""

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import nnls

from cad.design.parameters import Design, Fruit, Press, Targets, Tips
from cad.theory.two_spring_law import Definition, Springs, force_ratio, nonlinearity, size_springs
from pipeline.bench.hard.reference_check import Claim, DeclinedError, HardCase
from pipeline.stages.contact import contact_compliance
from solve.contact.cells import folded, footprint_compliance
from solve.contact.linear_response import spring_compliance
from solve.contact.response import scene_response
from solve.contact.scene import Scene
from solve.contact.unilateral import travels
from solve.fruit.compliance import Compliance
from solve.fruit.split import Foot
from solve.halfspace.punch import graded_edges

Floats = NDArray[np.float64]

ROUNDING = 1e-9  # relative: what a closed formula may lose
CELLS = (22, 32)  # a side, of the independent solution; the product takes 18 and 26, or 14 and 20 with roll
ROLLED = (16, 24)
GRADING = 2.0
ORDER = 1.5  # of cells of constant pressure under an edge
SPRINGS = (0.9057, 20.831)  # [N/mm]
BLOCK, TIPS = Fruit(), Tips()


@dataclass(frozen=True, kw_only=True)
class Pressing:
    """One state of a scene: modulus [MPa], travel [mm], springs [N/mm]."""

    E: float = 1.0
    x: float = 0.6
    springs: tuple[float, float] = SPRINGS


def flat_claims(pressing: Pressing) -> tuple[Claim, ...]:
    """Return the claim that P of level flat tips is the paper's law with K_m = E / (s11 - s12), its error that of s."""
    compliance = contact_compliance(BLOCK, TIPS)
    found = _response(Scene(fruit=BLOCK, tips=TIPS, press=Press(travel_mm=pressing.x)), compliance, pressing)
    K_m = pressing.E * compliance.K_m_over_E_mm
    low, high = pressing.springs
    expected = (1.0 / low + 1.0 / K_m) / (1.0 / high + 1.0 / K_m)
    force = pressing.x / (1.0 / low + 1.0 / K_m) if abs(low - high) <= ROUNDING * high else None
    claims = [_rounded("P", found[1] / found[0], expected, "paper's law (3)")]
    if force is not None:
        claims.append(_rounded("F", found[0], force, "springs in series"))
    return tuple(claims)


def _rounded(name: str, value: float, reference: float, by: str) -> Claim:
    return Claim(name=name, value=value, bar=ROUNDING * abs(reference), reference=reference, uncertainty=0.0, by=by)


def _response(scene: Scene, compliance: Compliance, pressing: Pressing) -> tuple[float, float]:
    C = spring_compliance(*pressing.springs)
    found = scene_response(scene, compliance, C, [pressing.E], [pressing.x]).responses[0]
    return float(found.F_l[0]), float(found.F_h[0])


def scene_claims(scene: Scene, pressing: Pressing) -> tuple[Claim, ...]:
    """Return the claims on both forces under unilateral contact, against another solver on two finer grids."""
    compliance = contact_compliance(scene.fruit, scene.tips)
    C = spring_compliance(*pressing.springs)
    found = scene_response(scene, compliance, C, [pressing.E], [pressing.x])
    error = 0.01 * float(found.error_percent[0, 0])
    forces = float(found.responses[0].F_l[0]), float(found.responses[0].F_h[0])
    if max(forces) == 0.0:
        msg = f"off the fruit, P is null: the travel of {pressing.x:g} mm reaches no middle of a cell"
        raise DeclinedError(msg)
    cells = CELLS if scene.press.roll_deg == 0.0 else ROLLED
    coarse, fine = (_independent(scene, compliance, pressing, n) for n in cells)
    step = (fine - coarse) / ((cells[1] / cells[0]) ** ORDER - 1.0)
    claims = []
    for name, value, reference, change in zip(("F_l", "F_h"), forces, fine + step, step, strict=True):
        if value > 0.0 or reference > ROUNDING * float(np.max(fine)):
            claims.append(
                Claim(
                    name=name, value=value, bar=error * value, reference=float(reference),
                    uncertainty=abs(float(change)), by=f"least squares over forces on {cells[1]} cells a side",
                )
            )  # fmt: skip
    return tuple(claims)


def _independent(scene: Scene, compliance: Compliance, pressing: Pressing, cells: int) -> Floats:
    """Return both forces by non-negative least squares, which shares the influence but neither cells nor solver."""
    block = scene.fruit.equivalent_block
    feet = tuple(Foot(x, scene.tips.side_mm) for x in scene.centres)
    edges = graded_edges(cells, GRADING)
    whole = footprint_compliance(block, feet, edges)
    prints = folded(whole) if scene.press.roll_deg == 0.0 else whole
    gap = scene.fruit_gap(*prints.places.T) + scene.tip_gap(*prints.local.T) - scene.first_touch_mm
    faces = np.isfinite(gap)
    entered = (travels(prints, pressing.x, scene.press.tilt_deg, scene.press.roll_deg) - gap)[faces]
    A, tips = prints.compliance[np.ix_(faces, faces)], np.eye(2)[prints.owner[faces]]
    give = pressing.E * spring_compliance(*pressing.springs)
    if scene.tips.shape != "sphere":
        give = give + np.array(compliance.S) - np.linalg.inv(tips.T @ np.linalg.solve(A, tips))
    near = entered > 0.0
    if not near.any():
        return np.zeros(2)
    lower = cholesky(A[np.ix_(near, near)] + tips[near] @ give @ tips[near].T, lower=True)
    scale = float(np.abs(entered).max())
    right = solve_triangular(lower, entered[near] / scale, lower=True)
    f = nnls(lower.T, right, maxiter=100 * len(right))[0]
    forces: Floats = pressing.E * scale * (tips[near].T @ f)
    return forces


def law_claims(P_max: float, NL: float, definition: Definition = "mid-range") -> tuple[Claim, ...]:
    """Return the claims that the sized springs have the targets; the nonlinearity is found by searching P itself."""
    targets = Targets(P_max=P_max, NL=NL, NL_definition=definition)
    K_m = 4.6292
    springs = size_springs(targets.P_max, targets.NL, K_m, targets.NL_definition)
    steps = np.linspace(0.0, 1.0, 20001) if definition == "largest" else np.array([0.5])
    # K_h + K_m and so on, written out: no function of the law is used.
    m = steps * K_m
    ratio = springs.K_h * (m + springs.K_l) / (springs.K_l * (m + springs.K_h))
    top = springs.K_h * (K_m + springs.K_l) / (springs.K_l * (K_m + springs.K_h))
    bend = float(np.max((ratio - 1.0) / (top - 1.0) - steps))
    # P - 1 loses digits where P is close to 1; a search over steps finds the largest bend to 1e-7.
    allowed = (ROUNDING if definition == "mid-range" else 1e-7) + 1e-15 / ((P_max - 1.0) * NL)
    return (
        Claim(name="NL", value=nonlinearity(springs, K_m, targets.NL_definition), bar=allowed * NL, reference=bend,
              uncertainty=ROUNDING * NL, by="P searched over the range"),
        Claim(name="NL", value=nonlinearity(springs, K_m, targets.NL_definition), bar=allowed * NL, reference=NL,
              uncertainty=0.0, by="target"),
        _rounded("P_max", force_ratio(springs, K_m), P_max, "target"),
    )  # fmt: skip


def given_claims(K_l: float, K_h: float) -> tuple[Claim, ...]:
    """Return the claim that springs of any ratio give the paper's P."""
    springs = Springs(K_l=K_l, K_h=K_h)
    return flat_claims(Pressing(springs=(springs.K_l, springs.K_h), E=3.5))


def _design_claims(table: str, key: str, value: float) -> Sequence[Claim]:
    """Return no claim: a design with this value must have been refused."""
    design = Design()
    changed = dataclasses.replace(getattr(design, table), **{key: value})
    return flat_claims(Pressing(x=dataclasses.replace(design, **{table: changed}).press.travel_mm))


LAWS = (*((P, NL) for P in (1.05, 5.0, 50.0) for NL in (0.005, 0.05, 0.2)), (1.0001, 1e-4), (100.0, 0.4999))
MODULI = (1e-3, 1.0, 1e5)
TILTS: tuple[tuple[str, dict[str, object], dict[str, float], Pressing], ...] = (
    ("tilt 0.5 deg", {}, {"tilt_deg": 0.5}, Pressing()),
    ("tilt 5 deg", {}, {"tilt_deg": 5.0}, Pressing()),
    ("tilt -5 deg", {}, {"tilt_deg": -5.0}, Pressing()),
    ("tilt 15 deg", {}, {"tilt_deg": 15.0}, Pressing()),
    ("tilt 15 deg, roll 10 deg", {}, {"tilt_deg": 15.0, "roll_deg": 10.0}, Pressing()),
    ("tilt 1 deg, E 1e-3 MPa", {}, {"tilt_deg": 1.0}, Pressing(E=1e-3)),
    ("tilt 1 deg, E 1e5 MPa", {}, {"tilt_deg": 1.0}, Pressing(E=1e5)),
    ("tilt 1 deg, travel 1e-6 mm", {}, {"tilt_deg": 1.0}, Pressing(x=1e-6)),
    ("tilt 1 deg, travel 5 mm", {}, {"tilt_deg": 1.0}, Pressing(x=5.0)),
    ("tilt 1 deg, springs 1000:1", {}, {"tilt_deg": 1.0}, Pressing(springs=(0.02, 20.0))),
    ("tilt 5 deg, springs 1000:1", {}, {"tilt_deg": 5.0}, Pressing(springs=(0.02, 20.0))),
    ("roll 0.5 deg", {}, {"roll_deg": 0.5}, Pressing()),
    ("sphere of radius 35 mm", {"shape": "sphere", "radius_mm": 35.0}, {}, Pressing()),
    ("sphere of radius 35 mm, tilt 15 deg", {"shape": "sphere", "radius_mm": 35.0}, {"tilt_deg": 15.0}, Pressing()),
    ("sphere of radius 35 mm, travel 1e-6 mm", {"shape": "sphere", "radius_mm": 35.0}, {}, Pressing(x=1e-6)),
    ("tilt 21 deg", {}, {"tilt_deg": 21.0}, Pressing()),
    ("tilt 1 deg, nu 0.4999", {"poisson": 0.4999}, {"tilt_deg": 1.0}, Pressing()),
    ("tilt 1 deg, nu 0.49999", {"poisson": 0.49999}, {"tilt_deg": 1.0}, Pressing()),
)


def cases() -> Iterator[HardCase]:
    """Yield the hard targets, moduli, travels, springs and tilts."""
    for P_max, NL in LAWS:
        what = f"P_max {P_max:g}, NL {NL:g}"
        yield HardCase(group="law", what=what, claims=partial(law_claims, P_max, NL), answerable=True)
    yield HardCase(group="law", what="P_max 5, largest NL 0.05", claims=partial(law_claims, 5.0, 0.05, "largest"))
    for key, value in (("NL", 0.5), ("NL", 0.0), ("P_max", 1.0), ("P_max", 1e3)):
        yield HardCase(group="law", what=f"{key} {value:g}", claims=partial(_design_claims, "targets", key, value))
    for E in MODULI:
        yield HardCase(group="press", what=f"E {E:g} MPa", claims=partial(flat_claims, Pressing(E=E)), answerable=True)
    for x in (1e-6, 5.0):
        yield HardCase(
            group="press", what=f"travel {x:g} mm", claims=partial(flat_claims, Pressing(x=x)), answerable=True
        )
    yield HardCase(group="press", what="travel 12 mm", claims=partial(_design_claims, "press", "travel_mm", 12.0))
    yield HardCase(group="press", what="tilt 31 deg", claims=partial(_design_claims, "press", "tilt_deg", 31.0))
    yield HardCase(group="press", what="springs 1000:1", claims=partial(given_claims, 0.02, 20.0))
    yield HardCase(group="press", what="springs 1e6:1", claims=partial(given_claims, 2e-5, 20.0))
    for what, fruit, press, pressing in TILTS:
        claims = partial(_tilted_claims, fruit, press, pressing)
        yield HardCase(group="press", what=what, claims=claims)


def _tilted_claims(fruit: dict[str, Any], press: dict[str, float], pressing: Pressing) -> tuple[Claim, ...]:
    piece = dataclasses.replace(BLOCK, **fruit)
    scene = Scene(fruit=piece, tips=TIPS, press=Press(travel_mm=pressing.x, **press))
    return scene_claims(scene, pressing)
