"""Large deflection of guided leaves by the elastica, exact for thin leaves, in series that cancel no digits."""

from dataclasses import dataclass

from sensor.quantity import Bounds, validation_error

_DEFLECTIONS = Bounds(at_least=0.0, at_most=0.5)  # over the length, beyond what any leaf is bent to
_SINES = Bounds(at_least=0.0, below=1.0)
_ROUND_OFF = 1e-17
_STEPS = 40  # each leaves at most a quarter of the distance


@dataclass(frozen=True, kw_only=True)
class Cantilever:
    """A cantilever of unit length and unit EI under a force across its end: the force and how far the end has moved.

    `stiffening` is the force over 3 times the deflection, the law of small deflections, less one.
    """

    force: float
    deflection: float
    stiffening: float


def cantilever(sine: float) -> Cantilever:
    """Return the cantilever whose end has turned by an angle of the given sine [1].

    Raises InputError for a sine below 0 or from 1 on. With s = sine the force is 2 s I^2 and the deflection s J / I.
    Over 0 < v < 1, I is the integral of 1 / q, J that of (1 - v^2) / q, and q = sqrt(1 - s^2 (1 - v^2)^2). They are the
    elliptic integrals of K. E. Bisshopp and D. C. Drucker, Quart. Appl. Math. 3, 1945, with s (1 - v^2) for the sine of
    the slope.
    """
    if not _SINES.hold(sine):
        raise validation_error("sine of the end's slope", sine, "1", str(_SINES), "press less")
    # With I = 1 + a and J = 2/3 (1 + b), nothing below subtracts numbers that are nearly equal.
    a, b = _integrals_less_one(sine * sine)
    return Cantilever(
        force=2.0 * sine * (1.0 + a) ** 2,
        deflection=2.0 / 3.0 * sine * (1.0 + b) / (1.0 + a),
        stiffening=(3.0 * a + 3.0 * a * a + a**3 - b) / (1.0 + b),
    )


def _integrals_less_one(square: float) -> tuple[float, float]:
    """Return I - 1 and 1.5 J - 1 of `cantilever` from s^2, the square of the sine.

    1 / q is a binomial series in x = s^2 (1 - v^2)^2, which is integrated term by term.
    """
    a = b = 0.0
    binomial = 1.0
    odd = 2.0 / 3.0  # integral of 1 - v^2
    n = 0
    while True:
        n += 1
        binomial *= square * (2 * n - 1) / (2 * n)  # coefficient of x^n in 1 / sqrt(1 - x), times s^(2 n)
        even = odd * 4 * n / (4 * n + 1)  # integral of (1 - v^2)^(2 n)
        odd = even * (4 * n + 2) / (4 * n + 3)  # integral of (1 - v^2)^(2 n + 1)
        a += binomial * even
        b += 1.5 * binomial * odd
        # Terms fall faster than the powers of s^2, so those left out sum to less than this.
        if binomial * square / (1.0 - square) <= _ROUND_OFF * a:
            return a, b


def large_deflection_stiffening(length: float, deflection: float) -> float:
    """Return the gain in secant stiffness of a guided leaf, or of a pair, at a deflection d of length L [1 from mm].

    It is 36/35 (d / L)^2 while d is small. The shuttle is free along the leaves and does not turn. So each half of a
    leaf is a cantilever of length L / 2 with the deflection d / 2. Raises InputError beyond d = L / 2.
    """
    relative = deflection / length
    if not _DEFLECTIONS.hold(relative):
        hint = "take a longer leaf or press less"
        raise validation_error("deflection / leaf length", relative, "1", str(_DEFLECTIONS), hint)
    # The deflection is nearly proportional to the sine: 2/3 of it while both are small.
    sine = 1.5 * relative
    for _ in range(_STEPS):
        bent = cantilever(sine)
        if bent.deflection == relative:
            break
        sine *= relative / bent.deflection
    return bent.stiffening
