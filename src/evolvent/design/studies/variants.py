"""Many variants of one built structure: values that differ, runs beside one another, what is kept of each.

Every variant has a copy of the arrays of the model, in which its values stand, so runs share nothing that they write.
The compiled time loops let other threads run; what is left to Python, a fifth to a tenth of a short run, takes turns.
"""

from __future__ import annotations

import concurrent.futures
import threading
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from evolvent.analysis import simulation
from evolvent.base.errors import InputError, nearest
from evolvent.design.studies import accessor, record  # noqa: F401  (it registers found.ev)
from evolvent.results.kept import Kept

if TYPE_CHECKING:
    from evolvent.analysis.system import System

#: Threads beyond which Python's share of short runs keeps others waiting; processes then serve better.
MOST_THREADS = 4
#: Arguments of `System.simulate` for the runs.
_SETTINGS = ("until", "every", "fine", "method", "step", "tolerance", "spectral_radius")


def simulate_many(
    system: System, values: Sequence[Mapping[str, Any]] | Mapping[str, Sequence[Any]], keep: Sequence[str], *,
    workers: int | None = None, progress: Callable[[int, int], None] | None = None, **settings: Any,
) -> xr.Dataset:  # fmt: skip
    """Simulate many variants of a structure, as `evolvent.System.simulate_many` does.

    Parameters
    ----------
    system : System
    values, keep, workers, progress, settings : as of `evolvent.System.simulate_many`

    Returns
    -------
    xarray.Dataset
        As of `evolvent.System.simulate_many`.

    Raises
    ------
    InputError
        As of `evolvent.System.simulate_many`.
    """
    from evolvent.design.studies.runner import cores

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
    workers = min(cores(), MOST_THREADS) if workers is None else workers
    found = runs(system, listed, margins.keep, workers=workers, given=settings, progress=progress)
    outcomes = [record.outcome(k, one, margins.keep) for k, one in enumerate(found)]
    record.check_kept(outcomes)
    return _dataset(listed, record.table(outcomes))


def runs(
    system: System, values: Sequence[Mapping[str, Any]], keep: Sequence[str], *, workers: int = 1,
    given: Mapping[str, Any] | None = None, progress: Callable[[int, int], None] | None = None,
) -> list[Kept | Exception]:  # fmt: skip
    """What is kept of the runs of variants, in order, or why there is none; the same bits for any number of workers.

    Parameters
    ----------
    values : of each variant, as of `evolvent.System.with_values`
    keep : names that the runs of the system have
    workers : threads
    given : arguments of `evolvent.System.simulate`
    progress : called with the number of runs that have ended and of all

    Raises
    ------
    KeyboardInterrupt
        If the user ended the runs.
    """
    found: list[Any] = [None] * len(values)
    stop, waiting = threading.Event(), iter(range(len(values)))

    def check(_: float = 0.0) -> None:
        if stop.is_set():
            raise KeyboardInterrupt

    def compute(k: int) -> int:
        try:
            found[k] = simulation.kept_of_variant(system, values[k], keep, check, given or {})
        except Exception as error:  # noqa: BLE001  (whatever a run raises is the reason that is recorded)
            found[k] = error
        if isinstance(found[k], Kept) and found[k].attrs["status"] == "interrupted":
            raise KeyboardInterrupt
        return k

    def report(done: int) -> None:
        if progress is not None:
            progress(done, len(values))

    if workers == 1 or len(values) == 1:
        for k in waiting:
            compute(k)
            report(k + 1)
        return found
    for k in waiting:  # what all share is found by the first run, and functions are compiled
        report(compute(k) + 1)
        break
    with concurrent.futures.ThreadPoolExecutor(workers, thread_name_prefix="evolvent-variant") as pool:
        try:
            for done, one in enumerate(concurrent.futures.as_completed(pool.submit(compute, k) for k in waiting)):
                one.result()
                report(done + 2)
        except BaseException:
            stop.set()
            pool.shutdown(wait=True, cancel_futures=True)
            raise
    return found


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


def _dataset(values: Sequence[Mapping[str, Any]], rows: record.Table) -> xr.Dataset:
    """What is kept of all variants over ``variant``, with the values of their keys."""
    over = ("variant",)
    data = {
        "status": xr.Variable(over, np.array(rows.status), {"long_name": "how the run ended"}),
        "reason": xr.Variable(over, np.array(rows.reason), {"long_name": "why the run failed"}),
    }
    for name, column in rows.columns.items():
        data[name] = xr.Variable((*over, *column.dims), column.values, dict(column.attrs))
    keys = dict.fromkeys(key for one in values for key in one)
    along = {key: xr.Variable(over, _column([one.get(key) for one in values])) for key in keys}
    for dim, one in rows.coordinates.items():
        if one.common:
            along[dim] = xr.Variable((dim,), one.values, dict(one.attrs))
    return xr.Dataset(data, along)


def _column(values: Sequence[Any]) -> np.ndarray:
    """Values of a key over the variants: numbers, NaN where one has its own, or texts."""
    if all(one is None or (isinstance(one, (int, float, np.number)) and not isinstance(one, bool)) for one in values):
        return np.array([np.nan if one is None else float(one) for one in values])
    return np.array(["" if one is None else str(one) for one in values])
