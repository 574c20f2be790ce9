"""Loops of feedback: spools whose rate follows from what is measured while the motion goes on.

The table of such a drive is empty before a run: its breaks are the moments of commands. A loop goes from sample to
sample and from command to command, reads results, evaluates the law, and writes the next piece. The run itself follows
with the whole table, as that of a drive that was prescribed, with all that runs have.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from typing import Any, Protocol

import numpy as np

from evolvent.assembly import families
from evolvent.assembly.assembled import Assembly
from evolvent.kernels.expression import evaluate
from evolvent.model import family
from evolvent.parts.feedback import FeedbackDrive
from evolvent.solvers.time.explicit.plan import METHODS
from evolvent_base import units
from evolvent_base.errors import InputError, RunFailed

Array = np.ndarray
#: Parts of a period that are round-off of times.
_NEAR = 1e-9
#: Numbers of a piece of a table.
_PIECE = 5
#: Part of a thread's length at which its spool stops before all is out.
_ROUND_OFF = 1e-9


def reels(assembly: Assembly) -> dict[str, FeedbackDrive]:
    """The drives that react, by the names of their reels."""
    found = ((name, getattr(part, "drive", None)) for name, part in assembly.parts.items())
    return {name: drive for name, drive in found if isinstance(drive, FeedbackDrive)}


@dataclasses.dataclass
class Command:
    """State of the spool at a command: time (s), angle (rad), rate (rad/s), and the rate that it goes to (rad/s)."""

    time: float
    angle: float
    rate: float
    target: float


class Measured(Protocol):
    """What a loop needs of what is stepped: the results that it measures, and the model whose table it writes."""

    assembly: Assembly

    def address(self, name: Any) -> Any:
        """Where a result is found."""

    def describe(self, name: str) -> tuple[str, str]:
        """Unit and meaning of a result."""

    def value(self, address: Any) -> float | Array:
        """A result now."""


class Loop:
    """One drive that reacts, from the start of a run on.

    Attributes
    ----------
    name : str, of the reel
    drive : FeedbackDrive
    owner : (str, int), family and index of the record that it drives
    start : float, s
    late : int, samples that were taken between that of a command and the command
    offset : float, s, from a sample to the next command
    measured : list of (k,) arrays, what every sample measured, NaN of what cannot be; filtered : list of (2 k,), values
        and rates that the law gets
    commands : list of Command
    """

    def __init__(self, assembly: Assembly, name: str, drive: FeedbackDrive, number: int, start: float) -> None:
        self.name, self.drive, self.start = name, drive, start
        self.owner = next(
            found for part, found in assembly.names.items() if getattr(assembly.parts.get(part), "reel", None) == name
        )
        sensor = drive.sensor
        self.period = sensor.period
        self.late = math.floor(sensor.delay / sensor.period + _NEAR)
        self.offset = max(0.0, sensor.delay - self.late * sensor.period)
        if self.offset < _NEAR * self.period:
            self.offset = 0.0
        self.code = np.array(drive.program(f"{name}.drive").code)
        self.random = np.random.default_rng([sensor.seed, number])
        self.bounds = (0.0, full_angle(self.record(assembly.model)[0]))
        self.measured: list[Array] = []
        self.filtered: list[Array] = []
        self.commands = [Command(start, drive.angle, drive.rate, drive.rate)]
        self.noise = np.zeros(len(drive.variables))
        self.known = np.zeros(len(drive.variables), dtype=bool)
        self.first = 0

    def breaks(self, end: float) -> Array:
        """Times between the pieces of the table, s, from the start until after `end`."""
        count = max(1, math.ceil((end - self.start) / self.period) + 1)
        times = self.start + self.offset + self.period * np.arange(count + 1)
        return times if self.offset == 0.0 else np.concatenate([[self.start], times])

    def samples(self, end: float) -> Array:
        """Times of samples up to `end`, s."""
        count = math.floor((end - self.start) / self.period + _NEAR) + 1
        return self.start + self.period * np.arange(count)

    def attach(self, stepper: Measured) -> None:
        """Find the results that are measured, and the sizes of their noise.

        Raises
        ------
        InputError
            For a result that is not known, is not one number, or has another unit than its noise.
        """
        self.addresses, self.units = [], []
        for k, (name, result) in enumerate(self.drive.variables.items()):
            key = f"{self.name}.drive.variables.{name}"
            try:
                address = stepper.address(result)
            except InputError as error:
                raise InputError(f"{key}: {error}") from None
            if np.ndim(address.at) != 0:
                raise InputError(f"{key} is {result!r}, which is not one number; name one of its components")
            self.addresses.append(address)
            self.units.append(stepper.describe(result)[0])
            size = self.drive.sensor.noise.get(name, 0.0)
            if isinstance(size, str):
                size = _size(size, self.units[-1], f"{self.name}.drive.sensor.noise.{name}")
            self.noise[k] = size
        self.first = int(self.record(stepper.assembly.model)["first"][0])

    def record(self, model: Any) -> Array:
        """The record that it drives, as one of (1,)."""
        family, k = self.owner
        return families.records(model, family)[k : k + 1]

    def sample(self, stepper: Measured) -> None:
        """Measure and filter."""
        values = np.array([float(stepper.value(address)) for address in self.addresses])
        self.measure(values + self.noise * self.random.standard_normal(values.size))

    def measure(self, values: Array) -> None:
        """Take what a sample measured, with its noise; what is not finite keeps its last value, 0 before the first."""
        seen, k = np.isfinite(values), values.size
        before = self.filtered[-1] if self.filtered else np.zeros(2 * k)
        first, self.known = seen & ~self.known, seen | self.known
        values = np.where(seen, values, before[:k])
        last = np.where(first, values, before[:k])
        share = 1.0
        if self.drive.sensor.filter > 0.0:
            share = -math.expm1(-self.period / self.drive.sensor.filter)
        now = last + share * (values - last)
        self.measured.append(np.where(seen, values, np.nan))
        self.filtered.append(np.append(now, (now - last) / self.period))

    def signals(self) -> dict[str, tuple[Array, Array, str]]:
        """What was measured: variable -> times (s), values with noise, unit."""
        times = self.start + self.period * np.arange(len(self.measured))
        values = np.array(self.measured).reshape(times.size, -1).T
        return {
            name: (times, own, unit) for name, own, unit in zip(self.drive.variables, values, self.units, strict=True)
        }

    def law(self, t: float, angle: float, rate: float, filtered: Array) -> float:
        """Rate that the law commands, without limits, rad/s."""
        return float(evaluate(self.code, 0, np.concatenate([[t, angle, rate], filtered])))

    def command(self, t: float) -> Command:
        """Evaluate the law at t, and go to what it commands within the limits.

        Raises
        ------
        RunFailed
            Where the law has no finite value.
        """
        before = self.commands[-1]
        length = t - before.time
        angle = before.angle + 0.5 * (before.rate + before.target) * length
        rate = before.target
        seen = self.filtered[max(0, len(self.filtered) - 1 - self.late)]
        wanted = self.law(t, angle, rate, seen)
        if not math.isfinite(wanted):
            values = dict(zip(self.drive.names, [t, angle, rate, *seen], strict=True))
            shown = ", ".join(f"{name} = {value:.6g}" for name, value in values.items())
            raise RunFailed(f"{self.name}.drive.law is {wanted} at t = {t:.6g} s, with {shown}", None)
        found = Command(t, angle, rate, self.limited(wanted, angle, rate))
        if length == 0.0:
            self.commands.pop()
        self.commands.append(found)
        return found

    def limited(self, wanted: float, angle: float, rate: float) -> float:
        """The rate that the spool reaches in a period within its limits, and short of the ends of its thread, rad/s."""
        limits, period = self.drive.limits, self.period
        most = math.inf if limits.acceleration is None else limits.acceleration
        if limits.rate is not None:
            wanted = min(max(wanted, limits.rate[0]), limits.rate[1])
        if math.isfinite(most):
            wanted = min(max(wanted, rate - most * period), rate + most * period)
        low, high = self.bounds
        wanted = min(wanted, _stopping(high - angle, rate, most, period))
        return max(wanted, -_stopping(angle - low, -rate, most, period))

    def write(self, stepper: Measured, piece: Command, end: float) -> None:
        """Write a piece of the table, and in the place of the next one that its rate goes on."""
        p, model = stepper.assembly.model.parameters, stepper.assembly.model
        n = int(p[self.first])
        times = p[self.first + 1 : self.first + 1 + n]
        k = int(np.searchsorted(times, piece.time + _NEAR * self.period)) - 1
        length = end - piece.time
        bend = 0.5 * (piece.target - piece.rate) / length
        after = piece.angle + 0.5 * (piece.rate + piece.target) * length
        pieces = [(0.0, 0.0, bend, piece.rate, piece.angle), (0.0, 0.0, 0.0, piece.target, after)]
        for j, numbers in enumerate(pieces):
            if k + j < n - 1:
                at = self.first + 1 + n + _PIECE * (k + j)
                model.parameters[at : at + _PIECE] = numbers


class Loops:
    """All loops of a stepper.

    Parameters
    ----------
    stepper : Measured, at its start, of an assembly that `with_tables` has made
    loops : list of Loop
    """

    def __init__(self, stepper: Measured, loops: list[Loop]) -> None:
        self.stepper, self.loops = stepper, loops
        for loop in loops:
            loop.attach(stepper)
            loop.write(stepper, loop.commands[0], loop.start + (loop.offset or loop.period))

    def stops(self, start: float, end: float) -> Iterator[float]:
        """Times of samples and commands after `start` and before `end`, then `end`."""
        found = [np.zeros(0)]
        for loop in self.loops:
            samples = loop.samples(end)
            found += [samples, samples + loop.offset]
        near = _NEAR * min((loop.period for loop in self.loops), default=1.0)
        times = np.unique(np.concatenate(found))
        last = start
        for t in times[(times > start + near) & (times < end - near)]:
            if t > last + near:
                last = float(t)
                yield last
        yield end

    @property
    def measured(self) -> dict[str, dict[str, tuple[Array, Array, str]]]:
        """As of `evolvent.solvers.Solution`."""
        return {loop.name: loop.signals() for loop in self.loops}

    def act(self, t: float) -> None:
        """Sample and command what is due at t, where the stepper is."""
        for loop in self.loops:
            near = _NEAR * loop.period
            k = len(loop.measured)
            if abs(t - (loop.start + k * loop.period)) <= near:
                loop.sample(self.stepper)
            due = loop.start + loop.offset + (len(loop.measured) - 1) * loop.period
            if abs(t - due) <= near and not (len(loop.commands) > 1 and loop.commands[-1].time > t - near):
                loop.write(self.stepper, loop.command(t), t + loop.period)


def with_tables(assembly: Assembly, start: float, end: float) -> tuple[Assembly, list[Loop]]:
    """The assembly with an empty table for every drive that reacts, and the loops that fill them from start to end (s).

    The model is a copy where there are any.
    """
    drives = reels(assembly)
    if not drives:
        return assembly, []
    model = assembly.model.copy()
    loops, breaks, parameters = [], [model.breaks], [model.parameters]
    place = model.parameters.size
    for number, (name, drive) in enumerate(drives.items()):
        loop = Loop(assembly, name, drive, number, start)
        times = loop.breaks(end)
        table = np.zeros(1 + times.size + _PIECE * (times.size - 1))
        table[0], table[1 : 1 + times.size] = times.size, times
        row = loop.record(model)
        row["first"], row["last"], row["law"] = place, place + table.size, 0
        place += table.size
        parameters.append(table)
        breaks.append(times[(times > start) & (times < end)])
        loops.append(loop)
    model = model._replace(parameters=np.concatenate(parameters), breaks=np.unique(np.concatenate(breaks)))
    return dataclasses.replace(assembly, model=model, shared=None, touched=None), loops


def method_of(assembly: Assembly, method: str) -> tuple[str, str]:
    """The method of a run with loops of feedback, and why it is taken.

    Raises
    ------
    InputError
        If it is no explicit one, or does not support another part.
    """
    name = next(iter(reels(assembly)))
    if method not in ("auto", *METHODS):
        raise InputError(
            f"{name!r} reacts to what is measured, which {method} does not support; use {', '.join(METHODS)}"
        )
    whole, _ = with_tables(assembly, 0.0, 1.0)
    families.check(whole, family.EXPLICIT)
    if method != "auto":
        return method, "as asked for"
    fixed = all(families.suit_adaptive_steps(whole.model))
    return "dopri5" if fixed else "rk4", f"{name!r} reacts to what is measured, which needs an explicit method"


def _stopping(left: float, rate: float, most: float, period: float) -> float:
    """The largest rate after a period from which a spool can stop within `left` rad from now, at an acceleration."""
    left -= 0.5 * rate * period
    if not math.isfinite(most):
        return left / period
    return most * (-period + math.sqrt(period**2 + 2.0 * max(left, 0.0) / most))


def full_angle(row: Any) -> float:
    """Angle of a thread's spool at which all but round-off of it is out, rad."""
    r, c, length = float(row["radius"]), float(row["coiling"]), float(row["n"] * row["segment"]) * (1.0 - _ROUND_OFF)
    return 2.0 * length / (r + math.sqrt(max(r * r - 2.0 * c * length, 0.0)))


def _size(text: str, unit: str, key: str) -> float:
    """Size of noise, of a text with a unit of the quantity's."""
    try:
        size = units.parse(text, units.unit_text(unit))
    except units.UnitError as error:
        raise InputError(f"{key} is {text!r}; {error}; it must be in {unit}, as what is measured") from None
    if not 0.0 <= size < math.inf:
        raise InputError(f"{key} is {text!r}; it must be 0 or above")
    return float(size)
