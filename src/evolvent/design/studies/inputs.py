"""Files that the cases of a study read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from evolvent import cases
from evolvent.design.studies.axes import Axis
from evolvent.design.studies.stages import Stage


def files_of(
    content: Mapping[str, Any], fixed: Mapping[str, Any], axes: Sequence[Axis], stages: Sequence[Stage]
) -> dict[str, str]:
    """Files that any of the cases reads -> SHA-256 of what they hold (`cases.files_of`)."""
    changes: list[Mapping[str, Any]] = [{}, *(stage.set for stage in stages)]
    for axis in axes:
        words = {repr(one): one for one in axis.values if not isinstance(one, int | float | None)}
        changes += [{axis.path: one} for one in words.values()]
    found: dict[str, str] = {}
    for one in changes:
        found |= cases.files_of(cases.content_of(content, {**fixed, **one}))
    return found
