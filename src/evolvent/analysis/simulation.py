"""How a system is simulated: the settings of a run, and a run of which values alone are kept."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from evolvent.base.errors import InputError

if TYPE_CHECKING:
    from evolvent.analysis.system import System
    from evolvent.results.kept import Kept


def settings_of(own: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Settings of a run with what is given in their place, times in seconds.

    Parameters
    ----------
    own : settings of the system
    given : arguments, None where they are left out
    """
    from evolvent import analysis

    method = given.get("method")
    if method is not None and method != own.get("method", method):  # step and tolerances are of another method
        own = {name: value for name, value in own.items() if name in ("until", "every", "fine")}
    settings = {**own, **{name: value for name, value in given.items() if value is not None}}
    if "until" not in settings:
        raise InputError("until is missing; give the end of the run, such as until='20 s'")
    for name in ("until", "every", "step"):
        if name in settings:
            settings[name] = analysis.seconds(name, settings[name])
    return settings


def kept(
    system: System, keep: Sequence[str], progress: Callable[[float], None] | None, settings: Mapping[str, Any]
) -> Kept:
    """What is kept of a simulation: see `evolvent.System.simulate`."""
    from evolvent import analysis
    from evolvent.analysis.margins.kept import KeptMargins

    assembly = system.assemble()
    if isinstance(keep, str) or not all(isinstance(name, str) for name in keep):
        raise InputError(f"keep is {keep!r}; it must be a list of variables, such as ['hub.rate.z.last']")
    margins = KeptMargins.of(assembly, system.sections.get("margin", {}), keep)
    if not system._found.issuperset(margins.others):
        analysis.check_kept(assembly, margins.others)
        system._found.update(margins.others)
    if not margins.need_run:
        return margins.without_run()
    return analysis.simulate_kept(
        assembly, margins, case=lambda: system._case(settings), title=system.title, progress=progress, **settings
    )
