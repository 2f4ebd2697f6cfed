"""Hard cases: each ends in a right answer or in a refusal that names the cause."""
