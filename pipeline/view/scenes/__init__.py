"""Scenes: bodies with their fields, whole, deformed, cut, and what is drawn around them."""
