"""From what was measured of a print to its springs: weights, a coupon; what they make of it."""
