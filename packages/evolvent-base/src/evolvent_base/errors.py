"""Errors that reach the user as one clear sentence."""

from __future__ import annotations

import contextlib
import difflib
import re
from collections.abc import Iterable, Iterator, Mapping

#: Longest word of a message, and longest message, in characters; what is cut from them.
_LONGEST_WORD, _LONGEST_MESSAGE = 300, 1200


#: Characters of a text that are not seen and change what is seen: of control but for tabs and ends of lines, half
#: characters, those that no XML may hold, and those that turn the direction of writing.
HIDDEN = re.compile("[\0-\x08\x0b-\x1f\x7f-\x84\x86-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]")


def visible(text: str) -> str:
    r"""A text whose hidden characters are written as escapes: what of a file reaches a terminal, XML, HTML or CSV.

    Examples
    --------
    >>> visible("boom\x1b[2J")
    'boom\\x1b[2J'
    """
    return HIDDEN.sub(lambda found: found[0].encode("unicode_escape").decode(), text)


class EvolventError(Exception):
    """Base of all errors that this package raises on purpose; the message is one clear sentence."""

    def __init__(self, message: str = "") -> None:
        super().__init__(visible(abbreviated(message)))

    def _render_traceback_(self) -> list[str]:
        """What IPython shows in place of a traceback: the sentence."""
        return [f"{type(self).__name__}: {self}"]


class InputError(EvolventError):
    """Something that the user wrote cannot be used; the message names it, its value and what is allowed."""


class RunFailed(EvolventError):
    """A run that stopped early; ``run`` holds what was computed so far."""

    def __init__(self, message: str, run: object = None) -> None:
        super().__init__(message)
        self.run = run


def abbreviated(message: str) -> str:
    """A message in which very long values are cut."""
    if len(message) <= _LONGEST_WORD:
        return message
    message = re.sub(rf"\S{{{_LONGEST_WORD},}}", lambda word: f"{word[0][:77]}...{word[0][-1]}", message)
    if len(message) <= _LONGEST_MESSAGE:
        return message
    half = _LONGEST_MESSAGE // 2
    return f"{message[:half]} ... {message[-half:]}"


def reason_of(error: OSError) -> str:
    """What an error of the operating system says, as the end of a sentence."""
    return (error.strerror or str(error)).lower()


def nearest(word: str, known: Iterable[str]) -> str:
    """A closing half sentence with the known word nearest to `word`, or with all of them."""
    words = sorted(set(known))
    if not words:
        return "there is none"
    close = difflib.get_close_matches(word, words, n=1, cutoff=0.5)
    if close:
        return f"did you mean {close[0]!r}?"
    return "known: " + ", ".join(words)


def counted(number: float, one: str, many: str = "") -> str:
    """A number and what it counts, in the singular or plural: "1 value", "2 values"; `many` if no s is added."""
    shown = f"{number:.3g}" if isinstance(number, float) else str(number)
    return f"{shown} {one if shown == '1' else many or one + 's'}"


def in_keys(message: str, keys: Mapping[str, str]) -> str:
    """A message to a Python caller, as one to the author of a case file: arguments become keys, None becomes auto.

    Parameters
    ----------
    message : str, that names arguments in backticks, or as the first word of "argument is value"
    keys : mapping, argument -> key; what is not in it stays. An argument with a dot is a part's, such as
        "reel-*.drive", where * stands for the rest of a part's name; it is found anywhere in the message

    Examples
    --------
    >>> in_keys("step is None; take a smaller `tolerance`, or None", {"step": "solver.step"})
    'solver.step is auto; take a smaller `tolerance`, or auto'
    """
    if not keys:
        return message
    first = re.match(r"(\w+) is ", message)
    if first and first[1] in keys:
        message = keys[first[1]] + re.sub(r"^ is None\b", " is auto", message[len(first[1]) :])
    for argument in (key for key in keys if "." in key):
        pattern = re.escape(argument).replace(r"\*", r"[\w-]+") + ("" if argument.endswith(".") else r"(?![\w-])")
        message = re.sub(rf"(?<![\w.-]){pattern}", keys[argument], message)
    message = re.sub(r"\bor None\b", "or auto", message)
    return re.sub(r"`(\w+)`", lambda found: keys.get(found[1], found[0]), message)


@contextlib.contextmanager
def naming_keys(keys: Mapping[str, str]) -> Iterator[None]:
    """Let errors that are raised inside name keys of a case file in place of Python arguments: see `in_keys`."""
    try:
        yield
    except InputError as error:
        raise InputError(in_keys(str(error), keys)) from error
    except RunFailed as error:
        raise RunFailed(in_keys(str(error), keys), error.run) from error
