"""
Torque margins: a panel that lifts its own weight
=================================================

A hinge spring opens a panel against gravity in a test on the ground. Does it have its margin, and where is it least?
"""

# %%
# The panel hangs from its hinge and is to stop at 90 degrees, where a latch catches it.

import math

import matplotlib.pyplot as plt

from evolvent import System, parts

MASS, LENGTH = 2.0, 0.8


def panel(stiffness, gravity):
    """The panel with a spring of the stiffness (N m/rad), wound by 180 degrees at the start."""
    system = System(gravity=(0.0, 0.0, -gravity), title="a panel on its hinge")
    system.add(
        parts.RigidBody(
            mass=MASS, shape={"box": [0.02, 0.5, LENGTH]}, position=(0.0, 0.0, -LENGTH / 2),
            points={"root": (0.0, 0.0, LENGTH / 2)},
        ),
        "panel",
    )  # fmt: skip
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="panel.root", type="revolute", axis=(0, -1, 0)), "pivot")
    hinge = parts.JointSpring(
        joint="pivot", stiffness=stiffness, rest=math.pi, friction=0.05, latch=math.pi / 2, latch_stiffness=1e4
    )
    system.add(hinge, "hinge")
    return system


# %%
# Friction is given by the hinge. What the case does not have is declared to be zero: a resistance about which it were
# silent would be refused.

ASK = {"zero": ("hysteresis", "harness", "motor losses", "adhesion", "load"), "lines": {"hinge": {"duration": "30 s"}}}
fig, axis = plt.subplots(layout="constrained")
for stiffness, gravity in ((4.0, 0.0), (4.0, 9.81), (16.0, 9.81)):
    margins = panel(stiffness, gravity).margin(**ASK)
    table = margins["hinge"]
    _, governing = table.governing()
    print(
        f"{stiffness:g} N m/rad, {gravity:g} m/s2: margin {margins.least:+.3f} at "
        f"{math.degrees(table.x[governing]):.0f} deg, spring to add {table.spring_to_add():+.2f} N m"
    )
    label = f"{stiffness:g} N m/rad, {gravity:g} m/s²"
    axis.plot([math.degrees(x) for x in table.x], table.margin("motorization"), label=label)
axis.axhline(0.0, color="gray", linewidth=0.8)
axis.set(xlabel="angle of the hinge [deg]", ylabel="margin", ylim=(-1.0, 5.0))
axis.legend()

# %%
# By hand at 90 degrees on the ground: 0.8 k pi/2 drives; 2 (1.1 m g l/2 + 3 friction) resists.

required = 2.0 * (1.1 * MASS * 9.81 * LENGTH / 2 + 3 * 0.05)
print(f"required at 90 deg {required:.3f} N m, and {0.8 * 16.0 * math.pi / 2:.3f} N m counts with 16 N m/rad")

plt.show()
