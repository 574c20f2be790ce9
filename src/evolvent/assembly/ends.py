"""What the records of each family act on. Couplings, isolation and what acts from outside all follow from it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from evolvent import model as mdl
from evolvent.kernels import joint, rigid, sides, springs

Array = np.ndarray
End = tuple[str, int]
Records = Callable[[str], Any]


def _of_side(on: int, index: int, iv: int) -> Iterator[End]:
    if on == sides.ON_BODY or (on == sides.ON_COORDINATES and index >= 0):  # or a spinning body's angle
        yield "bodies", index
    elif on != sides.ON_NOTHING:
        for vector in range(3 if on == sides.ON_NODE else 1):
            yield "vectors", iv + 3 * vector


def _of_markers(own: Any, records: Records) -> Iterator[End]:
    for marker in records("markers")[own]:
        if marker["kind"] == springs.ON_POINT:
            yield "vectors", int(records("points")["iv"][marker["index"]])
        else:
            yield "bodies", int(marker["index"])


def _of_spring(row: Any, records: Records) -> Iterator[End]:
    yield from _of_markers([row["a"], row["b"]], records)


def _of_custom(row: Any, records: Records) -> Iterator[End]:
    first = int(row["first_marker"])
    yield from _of_markers(slice(first, first + int(row["points"])), records)


def _of_coordinate(row: Any, records: Records) -> Iterator[End]:
    yield "bodies", int(row["body"])
    yield from _of_side(int(row["on"]), int(row["other"]) if row["on"] == sides.ON_BODY else -1, int(row["iv"]))


def _of_coordinates(*names: str) -> Callable[[Any, Records], Iterator[End]]:
    def ends(row: Any, records: Records) -> Iterator[End]:
        for name in names:
            yield from _of_coordinate(records("coordinates")[int(row[name])], records)

    return ends


def _of_joint(row: Any, records: Records) -> Iterator[End]:
    if row["kind"] == joint.GEAR:
        for coordinate in records("gear_coordinates")[int(row["first"]) : int(row["last"])]:
            yield from _of_coordinate(coordinate, records)
        return
    for side in range(len(row["on"])):
        yield from _of_side(*(int(row[key][side]) for key in ("on", "index", "iv")))
    if row["reduced"] > 0:
        yield "reduced_bodies", int(row["reduced"]) - 1


def _of_bearing(row: Any, records: Records) -> Iterator[End]:
    for k in range(int(row["first"]), int(row["last"])):
        yield from _of_joint(records("joints")[k], records)
    yield from _of_coordinate(records("coordinates")[int(row["coordinate"])], records)


def _of_rod_element(row: Any, records: Records) -> Iterator[End]:
    yield from (("bodies", int(row[key])) for key in ("a", "b"))
    if row["tape"] > 0:
        first = int(row["tape_node"])
        yield from (("vectors", int(iv)) for iv in records("tape_nodes")["iv"][first : first + 2])


def _of_surface(row: Any, records: Records) -> Iterator[End]:
    """Of a layer on other turns, whose points pass from element to element, its body alone."""
    yield "bodies", int(row["body"])
    if row["under"] < 0:
        for point in records("contact_points")[int(row["first"]) : int(row["last"])]:
            yield from (("vectors", int(iv)) for iv in point["iv"])


def _of_thread(row: Any, records: Records) -> Iterator[End]:
    """But for its nodes."""
    yield "bodies", int(row["body"])
    if row["end"] >= 0:
        yield from _of_markers([row["end"]], records)


def _of_bodies(*names: str) -> Callable[[Any, Records], Iterator[End]]:
    return lambda row, _: (("bodies", int(row[name])) for name in names)


#: What a record acts on, of families that act between parts.
ENDS: dict[str, Callable[[Any, Records], Iterator[End]]] = {
    "springs": _of_spring,
    "threads": _of_thread,
    "wheels": _of_bodies("body"),
    "joints": _of_joint,
    "gear_coordinates": _of_coordinate,
    "coordinates": _of_coordinate,
    "motors": _of_coordinates("coordinate"),
    "drivetrains": _of_coordinates("coordinate"),
    "resistances": _of_coordinates("coordinate"),
    "synchronizations": _of_coordinates("a", "b"),
    "bearings": _of_bearing,
    "custom_forces": _of_custom,
    "rod_elements": _of_rod_element,
    "contact_surfaces": _of_surface,
    "body_contacts": _of_bodies("a", "b"),
}
#: Families whose records act through those of others.
OF_OTHERS = ("gear_coordinates", "bearings")
#: Families that act within one body: what holds its axis takes their torque across that, but nothing is tied to it.
WITHIN_ITS_BODY = ("wheels",)
#: Families whose records act at times: `outside` of a record is 1 where an end of it is no free body.
AT_TIMES = ("joints", "contact_surfaces", "body_contacts")
#: Families that may be in an isolated system beside those of `ENDS`, and what belongs to others or to other methods; of
#: loads on beams and of gravity the torque is known (`flow.implicit.load_torque`).
WITHIN = frozenset(
    (
        "info", "blocks", "bodies", "points", "markers", "links", "guides", "nodes", "events", "field_points",
        "controllers", "rows", "row_sides", "row_pairs", "beams", "beam_nodes", "elements", "beam_loads",
        "thermal_loads", "rods", "tapes", "tape_nodes", "reduced_bodies", "modes", "curves", "bristles",
        "contact_points",
    )
)  # fmt: skip


def ends_of(name: str, row: Any, records: Records) -> Iterator[End]:
    """What a record of a family acts on: ("bodies", index), ("reduced_bodies", index), ("vectors", index).

    The index of vectors is that in the state of the first velocity; of reduced bodies the modal coordinates are meant.

    Parameters
    ----------
    records : function of the name of a family to its records
    """
    return ENDS[name](row, records)


def _unbalanced(joints: Array) -> Array:
    """Joints whose forces on both sides need not lie on one line: (n,) bool.

    The damper of a soft joint pulls along the rate of a gap between two points, not along the gap.
    """
    return np.asarray((joints["kind"] == joint.POINT) & (joints["stiffness"] > 0.0) & (joints["damping"] > 0.0))


def mark_outside(families: dict[str, Array], info: Any) -> None:
    """Note which records tie the system to what is not part of it: bodies that are driven, or spin about an axis.

    `info.outside` is 1 where one of those that act at all times does, and `info.open` where forces come from outside.
    """
    free = families["bodies"]["motion"] == rigid.FREE

    def ties(name: str) -> Array:
        rows = families[name]
        found = (ends_of(name, row, families.__getitem__) for row in rows)
        return np.array([any(not free[i] for what, i in ends if what == "bodies") for ends in found], dtype=bool)

    for name in ENDS:
        tied = ties(name)
        if name == "custom_forces":
            tied |= families[name]["points"] == 1
        if name in AT_TIMES:
            families[name]["outside"] = tied
        elif name not in (*OF_OTHERS, *WITHIN_ITS_BODY):
            info["outside"] |= np.any(tied)
    acts: list[Any] = [np.any(ties(name)) for name in WITHIN_ITS_BODY]
    acts += [families[name].size > 0 for name in mdl.RECORDS if name not in WITHIN and name not in ENDS]
    acts += [np.any(families["bodies"]["motion"] == rigid.SPIN), families["threads"].size > 0]
    acts += [np.any(families["beams"]["paper"] != 0), np.any(families["rods"]["payout"] != 0)]
    acts += [np.any(families[name]["alpha"] != 0.0) for name in ("elements", "rods")]
    joints = families["joints"]
    acts += [np.any(_unbalanced(joints))]
    info["open"] = any(bool(one) for one in acts)
