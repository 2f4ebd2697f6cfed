"""Presses of sprung domes on an ellipsoid by boundary elements, which share nothing with the laws of contact."""
