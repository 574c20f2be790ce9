"""Prony series fitted to relaxation curves: force over time at a position that is held, at one or more temperatures."""

from __future__ import annotations

from typing import TYPE_CHECKING

import lazy_loader as lazy

if TYPE_CHECKING:
    from evolvent.design.calibration.relaxation.answer import Relaxation as Relaxation
    from evolvent.design.calibration.relaxation.fit import fit_relaxation as fit_relaxation

__getattr__, __dir__, __all__ = lazy.attach(
    __name__, submod_attrs={"answer": ["Relaxation"], "fit": ["fit_relaxation"]}
)
