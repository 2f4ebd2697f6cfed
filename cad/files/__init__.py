"""Solids and drawings as files whose bytes depend on nothing but what they show."""
