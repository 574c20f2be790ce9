"""Pictures of the built-in cases: `python docs/images/cases.py [NAME ...]` writes cases/NAME.png here.

Each is one frame of the animation, at a time when the motion shows. Cases that take a minute with the settings of their
papers are run with faster settings that give the same picture.
"""

from __future__ import annotations

import pathlib
import sys
from typing import Any, NamedTuple

import numpy as np
from PIL import Image

import evolvent
from evolvent import cases
from evolvent.exports.pictures import pictures
from evolvent.exports.request import animation_of
from evolvent.results import unfinished
from evolvent_base.errors import RunFailed

FOLDER = pathlib.Path(__file__).with_name("cases")
SIZE = (720, 540)  # pixels, in which it is drawn
SHOWN = (480, 360)  # pixels, in which it is kept


class Frame(NamedTuple):
    """Share of the run at which a case is drawn, and the changes of its keys."""

    share: float
    changes: dict[str, Any] = {}  # noqa: RUF012  (nothing changes it)


_FAST_BLADES = {"blade.segments": "inextensible", "solver.method": "dopri5"}

FRAMES = {
    "andrews-mechanism": Frame(0.4),
    "boom-on-drum-stored": Frame(0.1),
    "boom-slew": Frame(0.1),
    "film-blade": Frame(0.75, {"payout.rate": 0.035, "payout.start": 3.0, "payout.length": 4.2}),
    "flexible-array-shell": Frame(0.16),
    "hanging-chain": Frame(0.0),
    "heliogyro": Frame(0.8, _FAST_BLADES),
    "heliogyro-designed": Frame(0.6, _FAST_BLADES),
    "heliogyro-feedback": Frame(0.55),
    "heliogyro-paper": Frame(1.0, _FAST_BLADES),
    "heliogyro-strip-payout": Frame(0.1),
    "heliogyro-strip": Frame(0.5),
    "heliogyro-unequal": Frame(0.8, {"spool.rate": [3.5, 2.8]}),
    "hinge-stored": Frame(0.25),
    "inertia-stand": Frame(0.02),
    "inertia-stand-paper": Frame(0.05),
    "miura-sheet": Frame(1.0, {"simulate.until": 1.3, "simulate.step": 0.02}),
    "net-reflector": Frame(1.0),
    "offload": Frame(0.1),
    "orbit-tether": Frame(0.9),
    "plate-swing": Frame(0.59),
    "rib-antenna": Frame(0.2),
    "rib-antenna-wound": Frame(1.0, {"simulate.until": 18.0}),
    "rib-held-ten-years": Frame(0.1),
    "rib-lenticular-shell": Frame(0.2),
    "rib-reflector": Frame(0.12),
    "ring-antenna": Frame(1.0, {"simulate.until": 2.5}),
    "solar-array": Frame(0.12),
    "solar-array-flexible": Frame(0.12),
    "spinning-tether": Frame(0.5),
    "tape-drum": Frame(0.3),
    "tape-hinge": Frame(0.4),
    "tape-hinge-shell": Frame(0.25),
    "tape-hinge-stored": Frame(0.52),
    "tape-rods-stored": Frame(0.4),
    "two-booms": Frame(0.05),
    "wire-boom-satellite": Frame(0.2),
    "wire-booms": Frame(0.7, {"wire.nodes": 8}),
    "wrapped-rib": Frame(0.36),
    "wrapped-rib-deploy": Frame(0.25, {"rib.elements": 40}),
    "wrapped-rib-deploy-damped": Frame(0.66),
    "wrapped-rib-hold": Frame(1.0),
    "wrapped-rib-paper": Frame(0.9),
    "yo-yo-despin": Frame(0.6),
    "z-fold": Frame(0.2),
}


def draw(name: str) -> pathlib.Path:
    """Run a built-in case and keep one frame of its animation."""
    frame = FRAMES[name]
    try:
        run = evolvent.run(name, frame.changes)
    except RunFailed as failed:  # the paper's set-up of the rib fails; its motion until then is shown
        run = failed.run
    motion = animation_of(run)
    start, end = float(motion.time[0]), float(motion.time[-1])
    time = np.array([start + frame.share * (end - start)])
    (pixels,) = pictures(motion, time, size=SIZE, inertial=True, label=unfinished(run))
    picture = Image.fromarray(pixels[..., :3]).resize(SHOWN, Image.Resampling.LANCZOS)
    path = FOLDER / f"{name}.png"
    picture.quantize(colors=256, method=Image.Quantize.MAXCOVERAGE).save(path, optimize=True)
    return path


def main(names: list[str]) -> None:
    """Draw the cases that are named, or all."""
    if unknown := set(names) - set(FRAMES):
        sys.exit(f"no such case: {', '.join(sorted(unknown))}; known: {', '.join(FRAMES)}")
    FOLDER.mkdir(exist_ok=True)
    for name in names or sorted(cases.built_in()):
        path = draw(name)
        print(f"{path.relative_to(FOLDER.parent)}: {path.stat().st_size / 1000:.0f} kB", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
