"""How exact a run must be: `--tol`, what each stage is given of it, and which `--tol` would decide a verdict."""

import math

from cad.quantity import Bounds

TOLERANCES = Bounds(at_least=1e-4, at_most=0.1)
_PARTS = 2.0  # an error of P or of NL adds those of both springs and of the contact
DEFAULT_TOLERANCE = 1e-3  # what the verdicts on K_l and K_h allow: with more they stay undecided
CONTACT_SHARE = 0.25  # of the tolerance: the contact is cheap, so the springs, the dear part, may use up the rest


def would_decide(asked: float, allowed: float, error: float) -> float | None:
    """Return the `--tol`, of one digit, that brings a relative error down to what is allowed; None where none does.

    An error beyond that of all parts at the tolerance asked for, which no mesh met, stays where it is.
    """
    if not 0.0 < allowed < error <= _PARTS * asked:
        return None
    wanted = allowed / _PARTS
    digit = 10.0 ** math.floor(math.log10(wanted))
    rounded = round(math.floor(wanted / digit * (1.0 + 1e-9)) * digit, 12)
    return rounded if rounded < asked and TOLERANCES.hold(rounded) else None
