"""
A system composed part by part
==============================

A spinning body, a reel, a thread, and a user-defined law of drag on the thread: the heliogyro without its case file.
"""

# %%
# A load law returns a force per length from position, velocity and time. Helpers of a law belong in the same file.

import matplotlib.pyplot as plt
import numpy as np

from evolvent import System, law, parts
from evolvent.solvers import solve
from evolvent.solvers.common.observations import observe


@law
def drag(x, v, t, parameters):
    """Drag across all directions, in proportion to the velocity, N/m."""
    coefficient = parameters[0]
    return -coefficient * v[0], -coefficient * v[1], -coefficient * v[2]


# %%
# Parts are added one by one and refer to one another by name. `assemble` turns them into flat arrays and an initial
# state, `solve` integrates, and `observe` computes results from the states.


def deployed(coefficient):
    """Deploy half a metre of thread: times (s), and rates of the body (rad/s)."""
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=0.004, rate=6.0), "hub")
    drive = parts.ConstantDrive(rate=3.5)
    system.add(parts.Reel(body="hub", centre=(0.05, 0.0, 0.0), radius=0.01, drive=drive), "reel")
    blade = parts.Thread(
        reel="reel",
        length=0.5,
        line_density=7.35e-4,
        nodes=10,
        segments="inextensible",
    )
    thread = system.add(blade, "thread")
    system.add(parts.Load(along=thread, law=drag, parameters=[coefficient]))
    assembly = system.assemble()
    solution = solve(assembly, samples=np.linspace(0.0, 14.0, 141), method="dopri5")
    seen = observe(assembly.model, solution.t, solution.y, solution.s)
    rate = seen.body_rate[:, assembly.index("hub"), 2]
    print(f"drag {coefficient:g} N s/m2: {solution.message}, body rate {rate[-1]:.4f} rad/s")
    return solution.t, rate


for coefficient in (0.0, 1e-4):
    plt.plot(*deployed(coefficient), label=f"{coefficient:g} N s/m²")
plt.xlabel("time, s")
plt.ylabel("rate of the body, rad/s")
plt.legend(title="drag")
plt.show()
