"""The inputs of a sensor that a person chooses, and its closed forms: no CAD, no finite elements."""
