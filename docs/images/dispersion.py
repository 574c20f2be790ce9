"""Figures and numbers of the guide "Dispersions and worst cases": `python docs/images/dispersion.py` writes them here.

It runs the study that the page shows, 1000 runs, and prints the table.
"""

import pathlib
import re

import evolvent
from evolvent import cases
from evolvent_base import plots

HERE = pathlib.Path(__file__).parent
#: Figures of the page: name of the result's figure -> file.
FIGURES = {
    "hinge_2_latch_torque_peak_last-histogram": "dispersion-histogram.png",
    "hinge_1_latch_time_last-sensitivity": "dispersion-sensitivity.png",
}

if __name__ == "__main__":
    page = (HERE.parent / "guide" / "dispersions.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"^```yaml\n(.*?)^```", page, flags=re.DOTALL | re.MULTILINE)
    found = evolvent.disperse(cases.parse_yaml(text, "the page's study"), workers=None)
    print(found)
    for figure in found.answer().figures:
        if figure.name in FIGURES:
            plots.save(figure, HERE / FIGURES[figure.name])
