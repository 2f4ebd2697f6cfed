"""How exact a run must be: `--tol`, what each stage is given of it, and which `--tol` would decide a verdict."""

import math

from cad.quantity import Bounds

TOLERANCES = Bounds(at_least=1e-5, at_most=0.1)
DEFAULT_TOLERANCE = 1e-3  # what the verdicts on K_l and K_h allow: with more they stay undecided
_MET = 2.0  # an error of P adds those of both springs and of the contact
CONTACT_SHARE = 0.25  # of the tolerance: the contact is cheap, so the springs, the dear part, may use up the rest


def would_decide(tolerance: float, allowed: float, error: float) -> float | None:
    """Return the tolerance, of one digit, at which a relative error becomes what is allowed; None where none does.

    Errors shrink as the tolerance does, but for one that is far from the tolerance: no mesh met it.
    """
    if not (allowed > 0.0 and 0.0 < error <= _MET * tolerance):
        return None
    wanted = tolerance * min(1.0, allowed / error)
    digit = 10.0 ** math.floor(math.log10(wanted))
    rounded = round(math.floor(wanted / digit * (1.0 + 1e-9)) * digit, 12)
    return rounded if rounded < tolerance and TOLERANCES.hold(rounded) else None
