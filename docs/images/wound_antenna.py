"""Stages of the case rib-antenna-wound: `python docs/images/wound_antenna.py [RUN.nc]` writes wound-antenna.png here.

The run takes some minutes; the file of one may be given, such as that of an antenna with fewer ribs.
"""

import pathlib
import sys

import numpy as np

import evolvent
from evolvent_base import plots
from evolvent_base.figures import Figure, Line, Panel

TIMES = {0: "start", 35: "winding", 85: "held", 100: "released", 150: "unwound", 500: "latched"}

run = evolvent.open(sys.argv[1]) if len(sys.argv) > 1 else evolvent.run("rib-antenna-wound")
ribs = [name for name in run.children if name.startswith("rib ")]
around = np.linspace(0.0, 2.0 * np.pi, 73)
panels = []
for time, stage in TIMES.items():
    net = run["net"].position.sel(time=time, method="nearest").values
    ends = net[run["net"].cord_nodes.values]
    cords = np.concatenate([ends, np.full((len(ends), 1, 3), np.nan)], axis=1).reshape(-1, 3)
    lines = [Line(x=cords[:, 0], y=cords[:, 1], color="gray", width=0.4)]
    for name in ribs:
        x = run[name].position.sel(time=time, method="nearest").values
        lines.append(Line(x=x[:, 0], y=x[:, 1], color=0, width=1.0))
    lines.append(Line(x=0.6 * np.cos(around), y=0.6 * np.sin(around), color="black", width=0.8))
    panels.append(Panel(x_label="x, m", y_label="y, m", lines=lines, equal=True, title=f"{stage}, {time} s"))
figure = Figure(
    name="wound", title="Winding, release and deployment, along the axis", panels=panels, height=150.0, columns=3
)
plots.save(figure, pathlib.Path(__file__).with_name("wound-antenna.png"))
