"""When a press was first touched."""

import math


class FirstTouch:
    """The time [s] at which the whole force was least since no tip touched; None while no tip touches.

    A press begins there, not at the first force above zero: a tip may show the zero that the press before has left.
    """

    def __init__(self) -> None:
        """Begin without a touch."""
        self.t: float | None = None
        self._least = math.inf

    def add(self, t: float, whole: float, *, touches: bool) -> None:
        """Take the time [s] and the whole force [N] of the next sample; `touches` says whether any tip does."""
        if not touches:
            self.t, self._least = None, math.inf
        elif whole < self._least:
            self.t, self._least = t, whole

    def look_anew(self) -> None:
        """Let the next sample that touches be the first touch: a press has ended."""
        self._least = math.inf
