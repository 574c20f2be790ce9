"""Figures of the laboratory and of the rib's paper: `python docs/images/measured.py [FILE ...]` writes them here.

Without a FILE all are written: those of the laboratory in a minute, those of the paper as `evolvent figure list` tells.
"""

import pathlib
import sys

from evolvent_base import plots
from evolvent_papers import laboratory, papers

HERE = pathlib.Path(__file__).parent
#: Files, and the sets of measurements of which they show the first figure.
SETS = {
    "laboratory-triple.png": "triple-pendulum",
    "laboratory-rotating-beam.png": "rotating-beam",
    "laboratory-composite-strips.png": "composite-strips",
}
#: Files, and the paper's figures that they are.
PAPER = {"rib-figure-7.png": "rib-figure-7", "rib-figure-10.png": "rib-figure-10"}

if __name__ == "__main__":
    for file in sys.argv[1:] or [*SETS, *PAPER]:
        if file in SETS:
            drawn = laboratory.found(SETS[file]).validate().figures[0]
        else:
            drawn = papers.entry(PAPER[file]).make(papers.Options()).figure
        print(plots.save(drawn, HERE / file))
