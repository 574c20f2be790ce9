"""What a planned recording is and will show: the expected body on its stand, the pull, and the sensors' signals."""

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
from evolvent.massprops.recordings import Reading, converted
from evolvent.massprops.signals import Signals
from evolvent.massprops.springs_inputs import Task as SpringTask, first_body, sensors_of, stand_of

Array = np.ndarray
#: Relative difference of frequencies below which two modes are one in the signals.
COINCIDING = 1e-6
#: Motion of a sensor, of the largest, below which it shows nothing.
BLIND = 1e-9
#: What a wanted uncertainty is held against.
COUNTED = ("mass", "Ixx", "Iyy", "Izz", "common_factor")


class Option(NamedTuple):
    """One way to measure.

    Attributes
    ----------
    spring : int, number of the spring at which the pull is released, from 1
    rate : float, Hz
    duration : float, s, of the record; the longest allowed where the wanted uncertainty is not reached
    sensors : tuple of int, numbers of the description's sensors, from 1
    reached : bool, whether the wanted uncertainty is reached
    keys : tuple of str, the quantities that are asked
    relative : (p,) float, expanded uncertainty of each over its value; NaN of offsets and products
    noise : (p,) float, what the sensors' noise alone gives
    reason : str, why it cannot be evaluated, '' where it can
    """

    spring: int
    rate: float
    duration: float
    sensors: tuple[int, ...]
    reached: bool
    keys: tuple[str, ...]
    relative: Array
    noise: Array
    reason: str = ""

    @property
    def worst(self) -> float:
        """Largest relative expanded uncertainty; infinite where there is none."""
        return float(np.nanmax(self.relative)) if self.relative.size and not self.reason else math.inf

    @property
    def rank(self) -> tuple[bool, float]:
        """The less, the better: the shorter record that reaches what is wanted, else the smaller uncertainty."""
        return not self.reached, self.duration if self.reached else self.worst

    @property
    def samples(self) -> int:
        """Samples of the record, the first among them."""
        return round(self.duration * self.rate) + 1


class Task(NamedTuple):
    """What is planned.

    Attributes
    ----------
    given, planned : OnSprings, Planned
    stand, body : Stand, Body, as they are expected
    modes : NormalModes
    points, directions : (c, 3) float, m and 1, of the sensors
    noise : (c,) float, m, standard deviations
    sensitivity_std : (c,) float, relative
    """

    given: OnSprings
    planned: Planned
    stand: Stand
    body: Body
    modes: NormalModes
    points: Array
    directions: Array
    noise: Array
    sensitivity_std: Array


class Lines(NamedTuple):
    """What some sensors show of the modes, by rising frequency; modes of one frequency are one line.

    Attributes
    ----------
    frequency, decay_rate : (m,) float, rad/s and 1/s
    amplitude : (m, c) complex, m
    coinciding : (k,) float, rad/s, frequencies of several modes
    """

    frequency: Array
    decay_rate: Array
    amplitude: Array
    coinciding: Array

    @property
    def least_duration(self) -> float:
        """Length of a record in which no two lines are one, s."""
        gap = float(np.diff(self.frequency).min(initial=math.inf))
        return 2.0 * math.pi / gap if math.isfinite(gap) else 0.0


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
    _check(given)
    held = stand_of(given)
    body, _ = first_body(given, held, np.ones(1))
    points, directions = sensors_of(given, held)
    noise, std = _sensors(given, planned)
    task = Task(given, planned, held, body, linear_model(held, body).modes(), points, directions, noise, std)
    seen = np.max([np.abs(_amplitude(task, spring)).max(axis=0) for spring in range(len(held.points))], axis=0)
    for k in np.flatnonzero(seen <= BLIND * seen.max()):
        raise InputError(
            f"signals.sensors.{k} shows nothing, at whatever spring the pull is released; turn it, move it or leave "
            "it out"
        )
    return task


def _check(given: OnSprings) -> None:
    """Refuse unknowns without an expected value, and what a plan cannot take into account."""
    for key in ("tare", "mounting", "air"):
        if getattr(given, key):
            raise InputError(f"{key} is given; a plan is made for a body alone on the stand, in one mounting")
    asked = (*given.body.unknown, *(("common_factor",) if given.stand.common_factor.unknown else ()))
    if not any(key in COUNTED for key in asked):
        raise InputError(
            f"body has the unknown {' and '.join(asked)}; a plan needs one with a relative uncertainty: "
            f"{', '.join(COUNTED[:-1])}"
        )
    for key in asked:
        factor = key == "common_factor"
        value = given.stand.common_factor if factor else getattr(given.body, key)
        if not math.isfinite(value.value):
            raise InputError(
                f"{'stand' if factor else 'body'}.{key} is unknown; a plan needs the value that is expected, such as "
                f"{key}: unknown near {_example(key)}"
            )
    chosen = given.identification
    if chosen.method != "varpro":
        raise InputError(
            f"identification.method is {chosen.method!r}; a plan holds for varpro, which reaches the bound"
        )
    if chosen.band is not None:
        raise InputError("identification.band is given; a plan looks at all modes: leave it out")


def _example(key: str) -> str:
    plain = {"mass": "15 t", "offset_x": "0 m", "offset_z": "0 m", "height": "0 m", "common_factor": "1"}
    return plain.get(key, "3700 kg m^2")


def _sensors(given: OnSprings, planned: Planned) -> tuple[Array, Array]:
    """Noise (c,), m, and relative standard uncertainty of the sensitivity (c,), of each sensor."""
    noise, std = [], []
    for k, sensor in enumerate(given.signals.sensors):
        key, own = f"signals.sensors.{k}", None
        if sensor.unit or given.signals.unit or sensor.sensitivity:
            found = converted(sensor, "", given.signals, k)
            try:
                length = units.factor(found.unit, "m")
            except units.UnitError:
                raise InputError(f"{key} reads {found.unit}; a plan takes sensors of displacement") from None
            own = None if found.noise is None else found.noise * abs(found.factor) * length
            std.append(found.std)
        else:
            std.append(0.0)
            if sensor.noise is not None:
                try:
                    own = units.parse(sensor.noise, "m")
                except units.UnitError as error:
                    raise InputError(
                        f"{key}.noise is {sensor.noise!r}; a plan takes sensors of displacement: {error}"
                    ) from None
        if own is None and planned.noise is None:
            raise InputError(f"{key}.noise is missing; give it, or plan.noise for all sensors, such as '0.1 mm'")
        noise.append(planned.noise if own is None else own)
        if not float(noise[-1] or 0.0) > 0.0:
            raise InputError(f"{key}.noise is {sensor.noise!r}; it must be above 0")
    return np.array(noise, dtype=float), np.array(std)


def _amplitude(task: Task, spring: int) -> Array:
    """(m, c) complex, m, of every mode of the linear model at all sensors after the pull at a spring."""
    z = task.modes.release((0.0, -task.planned.force, 0.0), task.stand.points[spring])
    return np.asarray(task.modes.amplitude(z, task.points, task.directions))


def lines(task: Task, spring: int, rows: Sequence[int]) -> Lines:
    """What some sensors show after the pull at a spring.

    Raises
    ------
    InputError
        If they show nothing.
    """
    w, decay, a = task.modes.frequency, task.modes.decay_rate, _amplitude(task, spring)[:, list(rows)]
    first = np.flatnonzero(np.diff(w, prepend=-math.inf) > COINCIDING * w)  # of the modes with the same frequency
    several = np.diff(np.append(first, w.size)) > 1
    a, w, decay = np.add.reduceat(a, first, axis=0), w[first], decay[first]
    speed = np.abs(a).max(axis=1) * w
    if not speed.max(initial=0.0) > 0.0:
        raise InputError(f"the pull at spring {spring + 1} moves none of the sensors")
    seen = speed > FAINT * speed.max()
    return Lines(w[seen], decay[seen], a[seen], w[seen & several])


def with_sensors(task: Task, rows: Sequence[int], order: int) -> OnSprings:
    """The description with some of its sensors, the number of modes given."""
    signals = task.given.signals.model_copy(update={"sensors": tuple(task.given.signals.sensors[k] for k in rows)})
    identification = task.given.identification.model_copy(update={"order": order})
    return task.given.model_copy(update={"signals": signals, "identification": identification})


def reading_of(task: Task, spring: int, rate: float, samples: int, rows: Sequence[int]) -> Reading:
    """What the sensors read without noise."""
    t, at = np.arange(samples) / rate, list(rows)
    wave = np.exp((-task.modes.decay_rate + 1j * task.modes.frequency)[:, None] * t)
    data = np.einsum("ms,mk->ks", _amplitude(task, spring)[:, at], wave).real
    names = tuple(f"sensor {k + 1}" for k in rows)
    source = Signals.of(names, data, ("m",) * len(names), rate, path="plan", format="plan")
    return Reading(source, names, t, 0.0, data, "m", task.noise[at], task.sensitivity_std[at], ())


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
    w, decay, a, _ = lines(task, spring, rows)
    if np.pi * rate <= float(w.max()):
        raise InputError(
            f"plan.rate is {rate:.6g} Hz, which shows nothing above {np.pi * rate:.6g} rad/s, but a mode has "
            f"{w.max():.6g} rad/s"
        )
    at, reading = list(rows), reading_of(task, spring, rate, samples, rows)
    signal = read_signal(
        reading.data, time=reading.time, names=reading.names, noise=reading.noise,
        detrend=task.given.identification.detrend,
    )  # fmt: skip
    R = np.linalg.qr(basis(-decay + 1j * w, signal, slopes=True), mode="r")
    C = covariance([Factor(np.asarray(R), np.arange(len(at)))], a, task.noise[at])
    if not np.all(np.isfinite(C)):
        raise InputError(f"a record of {(samples - 1) / rate:.3g} s is too short to distinguish the modes")
    zero = np.zeros(len(at))
    modes = Modes(
        "bound", w.size, reading.names, w, decay, np.abs(a), np.angle(a), zero, zero, C, task.noise[at],
        reading.time, reading.data, reading.data, np.zeros_like(reading.data),
    )  # fmt: skip
    found, own = modes.mode_shapes(), np.ones(w.size)
    return modal.Modal(
        reading, modes, 1.0, own, modes.natural_frequency, modes.natural_frequency_covariance, found.real,
        found.shape_covariance, (),
    )  # fmt: skip
