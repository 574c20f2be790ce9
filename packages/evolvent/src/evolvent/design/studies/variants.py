"""Many variants of one built structure: values that differ, runs beside one another, what is kept of each.

Every variant has a copy of the arrays of the model, in which its values stand, so runs share nothing that they write.
They are copies of one prepared run (`evolvent.analysis.many_runs`). The compiled time loops let
other threads run; Python code runs on one thread at a time. `benchmarks/batches.py` measures its share of the time:
from 5 % for `solar-array` to 60 % for a body on a spring over 2 s.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from evolvent.analysis import simulation
from evolvent.design.evaluator import pools
from evolvent.design.evaluator.evaluator import Evaluator
from evolvent.design.evaluator.runs import SystemRuns
from evolvent.design.studies import accessor, label  # noqa: F401  (it registers found.ev)
from evolvent_base.errors import InputError, nearest

if TYPE_CHECKING:
    from evolvent.analysis.system import System

#: Arguments of `System.simulate` for the runs.
_SETTINGS = ("until", "every", "fine", "method", "step", "tolerance", "spectral_radius")


def simulate_many(
    system: System, values: Sequence[Mapping[str, Any]] | Mapping[str, Sequence[Any]], keep: Sequence[str], *,
    workers: int | None = None, progress: Callable[[int, int], None] | None = None, **settings: Any,
) -> xr.Dataset:  # fmt: skip
    """Simulate many variants of a structure, on all cores, and keep values of each.

    Parameters
    ----------
    system : System
    values : of every variant, as of `evolvent.System.with_values`: a list of mappings, or a mapping of lists of one
        length
    keep : names of what is kept, as of `evolvent.System.simulate`
    workers : int, threads; left out, one a core
    progress : called with the number of variants that have ended and of all
    settings : until, every, fine, method, step, tolerance and spectral_radius, as of `evolvent.System.simulate`

    Returns
    -------
    xarray.Dataset
        Over ``variant``: what is kept, named as in sweeps (``hinge_1_latch_time_last``), ``status`` and ``reason`` of
        every run, NaN where a run has failed; the keys are coordinates. The bits do not depend on `workers`.

    Raises
    ------
    InputError
        For names that no run has, and settings that concern all variants. What one variant is refused for is its
        ``reason``.

    Examples
    --------
    >>> import evolvent
    >>> array = evolvent.load("solar-array")
    >>> found = evolvent.simulate_many(
    ...     array, {"hinge 1.stiffness": [0.19, 0.2, 0.21]}, ["hinge 1.latch_time.last"]
    ... )  # doctest: +SKIP
    """
    listed, names = _listed(values), tuple(_SETTINGS)
    for name in settings:
        if name not in names:
            raise InputError(f"simulate_many has no argument {name!r}; {nearest(name, names)}")
    if workers is not None and (isinstance(workers, bool) or not isinstance(workers, int) or workers < 1):
        raise InputError(f"workers is {workers!r}; it must be a whole number from 1, or left out")
    margins = simulation.margins_of(system, system._assembled(), keep)
    if not margins.keep:
        raise InputError("keep is empty; name what is kept of every run, such as ['hub.rate.z.last']")
    if margins.need_run:
        system._run_settings(settings)  # refuses what concerns all variants
    runs = SystemRuns(system=system, keep=margins.keep, settings=settings, points=listed)
    workers = min(pools.cores(), len(listed)) if workers is None else workers
    batch = 0 if progress is None else 1
    with Evaluator(runs, workers=workers, batch=batch, progress=progress) as evaluator:
        evaluator.of(listed, numbered=True)
    along = {key: _column([one.get(key) for one in listed]) for key in dict.fromkeys(k for one in listed for k in one)}
    found = label.table(evaluator.table(), ("variant",), (len(listed),))
    return found.assign_coords({key: ("variant", of) for key, of in along.items()})


def _listed(values: Any) -> list[Mapping[str, Any]]:
    """Values of each variant, of a list of mappings, or of a mapping of lists."""
    if isinstance(values, Mapping):
        if any(isinstance(of, str) or not hasattr(of, "__len__") for of in values.values()):
            raise InputError("the values are a mapping; each of its keys must have a list, with an entry a variant")
        sizes = {key: len(of) for key, of in values.items()}
        if len(set(sizes.values())) > 1:
            lengths = ", ".join(f"{key!r} {size}" for key, size in sizes.items())
            raise InputError(f"the lists of values differ in length: {lengths}")
        plain = {key: of.tolist() if isinstance(of, np.ndarray) else list(of) for key, of in values.items()}
        values = [dict(zip(plain, row, strict=True)) for row in zip(*plain.values(), strict=True)]
    if isinstance(values, str) or not hasattr(values, "__iter__"):
        raise InputError(f"the values are {values!r}; they must be a list of mappings, or a mapping of lists")
    listed = list(values)
    if not listed or not all(isinstance(one, Mapping) for one in listed):
        raise InputError("the values must hold a mapping of keys for every variant, such as {'hinge.stiffness': 2.0}")
    return listed


def _column(values: Sequence[Any]) -> np.ndarray:
    """Values of a key over the variants: numbers, NaN where one has its own, or texts."""
    if all(one is None or (isinstance(one, (int, float, np.number)) and not isinstance(one, bool)) for one in values):
        return np.array([np.nan if one is None else float(one) for one in values])
    return np.array(["" if one is None else str(one) for one in values])
