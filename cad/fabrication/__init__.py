"""The documents and parts that a workshop needs in addition to the housing: sheet, bill, coupon, cover and bracket."""
