"""The solids: housing, tips, fruit, cover, coupon, and how they stand together."""
