"""Commands for studies: many designs around one, and the best of them."""
