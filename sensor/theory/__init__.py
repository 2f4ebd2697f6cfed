"""Closed forms of springs, leaves and flesh."""
