"""Domes in closed form: where they meet the fruit, what it is under them, and the forces they carry."""
