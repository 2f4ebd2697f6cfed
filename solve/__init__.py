"""Finite-element and contact solvers. Only this package uses scikit-fem's forms and sparse solvers."""
