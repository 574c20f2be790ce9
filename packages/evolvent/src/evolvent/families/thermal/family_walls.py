"""Heated walls: the temperatures of the elements of a shell, of which the balance of heat is solved."""

from __future__ import annotations

from typing import Any

from evolvent.families.thermal import walls
from evolvent.kernels import calls
from evolvent.model.family import Family, record
from evolvent.model.layout import Accounts
from evolvent.model.questions import Implicit, Parts, Samples, Stability, Statics
from evolvent.model.shares import Shares


@calls.force
def start(interval, model):
    """A run in time begins at the temperatures of its state."""
    walls.start_walls(interval.step.t, interval.y1, model)


@calls.force
def end_step(interval, model):
    """Temperatures at the end of a step, or of an equilibrium, into the accounts."""
    step, rows = interval.step, model.heated_walls
    if step.h > 0.0:
        walls.advance_walls(step.t, step.h, interval.y1, model)
    for k in range(rows.size):
        if step.h > 0.0 or rows[k].steady != 0.0:
            for i in range(walls.TERMS):
                interval.y1[rows[k].account + i] = rows[k].now[i]


@calls.force
def load(interval, model):
    """Temperatures that stand among the accounts of a state."""
    walls.load_walls(interval.ym, model)


@calls.force
def evaluate(interval, model):
    """Temperatures of the faces, and the sunlight that they take."""
    walls.note_walls(interval.step.t, interval.ym, model)


def _at_rest(model: Any) -> None:
    model.heated_walls["steady"] = 1.0


# elements of a heated shell: load of which the balance is, account of the first coefficient of the temperature
# (`walls`). kept, rate, time: coefficients, K, at the end of the last step, and their rates over it; now: those of the
# last evaluation; steady: 1 in statics; before: W/m2, sunlight that top and bottom took at the end of the last step
HEATED_WALLS = Family(
    "heated_walls",
    record(
        "element load account", "",
        "kept rate now work before time steady top bottom absorbed_top absorbed_bottom",
        kept=(walls.TERMS,), rate=(walls.TERMS,), now=(walls.TERMS,), work=(walls.TERMS,), before=(2,),
    ),
    order=610,
    of="thermal_loads",
    results={
        "top": ("absolute_temperature_top", "K", "temperature of the face to which the normal points"),
        "bottom": ("absolute_temperature_bottom", "K", "temperature of the other face"),
        "absorbed_top": ("absorbed_top", "W m-2", "sunlight that the face takes to which the normal points"),
        "absorbed_bottom": ("absorbed_bottom", "W m-2", "sunlight that the other face takes"),
    },
    shares=Shares((), unforced=lambda model: {}),
    smooth=True,
    stiff=False,
    of_step=False,
    accounts=(Accounts(walls.TERMS, states=tuple(range(walls.TERMS)), order=5.7),),
    parts=Parts(reads_inertia=False),
    stability=Stability(by_rates=False),
    implicit=Implicit(start=start, end_step=end_step),
    statics=Statics(at_rest=_at_rest),
    samples=Samples(prepare=load, evaluate=evaluate),
)  # fmt: skip
