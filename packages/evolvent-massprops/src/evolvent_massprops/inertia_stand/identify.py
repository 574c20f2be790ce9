"""Modes and inertia from a run's signals; of the truth only what a laboratory knows is used."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from evolvent_base.errors import InputError, in_keys
from evolvent_massprops import batch
from evolvent_massprops.identification import IdentifiedModes, frequencies_in, identify, mode_variables
from evolvent_massprops.inertia import Inertia, from_modes, inertia_variables, mode_energies, partners
from evolvent_massprops.inertia_stand.case import Case
from evolvent_massprops.inertia_stand.structure import Setup, known_of

if TYPE_CHECKING:
    from evolvent.analysis.definition import Variables

#: Relative difference of two frequencies below which they count as one.
COINCIDING = 1e-6
#: Amplitude, of the largest, above which a mode of the linear model counts in signals without noise.
SEEN = 1e-3
#: Frequencies of an identified mode and of its partner in the linear model differ by at most so much, relatively.
PARTNER = 0.05
#: Relative change of a frequency by the amplitude above which there may be a warning.
SWING = 1e-5
#: Warnings about methods that give no deviations, where the signals hold noise.
PLAIN = {
    name: f"{name} gives no standard deviations; use varpro" for name in ("esprit", "matrix-pencil", "tls-prony")
} | {"prony": "noise biases the frequencies and decay rates of prony, which gives no standard deviations; use varpro"}
#: Names in `evolvent_massprops.inertia.from_modes` -> keys of the case.
_KEYS = {"way": "identification.way", "order": "identification.order"}


class Found(NamedTuple):
    """What the signals give.

    Attributes
    ----------
    modes, body : IdentifiedModes, Inertia; None where they could not be found
    reason : str, why not
    pairs : dict, number of an identified mode -> that of its partner in the linear model
    shift : (m,) relative difference of the frequencies from those of small motion; NaN where unknown
    bias : change of the body's numbers by that shift, by name; NaN where a mode has no partner
    """

    modes: IdentifiedModes | None
    body: Inertia | None
    reason: str
    pairs: dict[int, int]
    shift: np.ndarray
    bias: dict[str, float]


def identified(
    case: Case, setup: Setup, measured: np.ndarray, true: np.ndarray, step: float
) -> tuple[Variables, list[str]]:
    """Modes and inertia read from the signals, as variables of the root, and warnings; NaN for what was not found.

    Parameters
    ----------
    measured, true : (nt, c) float, m, what the sensors read, and the same without noise
    step : float, s, of a method with fixed steps; 0 of another one
    """
    chosen, order, modes, body, reason = case.identification, _order(case, setup), None, None, ""
    try:
        if order == 0:
            raise InputError("no mode of the linear model moves a sensor along its direction; turn or move the sensors")
        names = [f"sensor {k + 1}" for k in range(measured.shape[1])]
        method = chosen.method.replace("-", "_")
        modes = identify(measured, rate=case.sensors.rate, method=method, order=order, names=names)
        if chosen.way != "none":
            body = inertia_of(case, modes)
    except InputError as error:
        reason = in_keys(str(error), _KEYS)
    except np.linalg.LinAlgError as error:
        reason = f"the modes give no inertia by {chosen.way}: its equations have no solution ({error})"
    found = Found(modes, body, reason, {}, np.zeros(0), {})
    if modes is not None:
        shapes, sensors = modes.mode_shapes().real, (case.sensor_points, case.sensor_directions)
        found = found._replace(pairs=partners(modes.frequency, shapes, setup.modes, *sensors, within=PARTNER))
        found = _with_shift(case, setup, found, true, step)
    return _variables(case, setup, found, order or 3), _warnings(case, found)


def inertia_of(case: Case, modes: IdentifiedModes) -> Inertia:
    """Mass properties by the way that the case asks for."""
    sensors = {"points": case.sensor_points, "directions": case.sensor_directions}
    stand, body = known_of(case)
    return from_modes(stand, body, modes, way=case.identification.way, **sensors)


def distinct(frequency: np.ndarray) -> np.ndarray:
    """(m,) bool, whether each of the rising frequencies differs from the one before by more than `COINCIDING`."""
    return np.diff(frequency, prepend=0.0) > COINCIDING * frequency


def _order(case: Case, setup: Setup) -> int | None:
    """Number of modes that are identified; None where the signals decide."""
    if case.identification.order != "auto":
        return int(case.identification.order)
    if case.sensors.noisy:
        return None
    # without noise, whatever is above rounding would count as a mode: harmonics, and sway in the millionths
    seen = np.abs(setup.modes.amplitude(setup.start.z, case.sensor_points, case.sensor_directions)).max(axis=1)
    return int(np.sum(distinct(setup.modes.natural_frequency[seen > SEEN * seen.max()])))


def _with_shift(case: Case, setup: Setup, found: Found, true: np.ndarray, step: float) -> Found:
    """With the difference of the frequencies from those of small motion, and what it makes of the inertia.

    Notes
    -----
    The modes of the motion without noise against those of the linear model, as the integration's method steps them.
    """
    modes, body = found.modes, found.body
    assert modes is not None
    shift = np.full(modes.order, np.nan)
    found = found._replace(shift=shift)
    clean = frequencies_in(modes, true[:, np.ptp(true, axis=0) > 0.0], rate=case.sensors.rate)
    if clean is None:
        return found
    for i, j in found.pairs.items():
        small = float(setup.modes.frequency[j])
        small *= 1.0 + (batch.amplification(case.solver.method)(small * step)[1] if step else 0.0)
        shift[i] = clean[i] / small - 1.0
    if body is None:
        return found
    if np.any(np.isnan(shift)):
        return found._replace(bias=dict.fromkeys(body.identified, np.nan))
    try:
        small_body = inertia_of(case, dataclasses.replace(modes, frequency=modes.frequency / (1.0 + shift)))
    except (InputError, np.linalg.LinAlgError):
        return found
    return found._replace(bias={name: body[name] - small_body[name] for name in body.identified})


def _variables(case: Case, setup: Setup, found: Found, order: int) -> Variables:
    modes, pairs = found.modes, found.pairs
    data = mode_variables(modes, unit="m", order=order, sensors=len(case.sensor_points))
    linear = np.full(data["mode_frequency"][1].size, np.nan)
    energy = std = linear
    if modes:
        linear = linear.copy()
        linear[list(pairs)] = setup.modes.frequency[list(pairs.values())]
        sensors = case.sensor_points, case.sensor_directions
        energy, std = mode_energies(setup.stand, setup.modes, modes, pairs, *sensors)
        data["sensor_fitted"] = (("time", "sensor"), modes.fitted, "m", "sum of the identified modes")
    text = "frequency of the linear model's nearest mode"
    data["mode_frequency_linear"] = (("mode",), linear, "rad s-1", text)
    data["mode_energy"] = (("mode",), energy, "J", "energy of the mode at t = 0, from its amplitudes")
    data["mode_energy_std"] = (("mode",), std, "J", "its standard deviation")
    return data | inertia_variables(found.body, found.bias)


def _warnings(case: Case, found: Found) -> list[str]:
    """Sentences on what was not found, the amplitude, the method, and what the data do not support."""
    sentences = [f"identification: {found.reason}"] if found.reason else []
    sentences += [text for text in (_amplitude(found),) if text]
    if case.sensors.noisy:  # without noise a residual is what the modes do not hold, and never white
        sentences += [PLAIN[case.identification.method]] if case.identification.method in PLAIN else []
        sentences += found.modes.warnings if found.modes else ()
    return sentences + list(found.body.warnings if found.body else ())


def _amplitude(found: Found) -> str:
    """A sentence where the amplitude shows in frequencies or moments, beyond their deviations."""
    shift, bias, modes, body = np.abs(found.shift), found.bias, found.modes, found.body
    if body and modes and bias and (strange := np.flatnonzero(np.isnan(shift))).size:
        listed = ", ".join(f"{w:.6g}" for w in modes.frequency[strange])
        return (
            f"the linear model has no mode within {PARTNER:.0%} of those identified at {listed} rad/s, so the inertia "
            f"means little and gets no standard deviation; swing less, or see what else the signals hold"
        )
    if modes is None or not np.any(shift > SWING):
        return ""
    moments = [k for k in ("Ixx", "Iyy", "Izz") if k in bias] if body else []
    beyond = np.any((shift > SWING) & ~(shift * modes.frequency < modes.frequency_std))
    if not beyond and not (body and any(abs(bias[k]) > body.std[k] for k in moments)):
        return ""
    largest = 100.0 * np.nanmax(shift)
    text = f"the swing is large: its frequencies differ from those of small motion by up to {largest:.2g} %"
    if moments and body:
        most = 100.0 * max(abs(bias[k] / body[k]) for k in moments)
        text += f", and so the moments by up to {most:.2g} %, which their standard deviations include"
    return f"{text}; swing less"
