"""The moving picture of the README: `python docs/images/deployment.py` writes deployment.gif here."""

import pathlib

import evolvent
from evolvent.exports import moving
from evolvent.exports.request import Request

run = evolvent.run("solar-array", {"simulate.until": "22 s"})
print(moving.gif(run, str(pathlib.Path(__file__).with_name("deployment.gif")), Request(frames=80, speed=2.5)))
