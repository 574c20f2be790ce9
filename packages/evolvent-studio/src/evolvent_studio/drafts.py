"""What a tab of a browser shows and holds: the case in its form, measurement and calibration, and what is seen."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Mapping
from typing import Any

from evolvent_studio.job import Job

#: What is kept of a measurement, as it is at first.
MEASURED: dict[str, Any] = {
    "files": [], "kind": "springs", "stand": "", "content": {"stand": {"kind": "springs"}}, "columns": {},
}  # fmt: skip
#: What is kept of a calibration, as it is at first: which of its two forms is shown; file, observed variables and
#: fitted keys of the first; of the second, relaxation curves, columns and options.
CALIBRATED: dict[str, Any] = {
    "shown": "keys", "file": "", "observe": [], "fit": [],
    "curves": [], "column": "", "temperature": "", "options": {},
}  # fmt: skip


@dataclasses.dataclass
class Draft:
    """The case in a form.

    Attributes
    ----------
    source : str, "case:NAME" of a built-in one, "file:NAME", '' where it was opened from elsewhere
    about : str
    content : dict
    base : dict, the case that it was before it was changed
    origin : str, the source of that case, '' where there is none
    """

    source: str = ""
    about: str = ""
    content: dict[str, Any] = dataclasses.field(default_factory=dict)
    base: dict[str, Any] = dataclasses.field(default_factory=dict)
    origin: str = ""


@dataclasses.dataclass(frozen=True)
class View:
    """What the page shows beside the panels: nothing, the case's start, runs ("run"), modes, a report of a job, ..."""

    kind: str = ""
    refs: tuple[str, ...] = ()


def view_of(job: Job) -> View:
    """What shows a job."""
    return View(job.sort.view, (f"job:{job.key}",))


def kept(content: Any, first: Mapping[str, Any]) -> dict[str, Any] | None:
    """What was kept of a form; keys that were not kept are as at first. None where it cannot be that of the form.

    Parameters
    ----------
    content : as it was read
    first : what it is at first
    """
    if not isinstance(content, dict):
        return None
    found = {key: content[key] if key in content else copy.deepcopy(value) for key, value in first.items()}
    return found if all(isinstance(found[key], type(value)) for key, value in first.items()) else None


def kept_calibration(content: Any) -> dict[str, Any] | None:
    """What was kept of a calibration, whose rows hold texts; None where it can be none."""
    found = kept(content, CALIBRATED)
    rows = [row for value in (found or {}).values() if isinstance(value, list) for row in value]
    texts = all(isinstance(row, dict) and all(isinstance(text, str) for text in row.values()) for row in rows)
    return found if texts else None
