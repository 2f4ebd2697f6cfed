"""Pictures of an output folder: the part and its fields."""
