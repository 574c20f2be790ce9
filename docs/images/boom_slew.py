"""Figure of the guide "Model your own structure": `python docs/images/boom_slew.py` writes boom-slew.png here."""

import pathlib

import evolvent

run = evolvent.run("boom-slew")
run.ev.plot("hub.rate.z", "boom.tip_deflection.y", path=pathlib.Path(__file__).with_name("boom-slew.png"))
