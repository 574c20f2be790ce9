"""Relaxation curves: force over time at a position that is held, from arrays and files."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from evolvent.design.calibration import data, histories
from evolvent_base import units
from evolvent_base.errors import InputError, counted
from evolvent_base.scales import CELSIUS, celsius

Array = np.ndarray
#: Share of the largest force below which the first force is that of a ramp, and up to which the position is not loaded.
_RAMP, _UNLOADED = 0.5, 0.02
#: Share of the largest force below which a ramp counts as straight.
_STRAIGHT = 0.6
#: Groups of neighbouring rows whose means show whether the force rises; what is more than scatter, in standard
#: deviations; share of the range of a curve that it may rise by.
_GROUPS, _MANY, _RISE = 20, 6.0, 0.1
#: Difference of temperatures that are counted as one, and range within one, K.
_SAME, _RANGE = 1.0, 2.0
#: Noise of forces without any, in parts of the largest.
ROUND_OFF = 1e-9


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Curve:
    """Force or torque over time at a position that is held.

    Attributes
    ----------
    times : (n,) float, s since the position is held, rising
    forces : (n,) float, positive
    temperature : float, K; None if it is not known
    ramp : float, s, length of the loading ramp before the hold; 0 for a sudden step
    label : str, what messages call it
    noise : float, standard deviation of the forces about a smooth curve
    """

    times: Array
    forces: Array
    temperature: float | None
    ramp: float
    label: str
    noise: float


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Measured:
    """Curves, and what a reader must know of them.

    Attributes
    ----------
    curves : tuple of Curve
    unit : str, of the forces, as the file states it
    notes : tuple of str
    source : str, file or files
    """

    curves: tuple[Curve, ...]
    unit: str
    notes: tuple[str, ...]
    source: str


# ------------------------------------------------------------------------------------------------ files


def read(paths: Sequence[str], column: str, *, temperatures: Sequence[str] = (), ramp: float | None = None) -> Measured:
    """Curves of files.

    Parameters
    ----------
    paths : of one file, with one curve or those of several temperatures; or of several, one for each curve
    column : name of the column of forces or torques
    temperatures : name of a column of temperatures, or the temperature (K, or with a unit) of each file
    ramp : float, s, length of the ramp before the hold; that of the file unless given

    Raises
    ------
    InputError
        For columns and units that cannot be used, and rows that are no relaxation.
    """
    given = _temperatures(paths, temperatures)
    curves: list[Curve] = []
    notes: list[str] = []
    found: dict[str, str] = {}
    for path, temperature in zip(paths, given, strict=True):
        table = data.opened(path)
        place = data.place(table, column, "`column`")
        found[path] = table.units[place]
        time = data.times(table, data.clock_of(table), place, notes, "`column`")
        values = table.numbers(place + 1)
        for warm, rows in _groups(table, temperature, values):
            label = repr(path) if warm is None or len(paths) > 1 else f"{path!r} at {celsius(warm)}"
            history = histories.History(table, table.names[place], table.units[place], time, values, rows)
            curves.append(curve(*history.cleaned(notes), temperature=warm, ramp=ramp, label=label, notes=notes))
    if len(set(found.values())) > 1:
        listed = ", ".join(f"{unit or 'none'} in {path!r}" for path, unit in found.items())
        raise InputError(f"the column {column!r} has different units: {listed}; one unit is needed")
    unit = next(iter(found.values()))
    return Measured(curves=tuple(curves), unit=unit, notes=tuple(dict.fromkeys(notes)), source=", ".join(paths))


def _temperatures(paths: Sequence[str], given: Sequence[str]) -> list[str | float | None]:
    """Of each file its temperature, K, or the name of its column of temperatures."""
    if not given:
        return [None] * len(paths)
    found: list[str | float | None] = [kelvin(one, "temperatures") if is_value(one) else one for one in given]
    if len(found) == 1 and isinstance(found[0], str):
        return found * len(paths)
    if len(found) != len(paths):
        raise InputError(
            f"temperatures is given {counted(len(given), 'time')} for {counted(len(paths), 'file')}; give the name of "
            f"a column once, or a temperature for each file"
        )
    return found


def is_value(text: str) -> bool:
    """Whether a text is a temperature, and no name of a column."""
    return units.split(text) is not None


def kelvin(text: Any, key: str) -> float:
    """An absolute temperature, K.

    Raises
    ------
    InputError
        If it is none.
    """
    try:
        value = units.parse(text, "K") if isinstance(text, str) else float(text)
    except (units.UnitError, TypeError, ValueError) as error:
        why = f"; {error}" if isinstance(error, units.UnitError) else ""
        raise InputError(f"{key} is {text!r}; it must be an absolute temperature, such as '20 degC'{why}") from None
    if not 0.0 < value < 1e5:
        raise InputError(f"{key} is {text!r}, {value:g} K; it must be an absolute temperature, such as '20 degC'")
    return value


def _groups(table: Any, temperature: str | float | None, values: Array) -> list[tuple[float | None, Array]]:
    """Rows of each temperature, and it, K."""
    if not isinstance(temperature, str):
        _check_unnamed(table)
        return [(temperature, np.arange(values.size))]
    place = data.place(table, temperature, "`temperatures`")
    head = table.heads[place]
    if not table.units[place]:
        raise InputError(f"the column {head!r} of {table.path!r} states no unit; write it as temperature (degC)")
    try:
        in_kelvin = _in_kelvin(table, place)
    except units.UnitError as error:
        raise InputError(f"the column {head!r} of {table.path!r}: {error}") from None
    known = np.flatnonzero(np.isfinite(in_kelvin) & np.isfinite(values))
    if not known.size:
        raise InputError(f"the column {head!r} of {table.path!r} has no value beside one of the force")
    order = known[np.argsort(in_kelvin[known], kind="stable")]
    parts = np.split(order, np.flatnonzero(np.diff(in_kelvin[order]) > _SAME) + 1)
    found: list[tuple[float | None, Array]] = []
    for rows in parts:
        low, high = (float(end(in_kelvin[rows])) for end in (np.min, np.max))
        if high - low > _RANGE:
            raise InputError(
                f"the temperatures in {head!r} of {table.path!r} go from {low - CELSIUS:.4g} to {high - CELSIUS:.4g} "
                f"degC without a gap; a curve is measured at one temperature, within {_RANGE:g} K"
            )
        mean = kelvin(float(np.mean(in_kelvin[rows])), "temperatures")
        found.append((mean if high == low else round(mean - CELSIUS, 1) + CELSIUS, np.sort(rows)))
    return found


def _in_kelvin(table: Any, place: int) -> Array:
    """Temperatures of a column, K."""
    written = units.file_unit(table.units[place], "K")
    zero, one = (units.parse(f"{value} {written}", "K") for value in ("0", "1"))
    return np.asarray(zero + (one - zero) * table.numbers(place + 1))


def _check_unnamed(table: Any) -> None:
    """Refuse a file with a column of different temperatures that is not named."""
    for place, unit in enumerate(table.units):
        try:
            values = _in_kelvin(table, place) if unit else np.zeros(1)
        except (units.UnitError, InputError):
            continue
        if np.nanmax(values) - np.nanmin(values) > _RANGE:
            raise InputError(
                f"the temperatures in {table.heads[place]!r} of {table.path!r} go from {celsius(np.nanmin(values))} to "
                f"{celsius(np.nanmax(values))}; name the column with `temperatures` {table.names[place]}"
            )


# ------------------------------------------------------------------------------------------------ curves


def of_arrays(times: Any, forces: Any, temperatures: Any, ramp: float | None) -> Measured:
    """Curves of arrays: see `evolvent.design.calibration.fit_relaxation`."""
    if not (units.is_list(times) and units.is_list(forces)):
        raise InputError("times and forces must be arrays of one curve, or lists of arrays of several")
    several = len(times) > 0 and units.is_list(times[0])
    each = list(times) if several else [times]
    values = list(forces) if several else [forces]
    if several and len(values) != len(each):
        raise InputError(f"times holds {counted(len(each), 'curve')}, forces {len(values)}; they must be as many")
    if not units.is_list(temperatures):
        warm: list[Any] = [temperatures] * len(each)
    elif len(temperatures) == (len(each) if several else len(times)):
        warm = list(temperatures)
    else:
        wanted = "one for each curve" if several else "one for each time"
        raise InputError(f"temperatures holds {counted(len(temperatures), 'value')}; give {wanted}, or one")
    if not several and units.is_list(temperatures):
        at = np.array([kelvin(one, "temperatures") for one in warm])
        split = [np.flatnonzero(at == one) for one in np.unique(at)]
        if np.size(forces) != at.size:
            raise InputError(f"times holds {at.size} values, forces {np.size(forces)}; they must be as many")
        each, values = ([np.asarray(one)[rows] for rows in split] for one in (times, forces))
        warm = np.unique(at).tolist()
    notes: list[str] = []
    found = []
    for k, (time, force, one) in enumerate(zip(each, values, warm, strict=True)):
        label = "the curve" if len(each) == 1 else f"curve {k + 1}"
        temperature = None if one is None else kelvin(one, "temperatures")
        try:
            t, f = (np.asarray(x, dtype=float).ravel() for x in (time, force))
        except (TypeError, ValueError):
            raise InputError(f"{label} holds a time or a force that is no number") from None
        if t.size != f.size:
            raise InputError(
                f"{label} has {counted(t.size, 'time')} and {counted(f.size, 'force')}; as many are needed"
            )
        if not np.all(np.isfinite(t)) or not np.all(np.isfinite(f)):
            raise InputError(f"{label} holds a time or a force that is not finite")
        order = np.argsort(t, kind="stable")
        found.append(curve(t[order], f[order], temperature=temperature, ramp=ramp, label=label, notes=notes))
    return Measured(curves=tuple(found), unit="", notes=tuple(notes), source="")


def curve(
    times: Array, forces: Array, *, temperature: float | None, ramp: float | None, label: str, notes: list[str]
) -> Curve:
    """A curve of times that do not fall, and forces; a ramp before the hold is taken off.

    Parameters
    ----------
    ramp : float, s, length of the ramp; that of the data if None
    label : str, what messages call it
    notes : takes what was found

    Raises
    ------
    InputError
        If they are no relaxation: times before 0, a force that changes its sign or rises by more than it scatters.
    """
    if times.size < 4:
        raise InputError(f"{label} has {counted(times.size, 'value')}; a relaxation curve needs 4 or more")
    _check_sizes(times, forces, label)
    if ramp is not None and not 0.0 <= ramp < float(np.ptp(times)):
        raise InputError(f"ramp is {ramp:g} s; it must be 0 s or longer, and shorter than the curve")
    sign = -1.0 if np.median(forces) < 0.0 else 1.0
    forces = sign * forces
    peak = int(np.argmax(forces))
    if forces[0] < _RAMP * forces[peak] and _rises(forces[: peak + 1]):
        first = _start_of_ramp(times, forces, peak)
        begin, length = float(times[peak]), float(times[peak]) - first
        notes.append(
            f"{_capital(label)}: the force rises from {first:.4g} s to {begin:.4g} s, the end of a loading ramp, from "
            f"which times count; " + (f"the ramp is {length:.4g} s long." if ramp is None else "its length is given.")
        )
        times, forces = times[peak:] - begin, forces[peak:]
        ramp = length if ramp is None else ramp
        if times.size < 4:
            raise InputError(
                f"{label} has {counted(times.size, 'value')} from its largest force on, at {begin:.4g} s; a force that "
                "relaxes falls after it"
            )
    if times[0] < 0.0:
        raise InputError(
            f"{label} begins at {times[0]:g} s; times count from the moment at which the position is held, 0 s"
        )
    if float(times[-1]) == float(times[0]):
        raise InputError(f"{label} has one time, {times[0]:g} s; force over time is needed")
    noise = scatter(forces)
    _check_sign(times, forces, noise, label)
    _check_rise(times, forces, noise, label, notes)
    return Curve(times=times, forces=forces, temperature=temperature, ramp=float(ramp or 0.0), label=label, noise=noise)


def _check_sizes(times: Array, forces: Array, label: str) -> None:
    """Refuse numbers with which the fit could not be computed."""
    for what, values in (("time", times), ("force", forces)):
        sizes = np.abs(values[values != 0.0])
        if not sizes.size:
            raise InputError(f"{label}: every {what} is 0")
        wrong = (sizes > units.LARGEST) | (sizes < 1.0 / units.LARGEST)
        if wrong.any():
            raise InputError(
                f"{label}: a {what} is {sizes[wrong][0]:g} in size; it must be between {1.0 / units.LARGEST:g} and "
                f"{units.LARGEST:g}"
            )


def _capital(text: str) -> str:
    return text[0].upper() + text[1:]


def _rises(forces: Array) -> bool:
    """Whether forces are larger in their second half."""
    half = forces.size // 2
    return bool(np.median(forces[:half]) < np.median(forces[half:]))


def _start_of_ramp(times: Array, forces: Array, peak: int) -> float:
    """When the ramp begins: the last row without a load, or where the straight line of the ramp meets 0."""
    unloaded = np.flatnonzero(forces[:peak] < _UNLOADED * forces[peak])
    if unloaded.size:
        return float(times[unloaded[-1]])
    rows = np.flatnonzero(forces[: peak + 1] < _STRAIGHT * forces[peak])
    rows = rows if rows.size > 1 else np.array([0, peak])
    slope, level = np.polyfit(times[rows], forces[rows], 1)
    return float(-level / slope) if slope > 0.0 else float(times[0])


def scatter(forces: Array) -> float:
    """Standard deviation of forces about a smooth curve, from second differences; at least that of their rounding."""
    second = np.abs(np.diff(forces, 2))
    sigma = 1.4826 * float(np.median(second)) / np.sqrt(6.0) if second.size else 0.0
    steps = np.abs(np.diff(forces))
    resolved = float(steps[steps > 0.0].min(initial=np.inf))
    rounding = resolved / np.sqrt(12.0) if np.isfinite(resolved) else 0.0
    return max(sigma, rounding if sigma == 0.0 else 0.0, ROUND_OFF * float(np.abs(forces).max()))


def _check_sign(times: Array, forces: Array, noise: float, label: str) -> None:
    """Refuse a force that goes through 0."""
    low = int(np.argmin(forces))
    if forces[low] < -_MANY * noise:
        raise InputError(
            f"{label}: the force changes its sign at {times[low]:.4g} s; a force that relaxes keeps it: check the zero "
            "of the sensor"
        )


def _check_rise(times: Array, forces: Array, noise: float, label: str, notes: list[str]) -> None:
    """Refuse a force that rises by more than it scatters; a small rise is noted."""
    groups = np.array_split(np.arange(times.size), min(_GROUPS, times.size))
    means = np.array([forces[rows].mean() for rows in groups])
    errors = noise / np.sqrt([rows.size for rows in groups])
    lowest = np.minimum.accumulate(means)
    below = np.array([int(np.argmin(means[: k + 1])) for k in range(means.size)])
    rise = means - lowest
    is_rise = rise > _MANY * np.hypot(errors, errors[below])
    if not is_rise.any():
        return
    k = int(np.argmax(np.where(is_rise, rise, 0.0)))
    at, before = (float(times[groups[j]].mean()) for j in (k, below[k]))
    what = f"the force rises by {rise[k]:.3g} from {before:.4g} s to {at:.4g} s, and scatters by {noise:.2g}"
    if rise[k] > _RISE * np.ptp(means):
        raise InputError(f"{label}: {what}; a force that relaxes falls all the time: give the rows of the hold alone")
    notes.append(f"{_capital(label)}: {what}; a Prony series falls all the time.")
