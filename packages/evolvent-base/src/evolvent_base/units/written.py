"""Units as files write them (`m/s2`, `Volts`, `in-lbf`, `dps`, `°`), and what they are called here.

Case files are read by `parse`, which takes one spelling and answers others by a hint. Columns come from
programs whose spelling a user cannot choose: their units are read from a lexicon of symbols and names. Other words go
to the units library only where they are long: it reads short ones as what nobody means here, `Nm` as the fineness of a
thread, `pct` as a weight of gems.
"""

from __future__ import annotations

import functools
import itertools
import re
import unicodedata

from evolvent_base.errors import nearest
from evolvent_base.units.parsing import COMMON, UnitError, cut, known, value_in

#: Symbols of units and the prefixes that they are used with.
_SYMBOLS = {
    "m": "n u m c d k", "s": "n u m", "g": "k", "N": "n u m c da k M", "Pa": "u h k M G", "V": "n u m k M",
    "A": "n u m k", "W": "u m k M", "J": "u m k M", "T": "n u m", "Hz": "m k M G", "K": "m", "rad": "n u m",
    "deg": "m u", "ohm": "m k M", "C": "p n u m", "F": "p n u", "H": "n u m", "bar": "m u", "g_0": "n u m", "turn": "m",
    "gauss": "m u k", "psi": "k", "min": "", "h": "", "in": "u", "ft": "", "yd": "", "lbf": "k m", "ozf": "", "kgf": "",
    "slug": "", "rpm": "k", "degC": "", "degF": "", "arcmin": "", "arcsec": "m u", "dB": "", "ppm": "", "count": "k",
    "px": "", "dyn": "", "kip": "", "torr": "", "mmHg": "", "atm": "", "gon": "m", "t": "", "Gal": "m",
}  # fmt: skip
#: Names, in small letters, of one meaning or of several; "!" stands behind the one that a recording means: nobody
#: records a mass in grams that swings. The s of a plural may follow.
_NAMES = {
    "g": "g_0! g", "mg": "mg_0! mg", "ug": "ug_0! ug", "gs": "g_0", "g's": "g_0", "gee": "g_0", "gforce": "g_0",
    "g0": "g_0", "g_n": "g_0", "gn": "g_0", "gal": "Gal gallon", "gm": "g", "gramm": "g",
    "lb": "lbf lb", "pound": "lbf lb", "lbm": "lb", "poundforce": "lbf", "oz": "ozf oz", "ounce": "ozf oz",
    "kp": "kgf", "kilogramforce": "kgf", "dyne": "dyn", "gram": "g", "newton": "N", "pascal": "Pa", "joule": "J",
    "mil": "thou! mil", "thou": "thou", "''": "in! arcsec", "'": "ft! arcmin", "zoll": "in", "inch": "in",
    "inches": "in", "foot": "ft", "feet": "ft", "micron": "um", "meter": "m", "metre": "m",
    "sec": "s", "sek": "s", "second": "s", "sekunde": "s", "sekunden": "s", "minute": "min", "minuten": "min",
    "stunde": "h", "stunden": "h", "hour": "h", "hr": "h", "std": "h", "day": "day", "tage": "day",
    "volt": "V", "vdc": "V", "ampere": "A", "amp": "A", "watt": "W", "hertz": "Hz", "kelvin": "K",
    "tesla": "T", "celsius": "degC", "centigrade": "degC", "fahrenheit": "degF",
    "radian": "rad", "radiant": "rad", "degree": "deg", "grad": "deg gon", "gradian": "gon", "arcminute": "arcmin",
    "arcsecond": "arcsec", "rev": "turn", "revolution": "turn", "umdrehung": "turn",
    "umdrehungen": "turn", "cycle": "turn", "upm": "turn/min", "rps": "turn/s", "dps": "deg/s", "mdps": "mdeg/s",
    "mps": "m/s", "ips": "in/s", "fps": "ft/s", "kph": "km/h", "kmh": "km/h", "mph": "mile/h", "kt": "knot",
    "cc": "cm^3", "ton": "t ton", "tonne": "t",
    "%": "percent", "pct": "percent", "prozent": "percent", "cnt": "count", "ct": "count", "digit": "count",
    "lsb": "count", "adc": "count", "bit": "count", "tick": "count", "pixel": "px", "pix": "px", "strain": "m/m",
    "ustrain": "um/m", "microstrain": "um/m", "ue": "um/m", "psig": "psi", "psia": "psi", "barg": "bar", "bara": "bar",
}  # fmt: skip
#: What a word is taken for in a hint alone.
_MEANT = {"kg": "kgf", "gf": "kgf/1000"}
#: What says that a unit counts angles.
_ANGLE = re.compile(
    r"(?<![A-Za-z])([num]?(rad|deg|turn|gon)(ian|ree)?s?|revolutions?|k?rpm|[mu]?arc(min|sec)|mil)(?![A-Za-z])"
)
#: Symbols that stand before another, and behind one, without a sign between: "Nm", "kgm2", "ozin".
_FIRST = "kN|mN|uN|cN|daN|MN|N|kgf|kg|g|lbf|lb|ozf|oz|slug|in|ft|A|V"
_SECOND = "m|mm|cm|in|ft|s|h|lbf|lbs|lb|ozf|oz|rad"
#: What stands where no unit is stated; longest text of a unit, most meanings that are tried.
_NONE, _LONGEST, _MOST_TRIED = frozenset(["", "-", "--", "none", "n/a", "na", "unit", "units", "?"]), 60, 64
#: Spellings of signs.
_SIGNS = {
    "\u03bc": "u", "\u03b5": "e", "\u03a9": "ohm", "\u2212": "-", "\u2013": "-", "\u2032": "'", "\u2019": "'",
    "\u201d": "''", '"': "''", "\u2215": "/", "\u2044": "/", "**": "^", "°C": " degC ",
    "°F": " degF ", "°": " deg ",
}  # fmt: skip
_TOKENS = re.compile(
    r"(?P<word>g's|[A-Za-z_%]+0?|''?)|(?P<power>\^?(?P<open>\()?(?P<exponent>[-+]?\d+(?:\.\d+)?)(?(open)\)))"
    r"|(?P<sign>\s+|/|[()])"
)
#: Units that are named where none is near.
_COMMON = ("m", "mm", "um", "m/s", "m/s^2", "mm/s", "rad", "deg", "rad/s", "deg/s", "N", "N m", "V", "mV", "g_0", "px")


def file_unit(text: str, *wanted: str) -> str:
    """The unit of a column in the spelling of case files; '' where none is stated.

    Parameters
    ----------
    text : str, as the file has it: 'm/s²', 'Volts', 'in-lbf', '°/s', 'g'
    wanted : str, a unit of each quantity that the column may be, '' for a plain number; any quantity if left out, where
        `g` is the acceleration

    Raises
    ------
    UnitError
        If it is no unit that is known, of something else than what is wanted, or may mean two.

    Examples
    --------
    >>> file_unit("m/s²"), file_unit("mVolts"), file_unit("in-lbf"), file_unit("g"), file_unit("g", "kg")
    ('m/s^2', 'mV', 'in lbf', 'g_0', 'g')
    """
    for kind in wanted[:-1]:
        try:
            return _read(text.strip(), kind)
        except UnitError:
            continue
    return _read(text.strip(), wanted[-1] if wanted else None)


@functools.cache
def _read(text: str, wanted: str | None) -> str:
    plain = text.strip("[](){}").strip() if text[:1] in tuple("[({") else text
    if plain.lower() in _NONE:
        return ""
    if plain in COMMON.get(wanted or "", {}):
        return plain
    found = candidates(plain, any_of=wanted is None)
    if not found:
        hint = meant(plain, wanted) if wanted else f"; {nearest(plain, _COMMON)}"
        raise UnitError(f"{cut(text)!r} is not a known unit{hint}")
    if wanted is not None:
        fits = [one for one in found if _fits(one, wanted)]
        if not fits:
            raise UnitError(_refused(text, found[0], wanted))
        found = list({value_in(f"1 {one}", wanted): one for one in reversed(fits)}.values())[::-1]
    if len(found) > 1:
        raise UnitError(f"{text!r} may be {' or '.join(found)}; write one of them")
    return found[0]


def parse(text: str, unit: str) -> float:
    """The value of `text` in `unit`, as a case file writes it: see `parsing.value_in`, with a hint in the sentence.

    Raises
    ------
    UnitError
        If the text is not a number with a unit of the same dimension.
    """
    return value_in(text, unit, meant)


def factor(unit: str, wanted: str) -> float:
    """What a value in `unit`, as a file writes it, is multiplied by to be in `wanted`.

    Raises
    ------
    UnitError
        As of `file_unit`; where none is stated; and of a unit with another zero, such as degrees Celsius.
    """
    read = file_unit(unit, wanted)
    if not read:
        raise UnitError(f"{unit!r} states no unit")
    if value_in(f"0 {read}", wanted) != 0.0:
        raise UnitError(f"{unit!r} has another zero than {wanted!r}; write the values in {wanted}")
    return value_in(f"1 {read}", wanted)


def _fits(unit: str, wanted: str) -> bool:
    """Whether a unit is of a kind; an angle must be said to be one."""
    if known(unit).dimensionality != known(wanted or "1").dimensionality:
        return False
    return not wanted.startswith("rad") or bool(_ANGLE.search(unit))


def _refused(text: str, unit: str, wanted: str) -> str:
    """A sentence on a unit that is none of the wanted kind."""
    if "s" in wanted and wanted.startswith("rad") and known(unit).dimensionality == known(wanted).dimensionality:
        return f"{text!r} does not say whether it counts turns or radians; write rpm, turn/s or rad/s"
    return f"{text!r} is a unit of something else{meant(text, wanted)}"


def meant(given: str, wanted: str) -> str:
    """The end of a sentence on a text that is no unit of the wanted kind: the spelling that may be meant, or ''."""
    found = candidates(given, any_of=False, loose=True) if given.isprintable() else []
    return next((f"; did you mean {one!r}?" for one in found if one != given and _fits(one, wanted)), "")


def candidates(text: str, *, any_of: bool = True, loose: bool = False) -> list[str]:
    """The units that a text may stand for, in the spelling of case files.

    Parameters
    ----------
    any_of : bool, whether a recording of any quantity is meant, where `g` is no mass
    loose : bool, whether for a hint: other cases of letters and masses for forces as well
    """
    choices = _choices(_plain(text), any_of, loose) if len(text) <= _LONGEST else []
    tried = itertools.islice(itertools.product(*choices), _MOST_TRIED) if choices else ()
    joined = dict.fromkeys(re.sub(r"\s*([ /])\s*", r"\1", "".join(one).strip()) for one in tried)
    return [one for one in joined if _is_known(one)]


def _is_known(unit: str) -> bool:
    try:
        known(unit)
    except UnitError:
        return False
    return True


def _plain(text: str) -> str:
    """A text in letters of ASCII, with ^ for powers and a blank or / between units."""
    text = unicodedata.normalize("NFKC", text.replace("\u00ba", "°").replace("\u00b4", "'"))
    for old, new in _SIGNS.items():
        text = text.replace(old, new)
    if re.fullmatch(r"(a|arb)\. ?(u|units?)\.?|arb|au", text.lower()):
        return "count"
    text = re.sub(r"\s+(?:per|pro)\s+", "/", text, flags=re.IGNORECASE)
    text = re.sub(r"\s*([/^])\s*", r"\1", text)
    text = re.sub(r"([A-Za-z]+)\s+squared", r"\1^2", text)
    text = re.sub(r"(?<=[A-Za-z])[- ](force|g)\b", r"\1", text, flags=re.IGNORECASE) if "force" in text else text
    text = re.sub(r"\bmilli-?g\b", "mg_0", text)
    text = re.sub(r"(?<=[A-Za-z\d)'])\.?\s*[-.*\u00b7\u22c5\u2219\u2022\u00d7]\s*(?=[A-Za-z(])", " ", text)
    text = re.sub(r"\b[rRuU]/(?=min|s)", "turn/", text)
    return re.sub(r"\bdeg\s+([CF])\b", r"deg\1", text).strip().rstrip(".")


def _choices(text: str, any_of: bool, loose: bool) -> list[list[str]]:
    """What each word of a text and each sign between may be; none where it is no unit."""
    found: list[list[str]] = []
    at, words = 0, []
    for match in _TOKENS.finditer(text):
        last = found[-1][0] if found else "/"
        if match.start() != at:
            return []
        at = match.end()
        if match["open"] and last in "/(":
            return []
        if match["word"]:
            options = _meanings(match["word"], any_of, loose)
            if not options:
                return []
            if last[-1].isalnum() or last == ")":
                found.append([" "])
            words.append(len(found))
            preferred = [one[:-1] for one in options if one.endswith("!")] if any_of else []
            found.append(preferred or [one.rstrip("!") for one in options])
        elif match["power"] and last[-1].isalpha():
            found[-1] = [
                f"({one})^{match['exponent']}" if "/" in one or "^" in one else f"{one}^{match['exponent']}"
                for one in found[-1]
            ]
        elif match["power"] and last in "/(" and match["power"].isdecimal():
            found.append([match["power"]] if match["power"] in ("1", "10", "100", "1000") else ["?"])
        elif match["power"] and last == ")":
            found.append([f"^{match['exponent']}"])
        else:
            found.append([match["sign"] or "?"])
    if at != len(text):
        return []
    return _torques(found, words) if any_of else found


def _torques(found: list[list[str]], words: list[int]) -> list[list[str]]:
    """A pound beside a length is a force: "in-lb" is a torque, "lb in^2" a moment of inertia."""
    for a, b in itertools.pairwise(words):
        for weight, length in ((a, b), (b, a)):
            if len(found[weight]) == 2 and found[weight][0] in ("lbf", "ozf") and found[length][0][:2] in ("in", "ft"):
                found[weight] = [found[weight]["^" in found[length][0]]]
    return found


@functools.cache
def _symbols() -> frozenset[str]:
    """Symbols with their prefixes."""
    return frozenset(prefix + one for one, prefixes in _SYMBOLS.items() for prefix in ("", *prefixes.split()))


def _meanings(word: str, any_of: bool, loose: bool) -> list[str]:
    """Spellings that a word may stand for: a symbol by its own letters, a name, two symbols, other letters."""
    symbols, low = _symbols(), word.lower()
    more = [_MEANT[low]] if loose and low in _MEANT else []
    if loose:
        more += [one for tried in (word, low, word.upper(), word.capitalize()) for one in _parted(tried)]
        more += sorted(one for one in symbols if one.lower() == low != one)
    named = _NAMES.get(low) or (_NAMES.get(low.removesuffix("s")) if len(low) > 2 else None)
    if word in symbols and not (named and "!" in named):
        return [word, *more]
    if word == "Grad":
        return ["deg"]
    if named:
        return [*named.split(), *more]
    found = _parted(word)
    if not found and (len(word) > 1 or (word in "MS" and not any_of)):
        found = sorted(one for one in symbols if one.lower() in (low, low.removesuffix("s") if len(low) > 3 else low))
        found += _parted(low) + (_parted(low.capitalize()) if len(word) == 2 else [])
    for prefix, name in ((word[:1], low[1:]), ({"milli": "m", "micro": "u"}.get(low[:5], ""), low[5:])):
        whole = prefix + _NAMES.get(name.removesuffix("s"), " ")
        if not found and prefix and len(name) > 2 and whole in symbols:  # mVolts, millivolts
            found = [whole]
    if not found and len(word) >= 4:
        found = [one for one in (word, low) if _is_known(one)][:1]
    return [*found, *more]


def _parted(word: str) -> list[str]:
    """A word of two symbols, or of three, with blanks between them; "lb" may be a force or a mass."""
    match = re.fullmatch(rf"({_FIRST})({_SECOND})(s|rad)?", word)
    parts = [one for one in match.groups() if one] if match else []
    each = [_NAMES[one.rstrip("s")].split() if one in ("lb", "lbs", "oz") else [one] for one in parts]
    return [" ".join(one) for one in itertools.product(*each) if one]
