"""Numbers as people write them: the decimal sign and the sign that groups thousands are found for each column."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence

import numpy as np

from evolvent_base.units.heads import is_unit

#: Cells that hold no value, in small letters.
MISSING = frozenset((
    "", "nan", "+nan", "-nan", "na", "n/a", "n.a.", "null", "none", "nil", "-", "--", "---", "#n/a", "#na", "#nv",
    "1.#qnan", "1.#ind", "-1.#ind", "nan(ind)", "-nan(ind)", "<na>", "nat",
))  # fmt: skip
_INFINITE = {"inf": math.inf, "+inf": math.inf, "infinity": math.inf, "-inf": -math.inf, "-infinity": -math.inf}
#: What stands for a minus, a blank and an apostrophe.
_SIGNS = str.maketrans("\u2212\u2013\u00a0\u202f\u2009\u2019", "--   '")
_UNUSUAL = re.compile("[\u2212\u2013\u00a0\u202f\u2009\u2019]")


def _form(decimal: str, other: str) -> re.Pattern[str]:
    whole = "|".join(rf"[1-9]\d{{0,2}}(?:{group}\d{{3}})+" for group in (re.escape(other), " ", "'"))
    fraction = rf"(?:{re.escape(decimal)}\d*)?" if decimal == "." else rf"(?:{decimal}\d+)?"
    return re.compile(rf"[+-]? ?(?:(?:{whole}){fraction}|(?=[.,]?\d)\d*{fraction}(?:[eEdD] ?[+-]?\d+)?)")


#: Forms of numbers by their decimal sign. A zero begins no group, and a number with an exponent has none.
_FORMS = {".": _form(".", ","), ",": _form(",", ".")}
#: A number and a unit behind it, in cells up to a length.
_QUANTITY, _LONGEST = re.compile(r"([^A-Za-z%\u00b0\u00b5\u03bc]*[\d.]) ?([A-Za-z%\u00b0\u00b5\u03bc]\S{0,9})"), 30
#: Plain whole numbers, which any decimal sign fits.
_WHOLE = re.compile(r"[+-]? ?\d+")
#: Least size and number of different whole numbers below 1000 that show that larger ones are grouped.
_SHORT, _SEVERAL = 10, 3


def plain(cell: str) -> str:
    """A cell with the usual signs for minus, blank and apostrophe."""
    return cell.translate(_SIGNS).strip() if _UNUSUAL.search(cell) else cell


def is_missing(cell: str) -> bool:
    """Whether a cell holds no value."""
    return cell.lower() in MISSING


def is_number(cell: str) -> bool:
    """Whether a cell is a number, whatever its decimal sign."""
    try:
        return not math.isnan(float(cell)) and "_" not in cell
    except ValueError:
        cell = plain(cell)
    return any(form.fullmatch(cell) for form in _FORMS.values()) or cell.lower() in _INFINITE


def quantity(cell: str) -> tuple[str, str] | None:
    """Number and unit of a cell that holds both, "0.05 sec"; None of others."""
    found = _QUANTITY.fullmatch(cell) if len(cell) <= _LONGEST else None
    return (found[1], found[2]) if found and is_number(found[1]) and is_unit(found[2]) else None


def is_grouped(cell: str, decimal: str) -> bool:
    """Whether a cell is a number whose digits a point or a comma groups."""
    return bool(re.search(r"\d\.\d" if decimal == "," else r"\d,\d", cell)) and is_number(cell)


def readings(cells: Iterable[str]) -> str:
    """The decimal signs with which all cells are numbers: '.', ',', '.,' where both fit, '' where none does.

    Cells that are no numbers are passed over. Where whole numbers fit both, '.,' is meant as well.
    """
    found = ".,"
    short: set[str] = set()
    grouped, long_plain, zeros = "", False, False
    for raw in cells:
        cell = plain(raw)
        if _WHOLE.fullmatch(cell):
            digits = cell.lstrip("+- ")
            long_plain |= len(digits) > 3
            if len(digits) > 1 and len(short) < _SEVERAL:
                short.add(digits)
            continue
        own = "".join(sign for sign in found if _FORMS[sign].fullmatch(cell))
        if not own:
            if any(form.fullmatch(cell) for form in _FORMS.values()):
                return ""
            continue
        found = own
        if len(found) == 1:
            break
        grouped = grouped or next((sign for sign in ".," if sign in cell), "")
        zeros |= cell.endswith("0")
    if found == ".," and grouped:
        if long_plain:  # whole numbers above 999 are not grouped here: the sign is decimal
            return grouped
        if zeros and len(short) >= _SEVERAL:  # fixed decimals would show in the whole numbers, others end with no zero
            return "," if grouped == "." else "."
    return found


def has_sign(cells: Iterable[str]) -> bool:
    """Whether a number among the cells holds a point or a comma."""
    return any(("." in cell or "," in cell) and is_number(cell) for cell in cells)


def number(cell: str, decimal: str) -> float:
    """The value of a cell, NaN where it holds none.

    Raises
    ------
    ValueError
        If it is no number with this decimal sign.
    """
    cell = plain(cell)
    if _FORMS[decimal].fullmatch(cell):
        digits = cell.translate({ord("," if decimal == "." else "."): None, ord("'"): None, ord(" "): None})
        return float(digits.replace(",", ".").replace("d", "e").replace("D", "e"))
    low = cell.lower()
    if low in MISSING:
        return math.nan
    if low in _INFINITE:
        return _INFINITE[low]
    raise ValueError(cell)


def floats(cells: Sequence[str], decimal: str) -> tuple[np.ndarray, int]:
    """Values of cells, and the place of the first that is no number, or -1."""
    fast = values(cells, decimal)
    if fast is not None:
        return fast, -1
    found, wrong = np.full(len(cells), np.nan), -1
    for k, cell in enumerate(cells):
        try:
            found[k] = number(cell, decimal)
        except ValueError:
            wrong = k if wrong < 0 else wrong
    return found, wrong


def values(cells: Sequence[str], decimal: str) -> np.ndarray | None:
    """Values of cells without groups, NaN where one is empty; None where one is something else."""
    if decimal == ",":
        if any("." in cell for cell in cells):
            return None
        cells = [cell.replace(",", ".") for cell in cells]
    try:
        found = np.array(list(map(float, cells)))
    except ValueError:
        try:
            found = np.array([math.nan if is_missing(cell.strip()) else float(cell) for cell in cells])
        except ValueError:
            return None
    return None if any("_" in cell for cell in cells) else found
