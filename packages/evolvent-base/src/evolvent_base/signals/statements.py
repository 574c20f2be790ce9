"""Scalars and attributes of a file that are its sampling rate, its step, or the time of its first sample."""

from __future__ import annotations

import re
from typing import Literal

import numpy as np

from evolvent_base import units

#: Names of a rate, Hz, a step, s, and the time of the first sample, s, without blanks and signs, in small letters.
RATES = ("rate", "fs", "sr", "fsamp", "samplerate", "samplingrate", "samplefrequency", "samplingfrequency",
         "samplefreq", "samplingfreq", "abtastrate")  # fmt: skip
STEPS = ("dt", "ts", "step", "deltat", "timestep", "increment", "wfincrement", "xincrement", "sampletime",
         "sampletimes", "samplingtime", "sampleperiod", "samplingperiod", "sampleinterval",
         "samplinginterval")  # fmt: skip
STARTS = ("t0", "tstart", "timestart", "startvalue", "wfstartoffset", "xorigin")
_KEYS = {key: kind for kind, keys in (("rate", RATES), ("step", STEPS), ("start", STARTS)) for key in keys}


def _parts(key: str) -> tuple[str, str, str]:
    """What a key states, '' for nothing; its name as it is compared; and the unit that it ends with."""
    plain = re.sub(r"[\W_]+", "", key.lower())
    if plain in _KEYS:
        return _KEYS[plain], plain, ""
    match = re.fullmatch(r"(.+?)[\W_]+(hz|khz|s|ms|us)[\W_]*", key.lower())
    name = re.sub(r"[\W_]+", "", match[1]) if match else ""
    unit = match[2].replace("hz", "Hz") if match else ""
    return _KEYS.get(name, ""), name, unit


def is_statement(key: str) -> bool:
    """Whether a name is one of these."""
    return bool(_parts(key)[0])


def statement(key: str, value: object, unit: str = "") -> tuple[Literal["step", "start"], float] | None:
    """What a named value states: a step (also in place of a rate) or a start, s; None where it states none.

    Parameters
    ----------
    key : name, which may end with its unit, as dt_ms
    value : one number, or a text such as "50 Hz"
    unit : that the file states of the number
    """
    kind, _, own = _parts(key)
    number = _quantity(value, own or unit, "Hz" if kind == "rate" else "s") if kind else None
    if number is None or not np.isfinite(number):
        return None
    if kind == "start":
        return "start", number
    return ("step", 1.0 / number if kind == "rate" else number) if number > 0.0 else None


def _quantity(value: object, unit: str, wanted: str) -> float | None:
    """A number or a text in the unit that is wanted; None where it is none."""
    try:
        if isinstance(value, (str, bytes)):
            text = value.decode() if isinstance(value, bytes) else value
            return units.parse(text if re.search(r"[A-Za-z]", text) else f"{text} {unit or wanted}", wanted)
        number = float(np.asarray(value).ravel()[0])
        return number * units.factor(unit, wanted) if unit else number
    except (units.UnitError, TypeError, ValueError, IndexError):
        return None
