"""Every verdict of a run in one place: what was asked, what was found, and the paper's springs beside it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cad.design.parameters import Design, Tips
from cad.theory.two_spring_law import Springs
from cad.verdict import Verdict, failed
from pipeline.stages.sizing import Sizing
from pipeline.stages.springs import PrintedSprings
from pipeline.stages.verdict_rules import (
    PAPER,
    PAPER_TARGETS,
    Judged,
    bruise_verdict,
    displacement_verdict,
    monotonic_verdict,
    printable_verdict,
    stiffness_verdict,
    target_verdicts,
)
from solve.contact.linear_response import spring_compliance, travels
from solve.contact.response import SceneResponse, scene_response
from solve.contact.scene import Scene
from solve.fruit.compliance import Compliance

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
        q = self.sizing.asymmetry
        return Judged(springs=springs, K_m_max=K_m, spring_errors=errors, K_m_error=K_m_error, asymmetry=q)

    def respond(self, C: Floats, moduli: Sequence[float], count: int = TRAVELS) -> SceneResponse:
        """Return the response at each modulus [MPa] of springs with compliance C, shape (2, 2) [mm/N]."""
        design = self.design
        scene = Scene(fruit=design.fruit, tips=design.tips, press=design.press)
        return scene_response(scene, self.contact, C, moduli, travels(design.press.travel_mm, count))

    def hardest(self, C: Floats) -> SceneResponse:
        """Return the response at the largest modulus that is asked for, at full travel alone."""
        fruit = self.design.fruit
        return self.respond(C, [max(fruit.E_max_MPa, *fruit.E_MPa)], count=1)

    def spring_shares(self, printed: PrintedSprings, E: float) -> tuple[float, float]:
        """Return what the errors of both stiffnesses do to the force of their tip at modulus E [%]."""
        S, C = np.array(self.contact.S), printed.compliance
        crosstalk = 0.5 * (S[0, 1] + S[1, 0])
        low, high = (
            float(C[i, i] / (C[i, i] + (S[i, i] - crosstalk) / E)) * (spring.error_percent or 0.0)
            for i, spring in enumerate((printed.low, printed.high))
        )
        return low, high

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
    case: Case, printed: PrintedSprings, geometry: Sequence[Verdict], found: SceneResponse
) -> tuple[Verdict, ...]:
    """Return the verdicts on a design's own springs, on their response and on the part that carries them."""
    K, errors = printed.stiffnesses, printed.errors
    low, high = printed.low, printed.high
    return (
        *target_verdicts(case.judged(K, errors), case.design.targets, made=printed.housing is not None),
        stiffness_verdict("K_l", low, errors[0], plain=printed.plain),
        stiffness_verdict("K_h", high, errors[1], plain=printed.plain),
        *case.behaviour(printed.compliance, found),
        printable_verdict(low),
        printable_verdict(high),
        *(geometry or (_NOT_MADE,)),
        *_tip_shape(case.design.tips),
        *_bruise(case, printed),
    )


_NOT_MADE = failed("geometry.made", "a housing", unit="1", reference="no housing was made, see printable.low and .high")


def _tip_shape(tips: Tips) -> tuple[Verdict, ...]:
    """Return a failed verdict where the tips are not those of the housing: sharp square ones, or pins as asked for."""
    if tips.socket == "pin" or (tips.shape == "cube" and tips.fillet_mm == 0.0):
        return ()
    return (
        Verdict(
            name="geometry.tip_shape",
            value=None,
            unit="1",
            limit="cube without fillet",
            tolerance=None,
            passed=False,
            reference="the response is that of the tips asked for, the housing has sharp square ones; choose "
            "tips.socket = 'pin' for ground pins of that shape",
        ),
    )


def _bruise(case: Case, printed: PrintedSprings) -> tuple[Verdict, ...]:
    limit = case.design.fruit.bruise_limit_MPa
    return () if limit is None else (bruise_verdict(limit=limit, **largest_pressure(case, printed)),)


def largest_pressure(case: Case, printed: PrintedSprings) -> dict[str, float]:
    """Return the largest force over the face of a tip as `pressure`, and its `error` [MPa]."""
    tips, found = case.design.tips, case.hardest(printed.compliance)
    face = tips.side_mm**2 * (1.0 if tips.shape == "cube" else math.pi / 4.0)
    response = found.responses[0]
    pressure = float(max(response.F_l[-1], response.F_h[-1])) / face
    known = float(np.nan_to_num(found.error_percent[0, -1])) + max(case.spring_shares(printed, response.E))
    return {"pressure": pressure, "error": 0.01 * known * pressure}


def judge_paper(case: Case) -> tuple[Verdict, ...]:
    """Return the verdicts on the paper's own springs and targets under the contact of this design."""
    C = spring_compliance(PAPER.K_l, PAPER.K_h)
    return (
        *target_verdicts(case.judged(PAPER), PAPER_TARGETS),
        *case.behaviour(C, case.respond(C, case.design.fruit.E_MPa)),
    )
