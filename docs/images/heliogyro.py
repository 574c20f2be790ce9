"""Draw the picture of the README: a heliogyro's blades paying out, and what that does to its spin."""

from __future__ import annotations

import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection

import evolvent

TIMES = (12.0, 40.0, 70.0, 100.0, 142.0)


def main(path: pathlib.Path) -> None:
    """Run the built-in case with segments of fixed length and draw it to `path`."""
    run = evolvent.run(
        "heliogyro", {"blade.segments": "inextensible", "solver.method": "dopri5", "output.every": "0.02 s"}
    )
    figure, (left, right) = plt.subplots(1, 2, figsize=(11.0, 4.6), width_ratios=(1.0, 1.15), layout="constrained")
    angle = run.body_angle.values
    offset = float(run.position.isel(time=0, blade=0, node=-1, axis=0))
    tension = run.tension.values * 1e3
    for k in range(run.sizes["blade"]):
        tip = run.position.isel(blade=k, node=0).values
        x = tip[:, 0] * np.cos(angle) - tip[:, 1] * np.sin(angle)
        y = tip[:, 0] * np.sin(angle) + tip[:, 1] * np.cos(angle)
        left.plot(x, y, color="0.85", linewidth=0.6, zorder=0)
    lines = None
    for time in TIMES:
        n = int(np.argmin(np.abs(run.time.values - time)))
        for k in range(run.sizes["blade"]):
            out = np.flatnonzero(run.released.values[n, k])
            root = np.array([offset, 0.0]) * (1 if k == 0 else -1)
            points = np.vstack([run.position.values[n, k, out, :2], root])
            c, s = np.cos(angle[n]), np.sin(angle[n])
            points = points @ np.array([[c, s], [-s, c]])
            segments = np.stack([points[:-1], points[1:]], axis=1)
            lines = LineCollection(list(segments), cmap="viridis", norm=plt.Normalize(0.0, np.nanmax(tension)))
            lines.set_array(tension[n, k, out])
            lines.set_linewidth(2.4)
            left.add_collection(lines)
            if k == 0:
                left.annotate(f"{time:.0f} s", points[0], textcoords="offset points", xytext=(4, 4), fontsize=8)
    left.set(aspect="equal", xlabel="x, m (inertial)", ylabel="y, m", xlim=(-5.6, 5.6), ylim=(-5.6, 5.6))
    figure.colorbar(lines, ax=left, label="tension, mN", shrink=0.85)
    right.plot(run.time, run.body_rate, color="black", label="computed")
    right.plot(run.time, run.body_rate_paper, "--", color="#d55e00", label="published formula")
    right.plot(run.time, run.body_rate_corrected, "--", color="#0072b2", label="with the spools' offset")
    right.set(xlabel="time, s", ylabel="body rate, rad/s", xlim=(0.0, None), ylim=(0.0, None))
    right.legend(frameon=False)
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=120)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(__file__).with_suffix(".png"))
