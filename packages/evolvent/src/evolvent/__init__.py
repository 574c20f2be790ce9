"""evolvent: a package for simulating how cables, booms, ribs, blades and panels deploy from spacecraft."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from evolvent_base import __version__ as __version__
from evolvent_base.errors import EvolventError, InputError, RunFailed

if TYPE_CHECKING:
    from evolvent import parts
    from evolvent.analysis.stepper import Stepper
    from evolvent.analysis.system import System
    from evolvent.compiled.laws import law
    from evolvent.design.dispersions import disperse
    from evolvent.design.optimization import optimize
    from evolvent.design.studies import simulate_many, sweep
    from evolvent.elements.inertia import SectionInertia
    from evolvent.elements.materials import ALUMINIUM, CFRP, KAPTON, STEEL, Material
    from evolvent.elements.sections import General, Lenticular, SectionStiffness, Taper, TapeSection
    from evolvent.elements.shapes import Angle, Arc, Circle, IBeam, Rectangle, Strip, Tube
    from evolvent.results import open, save  # noqa: A004  (evolvent.open is the public name)

__all__ = [
    "ALUMINIUM",
    "CFRP",
    "KAPTON",
    "STEEL",
    "Angle",
    "Arc",
    "Circle",
    "EvolventError",
    "General",
    "IBeam",
    "InputError",
    "Lenticular",
    "Material",
    "Rectangle",
    "RunFailed",
    "SectionInertia",
    "SectionStiffness",
    "Stepper",
    "Strip",
    "System",
    "TapeSection",
    "Taper",
    "Tube",
    "disperse",
    "law",
    "load",
    "open",
    "optimize",
    "parts",
    "run",
    "save",
    "simulate_many",
    "sweep",
]

#: Public names that are loaded when they are first asked for, so that importing the package stays quick.
_LAZY = {
    **dict.fromkeys(("ALUMINIUM", "CFRP", "KAPTON", "STEEL", "Material"), "evolvent.elements.materials"),
    **dict.fromkeys(
        ("Angle", "Arc", "Circle", "General", "IBeam", "Lenticular", "Rectangle", "SectionStiffness", "Strip"),
        "evolvent.elements.sections",
    ),
    **dict.fromkeys(
        ("Taper", "TapeSection", "Tube"),
        "evolvent.elements.sections",
    ),
    "SectionInertia": "evolvent.elements.inertia",
    "Stepper": "evolvent.analysis.stepper",
    "System": "evolvent.analysis.system",
    "law": "evolvent.compiled.laws",
    "open": "evolvent.results",
    "save": "evolvent.results",
    "disperse": "evolvent.design.dispersions",
    "optimize": "evolvent.design.optimization",
    "simulate_many": "evolvent.design.studies",
    "sweep": "evolvent.design.studies",
}


def __getattr__(name: str) -> Any:
    if name == "parts":
        return importlib.import_module("evolvent.parts")
    if name in _LAZY:
        if name == "open":  # of whose runs `run.ev` is an attribute
            importlib.import_module("evolvent.analysis.accessor")
        return getattr(importlib.import_module(_LAZY[name]), name)
    raise AttributeError(f"module 'evolvent' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])


def load(case: Any, overrides: Mapping[str, Any] | None = None) -> System:
    """The system of a case, to be changed, simulated or analysed part by part.

    Parameters
    ----------
    case, overrides : as of `run`

    Returns
    -------
    System
        Its `simulate` takes what the case says where an argument is left out.

    Raises
    ------
    InputError
        If the case cannot be used, or its system has no parts of its own.

    Examples
    --------
    >>> import evolvent
    >>> system = evolvent.load("boom-slew")  # doctest: +SKIP
    >>> system.simulate().ev.plot("boom.tip_deflection")  # doctest: +SKIP
    """
    from evolvent import cases  # importing the package stays quick

    loaded = cases.load(case, overrides)
    definition = cases.system(loaded.system)
    system: System = definition.system(loaded)
    return system


def run(
    case: Any,
    overrides: Mapping[str, Any] | None = None,
    *,
    laws: Mapping[str, Any] | None = None,
    progress: Callable[[float], None] | None = None,
) -> Any:
    """Run a case and return its results.

    Parameters
    ----------
    case : str, path, mapping or a system's Case
        Name of a built-in case (`evolvent list` shows them), a YAML file, or a case's content.
    overrides : mapping, dotted key -> value, put in place of the case's own (``{"blade.nodes": 40}``)
    laws : mapping, optional, name -> law or (law, parameters)
        Laws of the user's that the system knows how to apply; see its module's ``run``.
    progress : called with the time reached (s), a few times a second; left out, a run that takes longer than 2 s prints
        lines with the time left on stderr

    Returns
    -------
    xarray.DataTree
        One group a part; times, balances and quantities of the system's field at the root (of some systems a Dataset
        with these alone). Every variable has its units. Its attribute ``status`` is "success", "stopped by event" or
        "interrupted".

    Raises
    ------
    InputError
        If the case or a law cannot be used; the message is one sentence.
    RunFailed
        If the run did not reach its end; ``.run`` holds what was computed.

    Examples
    --------
    >>> import evolvent
    >>> run = evolvent.run("heliogyro", {"blade.segments": "inextensible", "solver.method": "dopri5"})
    >>> float(run.body_rate[-1])  # doctest: +SKIP
    """
    from evolvent import cases  # importing the package stays quick
    from evolvent_base.progress import on_stderr  # importing the package stays quick

    if progress is not None and not callable(progress):
        raise InputError(f"progress is {progress!r}; it must be a function of the time reached")
    loaded = cases.load(case, overrides)
    plan = cases.system(loaded.system).plan(loaded, laws=laws)
    with on_stderr(plan.duration) as shown:
        results = plan.run(shown if progress is None else progress)
    if results.attrs["status"] == "failed":
        raise RunFailed(results.attrs["message"], results)
    return results
