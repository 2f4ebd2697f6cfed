"""WHAT happens: the only user of scikit-fem's forms and of sparse solvers."""
