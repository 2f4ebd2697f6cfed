"""The paper's figures 9 and 11 and its mangoes: nonlinearity over the low spring, force ratio over travel and mango.

The paper computes the stiffness of the fruit by a formula. This script takes it from the solved contact, 20 % larger.
"""

import tomllib
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt

import twintip

mpl.use("agg")

result = twintip.evaluate(twintip.load_design("paper"))
K_m_max = result.contact.K_m_over_E() * result.design.fruit.E_max_MPa  # [N/mm]

figure, (left, right) = plt.subplots(1, 2, figsize=(10.0, 4.0), layout="constrained")
nonlinearities = [0.01, 0.02, 0.05, 0.1, 0.2, 0.3]
K_l = [twintip.size_springs(P_max=5.0, NL=NL, K_m_max=K_m_max).K_l for NL in nonlinearities]
left.plot([1e3 * K for K in K_l], [100.0 * NL for NL in nonlinearities], "o-")
left.set(xlabel="low spring K_l [N/m]", ylabel="nonlinearity NL [%]", title="Figure 9, for P_max = 5")
for NL, K in zip(nonlinearities, K_l, strict=True):
    print(f"figure 9   NL {100.0 * NL:3.0f} %    K_l {1e3 * K:5.0f} N/m")

table = result.press.table  # forces and ratio over modulus and travel
for E, P in zip(table.E, table.P, strict=True):
    right.plot(table.x, P, label=f"{E:g} MPa")
    print(f"figure 11  E {E:.1f} MPa   P {P[0]:.3f} at {table.x[0]:g} mm, {P[-1]:.3f} at {table.x[-1]:g} mm")
right.set(xlabel="travel [mm]", ylabel="force ratio P", title="Figure 11", ylim=(0.0, 6.0))
right.legend(title="modulus", ncols=4, loc="lower center", fontsize="small")

Path("outputs").mkdir(exist_ok=True)
figure.savefig("outputs/figures-9-and-11.png", dpi=100)

# Table I: the modulus of each mango is plate stress over strain; that of its flesh is larger.
table_1 = Path(__file__).parents[1] / "docs" / "examples" / "mangoes-of-the-paper.toml"
for mango in tomllib.loads(table_1.read_text(encoding="utf-8"))["mango"]:
    P = np.interp(mango["E_MPa"], table.E, table.P[:, -1])
    print(f"table I    mango {mango['number']:2d}, {mango['variety']:12}  E {mango['E_MPa']:.2f} MPa   P {P:.2f}")
