"""
Statics and modes: a rib on a rotating hub
==========================================

The sag of a thin rib on a rotating hub, the forces at its root, and the frequencies about that equilibrium.
"""

# %%
# The rib is a beam of thin cable elements, clamped to a hub whose rate is given.

import matplotlib.pyplot as plt
import numpy as np

from evolvent import System, parts
from evolvent.elements import Material, Rectangle
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.static.static import solve_static

LENGTH, RADIUS, COUNT = 12.0, 0.6, 40


def turning(rate):
    """The system at a rate of the hub (rad/s)."""
    system = System(gravity=(0.0, 0.0, -9.81))
    system.add(parts.RigidBody(motion="driven", rate=rate), "hub")
    rib = parts.Beam(
        length=LENGTH,
        section=Rectangle(thickness=3e-4, width=0.03),
        material=Material(young_modulus=5e6, poisson_ratio=0.3, density=1600.0),
        elements=COUNT,
        formulation="cable_stretch",
        position=(RADIUS, 0.0, 0.0),
    )
    system.add(rib, "rib")
    system.add(parts.Joint(a=("hub", (RADIUS, 0.0, 0.0)), b="rib.root", type="clamp"), "root")
    return system.assemble()


# %%
# `solve_static` finds the equilibrium in the rotating frame, with gravity and the centrifugal load; `modes` uses its
# stresses, and adds the Coriolis and centrifugal terms.

rates, found = (1.0, 2.0, 4.0), []
for rate in rates:
    assembly = turning(rate)
    held = solve_static(assembly, rotating="hub")
    found.append(modes(assembly, equilibrium=held, count=6))
    first = assembly.model.beams["iq"][0]
    place = held.y[-1, first : first + 6 * (COUNT + 1)].reshape(-1, 6)[:, :3]
    tip = place[-1]
    along, across = -held.la[-1, 0], np.hypot(*held.la[-1, 1:3])
    print(f"{rate:g} rad/s: {held.message}")
    print(f"  the tip is at a radius of {tip[0]:.3f} m, {-tip[2]:.3f} m below the root")
    print(f"  force at the root: {abs(along):.4f} N along the rib, {across:.4f} N across")
    print(f"  modes at {', '.join(f'{w:.4f}' for w in found[-1].frequency)} rad/s")
    plt.plot(np.hypot(place[:, 0], place[:, 1]), place[:, 2], label=f"{rate:g} rad/s")
plt.xlabel("distance from the axis, m")
plt.ylabel("height, m")
plt.legend()
plt.show()

# %%
# The faster the hub, the more the rib is stiffened by its tension. For comparison: a spinning thread without a hub
# oscillates at 0 and sqrt(5) times the rate in the plane of rotation, and at 1 and sqrt(6) times out of it.

plt.figure()
for k in range(6):
    plt.plot(rates, [m.frequency[k] / rate for m, rate in zip(found, rates, strict=True)], "o-")
plt.xlabel("rate of the hub, rad/s")
plt.ylabel("frequency over the rate")
plt.title("six slowest modes")
plt.show()
