"""Every verdict of a run in one place: what was asked, what was found, and the paper's springs beside it."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from cad.finding import Finding
from cad.parameters import Design, Tips
from cad.springs import Springs
from pipeline.sizing import Sizing
from pipeline.springs import PrintedSprings
from pipeline.verdicts import (
    PAPER,
    PAPER_TARGETS,
    Judged,
    Verdict,
    bruise_verdict,
    displacement_verdict,
    monotonic_verdict,
    printable_verdict,
    stiffness_verdict,
    target_verdicts,
)
from solve.compliance import Compliance
from solve.response import spring_compliance, travels
from solve.scene import Scene
from solve.scene_response import SceneResponse, scene_response

Floats = NDArray[np.float64]

TRAVELS = 12
_SCAN = 20  # moduli, from the least asked for to E_max, at which P must rise


@dataclass(frozen=True, kw_only=True)
class Case:
    """What judges any springs: a design and the contact of its tips with its fruit."""

    design: Design
    contact: Compliance
    sizing: Sizing

    def judged(self, springs: Springs, errors: tuple[float, float] = (0.0, 0.0)) -> Judged:
        """Return springs [N/mm] with their errors against the stiffest fruit under the true contact."""
        K_m = self.sizing.K_m_max_contact
        K_m_error = 0.01 * self.contact.error_percent * K_m
        return Judged(springs=springs, K_m_max=K_m, spring_errors=errors, K_m_error=K_m_error)

    def respond(self, C: Floats, moduli: Sequence[float], count: int = TRAVELS) -> SceneResponse:
        """Return the response at each modulus [MPa] of springs with compliance C, shape (2, 2) [mm/N]."""
        design = self.design
        scene = Scene(fruit=design.fruit, tips=design.tips, press=design.press)
        return scene_response(scene, self.contact, C, moduli, travels(design.press.travel_mm, count))

    def behaviour(self, C: Floats, found: SceneResponse) -> tuple[Verdict, Verdict]:
        """Return the verdicts on P over the travel and over the modulus."""
        fruit = self.design.fruit
        least = min(min(fruit.E_MPa), 0.5 * fruit.E_max_MPa)
        scan = np.linspace(least, fruit.E_max_MPa, _SCAN)
        rising = self.respond(C, [float(E) for E in scan], count=1)
        return displacement_verdict(found.responses, _spread_error(found)), monotonic_verdict(rising.responses)


def _spread_error(found: SceneResponse) -> float:
    """Return how far the spread of P may be off: twice its error where cells are solved, 0 where P is one number."""
    known = found.P_error_percent[np.isfinite(found.P_error_percent)]
    return 0.02 * float(known.max()) if found.cells and len(known) else 0.0


def judge(
    case: Case, printed: PrintedSprings, geometry: Sequence[Finding], found: SceneResponse
) -> tuple[Verdict, ...]:
    """Return the verdicts on a design's own springs, on their response and on the part that carries them."""
    K, errors = printed.stiffnesses, printed.errors
    low, high = printed.low, printed.high
    return (
        *target_verdicts(case.judged(K, errors), case.design.targets),
        stiffness_verdict("K_l", low.target, low.stiffness, errors[0]),
        stiffness_verdict("K_h", high.target, high.stiffness, errors[1]),
        *case.behaviour(printed.compliance, found),
        printable_verdict(low),
        printable_verdict(high),
        *(Verdict(**asdict(finding)) for finding in geometry),
        *_tip_shape(case.design.tips),
        *_bruise(case.design, found),
    )


def _tip_shape(tips: Tips) -> tuple[Verdict, ...]:
    """Return a failed verdict where the tips are not those of the housing: sharp square ones."""
    if tips.shape == "cube" and tips.fillet_mm == 0.0:
        return ()
    return (
        Verdict(
            name="geometry.tip_shape",
            value=None,
            unit="1",
            limit="cube without fillet",
            tolerance=None,
            passed=False,
            reference=f"the response is that of a {tips.shape} with a fillet of {tips.fillet_mm:g} mm, the housing has "
            "sharp square tips: a ground tip must take their place, and its give is not in K_l and K_h",
        ),
    )


def _bruise(design: Design, found: SceneResponse) -> tuple[Verdict, ...]:
    limit = design.fruit.bruise_limit_MPa
    return () if limit is None else (bruise_verdict(largest_pressure(design, found), limit),)


def largest_pressure(design: Design, found: SceneResponse) -> float:
    """Return the largest force of the response over the face of a tip [MPa]."""
    face = design.tips.side_mm**2 * (1.0 if design.tips.shape == "cube" else math.pi / 4.0)
    return max(float(max(one.F_l.max(), one.F_h.max())) for one in found.responses) / face


def judge_paper(case: Case) -> tuple[Verdict, ...]:
    """Return the verdicts on the paper's own springs and targets under the contact of this design."""
    C = spring_compliance(PAPER.K_l, PAPER.K_h)
    return (
        *target_verdicts(case.judged(PAPER), PAPER_TARGETS),
        *case.behaviour(C, case.respond(C, case.design.fruit.E_MPa)),
    )
