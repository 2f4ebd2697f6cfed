"""Readings: from tip forces to a modulus, and their accuracy over the poses that occur."""
