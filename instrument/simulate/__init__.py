"""A unit of a design with drawn errors, pressed on fruit by boundary elements: what a real one would write."""
