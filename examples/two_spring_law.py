"""The two-spring law: two targets give two springs, and two springs convert a force ratio into a fruit stiffness.

This script solves no finite elements. The formulas are the paper's equations (3), (4), (10) and (12).
"""

import twintip

P_MAX = 5.0  # wanted: the force ratio on the firmest fruit
NL = 0.05  # wanted: how far the ratio departs from a straight line, 5 %
K_M_MAX = 4.629  # [N/mm] stiffness of the firmest fruit under one tip

springs = twintip.size_springs(P_max=P_MAX, NL=NL, K_m_max=K_M_MAX)
print(f"low spring  {1e3 * springs.K_l:7.0f} N/m")
print(f"high spring {1e3 * springs.K_h:7.0f} N/m")

print("\nfruit stiffness   force ratio   read back")
for fraction in (0.1, 0.25, 0.5, 0.75, 1.0):
    K_m = fraction * K_M_MAX
    P = twintip.force_ratio(springs, K_m)
    read_back = twintip.fruit_stiffness(springs, P)
    print(f"{1e3 * K_m:11.0f} N/m {P:13.3f} {1e3 * read_back:7.0f} N/m")
