"""Statics, then modes: a thin rib on a hub that turns, how far it sags and how fast it flaps."""

import numpy as np

from evolvent import System, parts
from evolvent.elements import Material, Rectangle
from evolvent.solvers.modes import modes
from evolvent.solvers.static import solve_static

LENGTH, RADIUS, COUNT = 12.0, 0.6, 40
RIB = Rectangle(thickness=3e-4, width=0.03)
MATERIAL = Material(E=5e6, nu=0.3, density=1600.0)


def main() -> None:
    """Print sag, root tension and the first frequencies at several rates."""
    for rate in (1.0, 2.0, 4.0):
        system = System(gravity=(0.0, 0.0, -9.81))
        system.add(parts.RigidBody(motion="driven", rate=rate), "hub")
        system.add(
            parts.Beam(
                length=LENGTH, section=RIB, material=MATERIAL, elements=COUNT, formulation="cable_stretch",
                position=(RADIUS, 0.0, 0.0),
            ),
            "rib",
        )  # fmt: skip
        system.add(parts.Joint(a=("hub", (RADIUS, 0.0, 0.0)), b=("rib", "root"), kind="clamp"), "root")
        assembly = system.assemble()
        held = solve_static(assembly, rotating="hub")
        found = modes(assembly, equilibrium=held, count=4)
        tip = held.y[-1, assembly.model.flexible.beams["iq"][0] + 6 * COUNT :][:3]
        along, across = -held.la[-1, 0], np.hypot(*held.la[-1, 1:3])
        print(
            f"{rate:g} rad/s: {held.message}; the tip stands at {tip[0]:.3f} m and {-tip[2]:.3f} m lower, "
            f"the root pulls with {abs(along):.4f} N and bears {across:.4f} N; "
            f"modes at {', '.join(f'{w:.4f}' for w in found.frequency)} rad/s"
        )


if __name__ == "__main__":
    main()
