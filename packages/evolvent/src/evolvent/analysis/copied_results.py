"""Kept values of copies of a run, evaluated for many copies together if they depend on the states alone."""

from __future__ import annotations

import ctypes
import dataclasses
import functools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from evolvent.analysis.batch_parameters import WORD, BatchParameters
from evolvent.analysis.varied_run import VariedRun
from evolvent.assembly import needs
from evolvent.equations.sampling import evaluate_samples_of_copies
from evolvent.model.family import EXTREMES
from evolvent.results.kept import Kept, is_balance, is_local, kept_of, reduced_values, split
from evolvent.results.observe.view import View
from evolvent.results.tree import root_of
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.time.copies import Copies
from evolvent.solvers.time.run import FINISHED
from evolvent_base.errors import InputError

Array = np.ndarray
#: Smallest number of copies that are evaluated together, and largest number of their samples.
LEAST_COPIES, MOST_SAMPLES = 2, 10_000
#: Stored quantities of samples that few results need; values that need them are evaluated copy by copy.
_LEFT_OUT = ("acceleration", "la", "points")


class CopiedResults:
    """Kept values of copies that have ended.

    Parameters
    ----------
    copies : Copies
    varied, parameters : VariedRun and BatchParameters, the parameters in which copies differ
    keep : names of the values that are kept
    why : str, why the method was taken
    shared : what variants share (`Assembly.shared`)

    Attributes
    ----------
    copies : Copies
    model : Model, to which the values of a copy are written before it is evaluated
    which : (k,) int, copies whose samples are evaluated together
    values : fields of records at these samples, by solution and families

    Notes
    -----
    The samples of all copies form one solution, and compiled code evaluates each sample with the model of its copy.
    This is correct if Python code reads nothing of a copy but its samples. It is verified by further evaluations, which
    must give the same bits: with NaN for all numbers in which models of copies differ, with the parts of other copies,
    and with NaN for the samples of the first copy. Events of copies cannot be read.
    """

    def __init__(
        self, copies: Copies, varied: VariedRun, parameters: BatchParameters, keep: Sequence[str], why: str, shared: Any
    ) -> None:  # fmt: skip
        self.copies, self._varied, self._parameters, self._why = copies, varied, parameters, why
        self._shared = shared
        self._keep = {name: split(name) for name in keep}
        self._names = [*dict.fromkeys(name for name, _ in self._keep.values())]
        self._is_local = is_local(copies.run.assembly, keep) and all(how for _, how in self._keep.values())
        self.which, self.values = np.zeros(0, dtype=np.int64), dict[tuple[int, tuple[str, ...]], Array]()
        self._balances = any(is_balance(copies.run.assembly, name) for name in keep)
        self._is_of_states, self._proven, self._ended = True, -1, 0
        self._words = [*_words_of(copies)]
        self.model = copies.run.model.copy()
        needs.note_alike(copies.run.model, self.model)
        ends = {how for _, how in self._keep.values()} <= {"first", "last"}
        count = copies.run.plan.times.size
        self._at = np.unique([0, count - 1]) if ends else np.arange(count)

    @functools.cached_property
    def moves(self) -> Array:
        """Memory that is copied from a copy to `model`, (n, 3) int, as of `evaluate_samples_of_copies`.

        Its places are taken from a copy that has ended, since others may not have been placed.
        """
        one = self.copies.memory.views(self.copies.blocks[self._ended])["model"]
        found = np.array(self.model.moves(one), dtype=np.int64).reshape(-1, 3)
        assert np.all(found[:, 1])
        assert not np.any(found[:, 2] % WORD)
        found[:, 1] -= self._ended * self.copies.memory.size
        found[:, 2] //= WORD
        return found

    def of(self, which: Array) -> dict[int, Kept]:
        """Kept values of copies that have ended with success.

        Parameters
        ----------
        which : (k,) int, numbers of the copies

        Returns
        -------
        dict
            Kept values by number of the copy, without statistics. Copies that are missing must be evaluated by the
            caller.
        """
        if not self._is_local or not which.size:
            return {}
        self._ended = int(which[0])
        found, size = dict[int, Kept](), max(LEAST_COPIES, MOST_SAMPLES // self._at.size)
        for first in range(0, which.size, size):
            some = which[first : first + size]
            together = self._kept_of_all(some)
            own = ((k, self._kept_of_one(k)) for k in some.tolist()) if together is None else together.items()
            found |= {k: one for k, one in own if one is not None}
        return found

    def _kept_of_one(self, k: int) -> Kept | None:
        """Kept values of one copy, with its own model and parts; None if they are refused."""
        for to, of, size in self.moves.tolist():
            ctypes.memmove(to, of + k * self.copies.memory.size, WORD * size)
        own = self._solution(np.array([k]), *self.copies.events(k))
        assembly = dataclasses.replace(
            own.assembly, model=self.model, parts=dict(self._parameters.parts(k)), shared=self._shared
        )
        own.assembly, own.captures, own.measured = assembly, (), {}
        none = np.zeros(own.t.size, dtype=bool)
        try:
            found = kept_of(own, [*self._keep], lambda: root_of(own, {}), fine=none, why=self._why)
        except InputError:
            return None
        variables = {name: xr.Variable(one.dims, one.values.copy(), one.attrs) for name, one in found.variables.items()}
        return dataclasses.replace(found, variables=variables)

    def _kept_of_all(self, which: Array) -> dict[int, Kept] | None:
        """Kept values of copies by one evaluation; None if they depend on more than the states."""
        if which.size < LEAST_COPIES or not self._is_of_states:
            return None
        solution, self.which, self.values = self._solution(which), which, {}
        found = self._variables(solution)
        self._is_of_states = found is not None and self._depends_on_states_alone(which, solution, found)
        if found is None or not self._is_of_states:
            return None
        return dict(zip(which.tolist(), self._split(found, which.size), strict=True))

    def _solution(self, which: Array, event_times: Any = None, event_kinds: Any = None) -> Solution:
        """One solution with the samples of all copies, copy by copy; events are given for a single copy only."""
        copies, run, (status, message) = self.copies, self.copies.run, FINISHED
        left_out = () if event_times is not None else _LEFT_OUT if self._balances else (*_LEFT_OUT, "momenta")
        at = np.repeat(self._at[None], which.size, axis=0)
        own = copies.kept_samples(which, at, run.model, without=left_out)
        if own["kept"] is not None:
            own["kept"] = own["kept"]._replace(**dict.fromkeys(left_out, _UNKNOWN))
        return Solution(
            assembly=run.assembly,
            method=run.plan.method,
            t=np.tile(run.plan.times[self._at], which.size),
            status=status,
            message=message,
            statistics={},
            event_times=_UNKNOWN if event_times is None else event_times,
            event_kinds=_UNKNOWN if event_kinds is None else event_kinds,
            captures=_UNKNOWN,
            measured=_UNKNOWN,
            wall_time=math.nan,
            compile_time=run.compile_time,
            **own,
        )

    def _variables(self, solution: Solution) -> Kept | None:
        """Variables over the samples of all copies; None if they cannot be evaluated."""
        try:
            found = kept_of(
                solution,
                self._names,
                lambda: root_of(solution, {}),
                fine=np.zeros(solution.t.size, dtype=bool),
                why=self._why,
                view_of=functools.partial(_CopiesView, self),
            )
        except Exception:  # noqa: BLE001  (NaN may cause any error)
            return None
        if found.missing or any(one.dims[:1] != ("time",) for one in found.variables.values()):
            return None
        return found

    def _is_unchanged(self, solution: Solution, found: Kept, other: Mapping[str, Any]) -> bool:
        """Whether variables have the same bits with another model or other parts (`other`) of the assembly."""
        again = self._variables(dataclasses.replace(solution, assembly=dataclasses.replace(solution.assembly, **other)))
        return again is not None and _bits(again) == _bits(found)

    def _depends_on_states_alone(self, which: Array, solution: Solution, found: Kept) -> bool:
        """Whether variables depend on the states of each copy alone; only differences that are new are tested."""
        if self._has_new_differences(which) and not self._is_unchanged(
            solution, found, {"model": self._model_with_nan()}
        ):
            return False
        if self._proven == len(self._varied.parts):
            return True
        self._proven, count = len(self._varied.parts), self._at.size
        if not all(self._is_unchanged(solution, found, {"parts": dict(one)}) for one in self._varied.parts):
            return False
        behind = self._variables(_with_nan_before(self._solution(which), count))
        return behind is not None and _bits(behind, count) == _bits(found, count)

    def _has_new_differences(self, which: Array) -> bool:
        """Whether models of copies differ from that of the run in numbers in which no copy has differed before."""
        grown = False
        for one in self._words:
            own = one.of[which]
            differ = np.any(own != one.nominal, axis=0)
            if np.any(differ & ~one.differ):
                grown = True
                one.differ[:] |= differ
                last = len(own) - 1 - np.argmax((own != one.nominal)[::-1], axis=0)
                one.other[differ] = own[last, np.arange(last.size)][differ]
        return grown

    def _model_with_nan(self) -> Any:
        """A model with NaN for all floats in which copies have differed; such integers have the value of one copy."""
        model = self.copies.run.model.copy()
        needs.note_alike(self.copies.run.model, model)
        for one in self._words:
            words = np.where(one.is_float & one.differ, _NAN, one.other)
            value = np.atleast_1d(np.asarray(getattr(model, one.name)))
            np.ndarray(words.shape, np.int64, value.data)[:] = words
        return model

    def _split(self, found: Kept, count: int) -> Iterable[Kept]:
        """Kept values of each of `count` copies."""
        t, size = self.copies.run.plan.times[self._at], self._at.size
        kept: list[dict[str, xr.Variable]] = [{} for _ in range(count)]
        for wanted, (name, how) in self._keep.items():
            own = found.variables[name]
            extremes = own.attrs.get(EXTREMES)
            attrs_of_all = {key: value for key, value in own.attrs.items() if key != EXTREMES}
            for k, variables in enumerate(kept):
                over = None if extremes is None else extremes[..., k]
                values, attrs = reduced_values(own.values[k * size : (k + 1) * size], attrs_of_all, how, name, t, over)
                variables[wanted] = xr.Variable(own.dims[1:], values, attrs)
        along = {dim: one for dim, one in found.coordinates.items() if dim != "time"}
        for variables in kept:
            yield dataclasses.replace(found, variables=variables, coordinates=along)


class _CopiesView(View):
    """View of a solution with the samples of several copies.

    Parameters
    ----------
    results : CopiedResults
    solution, given : as of `View`
    """

    is_of_copies = True

    def __init__(self, results: CopiedResults, solution: Solution, **given: Any) -> None:
        super().__init__(solution, **given)
        self._of = results

    def _extremes(self, family: str) -> Array:
        """As of all views, for each copy: (n, 2 m, k)."""
        copies, of = self._of.copies, super()._extremes(family)
        place = copies.memory.places["model", family]
        strides = (copies.blocks.strides[0], place.dtype.itemsize)
        rows = np.ndarray((len(copies.blocks), len(of)), place.dtype, copies.blocks.data, place.offset, strides)
        found = np.moveaxis(rows[EXTREMES][self._of.which], 0, -1)
        finite = np.isfinite(found)
        if np.any(finite != finite[..., :1]):
            raise LookupError("extremes are known for some copies only")
        return found

    def _model_apart(self) -> Any:
        """As of all views: the model to which the values of each copy are written."""
        return self._of.model

    def _evaluate(
        self, s: Array, la: Array, factors: Array, model: Any, fields: tuple[Any, Array], values: Array
    ) -> None:  # fmt: skip
        """As of all views, with the model of each copy."""
        of, key = self._of, (id(self.solution.y), tuple(fields[0].families))
        if key not in of.values:
            times, size = self.t[: self.t.size // of.which.size], of.copies.memory.size
            needs.load(model, evaluate_samples_of_copies)
            evaluate_samples_of_copies(
                of.which, size, times, self.y, s, la, factors, of.moves, model, fields[1], values
            )
            of.values[key] = values.copy()
        values[:] = of.values[key]


class _Unknown:
    """Placeholder for a quantity that several copies do not share: any use raises an exception."""

    def _refuse(self, *_: Any) -> Any:
        raise LookupError("several copies do not share this quantity")

    __getattr__ = __getitem__ = __len__ = __iter__ = __array__ = __eq__ = __ne__ = __bool__ = _refuse
    __hash__ = None  # type: ignore[assignment]


_UNKNOWN: Any = _Unknown()
#: Bits of NaN.
_NAN = int(np.array(np.nan).view(np.int64))


class _Words(NamedTuple):
    """An array of the models of copies, as 64-bit words.

    Attributes
    ----------
    name : str
    of : (count, n) int, words of each copy
    nominal : (n,) int, words of the run
    other : (n,) int, words of a copy where copies have differed from the run, else those of the run
    is_float : (n,) bool, whether words are floats
    differ : (n,) bool, whether words of a copy have differed from those of the run
    """

    name: str
    of: Array
    nominal: Array
    other: Array
    is_float: Array
    differ: Array


def _words_of(copies: Copies) -> Iterator[_Words]:
    """Arrays of the models of copies as words."""
    memory, blocks = copies.memory, copies.blocks
    for (struct, name, *others), place in memory.places.items():
        size = math.prod(place.shape) * place.dtype.itemsize
        if struct != "model" or others or size % WORD:
            continue
        n, strides = size // WORD, (blocks.strides[0], WORD)
        nominal = np.ndarray((n,), np.int64, memory.image.data, place.offset)
        of = np.ndarray((len(blocks), n), np.int64, blocks.data, place.offset, strides)
        is_float = np.tile(_is_float(place.dtype), size // place.dtype.itemsize)
        yield _Words(name, of, nominal, nominal.copy(), is_float, np.zeros(n, dtype=bool))


def _is_float(dtype: np.dtype) -> Array:
    """Whether each word of an entry of a type is a float."""
    found = np.zeros(dtype.itemsize // WORD, dtype=bool)
    if dtype.names is None:
        found[:] = dtype.base.kind == "f"
    for name in dtype.names or ():
        field, at = dtype.fields[name][:2]  # type: ignore[index]
        found[at // WORD : (at + field.itemsize) // WORD] = field.base.kind == "f"
    return found


def _with_nan_before(solution: Solution, count: int) -> Solution:
    """A solution with NaN in its first `count` samples, in place."""
    kept = () if solution.kept is None else solution.kept
    for values in (solution.y, *(one for one in kept if isinstance(one, np.ndarray))):
        if values.dtype.names is None:
            values[:count] = np.nan
        for name in values.dtype.names or ():
            values[name][:count] = np.nan
    return solution


def _bits(kept: Kept, first: int = 0) -> list[Any]:
    """Names, dimensions, attributes and bits of variables, from sample `first` on."""
    timeless = {name: one for name, one in kept.coordinates.items() if name != "time"}
    return [
        *(
            (name, one.dims, _comparable(one.attrs), one.values[first:].tobytes())
            for name, one in kept.variables.items()
        ),
        *((name, one.dims, _comparable(one.attrs), one.values.tobytes()) for name, one in timeless.items()),
    ]


def _comparable(attrs: Mapping[Any, Any]) -> dict[Any, Any]:
    """Attributes with bytes in the place of arrays, of which a number that is none equals itself."""
    return {key: value.tobytes() if isinstance(value, np.ndarray) else value for key, value in attrs.items()}
