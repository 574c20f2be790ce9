"""Curves of the parts of a panel: equal ones are one, many different ones of repeated parts a band."""

from __future__ import annotations

import dataclasses
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from evolvent_base.figures import Line
from evolvent_base.style import PALETTE

#: Most lines that a legend names; more are coloured along a scale.
NAMED = 7
#: Share of the largest value of a panel within which curves are one, and most different ones without bands.
_ALIKE, _CURVES = 1e-3, 6
#: The first number in the name of a repeated part, and what stands about it.
NUMBERED = re.compile(r"(.*?)(\d+)(\D*)")
#: Most names, or ranges of numbers, that are listed in full.
_LISTED = 4
#: Share of a peak within which it is reached, and below which a sample says nothing of when it was.
_REACHED, _FAR = 1e-6, 0.5


class Peak(NamedTuple):
    """Largest magnitude of values over time.

    Attributes
    ----------
    k : int, sample at which it is first reached, but for round-off, or the largest one of its sign
    value : float
    between : bool, whether it is that of a step between samples, above those
    near : bool, whether the time of the sample says when it was
    """

    k: int
    value: float
    between: bool
    near: bool

    @property
    def when(self) -> str:
        """The word before its time; '' where that is not known."""
        return ("near" if self.between else "at") if self.near else ""


def listed(names: Sequence[str]) -> str:
    """Names of which only a number differs, in one: "rib 1 to 4, 7 and 9"; others with commas between them.

    Of many the first two and the last, and how many they are: "crease 2, 6, .. 131 (28)".
    """
    split = [NUMBERED.fullmatch(name) for name in names]
    if len(names) < 2 or any(one is None for one in split) or len({(one[1], one[3]) for one in split if one}) > 1:
        return ", ".join(names) if len(names) <= _LISTED else f"{names[0]}, {names[1]}, .. {names[-1]} ({len(names)})"
    spans: list[list[int]] = []
    for number in sorted(int(one[2]) for one in split if one):
        if spans and number == spans[-1][1] + 1:
            spans[-1][1] = number
        else:
            spans.append([number, number])
    words = [word for a, b in spans for word in ([f"{a} to {b}"] if b > a + 1 else dict.fromkeys((str(a), str(b))))]
    assert split[0] is not None
    if len(words) > _LISTED:
        return f"{split[0][1]}{words[0]}, {words[1]}, .. {words[-1]}{split[0][3]} ({len(names)})"
    if len(words) > 1:
        words = [", ".join(words[:-1]) + f" and {words[-1]}"]
    return f"{split[0][1]}{words[0]}{split[0][3]}"


def largest_of(values: np.ndarray) -> float:
    """Largest magnitude among finite values; 0 without one."""
    finite = np.abs(values[np.isfinite(values)])
    return float(finite.max(initial=0.0))


def first_peak(sizes: np.ndarray) -> int:
    """Sample at which the largest of values (nt,) is first reached, but for round-off."""
    most = np.nanmax(sizes)
    return int(np.argmax(sizes >= most - _REACHED * abs(most)))


def peak_over_time(values: np.ndarray, extremes: np.ndarray | None) -> Peak:
    """Largest magnitude of samples and of the steps between them.

    Parameters
    ----------
    values : (nt,) float
    extremes : (2, ...) float, least and largest values over all steps, NaN of what is not known; None without any
    """
    k = first_peak(np.abs(values))
    known = np.append(values[k], [] if extremes is None else extremes[np.isfinite(extremes)])
    largest = float(known[np.argmax(np.abs(known))])
    if abs(largest) <= (1.0 + _REACHED) * abs(values[k]):
        return Peak(k, float(values[k]), between=False, near=True)
    k = first_peak(np.copysign(1.0, largest) * values)
    return Peak(k, largest, between=True, near=bool(values[k] / largest >= _FAR))


def coloured(lines: list[Line]) -> list[Line]:
    """Lines of one panel in distinguishable colours; of many, along a scale, the first and last one named."""
    if len(lines) <= NAMED:
        return [dataclasses.replace(line, color=k) for k, line in enumerate(lines)]
    last = len(lines) - 1
    return [
        dataclasses.replace(line, color=k / last, label=line.label if k in (0, last) else "")
        for k, line in enumerate(lines)
    ]


def distinct(curves: Mapping[str, Line]) -> list[tuple[list[str], Line]]:
    """Curves of parts in distinguishable colours, those that are equal in one: the parts of each, and its curve.

    Where that leaves many, those of repeated parts are one band between their least and largest values.
    """
    size = max((largest_of(np.asarray(line.y)) for line in curves.values()), default=0.0)
    groups: list[list[str]] = []
    for part, line in curves.items():
        alike = (group for group in groups if _is_same(curves[group[0]].y, line.y, _ALIKE * size))
        group = next(alike, None)
        if group is None:
            groups.append([part])
        else:
            group.append(part)
    banded: list[list[str]] = []
    if len(groups) > _CURVES:
        curves_of = Counter(stem for group in groups for stem in dict.fromkeys(map(stem_of, group)))
        many = [stem for stem, count in curves_of.items() if count > 1]
        banded = [[part for part in curves if stem_of(part) == stem] for stem in many]
        groups = [own for group in groups if (own := [part for part in group if stem_of(part) not in many])]
    named = [dataclasses.replace(curves[own[0]], label=listed(own)) for own in groups]
    named += [_band([curves[part] for part in own], listed(own)) for own in banded]
    return list(zip([*groups, *banded], map(_filled, coloured(named)), strict=True))


def _filled(line: Line) -> Line:
    """A line, and the area of a band, in its colour."""
    if not line.fill or not isinstance(line.color, int):
        return line
    return dataclasses.replace(line, fill=f"{PALETTE[line.color]}40")


def stem_of(part: str) -> str:
    """What the names of repeated parts have in common."""
    return re.sub(r"\d+", "#", part)


def _band(lines: Sequence[Line], label: str) -> Line:
    """The area between the least and the largest values of curves over the same times."""
    x, values = np.asarray(lines[0].x), np.array([np.nan_to_num(line.y) for line in lines])
    around = np.concatenate([values.min(axis=0), values.max(axis=0)[::-1]])
    return Line(x=np.concatenate([x, x[::-1]]), y=around, label=label, width=0.6, fill="gainsboro")


def _is_same(a: np.ndarray, b: np.ndarray, most: float) -> bool:
    a, b = np.nan_to_num(a), np.nan_to_num(b)
    return a.shape == b.shape and float(np.abs(a - b).max(initial=0.0)) <= most
