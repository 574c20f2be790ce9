"""What records act on that refer to bodies, vectors, markers or coordinates: answers to `Family.ends`. Not compiled."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from evolvent.kernels import gaps, markers, sides
from evolvent.model.family import End, Records

Ends = Callable[[Any, Records], Iterator[End]]


def of_side(on: int, index: int, iv: int) -> Iterator[End]:
    """Of a side of a joint: a body, or vectors of a beam's node or of a point."""
    if on == sides.ON_BODY or (on == sides.ON_COORDINATES and index >= 0):  # or a spinning body's angle
        yield "bodies", index
    elif on != sides.ON_NOTHING:
        for vector in range(3 if on == sides.ON_NODE else 1):
            yield "vectors", iv + 3 * vector


def of_markers(own: Any, records: Records) -> Iterator[End]:
    """Of markers, by their indices."""
    for marker in records("markers")[own]:
        if marker["kind"] == markers.ON_POINT:
            yield "vectors", int(records("points")["iv"][marker["index"]])
        else:
            yield "bodies", int(marker["index"])


def of_coordinate(row: Any, records: Records) -> Iterator[End]:
    """Of a coordinate of a joint: the two bodies that it measures between."""
    yield "bodies", int(row["body"])
    yield from of_side(int(row["on"]), int(row["other"]) if row["on"] == sides.ON_BODY else -1, int(row["iv"]))


class OfCoordinates:
    """Ends of records that act on coordinates of joints; `fields` hold their indices."""

    def __init__(self, *fields: str) -> None:
        self.fields = fields

    def __call__(self, row: Any, records: Records) -> Iterator[End]:
        """The bodies that the coordinates measure between."""
        for name in self.fields:
            yield from of_coordinate(records("coordinates")[int(row[name])], records)


def of_bodies(*names: str) -> Ends:
    """Of records that act on bodies, by the fields with their indices."""
    return lambda row, _: (("bodies", int(row[name])) for name in names)


def of_joint(row: Any, records: Records) -> Iterator[End]:
    """Of a joint: its sides, or those of a gear's coordinates."""
    if row["kind"] == gaps.GEAR:
        for coordinate in records("gear_coordinates")[int(row["first"]) : int(row["last"])]:
            yield from of_coordinate(coordinate, records)
        return
    for side in range(len(row["on"])):
        yield from of_side(*(int(row[key][side]) for key in ("on", "index", "iv")))
    if row["reduced"] > 0:
        yield "reduced_bodies", int(row["reduced"]) - 1
