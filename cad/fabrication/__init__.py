"""Documents and parts for a workshop beside the files of the housing: sheet, bill, coupon, cover and bracket."""
