"""Commands for what was measured: compression tests, a printed unit, its readings."""
