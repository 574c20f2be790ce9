"""Compose a system part by part: a spinning body, a reel, a thread, and a drag law of one's own on the thread."""

import numpy as np

from evolvent import System, force_law, parts
from evolvent.flow import observe
from evolvent.solvers import solve


@force_law
def drag(x, v, t, parameters):
    """Drag across all directions, in proportion to the velocity, N/m."""
    coefficient = parameters[0]
    return -coefficient * v[0], -coefficient * v[1], -coefficient * v[2]


def main() -> None:
    """Deploy half a metre of thread with and without drag and print how fast the body ends."""
    for coefficient in (0.0, 1e-4):
        system = System()
        system.add(parts.RigidBody(motion="spin", inertia=0.004, rate=6.0), "hub")
        feed = parts.ConstantFeed(rate=3.5)
        system.add(parts.Reel(body="hub", centre=(0.05, 0.0, 0.0), radius=0.01, feed=feed), "reel")
        thread = system.add(
            parts.Thread(reel="reel", length=0.5, line_density=7.35e-4, nodes=10, segments="inextensible")
        )
        system.add(parts.LawLoad(thread=thread, law=drag, parameters=[coefficient]))
        assembly = system.assemble()
        solution = solve(assembly, samples=np.linspace(0.0, 14.0, 141), method="dopri5")
        seen = observe(assembly.model, solution.t, solution.y, solution.s)
        rate = seen.body_rate[-1, assembly.index("hub"), 2]
        print(f"drag {coefficient:g} N s/m2: {solution.message}, body rate {rate:.4f} rad/s")


if __name__ == "__main__":
    main()
