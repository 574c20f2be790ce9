"""From the columns of a file to sensors: time, units, sensitivities, range and gaps."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence
from typing import Any

import numpy as np

from evolvent_base import units
from evolvent_base.errors import InputError
from evolvent_base.signals import Signals, timebase
from evolvent_base.signals.times import check_rate, read_times
from evolvent_base.tables import mark_of_missing
from evolvent_massprops import description as schema
from evolvent_massprops.uncertain import parts_of

#: Largest share of missing samples.
MOST_MISSING = 0.5


@dataclasses.dataclass(frozen=True, eq=False)
class Reading:
    """What the sensors of one recording read.

    Attributes
    ----------
    source : Signals
    names : c names
    time : (N,) s, from the first sample
    start : s, the file's time of the first sample
    data : (N, c) in `unit`, NaN where a sample is missing
    unit : of all sensors together
    noise : (c,) in `unit`, or None
    sensitivity_std : (c,) relative
    notes : sentences on what was done to the file's samples
    """

    source: Signals
    names: tuple[str, ...]
    time: np.ndarray
    start: float
    data: np.ndarray
    unit: str
    noise: np.ndarray | None
    sensitivity_std: np.ndarray
    notes: tuple[str, ...]

    @functools.cached_property
    def rate(self) -> float:
        """Samples a second, Hz."""
        return 1.0 / read_times(self.time).step


def read(source: Signals, given: schema.Signals) -> Reading:
    """Map a file's columns to sensors.

    Raises
    ------
    InputError
        Columns that are not there, no time, no unit, units of different kinds, times that do not rise, an empty range,
        gaps that are not wanted or too large.
    """
    named = [(sensor.column, f"signals.sensors.{k}.column") for k, sensor in enumerate(given.sensors)]
    base = timebase.choose(source, named, time=given.time, rate=given.rate)
    notes = [*([] if given.sensors else _left_out(source)), *base.notes]
    places = base.columns
    sensors = given.sensors or tuple(schema.Sensor(column=source.names[k]) for k in places)
    names = tuple(s.name or source.names[c] for s, c in zip(sensors, places, strict=True))
    if len(set(names)) < len(names):
        raise InputError(f"signals.sensors have the names {', '.join(names)}; they must be different")
    data = np.column_stack([source.samples(k)[: base.size] for k in places])
    _check_marks(data, [source.names[k] for k in places], source.path)
    notes += [note for note in source.notes if note not in notes]  # reading of a column adds to them
    if base.time is None:
        assert base.rate is not None
        check_rate(base.rate, "signals.rate" if given.rate else f"the rate that {source.path!r} states")
        time = base.start + np.arange(len(data)) / base.rate
    else:
        time, data = _at_times(base.time, data, given, notes)
    time, data = _cut(time, data, given, notes)
    found = [converted(s, source.units[c], given, k) for k, (s, c) in enumerate(zip(sensors, places, strict=True))]
    notes += [item.note for item in found if item.note]
    unit = found[0].unit
    try:
        factors = [item.factor * _ratio(item.unit, unit, names[k], names[0]) for k, item in enumerate(found)]
    except InputError as error:
        if given.sensors:
            raise
        raise InputError(f"{error}; name the ones that are signals under signals.sensors or --variables") from None
    data = data * np.array(factors)
    noise = _noise(found, factors, names)
    _gaps(data, names, given, notes)
    start = float(time[0])
    time = (time - start) * given.clock.value
    read_times(time)
    return Reading(
        source=source,
        names=names,
        time=time,
        start=start,
        data=data,
        unit=unit,
        noise=noise,
        sensitivity_std=np.array([item.std for item in found]),
        notes=tuple(notes),
    )


def _left_out(source: Signals) -> list[str]:
    """Sentences on what of a file is no column of numbers."""
    names: dict[str, list[str]] = {}
    for name, why in source.left_out.items():
        names.setdefault(why, []).append(repr(name))
    return [f"{', '.join(own)} {'is' if len(own) == 1 else 'are'} left out: {why}" for why, own in names.items()]


def _check_marks(data: np.ndarray, names: Sequence[str], path: str) -> None:
    """Refuse a sample far from all others that is written as a missing one is."""
    for name, values in zip(names, data.T, strict=True):
        far = mark_of_missing(values)
        if far is not None:
            raise InputError(
                f"sample {far + 1} of {name!r} in {path!r} is {values[far]:.12g}, far from all others; leave the cell "
                "empty if it marks a missing value"
            )


# ------------------------------------------------------------------------------------------------ time


def _at_times(
    time: np.ndarray, data: np.ndarray, given: schema.Signals, notes: list[str]
) -> tuple[np.ndarray, np.ndarray]:
    """Samples at their times; where these are on an even grid, with empty rows where rows are missing."""
    if len(time) < 3:
        raise InputError(f"the file has {len(time)} samples; at least 8 are needed")
    found = read_times(time)
    notes += found.notes
    rows = int(found.place[-1]) + 1
    lost = rows - len(time)
    if lost > 0 and given.gaps == "refuse":
        raise InputError(f"the file lacks {lost} of {rows} rows, and signals.gaps is 'refuse'")
    if lost > MOST_MISSING * rows:
        raise InputError(f"the file lacks {lost} of {rows} rows, more than half; choose another range")
    if found.even or found.unsure:  # as stated: the modes take into account what the rounding leaves open
        return time, data
    if not found.grid:
        return found.origin + found.time, data
    whole = np.full((rows, data.shape[1]), np.nan)
    whole[found.place] = data
    return found.origin + found.step * np.arange(rows), whole


def _cut(time: np.ndarray, data: np.ndarray, given: schema.Signals, notes: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """The samples from start to end."""
    kept = np.ones(len(time), dtype=bool)
    slack = 1e-9 * (time[-1] - time[0])
    if given.start is not None:
        kept &= time >= given.start - slack
    if given.end is not None:
        kept &= time <= given.end + slack
    if np.count_nonzero(kept) < 8:
        raise InputError(
            f"signals.start and signals.end leave {np.count_nonzero(kept)} of {len(time)} samples, which run from "
            f"{time[0]:g} to {time[-1]:g} s; at least 8 are needed"
            if not kept.all()
            else f"the file has {len(time)} samples; at least 8 are needed"
        )
    if not kept.all():
        notes.append(f"samples from {time[kept][0]:.6g} s to {time[kept][-1]:.6g} s of the file were used")
    return time[kept], data[kept]


def _gaps(data: np.ndarray, names: tuple[str, ...], given: schema.Signals, notes: list[str]) -> None:
    """Refuse gaps that are not allowed or too large; report the others."""
    missing = np.isnan(data).sum(axis=0)
    if not missing.any():
        return
    worst = int(np.argmax(missing))
    lacking = f"{names[worst]} lacks {missing[worst]} of {len(data)} samples"
    if given.gaps == "refuse":
        raise InputError(f"{lacking}, and signals.gaps is 'refuse'")
    if missing[worst] == len(data):
        raise InputError(f"{names[worst]} holds no sample in this range; leave it out")
    if missing[worst] > MOST_MISSING * len(data):
        raise InputError(f"{lacking}, more than half; leave it out, or choose another range")
    notes.append(f"{lacking} ({100.0 * missing[worst] / len(data):.2g} %); the fit goes around gaps")


# ------------------------------------------------------------------------------------------------ units


@dataclasses.dataclass(frozen=True)
class _Converted:
    """A column's way to its quantity: quantity = factor * column, in `unit`; relative std; noise of the column."""

    factor: float
    unit: str
    std: float
    noise: float | None
    note: str = ""


def converted(sensor: schema.Sensor, found: str, given: schema.Signals, k: int) -> _Converted:
    """How the column of a sensor becomes a quantity; `found` : its unit by the file, '' where it states none."""
    key = f"signals.sensors.{k}"
    note = ""
    if sensor.unit:
        unit = _unit(sensor.unit, f"{key}.unit")
        if not _same(found, unit):
            note = f"{sensor.column!r} is taken in {unit}, by {key}.unit, not in {found} as the file states"
    else:
        unit = _unit(found, f"the unit of the column {sensor.column!r}", f"; {key}.unit overrules the file")
    if not unit and given.unit:
        unit = _unit(given.unit, "signals.unit")
    if not unit:
        raise InputError(
            f"{key}: neither the file nor the description states the unit of {sensor.column!r}; "
            f"give signals.unit or {key}.unit, such as mm, m/s^2, V or px"
        )
    noise = None
    if sensor.noise is not None:
        noise = _value(sensor.noise, unit, f"{key}.noise", "0.1 " + unit)
        if noise <= 0.0:
            raise InputError(f"{key}.noise is {sensor.noise!r}; it must be above 0, or left out to be estimated")
    if sensor.sensitivity is None:
        return _Converted(1.0, unit, 0.0, noise, note)
    value, std, per = _sensitivity(sensor.sensitivity, f"{key}.sensitivity")
    if not per:
        return _Converted(1.0 / value, unit, std, noise, note)
    read = units.known(unit)
    factor = (1.0 / value * (read / units.known(per))).to_reduced_units()
    numerator = units.known(per.split("/")[0].strip() or "1")
    # the column is divided by the sensitivity, so that the reading's own unit must go out
    if units.known(per).is_compatible_with(read) or ("/" in per and not numerator.is_compatible_with(read)):
        raise InputError(
            f"{key}.sensitivity is {sensor.sensitivity!r}; the column {sensor.column!r} is in {unit}, so it must be in "
            f"{unit} per quantity, such as {unit}/mm"
        )
    return _Converted(float(factor.magnitude), f"{factor.units:~}" or "1", std, noise, note)


def _sensitivity(text: str, key: str) -> tuple[float, float, str]:
    """Value, relative standard uncertainty, and unit of a sensitivity."""
    head, *tail = parts_of(text)
    match = units.split(head)
    wrong = f"{key} is {text!r}; it must be a reading per quantity, such as '0.5 V/mm +- 0.2 %'"
    if match is None or len(tail) > 1 or float(match[1]) == 0.0:
        raise InputError(wrong)
    value, unit = float(match[1]), match[2].strip()
    unit = _unit(unit, key) if unit else ""
    if not tail:
        return value, 0.0, unit
    percent = tail[0].rstrip().endswith("%")
    number = _value(tail[0].rstrip("% "), "" if percent else unit, key, "0.2 %")
    std = number / 100.0 if percent else number / abs(value)
    if std < 0.0:
        raise InputError(wrong)
    return value, std, unit


def _value(text: str, unit: str, key: str, example: str) -> float:
    match = units.split(text)
    try:
        if match and match[2]:
            return float(match[1]) * units.factor(match[2], unit)
        return units.parse(text, unit)
    except units.UnitError as error:
        raise InputError(f"{key} is {text!r}; it must be a value such as {example!r}; {error}") from None


def _unit(text: str, key: str, more: str = "") -> str:
    """A unit in the spelling of case files; `key` names where it stands."""
    try:
        return units.file_unit(text)
    except units.UnitError as error:
        raise InputError(f"{key}: {error}{more}") from None


def _same(found: str, unit: str) -> bool:
    """Whether a file states the unit that it is read in, or none."""
    try:
        return not units.file_unit(found) or units.factor(found, unit) == 1.0
    except units.UnitError:
        return False


def _ratio(unit: str, wanted: str, one: str, other: str) -> float:
    """Factor from `unit` to `wanted`; refused where they are of different kinds."""
    try:
        return 1.0 if unit == wanted else units.factor(unit, wanted)
    except units.UnitError:
        raise InputError(f"{one} is in {unit}, {other} in {wanted}; they must be of one kind") from None


def _noise(converted: list[_Converted], factors: list[float], names: tuple[str, ...]) -> np.ndarray | None:
    """(c,) or None where none is known; all or none must be."""
    known = [item.noise for item in converted]
    if all(n is None for n in known):
        return None
    if any(n is None for n in known):
        lacking = names[known.index(None)]
        raise InputError(f"signals.sensors: the noise of {lacking} is not given, that of others is; give all or none")
    values: Any = known
    return np.abs(np.array(factors)) * np.array(values, dtype=float)
