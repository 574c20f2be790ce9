"""What planned recordings are and will show: the expected body on its stand, what sets it swinging, the signals."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from evolvent_base import units
from evolvent_base.errors import InputError
from evolvent_base.signals import Signals
from evolvent_massprops import modal
from evolvent_massprops.description import OnSprings, for_recording, load
from evolvent_massprops.identification import IdentifiedModes
from evolvent_massprops.identification.bounds import Factor, covariance
from evolvent_massprops.identification.signals import basis, read_signal
from evolvent_massprops.inertia import Stand
from evolvent_massprops.inertia.combined import NO_BODY
from evolvent_massprops.inertia.stand import setup
from evolvent_massprops.inertia.vibration import NormalModes, linearise
from evolvent_massprops.mode_selection import FAINT
from evolvent_massprops.planning.pulls import Pull, pulls_of
from evolvent_massprops.recordings import Reading, converted
from evolvent_massprops.spring_keys import Planned
from evolvent_massprops.springs_inputs import (
    LABELS,
    SpringsTask as SpringTask,
    asked,
    first_body,
    mounting_of,
    sensors_of,
    stand_of,
)
from evolvent_massprops.springs_search import Recording, occupied

Array = np.ndarray
#: Relative difference of frequencies below which two modes are one in the signals.
COINCIDING = 1e-6
#: Motion of a sensor, of the largest, below which it shows nothing.
BLIND = 1e-9
#: What a wanted uncertainty is held against: quantities that are never zero.
COUNTED = ("mass", "Ixx", "Iyy", "Izz", "common_factor", "half_length", "half_width")
#: Most recordings of one plan.
MOST_RECORDINGS = 24


class Expected(NamedTuple):
    """One recording that is planned.

    Attributes
    ----------
    name : str, of its file; "" of the only one
    given : OnSprings, its description
    own : tuple of str, keys that it states itself
    stand : Stand
    modes : NormalModes, of all that moves, as it is expected
    points, directions : (c, 3) float, m and 1, of the sensors
    noise : (c,) float, m, standard deviations
    sensitivity_std : (c,) float, relative
    pulls : tuple of Pull, the ways of setting it swinging that are compared
    """

    name: str
    given: OnSprings
    own: tuple[str, ...]
    stand: Stand
    modes: NormalModes
    points: Array
    directions: Array
    noise: Array
    sensitivity_std: Array
    pulls: tuple[Pull, ...]


class PlanningTask(NamedTuple):
    """What is planned.

    Attributes
    ----------
    given, planned : OnSprings, Planned
    recordings : tuple of Expected
    """

    given: OnSprings
    planned: Planned
    recordings: tuple[Expected, ...]

    @property
    def best_pulls(self) -> tuple[Pull, ...]:
        """Of each recording the pull that gives the weakest of heave, roll and pitch most energy."""
        return tuple(max(one.pulls, key=lambda pull: pull.least) for one in self.recordings)

    @property
    def sensors(self) -> tuple[int, ...]:
        """Numbers of all sensors, from 0."""
        return tuple(range(len(self.recordings[0].points)))


class Option(NamedTuple):
    """One way to measure.

    Attributes
    ----------
    pulls : tuple of Pull, how each recording is set swinging
    rate : float, Hz
    duration : float, s, of each record; the longest allowed where the wanted uncertainty is not reached
    sensors : tuple of int, numbers of the description's sensors, from 1
    reached : bool, whether the wanted uncertainty is reached
    keys : tuple of str, the quantities that are asked
    values, std : (p,) float, expected, and their standard uncertainties
    relative : (p,) float, expanded uncertainty of each over its value; NaN of offsets and products
    noise : (p,) float, what the sensors' noise alone gives
    reason : str, why it cannot be evaluated, '' where it can
    open : int, combinations of unknowns that are not determined
    """

    pulls: tuple[Pull, ...]
    rate: float
    duration: float
    sensors: tuple[int, ...]
    reached: bool
    keys: tuple[str, ...]
    values: Array
    std: Array
    relative: Array
    noise: Array
    reason: str = ""
    open: int = 0

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
        """Samples of each record, the first among them."""
        return round(self.duration * self.rate) + 1

    @property
    def label(self) -> str:
        """How the recordings are set swinging, in words."""
        return "; ".join(dict.fromkeys(pull.label for pull in self.pulls))


class ExpectedLines(NamedTuple):
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


def task_of(stand: Any, uncertainty: float, overrides: Mapping[str, Any] | None) -> PlanningTask:
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
    if given.plan is None:
        raise InputError("plan is missing; give plan.force, the pull that is released, such as '1000 N'")
    names = tuple(given.recordings) if given.has_mounting and given.recordings else ("",)
    if len(names) > MOST_RECORDINGS:
        raise InputError(f"recordings has {len(names)}; at most {MOST_RECORDINGS} are planned together")
    several = {name: for_recording(given, name) if name else (given, ()) for name in names}
    wanted = {key for own, _ in several.values() if isinstance(own, OnSprings) for key in _check(own)}
    if not any(is_counted(key, wanted) for key in wanted):
        raise InputError(
            f"body has the unknown {' and '.join(sorted(wanted))}; a plan needs one with a relative uncertainty: "
            f"{', '.join(COUNTED[:4])}"
        )
    recordings = tuple(expected(name, own, keys) for name, (own, keys) in several.items() if isinstance(own, OnSprings))
    if not any(occupied(one.given) for one in recordings):
        raise InputError(NO_BODY)
    if any(len(one.points) != len(recordings[0].points) for one in recordings):
        raise InputError("recordings have different numbers of signals.sensors; a plan takes the same for all")
    task = PlanningTask(given, given.plan, recordings)
    seen = np.max([np.abs(amplitude(one, pull)).max(axis=0) for one in recordings for pull in one.pulls], axis=0)
    for k in np.flatnonzero(seen <= BLIND * seen.max()):
        raise InputError(
            f"signals.sensors.{k} shows nothing, wherever the pull is released; turn it, move it or leave it out"
        )
    return task


def expected(name: str, given: OnSprings, own: tuple[str, ...]) -> Expected:
    """One planned recording."""
    assert given.plan is not None
    stand = stand_of(given)
    body, _ = first_body(given, stand, np.ones(1))
    modes = linearise(setup(stand, body)._replace(mounting=mounting_of(given))).modes()
    points, directions = sensors_of(given, stand)
    noise, std = _sensors(given, given.plan)
    try:
        pulls = pulls_of(given.plan, stand.points, modes)
    except InputError as error:
        raise InputError(f"recordings.{name}: {error}" if name else str(error)) from None
    return Expected(name, given, own, stand, modes, points, directions, noise, std, pulls)


def is_counted(key: str, among: Sequence[str] | set[str]) -> bool:
    """Whether a wanted uncertainty is held against a quantity; against the tare's only where nothing else is asked."""
    if key.startswith("tare."):
        return key.rpartition(".")[2] in COUNTED and not any(other in COUNTED for other in among)
    return key in COUNTED


def _check(given: OnSprings) -> list[str]:
    """Keys of the unknowns; refuses those without an expected value, and what a plan cannot take into account."""
    found = []
    for key, _, stated in asked(given):
        if not math.isfinite(stated.value):
            where = key if "." in key else f"{'body' if key in LABELS and key != 'common_factor' else 'stand'}.{key}"
            raise InputError(
                f"{where} is unknown; a plan needs the value that is expected, such as {key.rpartition('.')[2]}: "
                f"unknown near {_example(key)}"
            )
        found.append(key)
    chosen = given.identification
    if chosen.method != "varpro":
        raise InputError(
            f"identification.method is {chosen.method!r}; a plan holds for varpro, which reaches the bound"
        )
    if chosen.band is not None:
        raise InputError("identification.band is given; a plan looks at all modes: leave it out")
    return found


def _example(key: str) -> str:
    last = key.rpartition(".")[2]
    plain = {"mass": "15 t", "offset_x": "0 m", "offset_z": "0 m", "height": "0 m", "common_factor": "1"}
    plain |= dict.fromkeys("xyz", "0 m") | {"half_length": "2 m +- 1 mm", "half_width": "1 m +- 1 mm"}
    return plain.get(last, "3700 kg m^2")


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


def amplitude(one: Expected, pull: Pull) -> Array:
    """(m, c) complex, m, of every mode of the linear model at all sensors after a pull."""
    return np.asarray(one.modes.amplitude(pull.z, one.points, one.directions))


def lines(one: Expected, pull: Pull, rows: Sequence[int]) -> ExpectedLines:
    """What some sensors show after a pull.

    Raises
    ------
    InputError
        If they show nothing.
    """
    w, decay, a = one.modes.frequency, one.modes.decay_rate, amplitude(one, pull)[:, list(rows)]
    first = np.flatnonzero(np.diff(w, prepend=-math.inf) > COINCIDING * w)  # of the modes with the same frequency
    several = np.diff(np.append(first, w.size)) > 1
    a, w, decay = np.add.reduceat(a, first, axis=0), w[first], decay[first]
    speed = np.abs(a).max(axis=1) * w
    if not speed.max(initial=0.0) > 0.0:
        raise InputError(f"the pull at {pull.label} moves none of the sensors")
    seen = speed > FAINT * speed.max()
    return ExpectedLines(w[seen], decay[seen], a[seen], w[seen & several])


def with_sensors(one: Expected, rows: Sequence[int], order: int) -> OnSprings:
    """The description of a recording with some of its sensors, the number of modes given."""
    signals = one.given.signals.model_copy(update={"sensors": tuple(one.given.signals.sensors[k] for k in rows)})
    identification = one.given.identification.model_copy(update={"order": order})
    return one.given.model_copy(update={"signals": signals, "identification": identification})


def reading_of(one: Expected, pull: Pull, rate: float, samples: int, rows: Sequence[int]) -> Reading:
    """What the sensors read without noise."""
    t, at = np.arange(samples) / rate, list(rows)
    wave = np.exp((-one.modes.decay_rate + 1j * one.modes.frequency)[:, None] * t)
    data = np.einsum("ms,mk->ks", amplitude(one, pull)[:, at], wave).real
    names, path = tuple(f"sensor {k + 1}" for k in rows), one.name or "plan"
    source = Signals.of(names, data, ("m",) * len(names), rate, path=path, format="plan")
    return Reading(source, names, t, 0.0, data, "m", one.noise[at], one.sensitivity_std[at], ())


def with_noise(one: Expected, exact: Reading, random: np.random.Generator, rows: Sequence[int]) -> Reading:
    """The same with the sensors' noise."""
    noise = random.standard_normal(exact.data.shape) * one.noise[list(rows)]
    return dataclasses.replace(exact, data=exact.data + noise)


def recording_of(one: Expected, seen: modal.Modal, rows: Sequence[int]) -> Recording:
    """A recording as an identification takes it, with modes that some sensors show."""
    return Recording(with_sensors(one, rows, 1), seen, one.own, one.name or "the recording")


def spring_task(one: Expected, recording: Recording, rows: Sequence[int], keys: tuple[str, ...]) -> SpringTask:
    """What is solved for the modes of a recording."""
    at, mean = list(rows), float(np.mean(one.stand.stiffness))
    used = tuple(range(len(recording.modal.frequency)))
    return SpringTask(recording.given, recording.modal, used, one.stand, one.points[at], one.directions[at], keys, mean)


def modal_of(one: Expected, pull: Pull, rate: float, samples: int, rows: Sequence[int]) -> modal.Modal:
    """Modes of a recording as an identification finds them at best, with the Cramér-Rao bound as their covariance."""
    w, decay, a, _ = lines(one, pull, rows)
    if np.pi * rate <= float(w.max()):
        raise InputError(
            f"plan.rate is {rate:.6g} Hz, which shows nothing above {np.pi * rate:.6g} rad/s, but a mode has "
            f"{w.max():.6g} rad/s"
        )
    at, reading = list(rows), reading_of(one, pull, rate, samples, rows)
    signal = read_signal(
        reading.data, time=reading.time, names=reading.names, noise=reading.noise,
        detrend=one.given.identification.detrend,
    )  # fmt: skip
    R = np.linalg.qr(basis(-decay + 1j * w, signal, slopes=True), mode="r")
    C = covariance([Factor(np.asarray(R), np.arange(len(at)))], a, one.noise[at])
    if not np.all(np.isfinite(C)):
        raise InputError(f"a record of {(samples - 1) / rate:.3g} s is too short to distinguish the modes")
    zero = np.zeros(len(at))
    modes = IdentifiedModes(
        "bound", w.size, reading.names, w, decay, np.abs(a), np.angle(a), zero, zero, C, one.noise[at],
        reading.time, reading.data, reading.data, np.zeros_like(reading.data),
    )  # fmt: skip
    found, own = modes.mode_shapes(), np.ones(w.size)
    return modal.Modal(
        reading, modes, 1.0, own, modes.natural_frequency, modes.natural_frequency_covariance, found.real,
        found.shape_covariance, (),
    )  # fmt: skip
