"""Differences of results that are texts with numbers and units, such as "(0, 0, 1.2) mm at the end"."""

from __future__ import annotations

import functools
import re
from collections.abc import Sequence

from evolvent_base import units

#: A number that stands alone: no digit of a name or of an exponent of a unit.
_NUMBER = re.compile(r"(?<![\w.^/-])[-+]?(?:\d{1,3}(?:,\d{3})+|\d+)(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.])(?!-\w)", re.I)
#: Words that follow a value and could be read as units.
_WORDS = ("at", "a", "an", "in", "of", "to", "the", "by", "on", "as", "per", "each", "times")


@functools.lru_cache(maxsize=1000)
def _unit(words: tuple[str, ...]) -> str:
    """The longest unit that words begin with; '' for none."""
    known = next((k for k, word in enumerate(words) if word in _WORDS), len(words))
    for count in range(known, 0, -1):
        text = " ".join(words[:count])
        try:
            units.known(text)
        except units.UnitError:
            continue
        return text
    return ""


def _numbers(text: str) -> list[re.Match[str]]:
    """The numbers of a text; those of names, which stand in quotes, are none."""
    names = [match.span() for match in re.finditer(r"'[^']*'", text)]
    return [one for one in _NUMBER.finditer(text) if not any(low < one.start() < high for low, high in names)]


def _parsed(text: str) -> tuple[list[str], list[float], list[str]]:
    """What stands between the numbers of a text without their units, the numbers, and the unit of each."""
    between, numbers, of, at = [], list[float](), list[str](), 0
    found = _numbers(text)
    for match in found:
        inside = text.rfind("(", 0, match.start()) > text.rfind(")", 0, match.start())
        end = text.find(")", match.end()) + 1 if inside else match.end()
        words = tuple(re.split(r"[,;()]", text[end:], maxsplit=1)[0].split()[:3])
        numbers.append(float(match[0].replace(",", "")))
        of.append(_unit(words))
        between.append(text[at : match.start()])
        at = match.end()
    between.append(text[at:])
    for k, unit in enumerate(of):
        if unit:
            between[k + 1] = between[k + 1].replace(f" {unit}", " \0", 1)
    return between, numbers, of


def difference(texts: Sequence[str]) -> str:
    """The second text less the first one, number by number in the units of the first; of more texts the spread.

    Empty where the texts say different things, or hold no numbers.

    Parameters
    ----------
    texts : two or more texts with numbers and units
    """
    first, *others = (_parsed(text) for text in texts)
    between, numbers, of = first
    columns = [numbers]
    for words, values, own in others:
        if words != between or len(values) != len(numbers):
            return ""
        scaled = []
        for value, unit, wanted in zip(values, own, of, strict=True):
            try:
                scaled.append(value * units.parse(f"1 {unit}", wanted) if unit != wanted else value)
            except (units.UnitError, ValueError):
                return ""
        columns.append(scaled)
    if not numbers:
        return ""
    found = [b[-1] - b[0] if len(b) == 2 else max(b) - min(b) for b in zip(*columns, strict=True)]
    shown = [f"{0.0 if abs(d) < 1e-12 * max(map(abs, b)) else d:{'+' if len(b) == 2 and d else ''}.4g}"
             for d, b in zip(found, zip(*columns, strict=True), strict=True)]  # fmt: skip
    text = between[0]
    for number, unit, after in zip(shown, of, between[1:], strict=True):
        text += number + after.replace("\0", unit, 1)
    return text


def whole(text: str) -> str:
    """A text in which no line ends between a number and its unit."""
    between, _, of = _parsed(text)
    parts, at = [], 0
    for match, after, unit in zip(_numbers(text), between[1:], of, strict=True):
        end = match.end() + len(after.replace("\0", unit, 1))
        piece = text[at:end]
        if unit:
            piece = piece.replace(f" {unit}", f"\u00a0{unit.replace(' ', chr(0xA0))}", 1)
        parts.append(piece)
        at = end
    return "".join(parts) + text[at:]
