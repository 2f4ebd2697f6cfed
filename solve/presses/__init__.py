"""Presses of sprung domes on an ellipsoid by boundary elements, independent of the laws of contact."""
