"""Loads: on threads (force per length) and at markers (force, torque). Gravity belongs to the System."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

from evolvent.builder import Builder
from evolvent.errors import InputError
from evolvent.kernels import loads as kernels
from evolvent.kernels import springs
from evolvent.parts.checks import choice, not_negative, unit_vector, vector

FRAMES = {"inertial": 0, "body": 1}


def _add(builder: Builder, name: str, kind: int, target: int, values: Sequence[float], law: int = 0) -> None:
    first, last = builder.parameters(values)
    index = builder.add("loads", kind=kind, target=target, law=law, first=first, last=last)
    builder.names[name] = ("loads", index)


@dataclasses.dataclass(frozen=True, kw_only=True)
class UniformLoad:
    """The same force per length all along a thread.

    Parameters
    ----------
    thread : str
    force : (3,) float, N/m
    frame : {"inertial", "body"}, axes of `force` (those of the body that carries the reel)
    """

    thread: str
    force: Sequence[float]
    frame: str = "inertial"

    def write(self, builder: Builder, name: str) -> None:
        """Write the load into the family `loads`."""
        values = [*vector(f"{name}.force", self.force), choice(f"{name}.frame", self.frame, FRAMES)]
        _add(builder, name, kernels.UNIFORM, builder.find(self.thread, "threads"), values)


@dataclasses.dataclass(frozen=True, kw_only=True)
class RadiationPressure:
    """Sunlight on a blade, a flat strip whose chord keeps the direction of the spool's axis.

    Parameters
    ----------
    thread : str
    pressure : float, Pa, of light that is wholly absorbed at normal incidence (4.56e-6 at one astronomical unit)
    width : float, m, the blade's chord, measured across the thread's tangent
    direction : (3,) float, in which the light travels, inertial frame
    reflectivity : float, 0 (absorbs all) to 1 (mirror)
    """

    thread: str
    pressure: float
    width: float
    direction: Sequence[float] = (0.0, 0.0, 1.0)
    reflectivity: float = 1.0

    def write(self, builder: Builder, name: str) -> None:
        """Write the load into the family `loads`."""
        scale = not_negative(f"{name}.pressure", self.pressure) * not_negative(f"{name}.width", self.width)
        if not 0.0 <= self.reflectivity <= 1.0:
            raise InputError(f"{name}.reflectivity is {self.reflectivity!r}; it must be from 0 to 1")
        values = [scale, self.reflectivity, *unit_vector(f"{name}.direction", self.direction)]
        _add(builder, name, kernels.RADIATION, builder.find(self.thread, "threads"), values)


@dataclasses.dataclass(frozen=True, kw_only=True)
class LawLoad:
    """A user's law of force per length along a thread.

    Parameters
    ----------
    thread : str
    law : function under ``@evolvent.force_law``: ``law(x, v, t, parameters) -> (fx, fy, fz)``, N/m
    parameters : sequence of float
    """

    thread: str
    law: Any
    parameters: Sequence[float] = ()

    def write(self, builder: Builder, name: str) -> None:
        """Write the load into the family `loads`."""
        target, law = builder.find(self.thread, "threads"), builder.law(self.law, "force")
        _add(builder, name, kernels.LAW, target, self.parameters, law)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Force:
    """A constant force at a marker between two times.

    Parameters
    ----------
    at : as the ends of a `Spring`
    force : (3,) float, N
    frame : {"inertial", "body"}
    start, end : float, s
    """

    at: Any
    force: Sequence[float]
    frame: str = "inertial"
    start: float = 0.0
    end: float = math.inf

    _kind = kernels.AT_MARKER

    def write(self, builder: Builder, name: str) -> None:
        """Write the load into the family `loads`, its times among the breaks."""
        target = builder.marker(self.at)
        on_body = builder.rows["markers"][target]["kind"] == springs.ON_BODY
        frame = choice(f"{name}.frame", self.frame, FRAMES)
        if not on_body and (frame == FRAMES["body"] or self._kind == kernels.TORQUE):
            raise InputError(f"{name}.at is {self.at!r}; this load needs a body")
        if not self.end > self.start:
            raise InputError(f"{name}.end is {self.end!r}; it must be after start {self.start!r}")
        builder.breaks.update(t for t in (float(self.start), float(self.end)) if math.isfinite(t) and t > 0.0)
        values = [*vector(f"{name}.force", self.force), frame, self.start, self.end]
        _add(builder, name, self._kind, target, values)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Torque(Force):
    """A constant torque on a body between two times; `force` holds it, N m."""

    _kind = kernels.TORQUE
