"""The solids of the housing, the tips, the fruit, the cover and the coupon, and their locations in the sensor."""
