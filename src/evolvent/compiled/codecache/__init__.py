"""The cache of compiled functions: its folder, its files, their keys, and how functions are compiled."""

from evolvent.compiled.codecache.compiled import Cache, LawCache, compiling, without_path
from evolvent.compiled.codecache.folder import (
    BASELINE,
    COMPILED,
    folder_name,
    is_followed,
    is_warm,
    mark_warm,
    module_name,
    sources,
)
from evolvent.compiled.codecache.snapshots import Linked, names_in, snapshot

__all__ = [
    "BASELINE", "COMPILED", "Cache", "LawCache", "Linked", "compiling", "folder_name", "is_followed", "is_warm",
    "mark_warm", "module_name", "names_in", "snapshot", "sources", "without_path",
]  # fmt: skip
