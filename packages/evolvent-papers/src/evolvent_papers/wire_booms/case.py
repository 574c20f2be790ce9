"""What a user writes about wire booms."""

from __future__ import annotations

from typing import Annotated, Literal, NamedTuple

from pydantic import Field, model_validator

from evolvent_base import units
from evolvent_base.errors import InputError
from evolvent_base.schema import Section

PAIRS = ("1-2", "3-4")
Pair = Literal["1-2", "3-4"]
Lengths = tuple[units.LengthOrZero, ...]
Rates = tuple[units.AngularRate, ...]


class Body(Section):
    """The spinning spacecraft."""

    mass: units.Mass = Field(description="without wires and spheres")
    inertia: units.Inertias = Field(description="about every axis, or three principal moments; no wires, no spheres")
    root: units.Length = Field(description="distance of the booms' roots from the spin axis")


class Wire(Section):
    """Every one of the four wires."""

    length: units.Length = Field(description="of the whole wire")
    line_density: units.LineDensity
    tip_mass: units.Mass = Field(description="of the sphere at its end")
    nodes: Annotated[int, units.Whole(least=2, most=1000)] = Field(20, description="lumped masses of a wire")
    stiffness: units.Stiffness = Field(1e4, description="of one segment")
    damping: units.DampingOrZero = Field(1.0, description="of one segment")


class Timing(Section):
    """Durations of what the log does not hold, or holds in hours."""

    pause: units.Duration = Field(60.0, description="rest after every step")
    ramp: units.Duration = Field(
        150.0, description="smooth start and end of a spool's turn; at most a third of the step"
    )
    spin_up: units.Duration = Field(900.0, description="of the thrusters' torque before a group")


class Solver(Section):
    """The time integration."""

    method: Literal["generalized-alpha", "dopri5", "rk4"] = "generalized-alpha"
    step: units.Duration | None = Field(None, description="of generalized-alpha and rk4; left out: from the tolerance")
    tolerance: units.Tolerance = Field(1e-5, description="relative, of generalized-alpha and dopri5")


class Step(NamedTuple):
    """A pay-out of both booms of a pair."""

    pair: str
    before: float
    after: float
    duration: float


class Case(Section):
    """A case of the system `wire-booms`."""

    system: Literal["wire-booms"] = "wire-booms"
    title: str = Field("", description="title of figures")
    body: Body
    wire: Wire
    reel_radius: units.Length = Field(0.05, description="of every spool")
    groups: tuple[tuple[tuple[Pair, units.LengthOrZero, units.LengthOrZero, units.Duration], ...], ...] = Field(
        description="groups of steps [pair, length before, length after, duration]; the craft is spun up between groups"
    )
    rates: Rates = Field(description="spin rate at the start of every group")
    start_lengths: Lengths = Field(description="length of all booms at the start of every group")
    timing: Timing = Timing()
    solver: Solver = Solver()

    @property
    def starts(self) -> list[dict[str, float]]:
        """Lengths of the booms of every pair at the start of every group, m.

        `start_lengths` is that of the pair of the group's first step. The other pair
        is longer than in the log by the same length.
        """
        found: list[dict[str, float]] = []
        reached: dict[str, float] = {}
        for start, group in zip(self.start_lengths, self.groups, strict=True):
            logged: dict[str, float] = {row[0]: row[1] for row in reversed(group)}
            excess = start - group[0][1]
            own = {pair: logged.get(pair, reached.get(pair, 0.0)) + excess for pair in PAIRS}
            found.append(own)
            reached = own | {row[0]: row[2] for row in group}
        return found

    @property
    def steps(self) -> list[list[Step]]:
        """The steps of every group; each begins at the length that its pair has reached."""
        found = []
        for start, group in zip(self.starts, self.groups, strict=True):
            reached = dict(start)
            rows = []
            for pair, _, after, duration in group:
                rows.append(Step(pair, reached[pair], after, duration))
                reached[pair] = after
            found.append(rows)
        return found

    @model_validator(mode="after")
    def _check(self) -> Case:
        count = len(self.groups)
        if count == 0 or any(not group for group in self.groups):
            raise InputError("groups holds no step; give one or more groups, each of one or more steps")
        for key in ("rates", "start_lengths"):
            if len(getattr(self, key)) != count:
                raise InputError(
                    f"{key} has {len(getattr(self, key))} entries; it must have one for each of the {count} groups"
                )
        if any(rate <= 0.0 for rate in self.rates):
            raise InputError(f"rates holds {min(self.rates)!r} rad/s; every rate must be above 0 rad/s")
        for k, (start, group) in enumerate(zip(self.starts, self.steps, strict=True)):
            for length in (*start.values(), *(step.after for step in group)):
                if not 0.0 <= length <= self.wire.length:
                    raise InputError(
                        f"groups.{k} has a boom of {length:g} m; its length must be from 0 m to wire.length, "
                        f"{self.wire.length:g} m"
                    )
        return self
