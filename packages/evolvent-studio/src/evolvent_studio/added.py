"""Panels that other packages add to the studio: entry points of the group ``evolvent.studio``.

Each names a panel (`evolvent_studio.context.Panel`); its own name is that of the panel's tab and view.
"""

from __future__ import annotations

import functools

from evolvent_base import plugins
from evolvent_studio.context import Panel

PANELS = "evolvent.studio"


@functools.cache
def panels() -> dict[str, type[Panel]]:
    """Panels by the names of their tabs."""
    return {entry.name: plugins.load(entry, f"the panel {entry.name!r}") for entry in plugins.entry_points(PANELS)}
