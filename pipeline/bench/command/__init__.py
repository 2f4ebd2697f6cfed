"""What the whole command costs, and its stages beside the bare work that they cannot leave out."""
