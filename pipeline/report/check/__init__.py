"""Whether an output folder or a part is as it was written, and whether its report agrees with itself."""
