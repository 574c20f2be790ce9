"""Figure of the theory page "Strip blades": `python docs/images/heliogyro_strip.py` writes heliogyro-strip.png here.

The case with strips, and the same sail with threads, whose light acts along the spin axis at any pitch.
"""

import pathlib

import numpy as np

import evolvent
from evolvent_base import plots
from evolvent_base.figures import Figure, Line, Panel

THREADS = {
    "body.rate": 0.26, "spool.rate": [0.0, 0.0], "spool.start_length": 5.0, "blade.width": 0.02625,
    "sunlight": {"pressure": 4.56e-6}, "solver.duration": 60.0, "output.every": 0.2,
}  # fmt: skip


def out_of_plane(run, blade, node, body):
    """Millimetres of the tip beyond the root along z."""
    x = np.asarray(run[blade]["position"])
    return 1e3 * (x[:, node, 2] - np.asarray(run[body]["position"])[:, 2])


def main() -> None:
    """Draw the figure."""
    strips, threads = evolvent.run("heliogyro-strip"), evolvent.run("heliogyro-unequal", THREADS)
    t = np.asarray(strips["time"])
    root = np.degrees(np.asarray(strips["pitch 1"]["angle"]))
    tip = root + np.degrees(np.asarray(strips["blade 1"]["twist_angle"])[:, -1])
    thread = out_of_plane(threads, "blade-1", 0, "body")
    names = ("strip", "thread")
    panels = [
        Panel(x_label="time, s", y_label="pitch, deg", lines=[
            Line(x=t, y=root, label="root of the strip", color=0), Line(x=t, y=tip, label="its tip", color=1)]),
        Panel(x_label="time, s", y_label="tip out of plane, mm", lines=[
            Line(x=t, y=out_of_plane(strips, "blade 1", -1, "body"), label=names[0], color=0),
            Line(x=t, y=thread - thread[0], label=names[1], color=1)]),
        Panel(x_label="time, s", y_label="spin, mrad/s", lines=[
            Line(x=t, y=1e3 * np.asarray(run["body"]["rate"])[:, 2], label=name, color=k)
            for k, (run, name) in enumerate(zip((strips, threads), names, strict=True))]),
    ]  # fmt: skip
    figure = Figure(name="heliogyro-strip", title="Strips and threads of the same sail", panels=panels, height=120.0)
    plots.save(figure, pathlib.Path(__file__).with_name("heliogyro-strip.png"))


if __name__ == "__main__":
    main()
