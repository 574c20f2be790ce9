"""Figures of the laboratory and of the rib's paper: `python docs/images/measured.py [FILE ...]` writes them here.

Without a FILE all are written: those of the laboratory in a minute, those of the paper as `evolvent figure list` tells.
"""

import pathlib
import sys

from evolvent_base import plots
from evolvent_papers import laboratory, papers

HERE = pathlib.Path(__file__).parent
#: Files, and the sets of measurements with the number of the figure that they show.
SETS = {
    "laboratory-triple.png": ("triple-pendulum", 0),
    "laboratory-rotating-beam.png": ("rotating-beam", 0),
    "laboratory-rotating-beam-causes.png": ("rotating-beam", 1),
    "laboratory-driven-arm-torque.png": ("driven-arm", 1),
    "laboratory-composite-strips.png": ("composite-strips", 0),
}
#: Files, and the paper's figures that they are.
PAPER = {"rib-figure-7.png": "rib-figure-7", "rib-figure-10.png": "rib-figure-10"}

if __name__ == "__main__":
    for file in sys.argv[1:] or [*SETS, *PAPER]:
        if file in SETS:
            name, number = SETS[file]
            drawn = laboratory.found(name).validate().figures[number]
        else:
            drawn = papers.entry(PAPER[file]).make(papers.Options()).figure
        print(plots.save(drawn, HERE / file))
