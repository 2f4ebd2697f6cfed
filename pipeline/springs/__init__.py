"""Springs: sized in closed form, and leaf lengths fitted by finite elements."""
