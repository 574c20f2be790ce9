"""
A wrapped rib springs open
==========================

A thin strip, wound on a hub without stretch, is let go. It unwinds by its own bending, at a constant speed of the tip:
a closed form says so, and the run lies beside it.
"""

# %%
# 40 elements and the first 200 s of 8587 s keep this short; the built-in case takes 80 elements and runs to the end.

import matplotlib.pyplot as plt
import numpy as np

import evolvent
from evolvent.closed_forms import Strip, deployed_tip_radius, deployment_speed

case = {"rib.elements": 40, "solver.duration": "200 s", "output.every": "2 s"}
run = evolvent.run("wrapped-rib-deploy", case)
print(run.attrs["status"])
print(run.attrs.get("warning", "no warning"))

# %%
# The bending stiffness of a thin strip is E w t³ / 12, its mass per length the density times the section.

width, thickness, modulus, density = 0.03, 3e-4, 5e6, 1600.0
strip = Strip(
    radius=0.6,
    length=12.0,
    line_density=density * width * thickness,
    bending_stiffness=modulus * width * thickness**3 / 12.0,
    axial_stiffness=modulus * width * thickness,
)
formula = deployed_tip_radius(strip, run.time.values)
gap = run.tip_radius.isel(rib=0, time=-1) / formula[-1] - 1.0
print(f"speed of the tip by the closed form: {1e3 * deployment_speed(strip):.2f} mm/s")
print(f"the tip is {100.0 * float(gap):.2f} % farther out than the closed form at the end")

figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 4.0), layout="constrained")
for time in (0.0, 50.0, 100.0, 200.0):
    shape = run["rib-1"]["position"].sel(time=time)
    left.plot(shape.sel(axis="x"), shape.sel(axis="y"), label=f"{time:.0f} s")
turn = np.linspace(0.0, 2.0 * np.pi, 200)
left.fill(0.6 * np.cos(turn), 0.6 * np.sin(turn), color="0.9", zorder=0)
left.set(aspect="equal", xlabel="x, m", ylabel="y, m")
left.legend()
run.tip_radius.isel(rib=0).plot(ax=right, label="run")
right.plot(run.time, formula, "--", label="closed form")
right.set_title("")
right.legend()
plt.show()
