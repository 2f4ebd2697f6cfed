"""The inputs of a sensor that a person chooses, and closed-form theory; no CAD and no finite elements."""
