"""A run as recorded signals: the sensors of its stand, and variables that are asked for, over time."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

import numpy as np

from evolvent import results
from evolvent.results import variables
from evolvent_base.errors import InputError


def columns(name: str, wanted: Iterable[str]) -> list[tuple[str, np.ndarray, str, str]]:
    """Name, values (nt,), unit and name of the column of times of each signal of a run.

    Parameters
    ----------
    name : str, the run's file
    wanted : full names of variables that become signals besides the sensors

    Raises
    ------
    InputError
        If the run cannot be read, a variable is no single number over time, or there is no signal.
    """
    run = results.regular(results.open(name))
    found = {"time": np.asarray(run["time"].values, dtype=float)}
    units = {"time": "s"}
    if "sensor_displacement" in run:
        data = run["sensor_displacement"]
        for k, sensor in enumerate(run["sensor"].values):
            found[f"sensor {sensor}"], units[f"sensor {sensor}"] = data.values[:, k], str(data.attrs["units"])
    for one in wanted:
        if one in found:
            continue
        variable = variables.get(run, one)
        if variable.dims != ("time",):
            axes = "axis" in variable.dims and "axis" in variable.coords
            hint = f"{one}.{variable['axis'].values[0]}" if axes else ""
            raise InputError(
                f"{one!r} of {name!r} is no single number over time; name one of its components or entries"
                + (f", such as {hint}" if hint else "")
            )
        found[one] = np.asarray(variable.values, dtype=float)
        units[one] = _plain_unit(str(variable.attrs.get("units", "")))
    if len(found) == 1:
        raise InputError(
            f"{name!r} is a run of {run.attrs['system']}, which has no sensors; name the variables that they read with "
            f"--variables or in signals.sensors, such as {_example(run)}"
        )
    return [(key, x, units[key], "" if key == "time" else "time") for key, x in found.items()]


def _example(run: Any) -> str:
    """A variable of a run that a sensor might read."""
    dims = {name: variables.get(run, name).dims for name in variables.names(run)}
    known = [name for name, own in dims.items() if own in (("time",), ("time", "axis"))]
    best = next((name for name in known if name.endswith("deflection")), known[-1])
    return f"{best}.y" if "axis" in dims[best] else best


def _plain_unit(unit: str) -> str:
    """A unit as results hold it, "kg m2 s-1", in the form of case files, "kg*m^2/s"."""
    above: list[str] = []
    below: list[str] = []
    for letters, sign, power in re.findall(r"([^\s\d-]+)(-?)(\d*)", unit):
        (below if sign else above).append(letters + (f"^{power}" if power not in ("", "1") else ""))
    return "/".join(["*".join(above) or "1", *below])
