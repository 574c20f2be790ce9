"""Where the accuracy of 0.1 % of Belyakov (2002) comes from: time step, Prony's method, static tilt."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from evolvent import cases
from evolvent_massprops.inertia import Body, Stand, partial_frequencies
from evolvent_massprops.inertia_stand import SYSTEM
from evolvent_papers.papers import Made, Options
from evolvent_papers.papers.winding import markdown

CASE = "inertia-stand-paper"
#: Offsets of the centre of mass, m; the first is the middle, the second the only one of the quick form.
OFFSETS = ((0.0, 0.0), (0.4, 0.0), (0.0, 0.174), (-0.2, 0.174), (0.4, 0.174), (0.4, -0.174))
#: What differs from the paper's method, by the name of the row.
VARIANTS: dict[str, dict[str, Any]] = {
    "the paper's: modified Euler (6 ms: ours), Prony, three frequencies": {},
    "step of 2 ms": {"solver.step": "2 ms"},
    "DOP853 in place of modified Euler": {"solver.method": "dop853", "solver.step": "auto"},
    "VARPRO in place of Prony": {"identification.method": "varpro"},
    "DOP853 and VARPRO": {"solver.method": "dop853", "solver.step": "auto", "identification.method": "varpro"},
    "DOP853, VARPRO, fit at the tilted equilibrium": {
        "solver.method": "dop853", "solver.step": "auto", "identification.method": "varpro",
        "identification.way": "fit",
    },
}  # fmt: skip
NOTE = """\
Error of the identified moments, %, without noise, each row with one change of the case `inertia-stand-paper`. By the
step alone the errors are (w_roll^2 - w_heave^2) dt^2/24 of Ixx and (w_pitch^2 - w_heave^2) dt^2/24 of Izz, without
offset: {0:+.3f} and {1:+.3f} %.
"""


def errors(changes: Mapping[str, Any], offsets: Sequence[tuple[float, float]] = OFFSETS) -> np.ndarray:
    """(n, 2) relative errors of Ixx and Izz at offsets, of the paper's case with changes."""
    keys = ("body.offset_x", "body.offset_z")
    runs = SYSTEM.run_batch([cases.load(CASE, dict(zip(keys, at, strict=True)) | dict(changes)) for at in offsets])
    found = []
    for run in runs:
        if isinstance(run, Exception):
            raise run
        found.append((run.inertia_identified / run.inertia_true - 1.0).sel(component=["xx", "zz"]).values)
    return np.array(found)


def of_the_step(step: float = 6e-3) -> tuple[float, float]:
    """Relative errors of Ixx and Izz that modified Euler makes at a step, s, without offset.

    Notes
    -----
    A frequency is lower by (w dt)^2/48 of itself, and the moments go with the squares of w_heave / w_roll and
    w_heave / w_pitch.
    """
    case = cases.load(CASE)
    stand = Stand(points=case.stand.springs, stiffness=case.stand.stiffness, length=case.stand.natural_length)
    body = Body(mass=case.body.mass, centre=case.body.centre, inertia=case.body.tensor)
    heave, roll, pitch = partial_frequencies(stand, body)
    return (roll**2 - heave**2) * step**2 / 24.0, (pitch**2 - heave**2) * step**2 / 24.0


def table_error(options: Options) -> Made:
    """Errors of the moments with one part of the paper's method after the other replaced."""
    offsets = OFFSETS[:2] if options.quick else OFFSETS
    head = ["method", *(f"e = ({x:g}, {z:g}) m" for x, z in offsets)]
    rows = []
    for name, changes in VARIANTS.items():
        options.report(name)
        rows.append([name, *(f"Ixx {100 * a:+.3f}, Izz {100 * b:+.3f}" for a, b in errors(changes, offsets))])
    first = [100.0 * value for value in of_the_step()]
    return Made(text=f"{NOTE.format(*first)}\n{markdown(head, rows)}")
