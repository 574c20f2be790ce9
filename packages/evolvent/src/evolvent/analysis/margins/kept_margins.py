"""Margins among what is kept of a run, ``hinge 1.margin`` and ``hinge 1.margin_in_run``, and clearances beside them.

The first is the least margin over the travel at rest and needs no run, the second the least one along the run. Both are
those of `evolvent.System.margin`, by the same key `margin` of the case; clearances are of `analysis.kept_clearances`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from evolvent.analysis import kept_clearances, margins
from evolvent.results.kept import Kept, split
from evolvent_base.errors import InputError

if TYPE_CHECKING:
    from evolvent.analysis.margins.evaluation import AtRest
    from evolvent.assembly.assembled import Assembly
    from evolvent.solvers.common.solution import Solution

AT_REST, IN_RUN = "margin", "margin_in_run"
#: Words of each of them.
_WHAT = {AT_REST: "least margin over the travel at rest", IN_RUN: "least margin along the run"}


def others_of(keep: Sequence[str]) -> tuple[str, ...]:
    """Names of `keep` that are neither margins nor clearances."""
    return tuple(name for name in keep if not _is_margin(name) and not kept_clearances.is_clearance(name))


def _is_margin(wanted: str) -> bool:
    coordinate, _, variable = split(wanted)[0].rpartition(".")
    return bool(coordinate) and variable in _WHAT


def _at_rest(assembly: Assembly, section: Mapping[str, Any]) -> AtRest:
    """Margins at rest by the keys of the section `margin`."""
    found: AtRest = margins.evaluation.at_rest(assembly, margins.evaluation.with_keys(section, {}))
    return found


@dataclasses.dataclass(frozen=True, eq=False)
class KeptMargins:
    """The margins and clearances among the names of `keep`.

    Attributes
    ----------
    keep : tuple of str, all names, in order
    others : tuple of str, those that are neither
    at_rest : AtRest, or None where no margin is asked for
    clearances : tuple of str, those that are clearances
    """

    keep: tuple[str, ...]
    others: tuple[str, ...]
    at_rest: AtRest | None
    clearances: tuple[str, ...] = ()

    @classmethod
    def of(cls, assembly: Assembly, section: Mapping[str, Any], keep: Sequence[str]) -> KeptMargins:
        """The margins at rest of an assembled system, where `keep` asks for margins.

        Parameters
        ----------
        section : the key `margin` of the case, empty where it has none
        keep : names, with reductions

        Raises
        ------
        InputError
            As of `evolvent.System.margin`, for a name that is no coordinate's, and for a reduction over time.
        """
        others = others_of(keep)
        clearances = tuple(name for name in keep if kept_clearances.is_clearance(name))
        kept_clearances.check(assembly.parts, clearances)
        asked = [name for name in keep if _is_margin(name)]
        if not asked:
            return cls(tuple(keep), others, None, clearances)
        for wanted in asked:
            name, reduction = split(wanted)
            if reduction:
                raise InputError(f"keep holds {wanted!r}, but {name!r} has no time to reduce; write {name!r}")
        found = cls(tuple(keep), others, _at_rest(assembly, section), clearances)
        if not (section and found.of_run):  # with the key, a run may give what is missing at rest
            found.values(None)
        return found

    @property
    def of_run(self) -> bool:
        """Whether a margin along the run, or a clearance, is asked for."""
        return bool(self.clearances) or any(name.rpartition(".")[2] == IN_RUN for name in self.keep if _is_margin(name))

    @property
    def need_run(self) -> bool:
        """Whether anything is asked for that a run gives."""
        return bool(self.others) or self.of_run or self.at_rest is None

    def values(self, solution: Solution | None) -> dict[str, xr.Variable]:
        """The margins, and the clearances of a run, by name; NaN where it says nothing of a coordinate.

        Raises
        ------
        InputError
            For a resistance that is neither given nor declared to be zero, and a name that is no coordinate's.
        """
        found = {} if solution is None else kept_clearances.values(solution, self.clearances)
        if self.at_rest is None:
            return found
        results = self.at_rest.results(solution if self.of_run else None)
        for wanted in self.keep:
            if not _is_margin(wanted):
                continue
            coordinate, _, variable = wanted.rpartition(".")
            try:
                table = results.at_rest(coordinate) if variable == AT_REST else results.motion(coordinate)
            except InputError as error:
                raise InputError(f"keep holds {wanted!r}; {error}") from None
            value = np.nan if table is None else margins.results.least_of(table)[2]
            found[wanted] = xr.Variable((), value, {"units": "1", "long_name": f"{wanted}: {_WHAT[variable]}"})
        return found

    def without_run(self) -> Kept:
        """What is kept where margins at rest alone are asked for."""
        attrs = {
            "status": "success", "message": "margins at rest need no run", "method": "", "method_reason": "",
            "wall_time_s": 0.0, "compile_time_s": 0.0, "statistics": {},
        }  # fmt: skip
        return Kept(attrs=attrs, variables=self.values(None))

    def added(self, kept: Kept, solution: Solution) -> Kept:
        """What is kept of a run, with margins and clearances; as it is, of a run that has failed."""
        if (self.at_rest is None and not self.clearances) or solution.status == "failed":
            return kept
        both = {**kept.variables, **self.values(solution)}
        return dataclasses.replace(kept, variables={name: both[name] for name in self.keep if name in both})
