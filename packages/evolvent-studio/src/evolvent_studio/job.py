"""A job of the queue: what it is, how far it is, and what of it is kept."""

from __future__ import annotations

import dataclasses
import re
import time
from collections import deque
from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BaseModel, Field, ValidationError

from evolvent_studio.jobkinds import KINDS, Kind

#: What a job is called that this installation has not queued, and why it does not start.
NOT_STARTED, FOREIGN = "not started", "queued by another installation"
#: Seconds over which the speed is taken that the time left follows from.
_WINDOW = 15.0
#: States of a job that is still to end.
OPEN = ("waiting", "running")
#: How a job may have ended.
_ENDED = ("success", "stopped by event", "interrupted", "failed")
_KEY = re.compile(r"\d{4}-[\w-]{1,60}", re.ASCII)
#: What is kept of a job.
KEPT = ("key", "kind", "title", "status", "message", "reached", "end", "elapsed", "extra", "digest")
_Cell = str | float | int | None


class _Extra(BaseModel, strict=True):
    """What is shown of a job that this installation has not queued; anything else of `Job.extra` is left out."""

    date: str = ""
    head: list[str] = []
    rows: list[list[_Cell]] = []
    warnings: list[str] = []
    notes: list[str] = []
    of: str = ""
    changes: list[Annotated[list[str], Field(min_length=2, max_length=2)]] | None = None
    before: int = 0
    since: list[Annotated[list[str], Field(min_length=2, max_length=2)]] | None = None
    modes: list[list[float]] = []
    limits: Annotated[list[int], Field(max_length=2)] = []
    unstated: list[str] = []


class _Content(BaseModel, strict=True, allow_inf_nan=False):
    """A job as the queue's file holds it."""

    key: str
    kind: str
    title: str
    status: str
    message: str = ""
    reached: float = 0.0
    end: float = 0.0
    elapsed: float = 0.0
    extra: _Extra = _Extra()
    digest: str = ""


@dataclasses.dataclass
class Job:
    """One piece of work.

    Attributes
    ----------
    key : str, name of its folder
    kind : a key of `KINDS`
    title : str
    status : "waiting", "running", "cancelling", or how it ended: "success", "stopped by event", "interrupted", "failed"
    message : str
    note : str, what it does before its progress is known
    reached, end : float, s or cases
    elapsed : float, s, that it took or takes
    extra : when it was added ("date"), and what a job of its kind has: the case that it is a change of and what
        differs, the run before it and what differs from that, signals, head and rows of a table, warnings, modes,
        limits that are met and all of them, a coordinate and its resistances that are neither given nor zero
    digest : str, SHA-256 of its case
    own : bool, whether this installation has queued it
    """

    key: str
    kind: str
    title: str
    status: str = "waiting"
    message: str = ""
    note: str = ""
    reached: float = 0.0
    end: float = 0.0
    elapsed: float = 0.0
    extra: dict[str, Any] = dataclasses.field(default_factory=dict)
    digest: str = ""
    own: bool = True
    marks: deque[tuple[float, float]] = dataclasses.field(default_factory=deque, repr=False)

    @property
    def sort(self) -> Kind:
        """What is known of its kind."""
        return KINDS[self.kind]

    @property
    def open(self) -> bool:
        """Whether it is still to end."""
        return self.status in (*OPEN, "cancelling")

    @property
    def is_warning(self) -> bool:
        """Whether its message warns, of a job that did not fail, or its run misses a limit."""
        missed = self.limits is not None and self.limits[0] < self.limits[1]
        return (bool(self.message) and (self.kind in ("disperse", "reflector") or "below 0" in self.message)) or missed

    @property
    def limits(self) -> tuple[int, int] | None:
        """How many limits of its case its run meets, and how many there are; None without any."""
        found = self.extra.get("limits")
        return (int(found[0]), int(found[1])) if isinstance(found, list) and len(found) == 2 else None

    @property
    def share(self) -> float:
        """How far it is, from 0 to 1."""
        return min(max(self.reached / self.end, 0.0), 1.0) if self.end > 0.0 else 0.0

    @property
    def left(self) -> float | None:
        """Seconds that it will still take at its speed of late; None while nothing is known."""
        if len(self.marks) < 2:
            return None
        (t0, x0), (t1, x1) = self.marks[0], self.marks[-1]
        return (self.end - x1) * (t1 - t0) / (x1 - x0) if x1 > x0 and t1 - t0 > 0.3 else None

    def mark(self, reached: float, end: float) -> None:
        """Note how far it is now."""
        now = time.monotonic()
        self.reached, self.end, self.note = reached, end, ""
        self.marks.append((now, reached))
        while len(self.marks) > 2 and now - self.marks[0][0] > _WINDOW:
            self.marks.popleft()

    def content(self) -> dict[str, Any]:
        """What is kept of it."""
        return {name: getattr(self, name) for name in KEPT}


def kept_job(content: Mapping[str, Any], *, own: bool) -> Job | None:
    """A job as it was kept, None where it is none.

    Parameters
    ----------
    own : bool, whether this installation has queued it
    """
    try:
        checked: Any = content if own else _Content.model_validate(content).model_dump(exclude_unset=True)
        job = Job(**{name: checked[name] for name in KEPT if name in checked}, own=own)
    except (ValidationError, TypeError):
        return None
    if not _KEY.fullmatch(job.key) or job.kind not in KINDS:
        return None
    if not own and job.status not in _ENDED:
        job.status, job.message = NOT_STARTED, FOREIGN
    elif job.status in ("running", "cancelling"):  # the studio was killed meanwhile
        job.status = "waiting"
    return job
