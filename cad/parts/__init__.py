"""The solids: housing, tips, fruit, cover and coupon, and their places in the sensor."""
