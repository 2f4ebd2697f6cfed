"""Closed forms of springs, leaves, gauges and flesh."""
