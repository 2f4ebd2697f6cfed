"""What a command works on, said by whoever works and shown on the terminal."""
