"""How a system is simulated: the settings of a run, and a run of which values alone are kept."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from evolvent.analysis import runs, trees, variation
from evolvent.analysis.closure import warning_of
from evolvent.analysis.composition import Composition
from evolvent.analysis.margins.kept_margins import KeptMargins
from evolvent.analysis.methods import choose_method
from evolvent.results.kept import check_names, is_of_samples, kept_of, refusal
from evolvent.results.tree import root_of
from evolvent.results.variables import names
from evolvent_base.errors import InputError, RunFailed

if TYPE_CHECKING:
    from evolvent.analysis.margins.kept_margins import KeptMargins
    from evolvent.assembly.assembled import Assembly
    from evolvent.results.fine_samples import Times
    from evolvent.results.kept import Kept
    from evolvent.solvers.common.solution import Solution


def check_kept(assembly: Assembly, keep: Sequence[str], *, method: str = "auto") -> None:
    """Refuse names of `keep` that a simulation will not have; statistics are known after it.

    Raises
    ------
    InputError
    """
    chosen, _ = choose_method(assembly, method)
    check_names(keep, trees.tree(trees.at_start(assembly, chosen), case="", why=""))


def margins_of(system: Composition, assembly: Assembly, keep: Sequence[str]) -> KeptMargins:
    """The names of `keep`, checked for a system, with the margins among them.

    Raises
    ------
    InputError
        For names that its runs will not have.
    """
    if isinstance(keep, str) or not all(isinstance(name, str) for name in keep):
        raise InputError(f"keep is {keep!r}; it must be a list of variables, such as ['hub.rate.z.last']")
    found = KeptMargins.of(assembly, system.sections.get("margin", {}), keep)
    if not system._found.issuperset(found.others):
        check_kept(assembly, found.others)
        system._found.update(found.others)
    return found


def kept(
    system: Composition, keep: Sequence[str], progress: Callable[[float], None] | None, settings: Mapping[str, Any]
) -> Kept:
    """What is kept of a simulation: see `evolvent.System.simulate`."""
    assembly = system._assembled()
    margins = margins_of(system, assembly, keep)
    if not margins.need_run:
        return margins.without_run()
    found, solution, why, times = evaluated(assembly, margins, progress, settings)
    if solution.status == "failed":
        root = times.mark(solution.t)
        run = trees.tree(solution, case=system._case(settings), why=why, title=system.title, root=root)
        raise RunFailed(solution.message, run)
    if found.missing:
        known = names(trees.tree(solution, case="", why=why), over_time=False)
        raise refusal(found.missing[0], [*known, *solution.statistics])
    return found


def kept_of_variant(
    system: Composition, values: Mapping[str, Any], keep: Sequence[str], progress: Callable[[float], None] | None,
    given: Mapping[str, Any],
) -> Kept:  # fmt: skip
    """What is kept of a simulation with other values of some keys; nothing of a run that has failed.

    Parameters
    ----------
    values : as of `evolvent.System.with_values`
    keep : names that runs of the system have
    given : arguments of `evolvent.System.simulate`, None where they are left out

    Raises
    ------
    InputError
        For values that a case would refuse.
    """
    own = variation.with_values(system, values)
    settings = own._run_settings(given)
    assembly = own._assembled()
    margins = KeptMargins.of(assembly, own.sections.get("margin", {}), keep)
    if not margins.need_run:
        return margins.without_run()
    return evaluated(assembly, margins, progress, settings, warns=False)[0]


def evaluated(
    assembly: Assembly, margins: KeptMargins, progress: Callable[[float], None] | None, settings: Mapping[str, Any],
    *, warns: bool = True,
) -> tuple[Kept, Solution, str, Times]:  # fmt: skip
    """What is kept of a run of an assembled system, its solution, why its method is taken, and times of its samples.

    The assembly is of this run alone, which may change its model. Where it `warns` is found if that is asked for.
    """
    fine = settings.get("fine", True) and (margins.of_run or not is_of_samples(assembly, margins.others))
    own = margins.at_rest is None  # which have been found of the assembly
    solution, why, times = runs.solve(assembly, progress=progress, **{**settings, "fine": fine, "own": own})
    found = kept_of(
        solution, margins.others, lambda: root_of(solution, {}), fine=times.is_fine(solution.t), why=why,
        warning=warning_of(solution) if warns and solution.status != "failed" else "",
    )  # fmt: skip
    return margins.added(found, solution), solution, why, times
