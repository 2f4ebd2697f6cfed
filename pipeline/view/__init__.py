"""Pictures of an output folder: the part, its fields, the response."""
