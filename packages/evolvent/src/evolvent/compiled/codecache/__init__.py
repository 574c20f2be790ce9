"""The cache of compiled functions: its folder, its files, their keys, and how functions are compiled.

`compiled` and `snapshots` use private interfaces of numba: they are not imported where `compiled.interfaces` finds
that these have changed.
"""

from evolvent.compiled.codecache.folder import (
    BASELINE,
    folder_name,
    is_own,
    is_warm,
    mark_warm,
    sources,
)
from evolvent.compiled.codecache.linked import Linked, names_in

__all__ = [
    "BASELINE", "Linked", "folder_name", "is_own", "is_warm", "mark_warm", "names_in",
    "sources",
]  # fmt: skip
