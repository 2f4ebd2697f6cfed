"""The solvers, which compute what happens: the only users of scikit-fem's forms and of sparse solvers."""
