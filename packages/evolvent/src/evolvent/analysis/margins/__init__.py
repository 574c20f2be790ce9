"""Torque and force margins of mechanisms, from the mechanism that is simulated.

Of every hinge and slide, over its whole travel: what drives and what resists, part by part, the factors of a standard,
and the margin. Each part counts by the virtual power of its force along the direction in which the mechanism moves
there (`mechanism`). Kinetic energy never counts.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import lazy_loader as lazy

if TYPE_CHECKING:
    from evolvent.analysis.margins import evaluation as evaluation, results as results

# imported on first use, which most runs do not need; import locks make this safe on several threads
__getattr__, __dir__, __all__ = lazy.attach(__name__, submodules=["evaluation", "results"])
