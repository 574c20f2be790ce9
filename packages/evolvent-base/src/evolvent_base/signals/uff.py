"""Universal file format: data sets 58 and 58b, with the units of a data set 164.

The library `pyuff` reads these files too, but by path, without the numbers of samples and bytes that they state, and no
line that ends in blanks. Fields by "Universal Dataset Number 58" (Structural Dynamics Research Lab, Cincinnati).
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from evolvent_base.errors import InputError, visible
from evolvent_base.signals.recording import Column, column
from evolvent_base.tables import NO_UNIT, distinct, words

#: A line that begins or ends a data set.
_END = re.compile(rb"^[ \t]*-1[ \t\r]*$", re.MULTILINE)
#: What closes a binary data set, behind its last byte or in a line of its own.
_CLOSE = re.compile(rb" {4}-1[ \t\r]*$", re.MULTILINE)
#: First line of a data set 58b: byte order, kind of floating point numbers, lines of the head, bytes of the data.
_BINARY = re.compile(rb"[ \t]*58[bB]((?:\s+\d+)*)")
_HEAD = 11
_TIME, _FREQUENCY = 17, 18
#: Kinds of ordinates that a data set 164 gives a unit.
_KINDS = {8: "m", 9: "N", 11: "m/s", 12: "m/s^2", 13: "N"}
_DIRECTIONS = {1: "X", 2: "Y", 3: "Z", 4: "RX", 5: "RY", 6: "RZ"}


class _Set(NamedTuple):
    """One data set: its kind, its lines below that, and for 58b what its first line states and where its data are."""

    kind: int
    head: list[str]
    data: bytes
    binary: tuple[int, ...]


class _Units(NamedTuple):
    """What a data set 164 states: a length and a force of the file are as many m and N."""

    length: float
    force: float


def begins(raw: bytes) -> bool:
    """Whether a file's first lines are those of a universal file."""
    first, _, rest = raw[:4096].lstrip().partition(b"\n")
    words = rest[:1000].split(maxsplit=1)[:1]
    return first.strip() == b"-1" and bool(words) and (words[0].isdigit() or words[0].lower() == b"58b")


def read(raw: bytes, name: str) -> tuple[list[Column], dict[str, str]]:
    """Columns of the functions of time in a universal file; and names of the others -> why they are left out.

    Raises
    ------
    InputError
        If a data set is damaged or holds fewer samples than it states.
    """
    found: list[Column] = []
    left: dict[str, str] = {}
    stated: _Units | None = None
    sets = list(_sets(raw))
    scales = [_scales(one) for one in sets if one.kind == 164]
    for k, one in enumerate(sets):
        if one.kind == 164:
            stated = scales.pop(0) if scales else stated
        if one.kind == 58:
            try:
                found += _function(one, stated or (scales[0] if scales else None), left)
            except InputError as error:
                raise InputError(f"cannot read {name!r}: its data set {k + 1} {error}") from None
            except (ValueError, IndexError):
                raise InputError(
                    f"cannot read {name!r}: it begins like a UFF 58 file, but its data set {k + 1} is damaged"
                ) from None
    names = distinct(one.name for one in found)
    renamed = [dataclasses.replace(one, name=n) for one, n in zip(found, names, strict=True)]
    return _with_times(renamed), left


def _sets(raw: bytes) -> Iterator[_Set]:
    """The data sets, one after the other; of one that is not closed, what is there."""
    place = 0
    while begin := _END.search(raw, place):
        start = begin.end() + 1
        below = _line_end(raw, start) + 1
        line = raw[start : below - 1]
        if match := _BINARY.match(line):
            numbers = tuple(map(int, match[1].split())) or (1,)
            lines, size = (numbers[2], numbers[3]) if len(numbers) > 3 else (_HEAD, 0)
            head, at = _lines(raw, below, lines or _HEAD)
            end = _CLOSE.search(raw, at + size)
            yield _Set(58, head, raw[at : end.start() if end else len(raw)], numbers)
        else:
            end = _END.search(raw, start)
            last = end.start() if end else len(raw)
            kind = line.split()[:1]
            head, at = _lines(raw, below, _HEAD)
            yield _Set(int(kind[0]) if kind and kind[0].isdigit() else 0, head, raw[at:last], ())
        if end is None:
            return
        place = end.end()


def _lines(raw: bytes, start: int, count: int) -> tuple[list[str], int]:
    """Lines from an address on, and the address behind them."""
    found = []
    for _ in range(min(count, 100)):
        end = _line_end(raw, start)
        found.append(_decoded(raw[start:end]).rstrip("\r"))
        start = end + 1
    return found, start


def _decoded(line: bytes) -> str:
    try:
        return line.decode("utf-8")
    except UnicodeDecodeError:
        return line.decode("latin-1")


def _line_end(raw: bytes, start: int) -> int:
    end = raw.find(b"\n", start)
    return len(raw) if end < 0 else end


def _fields(line: str, *widths: int) -> list[str]:
    """Cells of fixed widths."""
    found = []
    for width in widths:
        found.append(line[:width].strip())
        line = line[width:]
    return found


def _number(text: str) -> float:
    return float(text.replace("D", "E").replace("d", "e") or 0.0)


def _scales(one: _Set) -> _Units | None:
    """Units of a data set 164; None where it is damaged."""
    try:
        length, force = (_number(word) for word in " ".join(one.head[1:3]).split()[:2])
    except ValueError:
        return None
    return _Units(1.0 / length, 1.0 / force) if length > 0.0 < force else None


def _function(one: _Set, scales: _Units | None, left: dict[str, str]) -> list[Column]:
    """The column of a data set 58, behind it that of its times where they are uneven."""
    head = one.head
    kind = int(_fields(head[5], 5)[0] or 0)
    node = _fields(head[5], 5, 10, 5, 10, 11, 10, 4)
    data_type, points, spacing = (int(_number(cell)) for cell in _fields(head[6], 10, 10, 10))
    first, step = (_number(cell) for cell in _fields(head[6][30:], 13, 13))
    abscissa, ordinate = (_fields(line, 10, 5, 5, 5, 21, 21) for line in head[7:9])
    name = _name(node[5], node[6], head)
    time_kind, time_unit = int(abscissa[0] or 0), _label(abscissa[5])
    why, factor, notes = _second(time_kind, time_unit)
    if kind not in (0, 1):
        why = "it is no response over time"
    elif data_type not in (2, 4):
        why = "its samples are complex numbers"
    if why:
        left[name] = why
        return []
    samples, times = _samples(one, data_type, points, even=spacing != 0)
    if not samples.size:
        return []
    unit, scale = _unit(ordinate, scales)
    if unit and not _label(ordinate[5]):
        how = f": its samples were multiplied by {scale:g}" if scale != 1.0 else ""
        notes = (*notes, f"the unit of {name!r}, {unit}, is by the file's data set 164{how}")
    if times is not None:
        return [column(name, scale * samples, unit, times="time", notes=notes), column("time", factor * times, "s")]
    rate = 1.0 / (step * factor) if step > 0.0 and np.isfinite(step) else None
    return [column(name, scale * samples, unit, rate=rate, start=first * factor, notes=notes)]


def _samples(one: _Set, data_type: int, points: int, *, even: bool) -> tuple[np.ndarray, np.ndarray | None]:
    """As many samples as the data set states, and their times where it lists them."""
    each = 1 if even else 2
    if one.binary:
        order, arithmetic = [*one.binary, 1, 2][:2] if len(one.binary) < 2 else one.binary[:2]
        if arithmetic != 2:
            raise InputError("holds floating point numbers of another kind than IEEE 754, which are not read")
        sign = ">" if order == 2 else "<"
        size = one.binary[3] if len(one.binary) > 3 else 0
        single = "f4" if data_type == 2 else "f8"
        if not even and data_type == 4 and size == 12 * points:
            pairs = np.dtype([("t", f"{sign}f4"), ("x", f"{sign}f8")])
        else:
            pairs = np.dtype([(key, sign + single) for key in ("x",) if even] or [(k, sign + single) for k in "tx"])
        there = min(len(one.data), size or len(one.data)) // pairs.itemsize
        _enough(there, points)
        table = np.frombuffer(one.data, dtype=pairs, count=points)
        return table["x"].astype(float), None if even else table["t"].astype(float)
    text = one.data.decode("latin-1").replace("D", "E").replace("d", "e")
    try:
        values = np.array(text.split(), dtype=float)
    except ValueError:  # numbers without a blank between them
        values = np.array([float(cell) for line in text.splitlines() for cell in _cells(line, data_type, even=even)])
    _enough(values.size // each, points)
    values = values[: each * points]
    return (values, None) if even else (values[1::2], values[::2])


def _cells(line: str, data_type: int, *, even: bool) -> list[str]:
    """Cells of a line of data."""
    widths = (13,) * 6 if data_type == 2 else (20,) * 4 if even else (13, 20) * 2
    return [cell for cell in _fields(line.rstrip("\r"), *widths) if cell]


def _enough(there: int, points: int) -> None:
    if points < 0 or there < points:
        raise InputError(f"states {points} samples, but holds {there}")


def _second(kind: int, unit: str) -> tuple[str, float, tuple[str, ...]]:
    """Why an abscissa is no time, or its unit in s; and a note where the file leaves it open."""
    if kind == _FREQUENCY:
        return "it is a function of frequency, not of time", 1.0, ()
    factor = words.factor(unit) or words.factor(unit.lower())
    if factor is not None or not unit:
        return "", factor or 1.0, () if unit else (NO_UNIT,)
    if kind == _TIME:
        return "", 1.0, (f"the time has the unit {visible(unit)!r}, which is unknown: taken in s",)
    return f"its abscissa is in {unit!r}, which is no time", 1.0, ()


def _unit(ordinate: list[str], scales: _Units | None) -> tuple[str, float]:
    """Unit of an ordinate, by its label, else by the units of the file; and what its samples are multiplied by."""
    label, kind = _label(ordinate[5]), int(ordinate[0] or 0)
    if label or scales is None or kind not in _KINDS:
        return label, 1.0
    return _KINDS[kind], scales.force if _KINDS[kind] == "N" else scales.length


def _label(text: str) -> str:
    return "" if text.upper() == "NONE" else text


def _name(node: str, direction: str, head: list[str]) -> str:
    """Response node and direction, such as '3+Y'; else the first line of identification."""
    number, way = int(_number(node)), int(_number(direction))
    if number and abs(way) in _DIRECTIONS:
        return f"{number}{'-' if way < 0 else '+'}{_DIRECTIONS[abs(way)]}"
    return _label(head[0].strip())


def _with_times(found: list[Column]) -> list[Column]:
    """Columns that refer to the column of times behind them; equal times stand once."""
    columns: list[Column] = []
    kept: dict[bytes, str] = {}
    for k, one in enumerate(found):
        if one.times:
            values = found[k + 1].samples().tobytes()
            kept.setdefault(values, found[k + 1].name)
            columns.append(dataclasses.replace(one, times=kept[values]))
        elif k and found[k - 1].times:
            if kept[one.samples().tobytes()] == one.name:
                columns.append(one)
        else:
            columns.append(one)
    times = [one for one in columns if one.name in kept.values()]
    return [*times, *(one for one in columns if one.name not in kept.values())]
