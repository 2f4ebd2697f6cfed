"""An optimum: SciPy searches the nonlinearity with the least error of the modulus, and a run proves it.

With a small NL the force ratio hardly changes among soft fruit; with a large NL it hardly changes among firm fruit. The
best NL lies between. `pipeline optimise` searches more keys at once, with all verdicts as conditions.
"""

import numpy as np
from scipy.optimize import minimize_scalar

import twintip

ERROR = 0.01  # relative error of the force ratio [1]
design = twintip.load_design("paper")
K_m_over_E = twintip.evaluate(design).contact.K_m_over_E()  # [mm]
moduli = np.array(design.fruit.E_MPa)


def error_of_modulus(NL: float) -> float:
    """Return the largest relative error of the modulus over the fruit where the force ratio is wrong by ERROR [1]."""
    springs = twintip.size_springs(P_max=design.targets.P_max, NL=NL, K_m_max=K_m_over_E * design.fruit.E_max_MPa)
    K_m = K_m_over_E * moduli
    read = [twintip.fruit_stiffness(springs, (1.0 + ERROR) * twintip.force_ratio(springs, K)) for K in K_m]
    return float(np.max(np.array(read) / K_m - 1.0))


best = minimize_scalar(error_of_modulus, bounds=(0.01, 0.4), method="bounded")
for NL in (0.02, 0.05, best.x, 0.2, 0.3):
    print(f"NL {100.0 * NL:5.1f} %   error of the modulus {100.0 * error_of_modulus(NL):.2f} % at worst")

proved = twintip.evaluate(twintip.load_design("paper", {"targets.NL": round(best.x, 3)}))
print(f"\nNL {100.0 * round(best.x, 3):.1f} % solved: {'all verdicts pass' if proved.passed else 'not passed'}")
