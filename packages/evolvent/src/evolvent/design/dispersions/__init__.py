"""Dispersions: what a study with drawn keys says of its results: bounds, quantiles, sensitivities, worst cases.

`disperse` runs a study (`evolvent.design.studies`) and evaluates it; `evaluate` takes one that was swept before.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import lazy_loader as lazy

if TYPE_CHECKING:
    from evolvent.design.dispersions.answer import Dispersion as Dispersion
    from evolvent.design.dispersions.dispersed import disperse as disperse, evaluate as evaluate

__getattr__, __dir__, __all__ = lazy.attach(
    __name__, submod_attrs={"answer": ["Dispersion"], "dispersed": ["disperse", "evaluate"]}
)
