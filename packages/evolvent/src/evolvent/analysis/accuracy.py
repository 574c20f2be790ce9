"""Accuracy of runs: the same run with finer or coarser integration, by which the error of its values is found."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from evolvent.analysis import runs
from evolvent.analysis.methods import choose_method
from evolvent.solvers.time.explicit import plan as explicit_plan
from evolvent.solvers.time.implicit import plan as implicit

if TYPE_CHECKING:
    import numpy as np

    from evolvent.assembly.assembled import Assembly

#: Of one level of finer integration: factor of a tolerance, and of a fixed step.
TOLERANCE, STEP = 1e-2, 0.25
#: Settings that say how a run is integrated.
NAMES = ("step", "tolerance", "absolute_tolerance")
#: Smallest tolerance.
LEAST = 1e-13


def settings_at(
    level: float, assembly: Assembly, samples: np.ndarray, settings: Mapping[str, Any]
) -> dict[str, Any]:  # fmt: skip
    """Settings of a run, integrated finer.

    Parameters
    ----------
    level : float, of finer integration: the tolerance times `TOLERANCE`, or the step times `STEP`, to its power; below
        0 of coarser
    samples : (nt,) float, s
    settings : arguments of `evolvent.analysis.runs.plan`; with others, which stay

    Raises
    ------
    InputError
        As of `evolvent.analysis.runs.plan`, where a step that is chosen is asked for.
    """
    found = dict(settings)
    if not level:
        return found
    method, _ = choose_method(assembly, found.get("method", "auto"))
    step, tolerance = found.get("step"), found.get("tolerance")
    adaptive = method == "dopri5" or (method in implicit.METHODS and step is None)
    if adaptive:
        own = implicit.METHODS[method].tolerance if method in implicit.METHODS else explicit_plan.RTOL
        factor = TOLERANCE**level
        found["tolerance"] = max((own if tolerance is None else tolerance) * factor, LEAST)
        if found.get("absolute_tolerance") is not None:
            found["absolute_tolerance"] = max(found["absolute_tolerance"] * factor, LEAST)
        return found
    if step is None:
        own_settings = {name: found[name] for name in ("method", "step", "tolerance") if name in found}
        step = runs.plan(assembly, samples, **own_settings)[0].step
    return found | {"step": STEP**level * step}


def shown(settings: Mapping[str, Any]) -> str:
    """The tolerance or the step of settings in words."""
    if settings.get("step") is not None:
        return f"steps of {settings['step']:.3g} s"
    return f"tolerance {settings['tolerance']:.3g}" if settings.get("tolerance") is not None else ""
