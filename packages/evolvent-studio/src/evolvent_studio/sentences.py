"""Texts of the page on studies."""

from __future__ import annotations

import json

from evolvent_studio.jobview import duration


def names_key(sentence: str, row: str) -> bool:
    """Whether a sentence names a row of the form: a key of the study, or one that varies."""
    key = row.removeprefix("over.")
    return any(text in f"{sentence} " for text in (f"{row} ", f"{row}.", f"'{key}'", f" {key} is "))


def as_sentence(text: str) -> str:
    """A text that starts with a capital letter."""
    return text[:1].upper() + text[1:] if text.partition(" ")[0].isalpha() else text


def cases_text(count: int) -> str:
    """A number of cases in words."""
    return "1 case" if count == 1 else f"{count} cases"


def estimated_text(count: int, content: bytes) -> str:
    """An estimate as a sentence."""
    try:
        found = json.loads(content)
    except ValueError:
        return f"{cases_text(count)}; the estimate was cancelled"
    if "error" in found:
        return str(found["error"])
    each, reasons = found["seconds"], found["reasons"]
    if len(reasons) == found["computed"]:
        return f"{cases_text(count)}; those computed for the estimate failed: {reasons[0]}"
    text = f"{cases_text(count)} of about {duration(each)} each: about {duration(each * count)}"
    return f"{text}; {len(reasons)} of {found['computed']} computed cases failed: {reasons[0]}" if reasons else text
