"""What a case says of its margins: the key `margin`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from evolvent.analysis.margins.factors import ENDINGS, Category, Stated
from evolvent_base import units
from evolvent_base.file_keys import FileKey
from evolvent_base.schema import Section


class MarginLine(Section):
    """What is asked of one coordinate."""

    travel: tuple[units.AngleOrLength, units.AngleOrLength] | None = Field(
        None, description="from and to; left out, from the start to the latch or the stop"
    )
    acceleration: Annotated[
        float,
        units.Either((
            units.Quantity(what="an angular acceleration", unit="rad/s^2", example="0.01 rad/s^2", above=0.0),
            units.Quantity(what="an acceleration", unit="m/s^2", example="0.01 m/s^2", above=0.0),
        )),
    ] | None = Field(None, description="specified acceleration, worst case")  # fmt: skip
    duration: units.Duration | None = Field(
        None, description="time for the travel from rest; it asks for the acceleration 2 travel/duration^2"
    )
    torque: units.PositiveTorque | None = Field(
        None, description="torque that the motor of a reel whose spool follows a drive has at the worst"
    )
    zero: tuple[Stated, ...] = Field((), description="resistances of this coordinate that are zero")
    leave_out: str = Field("", description="why the coordinate has no margin; it is then left out")

    def refusals(self) -> Iterator[str]:
        """Sentences on keys that do not go together."""
        if self.acceleration is not None and self.duration is not None:
            yield "margin.lines: acceleration and duration of a coordinate are both given; leave one of them out"


class MarginPart(Section):
    """How a part counts."""

    category: Category | None = Field(None, description="category in place of that of its kind")
    evidence: str | None = Field(None, description="how it is known, by a word of the table of factors")
    source: str = Field("", description="where that is written, such as the number of a test report")


class Margin(Section):
    """Torque and force margins, of ``evolvent margin``."""

    factors: Annotated[str, FileKey(endings=ENDINGS)] = Field(
        "ECSS-E-ST-33-01C", description="table of factors: a standard's name, or a YAML file with an own table"
    )
    evidence: str | None = Field(
        None, description="how parts are known that have no own key; left out, the first word of the table"
    )
    zero: tuple[Stated, ...] = Field((), description="resistances that are zero in every coordinate")
    stations: Annotated[int, units.Whole(least=2, most=10_000)] = Field(
        37, description="positions along each travel, both ends included"
    )
    others: Literal["start", "end", "together"] = Field(
        "start",
        description="where the other coordinates are held: at their start, at the end of their travel, or together: at "
        "the same share of their travel",
    )
    pace: Literal["fast", "slow"] = Field(
        "fast",
        description="how fast the mechanism moves to the stations at rest, beside what relaxes in viscoelastic parts: "
        "fast, nothing relaxes on the way; slow, all has relaxed at each station",
    )
    time: units.DurationOrZero = Field(0.0, description="at which motors, loads and drives are evaluated")
    spin: units.AngularVelocity | None = Field(None, description="steady turn of everything, inertial axes")
    centre: units.Position = Field((0.0, 0.0, 0.0), description="a point on the axis of the turn")
    lines: dict[str, MarginLine] = Field({}, description="what is asked of a coordinate, by its name")
    parts: dict[str, MarginPart] = Field(
        {}, description='how a part counts, by its name; "hinge.friction" is one share'
    )
