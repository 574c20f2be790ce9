"""Errors that reach the user as one clear sentence."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class EvolventError(Exception):
    """Base of all errors that this package raises on purpose; the message is one clear sentence."""


class InputError(EvolventError):
    """Something that the user wrote cannot be used; the message names it, its value and what is allowed."""


class RunFailed(EvolventError):
    """A run that stopped early; ``run`` holds what was computed so far."""

    def __init__(self, message: str, run: object = None) -> None:
        super().__init__(message)
        self.run = run


def nearest(word: str, known: Iterable[str]) -> str:
    """A closing half sentence with the known word nearest to `word`, or with all of them."""
    words = sorted(known)
    if not words:
        return "there is none"
    close = difflib.get_close_matches(word, words, n=1, cutoff=0.5)
    if close:
        return f"did you mean {close[0]!r}?"
    return "known: " + ", ".join(words)
