"""Seeded mutations of texts, bytes and nested values, and the judge of what a reader makes of them."""

from __future__ import annotations

import contextlib
import copy
import math
import random
import signal
import threading
import traceback
from collections.abc import Callable, Iterator
from typing import Any

from evolvent_base.errors import EvolventError

#: Values that no key is prepared for.
HOSTILE: tuple[Any, ...] = (
    math.nan, math.inf, -math.inf, 10**18, -(10**18), 10**400, 1e308, -1e308, 5e-324, 0, -1, 0.5, True, None, "", " ",
    "nan m", "1e400 kg", "1 parsec", "1 m/s^2/kg", "m", "-", "x" * 100_000, "1" * 5000 + " m", "\u202e\x85", "${HOME}",
    "../../etc/passwd", [], {}, [[]], [None], ["1 m", "x"], {"": 1}, {"kind": "x"}, {"a": {"b": {"c": {}}}},
    [1.0] * 1000, [[0, 0]] * 50, "2 rad/s", "1 m" + " " * 20_000 + "x", "1 9**9**9*m", "1 m⁹⁹⁹⁹⁹⁹⁹",
    "max()", "x + min()",
    {"hub": 1, "boom": 2}, {"hub": 1, "boom": 2, "tip": 3}, [[1, 2, [3]], [1, 2, 3], [1, 2, "3 kg m^2"]],
    "=1+1", "\x1b[2J", 1e-300, "1e-300 m", "é", "off", "1_000", "0x10", "1:30", "2020-01-01",
)  # fmt: skip
#: Pieces of text that mean something to a reader of YAML or of tables.
TOKENS = (
    "&a [*a]", "*a", "!!python/object/apply:os.system [id]", "!!binary x", "<<: *a", "---", "...", "{", "[", "]", "}",
    ": ", "- ", "? ", "'", '"', "\t", "\0", "\r", "\x85", "\ufeff", "#", "%YAML 9.9", "!!set {a}", "!!timestamp x", "|",
    "[" * 2000, "- " * 2000, "*a, " * 2000, "&a {<<: *a}", " " * 5000, "(" * 2000, "    -1\n" * 500,
    "\n" * 5000, "\r\n" * 2000, '"\\u202e"', "\u202e", "=1+1", "x," * 2000,
    ">", "@", "`", "nan", "inf", "1e999", "9" * 400, ",", ";", ",,,,,,", "\n\n", "-1\n", "\U0010ffff", "é" * 300, "~",
)  # fmt: skip
#: Longest time of one call, s, and longest message.
LIMIT, LONGEST = 20.0, 1500


class TookTooLong(Exception):
    """A call that has not ended in time."""


@contextlib.contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Raise `TookTooLong` in the main thread after some processor time."""

    def stop(number: int, frame: Any) -> None:
        raise TookTooLong(f"more than {seconds:g} s")

    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "ITIMER_VIRTUAL"):
        yield
        return
    before = signal.signal(signal.SIGVTALRM, stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)


def judged(call: Callable[[], Any]) -> tuple[Any, str]:
    """What a call returns, and what is wrong with how it ended; '' if it returned or was refused in one sentence."""
    try:
        with limited(LIMIT):
            return call(), ""
    except EvolventError as error:
        text = str(error)
        if len(text) > LONGEST:
            return None, f"a message of {len(text)} characters: {text[:200]}..."
        return None, "" if text.strip() else "an empty message"
    except BaseException as error:  # noqa: BLE001  (every other end is a fault)
        last = traceback.extract_tb(error.__traceback__)[-1]
        return None, f"{type(error).__name__}: {str(error)[:200]} ({last.filename.rpartition('/')[2]}:{last.lineno})"


def changed_text(text: str, random_: random.Random) -> str:
    """A text with a few of its characters, words or lines removed, doubled, moved or replaced."""
    for _ in range(random_.choice((1, 1, 1, 2, 4))):
        how, place = random_.randrange(7), random_.randrange(len(text) + 1)
        end = min(len(text), place + random_.choice((1, 1, 3, 10, 60)))
        lines = text.split("\n")
        k = random_.randrange(len(lines))
        if how == 0:
            text = text[:place] + text[end:]
        elif how == 1:
            text = text[:place] + random_.choice(TOKENS) + text[place:]
        elif how == 2:
            text = text[:place] + random_.choice(TOKENS) + text[end:]
        elif how == 3:
            text = text[:place]
        elif how == 4:
            text = "\n".join([*lines[:k], *lines[k : k + 1] * random_.choice((0, 2, 3)), *lines[k + 1 :]])
        elif how == 5:
            lines[k] = " " * random_.randrange(6) + lines[k].lstrip()
            text = "\n".join(lines)
        else:
            text = text[:place] + chr(random_.choice((9, 10, 32, 45, 48, 57, 58, 101, 233, 0x2028))) + text[end:]
    return text


def changed_bytes(raw: bytes, random_: random.Random) -> bytes:
    """Bytes with a few of them flipped, removed, doubled or set to extremes."""
    found = bytearray(raw)
    for _ in range(random_.choice((1, 1, 2, 5, 20))):
        how, place = random_.randrange(6), random_.randrange(max(len(found), 1))
        if random_.random() < 0.5:
            place = min(place, random_.randrange(512))  # heads say more than values
        size = random_.choice((1, 2, 4, 8))
        if how == 0 and found:
            found[place] ^= 1 << random_.randrange(8)
        elif how == 1:
            found[place : place + size] = random_.choice((b"\xff", b"\0", b"\x7f", b"\x80")) * size
        elif how == 2:
            found[place : place + size] = random_.randbytes(size)
        elif how == 3:
            del found[place : place + random_.choice((1, 8, 100))]
        elif how == 4:
            found[place:place] = found[place : place + random_.choice((1, 8, 100))]
        elif random_.random() < 0.3:
            del found[place:]
    return bytes(found)


def leaves(content: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths of all values of nested mappings and lists, those of the mappings and lists themselves included."""
    if path:
        yield path
    if isinstance(content, dict):
        for key, value in content.items():
            yield from leaves(value, (*path, key))
    elif isinstance(content, list):
        for k, value in enumerate(content):
            yield from leaves(value, (*path, k))


def changed_values(content: Any, random_: random.Random) -> Any:
    """Nested values with one or two of them replaced, removed or renamed."""
    found = copy.deepcopy(content)
    for _ in range(random_.choice((1, 1, 2))):
        paths = list(leaves(found))
        if not paths:
            return found
        *above, last = random_.choice(paths)
        place = found
        for key in above:
            place = place[key]
        how = random_.randrange(6)
        if how == 0:
            del place[last]
        elif how == 1 and isinstance(place, dict):
            place[random_.choice((f"{last}x", "", "kind", "__class__", str(last).upper()))] = place.pop(last)
        elif how == 2:
            place[last] = copy.deepcopy(found)
        else:
            place[last] = copy.deepcopy(random_.choice(HOSTILE))
    return found


def not_finite(content: Any, path: tuple[Any, ...] = ()) -> set[tuple[Any, ...]]:
    """Paths of all numbers in nested values that are not finite."""
    if isinstance(content, dict):
        return set().union(*(not_finite(value, (*path, key)) for key, value in content.items()))
    if isinstance(content, (list, tuple)):
        return set().union(*(not_finite(value, (*path, k)) for k, value in enumerate(content)))
    return {path} if isinstance(content, float) and not math.isfinite(content) else set()
