"""What a planned recording will show: the expected body on its stand, the pull, and the sensors' signals."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from evolvent.base import units
from evolvent.base.errors import InputError
from evolvent.massprops import modal
from evolvent.massprops.description import OnSprings, Planned, load
from evolvent.massprops.identification import Modes
from evolvent.massprops.identification.bounds import Factor, covariance
from evolvent.massprops.identification.signals import basis, read_signal
from evolvent.massprops.inertia import Body, Stand, linear_model
from evolvent.massprops.inertia.vibration import NormalModes
from evolvent.massprops.mode_selection import FAINT
from evolvent.massprops.recordings import Reading
from evolvent.massprops.signals import Signals
from evolvent.massprops.springs_inputs import Task as SpringTask, first_body, sensors_of, stand_of

Array = np.ndarray
#: Relative difference of frequencies below which two modes are one in the signals.
COINCIDING = 1e-6


class Task(NamedTuple):
    """What is planned: description, its plan, stand, expected body and its modes, sensors and their noise (m)."""

    given: OnSprings
    planned: Planned
    stand: Stand
    body: Body
    modes: NormalModes
    points: Array
    directions: Array
    noise: Array


def task_of(stand: Any, uncertainty: float, overrides: Mapping[str, Any] | None) -> Task:
    """A checked description, and what it lets expect.

    Raises
    ------
    InputError
        One sentence for what a plan needs and the description lacks.
    """
    if not (math.isfinite(uncertainty) and 0.0 < uncertainty <= 1.0):
        raise InputError(f"uncertainty is {uncertainty!r}; it must be above 0 and at most 1 (100 %)")
    given = load(stand, overrides)
    if not isinstance(given, OnSprings):
        raise InputError(f"stand.kind is {given.stand.kind!r}; a plan is made for springs")
    planned = given.plan
    if planned is None:
        raise InputError("plan is missing; give plan.force, the pull that is released, such as '1000 N'")
    held = stand_of(given)
    for key in given.body.unknown:
        value = getattr(given.body, key)
        if not math.isfinite(value.value):
            raise InputError(
                f"body.{key} is unknown; a plan needs the value that is expected, such as {key}: unknown near "
                f"{_example(key)}"
            )
    body, _ = first_body(given, held, np.ones(1))
    points, directions = sensors_of(given, held)
    return Task(
        given, planned, held, body, linear_model(held, body).modes(), points, directions, _noise(given, planned)
    )


def _example(key: str) -> str:
    return "15 t" if key == "mass" else "0 m" if key in ("offset_x", "offset_z", "height") else "3700 kg m^2"


def _noise(given: OnSprings, planned: Planned) -> Array:
    """(c,) m, standard deviation of each sensor's noise."""
    found = []
    for k, sensor in enumerate(given.signals.sensors):
        key = f"signals.sensors.{k}.noise"
        if sensor.noise is None and planned.noise is None:
            raise InputError(f"{key} is missing; give it, or plan.noise for all sensors, such as '0.1 mm'")
        try:
            found.append(planned.noise if sensor.noise is None else units.parse(sensor.noise, "m"))
        except units.UnitError as error:
            raise InputError(f"{key} is {sensor.noise!r}; a plan takes sensors of displacement: {error}") from None
        if not found[-1] or found[-1] <= 0.0:
            raise InputError(f"{key} is {sensor.noise!r}; it must be above 0")
    return np.array(found, dtype=float)


def amplitude(task: Task, spring: int) -> Array:
    """(m, c) complex, m, of every mode of the linear model at all sensors after the pull at a spring."""
    z = task.modes.release((0.0, -task.planned.force, 0.0), task.stand.points[spring])
    return np.asarray(task.modes.amplitude(z, task.points, task.directions))


def seen_modes(task: Task, spring: int, rows: Sequence[int] | None = None) -> Array:
    """(m,) bool, modes of the linear model that move the sensors, one of those with the same frequency."""
    found = np.abs(amplitude(task, spring))
    found = found if rows is None else found[:, list(rows)]
    speed = found.max(axis=1) * task.modes.natural_frequency
    w = task.modes.natural_frequency
    apart = np.diff(w, prepend=-math.inf) > COINCIDING * w
    return np.asarray((speed > FAINT * speed.max()) & apart)


def order_of(task: Task, spring: int, rows: Sequence[int]) -> int:
    """Number of modes that some sensors show."""
    return int(seen_modes(task, spring, rows).sum())


def with_sensors(task: Task, rows: Sequence[int], order: int) -> OnSprings:
    """The description with some of its sensors, the number of modes given."""
    signals = task.given.signals.model_copy(update={"sensors": tuple(task.given.signals.sensors[k] for k in rows)})
    identification = task.given.identification.model_copy(update={"order": order})
    return task.given.model_copy(update={"signals": signals, "identification": identification})


def reading_of(task: Task, spring: int, rate: float, samples: int, rows: Sequence[int]) -> Reading:
    """What the sensors read without noise."""
    t = np.arange(samples) / rate
    wave = np.exp((-task.modes.decay_rate + 1j * task.modes.frequency)[:, None] * t)
    data = np.einsum("ms,mk->ks", amplitude(task, spring)[:, list(rows)], wave).real
    names = tuple(f"sensor {k + 1}" for k in rows)
    source = Signals(
        names=names, data=data, units=("m",) * len(names), rate=rate, path="plan", format="plan", sha256=""
    )
    return Reading(source, names, t, 0.0, data, "m", task.noise[list(rows)], np.zeros(len(names)), ())


def with_noise(task: Task, exact: Reading, random: np.random.Generator, rows: Sequence[int]) -> Reading:
    """The same with the sensors' noise."""
    noise = random.standard_normal(exact.data.shape) * task.noise[list(rows)]
    return dataclasses.replace(exact, data=exact.data + noise)


def spring_task(task: Task, given: OnSprings, seen: modal.Modal, rows: Sequence[int]) -> SpringTask:
    """What is solved for modes that some sensors show."""
    keys = (*given.body.unknown, *(("common_factor",) if given.stand.common_factor.unknown else ()))
    at, mean = list(rows), float(np.mean(task.stand.stiffness))
    used = tuple(range(len(seen.frequency)))
    return SpringTask(given, seen, used, task.stand, task.points[at], task.directions[at], keys, mean)


def modal_of(task: Task, spring: int, rate: float, samples: int, rows: Sequence[int]) -> modal.Modal:
    """Modes of a recording as an identification finds them at best, with the Cramér-Rao bound as their covariance."""
    seen, columns = seen_modes(task, spring, rows), list(rows)
    w, decay = task.modes.frequency[seen], task.modes.decay_rate[seen]
    if np.pi * rate <= float(w.max()):
        raise InputError(f"{rate:.6g} samples a second show nothing above {np.pi * rate:.6g} rad/s, but a mode has "
                         f"{w.max():.6g} rad/s")  # fmt: skip
    reading, a = reading_of(task, spring, rate, samples, rows), amplitude(task, spring)[seen][:, columns]
    signal = read_signal(
        reading.data, time=reading.time, names=reading.names, noise=reading.noise,
        detrend=task.given.identification.detrend,
    )  # fmt: skip
    R = np.linalg.qr(basis(-decay + 1j * w, signal, slopes=True), mode="r")
    C = covariance([Factor(np.asarray(R), np.arange(len(columns)))], a, task.noise[columns])
    if not np.all(np.isfinite(C)):
        raise InputError("the record is too short to distinguish the modes")
    zero = np.zeros(len(columns))
    modes = Modes(
        "bound", w.size, reading.names, w, decay, np.abs(a), np.angle(a), zero, zero, C, task.noise[columns],
        reading.time, reading.data, reading.data, np.zeros_like(reading.data),
    )  # fmt: skip
    found, own = modes.mode_shapes(), np.ones(w.size)
    return modal.Modal(
        reading, modes, 1.0, own, modes.natural_frequency, modes.natural_frequency_covariance, found.real,
        found.shape_covariance, (),
    )  # fmt: skip
