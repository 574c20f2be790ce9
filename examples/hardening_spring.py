"""
A spring with a user-defined law
================================

A mass oscillates on a spring that hardens with the cube of its extension. The period depends on the amplitude; it has
a closed form as an integral, with which the run is compared.
"""

# %%
# A spring law returns the tension from extension, its rate and time.

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import quad

from evolvent import System, law, parts
from evolvent.solvers import solve

MASS, LINEAR, CUBIC = 0.2, 50.0, 2000.0


@law
def hardening(extension, rate, t, p):
    """Tension (N) of a spring with a linear and a cubic stiffness."""
    return p[0] * extension + p[1] * extension**3


def period(amplitude):
    """Period (s) of the run: the mean time between upward passages through the equilibrium."""
    system = System()
    mass = system.add(parts.Point(mass=MASS, position=(1.0 + amplitude, 0.0, 0.0)))
    ground, constants = (0.0, 0.0, 0.0), (LINEAR, CUBIC)
    system.add(parts.Spring(a=ground, b=mass, length=1.0, law=hardening, parameters=constants))
    times = np.linspace(0.0, 10.0, 20001)
    solution = solve(system.assemble(), samples=times, method="dopri5", rtol=1e-10, atol=1e-12)
    x = solution.y[:, 0] - 1.0
    k = np.flatnonzero((x[:-1] < 0.0) & (x[1:] >= 0.0))
    crossings = solution.t[k] - x[k] * (solution.t[k + 1] - solution.t[k]) / (x[k + 1] - x[k])
    return np.diff(crossings).mean()


def closed_form(amplitude):
    """Period (s) from the conservation of energy, with x = A sin(s)."""

    def integrand(s):
        return 4.0 * np.sqrt(MASS / (LINEAR + 0.5 * CUBIC * amplitude**2 * (1.0 + np.sin(s) ** 2)))

    return quad(integrand, 0.0, np.pi / 2.0)[0]


# %%
# The energy m x'² / 2 + k x² / 2 + c x⁴ / 4 is constant, so a quarter of the period is the integral of dx / x' from 0
# to the amplitude A; the substitution x = A sin(s) removes the singularity at its end.

amplitudes = np.linspace(0.01, 0.4, 9)
computed = np.array([period(a) for a in amplitudes])
exact = np.array([closed_form(a) for a in amplitudes])
gap = np.abs(computed / exact - 1.0).max()
print(f"largest gap between run and closed form: {gap:.1e} of the period")

fine = np.linspace(0.0, 0.4, 200)
plt.plot(fine, [closed_form(a) for a in fine], label="closed form")
plt.plot(amplitudes, computed, "o", label="runs")
plt.xlabel("amplitude, m")
plt.ylabel("period, s")
plt.legend()
plt.show()
