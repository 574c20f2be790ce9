"""Settings of a run: its times and samples, checked before anything is compiled."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from pydantic_core import PydanticCustomError

from evolvent.assembly.assembled import Assembly
from evolvent.solvers.common.laws import refusing_laws
from evolvent.solvers.common.standing import check_drives
from evolvent.solvers.time.explicit import plan as explicit_plan
from evolvent_base import units
from evolvent_base.errors import InputError

#: Samples of a run where no interval is given.
SAMPLES = 400
#: Largest number of values of the state that a run may keep.
MOST_VALUES = 200_000_000
_TIME = units.Quantity(what="a time", unit="s", example="20 s", above=0.0)


def seconds(name: str, value: Any) -> float:
    """A time above zero, of a number or a text with a unit.

    Raises
    ------
    InputError
    """
    try:
        return float(_TIME.read(value))
    except PydanticCustomError as error:
        raise InputError(f"{name} is {value!r}; {error.message()}") from None


def sample_times(until: Any, every: Any = None, *, values: int = 1) -> np.ndarray:
    """Times from 0 to `until`, `every` so many seconds (the last interval may be shorter).

    Raises
    ------
    InputError
        If a time is not above zero, or a run would keep more than `MOST_VALUES` numbers.
    """
    end = seconds("until", until)
    step = end / SAMPLES if every is None else seconds("every", every)
    count = end / step
    if count * values > MOST_VALUES:
        raise InputError(f"every is {step:g} s; that makes {count:.3g} samples over {end:g} s, too many")
    samples = step * np.arange(int(count + 1e-9) + 1)
    if samples.size == 1 or end - samples[-1] > 1e-6 * step:
        return np.append(samples, end)
    samples[-1] = end
    return samples


def check_run(assembly: Assembly, samples: np.ndarray, step: float | None = None) -> None:
    """Refuse what is known before anything is compiled: too many steps, drives that pay out more than their thread.

    Raises
    ------
    InputError
    """
    duration = float(samples[-1] - samples[0])
    if step is not None and 0.0 < explicit_plan.MOST_STEPS * step < duration:
        raise InputError(
            f"step is {step:.3g} s; that makes {duration / step:.2g} steps over {duration:.6g} s, more than "
            f"{explicit_plan.MOST_STEPS:.0e}; use a longer `step`, or shorten `until`"
        )
    with refusing_laws(assembly):
        check_drives(assembly, float(samples[-1]))


def settings_of(own: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Settings of a run with what is given in their place, times in seconds.

    Parameters
    ----------
    own : settings of the system
    given : arguments, None where they are left out
    """
    method = given.get("method")
    if method is not None and method != own.get("method", method):  # step and tolerances are of another method
        own = {name: value for name, value in own.items() if name in ("until", "every", "fine")}
    settings = {**own, **{name: value for name, value in given.items() if value is not None}}
    if "until" not in settings:
        raise InputError("until is missing; give the end of the run, such as until='20 s'")
    for name in ("until", "every", "step"):
        if name in settings:
            settings[name] = seconds(name, settings[name])
    return settings
