"""Closed forms of springs, leaves, gauges and flesh; the standard library only."""
