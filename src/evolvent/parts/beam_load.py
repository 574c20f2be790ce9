"""Loads on beams."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from evolvent.builder import Builder
from evolvent.errors import InputError
from evolvent.kernels import beam_loads as kernels
from evolvent.kernels.flexible import NODE_VECTORS
from evolvent.parts.beam import node_of
from evolvent.parts.checks import not_negative, number, unit_vector, vector


def _add(builder: Builder, name: str, kind: int, beam: int, value: float, times: tuple[float, float, float],
         **fields: Any) -> None:  # fmt: skip
    start, end, ramp = times
    if not (math.isfinite(start) and end > start):
        raise InputError(f"{name}.end is {end!r} s; it must be after {name}.start, {start!r} s")
    whole = {"iq": -1, "iv": -1, "centre": np.zeros(3), "axis": np.zeros(3)}
    index = builder.add(
        "beam_loads", kind=kind, beam=beam, value=value, start=float(start), end=float(end),
        ramp=not_negative(f"{name}.ramp", ramp), **{**whole, **fields},
    )  # fmt: skip
    builder.names[name] = ("beam_loads", index)


@dataclasses.dataclass(frozen=True, kw_only=True)
class FieldTorque:
    """A torque about an axis spread over a beam's mass: force per mass proportional to axis x arm.

    Parameters
    ----------
    beam : str
    torque : float, N m
    centre, axis : (3,) float, inertial axes
    start, end, ramp : float, s, when it acts, and the time over which it grows smoothly
    """

    beam: str
    torque: float
    centre: Sequence[float] = (0.0, 0.0, 0.0)
    axis: Sequence[float] = (0.0, 0.0, 1.0)
    start: float = 0.0
    end: float = math.inf
    ramp: float = 0.0

    def write(self, builder: Builder, name: str) -> None:
        """Write the torque."""
        _add(
            builder, name, kernels.FIELD, builder.find(self.beam, "beams"), number(f"{name}.torque", self.torque),
            (self.start, self.end, self.ramp),
            centre=vector(f"{name}.centre", self.centre), axis=unit_vector(f"{name}.axis", self.axis),
        )  # fmt: skip


@dataclasses.dataclass(frozen=True, kw_only=True)
class LineLoad:
    """A force per length of a beam (of its length without stress), N/m, of one direction in space.

    Parameters
    ----------
    beam : str
    force : (3,) float, N/m, inertial axes
    start, end, ramp : as of `FieldTorque`
    """

    beam: str
    force: Sequence[float]
    start: float = 0.0
    end: float = math.inf
    ramp: float = 0.0

    def write(self, builder: Builder, name: str) -> None:
        """Write the load."""
        force = vector(f"{name}.force", self.force)
        _add(
            builder, name, kernels.LINE, builder.find(self.beam, "beams"), 1.0, (self.start, self.end, self.ramp),
            axis=force,
        )  # fmt: skip


@dataclasses.dataclass(frozen=True, kw_only=True)
class PointLoad:
    """A force at a beam's node, N, of one direction in space; or on its slope (`on` 1, 2, 3), N m.

    Parameters
    ----------
    node : (str, "root" | "tip" | int)
    force : (3,) float, inertial axes
    on : int, 0 the place, 1 the slope along the axis, 2 and 3 those across
    start, end, ramp : as of `FieldTorque`
    """

    node: Any
    force: Sequence[float]
    on: int = 0
    start: float = 0.0
    end: float = math.inf
    ramp: float = 0.0

    def write(self, builder: Builder, name: str) -> None:
        """Write the load."""
        beam, kind, iq, iv = node_of(builder, self.node)
        if self.on not in range(NODE_VECTORS[kind]):
            raise InputError(f"{name}.on is {self.on!r}; it must be 0 to {NODE_VECTORS[kind] - 1}")
        _add(
            builder, name, kernels.POINT, beam, 1.0, (self.start, self.end, self.ramp),
            axis=vector(f"{name}.force", self.force), iq=iq + 3 * self.on, iv=iv + 3 * self.on,
        )  # fmt: skip
