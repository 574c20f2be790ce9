"""Kinds of jobs that other packages add: entry points of the group ``evolvent.studio.jobs``.

Each names a function of a job's folder, the job and a report of its progress; its own name is the kind of the job.
"""

from __future__ import annotations

from collections.abc import Callable

from evolvent_base import plugins
from evolvent_base.errors import InputError

JOBS = "evolvent.studio.jobs"


def computation(kind: str) -> Callable[..., None]:
    """What computes a kind of job.

    Raises
    ------
    InputError
        If no package that is installed does.
    """
    for entry in plugins.entry_points(JOBS):
        if entry.name == kind:
            found: Callable[..., None] = plugins.load(entry, f"the job {kind!r}")
            return found
    raise InputError(f"no package that is installed computes jobs of the kind {kind!r}")
