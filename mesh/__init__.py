"""Meshing of parts. No other package imports gmsh."""
