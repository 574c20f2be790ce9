"""Picture of margins in the README: `python docs/images/margin.py` writes margin.png here."""

import pathlib

import evolvent

if __name__ == "__main__":
    evolvent.load("solar-array").margin().plot(pathlib.Path(__file__).with_suffix(".png"))
