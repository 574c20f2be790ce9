"""What drives move: refused beforehand where it goes too far, and stood still for statics."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from evolvent import model as mdl
from evolvent.assembly.assembled import Assembly
from evolvent.kernels.blocks import idle, indices
from evolvent.model.registry import asked

Array = np.ndarray
#: Times at which drives are evaluated over a run.
_TIMES = 2001


def check_drives(assembly: Assembly, end: float) -> None:
    """Refuse drives that leave by `end` (s) what their parts have.

    Raises
    ------
    InputError
    """
    breaks = assembly.model.breaks
    times = np.union1d(np.linspace(0.0, end, _TIMES), breaks[(breaks > 0.0) & (breaks < end)])
    for check in asked("drives.check").values():
        check(assembly, times)


def freeze(model: mdl.Model, time: float) -> mdl.Model:
    """The model with what changes its length by a drive at that of a time; other arrays are shared."""
    for one in asked("drives.freeze").values():
        model = one(model, time)
    return model


def stand_still(model: mdl.Model, time: float) -> None:
    """Let what drives move, but for lengths, stand where it is at `time`."""
    for stand in asked("drives.stand").values():
        stand(model, time)


def end_ramps(model: mdl.Model) -> None:
    """Let all loads of a model act as after their ramps."""
    for end in asked("drives.end_ramps").values():
        end(model)


def hold(t: float, y: Array, s: Array, model: mdl.Model) -> None:
    """Let the constraints of a model hold that do so in a state."""
    for one in asked("drives.hold").values():
        one(t, y, s, model)


def idle_nodes(model: mdl.Model) -> Array:
    """Velocities, counted from the first, of nodes that do not move yet and of nodes that are fixed to another part."""
    own = model.blocks[idle(model, model.switches)]
    return np.asarray(indices(own, "iv") - int(model.info.nq)).ravel()


def at_time(assembly: Assembly, y: Any, time: float) -> tuple[Assembly, Any]:
    """An assembly whose drives stand at `time`, with the nodes that move then, and the state to start from.

    Parameters
    ----------
    y : (ny,) float or None
        A state of that time, in which only nodes are placed whose positions it does not have. Without it all are.

    Raises
    ------
    InputError
        Where a drive has left by then what its part has.
    """
    if time > 0.0:
        check_drives(assembly, time)
    given = y is not None and np.shape(y) == assembly.y.shape
    state, s = np.array(y if given else assembly.y, dtype=float), assembly.s.copy()
    for place in asked("drives.place").values():
        place(assembly, time, state, s, given)
    found = freeze(assembly.model, time)
    hold(time, state, s, found)
    return dataclasses.replace(assembly, model=found, s=s), state if y is None or given else y
