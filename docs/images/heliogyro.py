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
    motion = run.ev.motion()
    tension = [1e3 * line.values["tension [N]"] for line in motion.lines]
    largest = max(float(np.nanmax(values)) for values in tension)
    for line in motion.lines:
        left.plot(line.points[:, 0, 0], line.points[:, 0, 1], color="0.85", linewidth=0.6, zorder=0)
    for time in TIMES:
        n = int(np.argmin(np.abs(motion.time - time)))
        for k, line in enumerate(motion.lines):
            points = line.points[n, :, :2]
            segments = np.stack([points[:-1], points[1:]], axis=1)
            lines = LineCollection(list(segments), cmap="viridis", norm=plt.Normalize(0.0, largest))
            lines.set_array(np.nan_to_num(tension[k][n, :-1]))
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
