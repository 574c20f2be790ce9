"""Runs of many variants of a system, prepared once: every thread has copies of the run, which take their values."""

from __future__ import annotations

import contextlib
import dataclasses
import math
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import xarray as xr

from evolvent.analysis import runs
from evolvent.analysis.batch_parameters import BatchParameters
from evolvent.analysis.closure import check_energy_gain
from evolvent.analysis.copied_results import CopiedResults
from evolvent.analysis.copied_runs import copies_of, prepared
from evolvent.analysis.methods import choose_method
from evolvent.analysis.settings import check_run, sample_times
from evolvent.analysis.start_motion import follows_masses
from evolvent.analysis.storage import storage_of
from evolvent.analysis.varied_run import VariedRun
from evolvent.assembly import families
from evolvent.assembly.variants import Variants
from evolvent.results.fine_samples import Times
from evolvent.results.kept import Kept, is_balance, is_of_part, is_of_samples, kept_of
from evolvent.results.tree import root_of
from evolvent.solvers.common.sizes import energy_floor, round_off_energy, sizes
from evolvent.solvers.time.copies import GOES_ON, HAS_FAILED, Copies
from evolvent.solvers.time.run import FINISHED
from evolvent_base.errors import InputError

if TYPE_CHECKING:
    from evolvent.analysis.composition import Composition
    from evolvent.solvers.common.solution import Solution

Array = np.ndarray
#: Copies that a thread has, at most, and bytes that they may take.
MOST, MOST_BYTES = 64, 50_000_000


class ManyRuns:
    """Runs of variants of a system, of which values are kept.

    Parameters
    ----------
    system : System
    keep : names of what is kept, none of them a margin
    settings : of a run, as of `evolvent.System.simulate`, times in seconds

    Raises
    ------
    InputError
        Where the runs cannot be copies of one: with users' laws, feedback, storage, or threads that are paid out under
        implicit methods.
    """

    def __init__(self, system: Composition, keep: Sequence[str], settings: Mapping[str, Any]) -> None:
        self.keep, options = list(keep), dict(settings)
        own, variants = system.copy(), Variants()
        assembly = own.assemble(variants)
        self._reads_statistics = not all(is_of_part(assembly, name) or is_balance(assembly, name) for name in keep)
        method, self.why = choose_method(assembly, options.pop("method", "auto"))
        if "stability_limit" in keep:
            raise InputError("runs that state what their step follows from are made one by one")
        if assembly.laws or assembly.expressions or families.reacts(assembly.model) or storage_of(own.sections):
            raise InputError("runs with laws of users, feedback or storage are made one by one")
        if follows_masses(own.sections):
            raise InputError("runs that start from a run, or with a spin about the centre of mass, are made one by one")
        samples = sample_times(options.pop("until"), options.pop("every", None), values=assembly.y.size)
        check_run(assembly, samples, options.get("step"))
        fine = options.pop("fine", True) and not is_of_samples(assembly, self.keep)
        self.times = Times.of(samples, fine=fine, values=assembly.y.size)
        options["method"], shared = method, assembly.shared
        plan, _ = runs.plan(dataclasses.replace(assembly, shared=None), self.times.all, **options)
        self.run = prepared(plan)
        self.varied = VariedRun(own, variants, self.run)
        self._shared, self._threads = shared, threading.local()
        weight, mass = sizes(self.run.assembly)
        floor = round_off_energy(self.run.assembly, float(self.times.all[0]))
        self._round_offs = energy_floor(self.run.assembly, mass, weight), floor

    @classmethod
    def of(cls, system: Composition, keep: Sequence[str], settings: Mapping[str, Any]) -> Self | None:
        """The runs of variants of a system; None where they cannot be copies of one, or are to be refused."""
        try:
            return cls(system, keep, settings)
        except InputError:  # where it is to be refused, the runs one by one say why
            return None

    def expect(self, points: Sequence[Mapping[str, Any]]) -> None:
        """Find what follows from the keys of all points at once, by their least and largest values."""
        others = set[str]()
        for key in dict.fromkeys(key for point in points for key in point):
            with contextlib.suppress(InputError):  # of a point, which is then made by itself
                if not self.varied.places(key, [point[key] for point in points if key in point]):
                    others.add(key)
        if others:
            self.varied.together([{key: value for key, value in point.items() if key in others} for point in points])

    def kept(self, points: Sequence[Mapping[str, Any]], check: Callable[[float], None] | None) -> Iterator[Kept | None]:
        """What is kept of variants, in order; None where a variant must be made by itself.

        The attributes of `Kept` have statistics if `keep` names one.

        Parameters
        ----------
        points : values, as of `evolvent.System.with_values`
        check : called from time to time with the time reached; what it raises ends the runs
        """
        copies, parameters, results = self._own()
        for first in range(0, len(points), copies.count):
            some = points[first : first + copies.count]
            refused = parameters.assign(some)
            which = np.array([k for k in range(len(some)) if k not in refused], dtype=np.int64)
            copies.check = check
            copies.place(which, parameters.write)
            copies.run_to_end(which)
            closed = copies.closes(which)
            together, closing = results.of(which[closed]), {*which[closed].tolist()}
            for k in range(len(some)):
                own = None if k in refused else together.get(k)
                yield own if k in refused or own else self._kept_of(copies, parameters, k, closes=k in closing)

    def _own(self) -> tuple[Copies, BatchParameters, CopiedResults]:
        """Copies of this thread, the parameters in which they differ, and the evaluation of their kept values."""
        if not hasattr(self._threads, "own"):
            size = copies_of(self.run, 1, 1).memory.size
            copies = copies_of(self.run, max(1, min(MOST, MOST_BYTES // size)), 1)
            parameters = BatchParameters(self.varied, copies)
            results = CopiedResults(copies, self.varied, parameters, self.keep, self.why, self._shared)
            self._threads.own = copies, parameters, results
        found: tuple[Copies, BatchParameters, CopiedResults] = self._threads.own
        return found

    def _kept_of(self, copies: Copies, parameters: BatchParameters, k: int, *, closes: bool) -> Kept | None:
        """Kept values of a copy that has ended; None if it is refused: its own run then states the reason.

        closes : bool, whether its energy balance closes even without round-off, which is then needed by statistics only
        """
        alone = closes and not self._reads_statistics
        solution = self._solution(copies, parameters, k, (0.0, 0.0) if alone else None)
        fine = self.times.is_fine(solution.t)
        try:
            found = kept_of(solution, self.keep, lambda: root_of(solution, {}), fine=fine, why=self.why)
        except InputError:
            return None
        attrs = {**found.attrs, "statistics": {}} if alone else found.attrs
        variables = {k: _copy(one) if one.ndim else one for k, one in found.variables.items()}
        return dataclasses.replace(found, attrs=attrs, variables=variables)

    def _solution(
        self, copies: Copies, parameters: BatchParameters, k: int, round_offs: tuple[float, float] | None
    ) -> Solution:  # fmt: skip
        """Solution of a copy; round_offs : energies (J), as of `Solution`, that replace those of its run, or None."""
        copies.round_offs = round_offs
        one, status = copies.of(k), int(copies.status[k])
        if round_offs is not None:
            one.round_offs = round_offs
        elif k not in parameters.planned:  # then these are those of the run as well
            one.round_offs = self._round_offs
        one.assembly = dataclasses.replace(one.assembly, parts=dict(parameters.parts(k)), shared=self._shared)
        ending = FINISHED if status == GOES_ON else one.stopped()
        if status == HAS_FAILED:
            ending = ("failed", copies.reasons[k])
        found = one.result(*ending, wall_time=math.nan).or_start(float(self.times.all[0]))
        return check_energy_gain(self.times.chosen(found)[0])


def _copy(values: xr.Variable) -> xr.Variable:
    """A variable with memory of its own, beside that of the copies, which take other values."""
    return xr.Variable(values.dims, np.array(values.values), values.attrs)
