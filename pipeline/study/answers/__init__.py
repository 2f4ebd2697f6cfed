"""What a solved study says: which key moves a number, and how all points look."""
