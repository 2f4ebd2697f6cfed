"""IN WHICH ORDER, and is it good enough."""
