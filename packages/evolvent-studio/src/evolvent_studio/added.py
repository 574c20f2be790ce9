"""What other packages add to the studio: panels, and kinds of jobs.

An entry point of the group ``evolvent.studio`` names a panel (`evolvent_studio.context.Panel`); its own name is that of
the panel's tab and view. One of the group ``evolvent.studio.jobs`` names a function of a job's folder, the job and a
report of its progress; its own name is the kind of the job.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import TYPE_CHECKING

from evolvent_base import plugins
from evolvent_base.errors import InputError

if TYPE_CHECKING:
    from evolvent_studio.context import Panel

PANELS, JOBS = "evolvent.studio", "evolvent.studio.jobs"


@functools.cache
def panels() -> dict[str, type[Panel]]:
    """Panels by the names of their tabs."""
    return {entry.name: plugins.load(entry, f"the panel {entry.name!r}") for entry in plugins.entry_points(PANELS)}


def job(kind: str) -> Callable[..., None]:
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
