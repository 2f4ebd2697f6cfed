"""The elastic half-space, homogeneous or layered: fields of given loads, and rigid punches."""
