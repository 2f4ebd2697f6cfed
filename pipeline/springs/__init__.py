"""Leaf lengths that give the springs their stiffness."""
