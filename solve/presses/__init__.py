"""Presses of sprung domes on an ellipsoid by boundary elements, independent of the contact laws in `solve.contact`."""
