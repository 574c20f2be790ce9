"""Analyses of a system: the method is chosen from its parts, the run becomes a tree of named results."""

from __future__ import annotations

from typing import TYPE_CHECKING

import lazy_loader as lazy

if TYPE_CHECKING:
    from evolvent.analysis import clearance as clearance

# imported on first use, which most runs do not need; import locks make this safe on several threads
__getattr__, __dir__, __all__ = lazy.attach(__name__, submodules=["clearance"])
