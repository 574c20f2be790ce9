"""Results of a stepper by the names that they have in a run."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from evolvent.assembly.assembled import Assembly
from evolvent.model.registry import constraining
from evolvent.results import variables
from evolvent.results.observe import Observed, View, observe_part
from evolvent.solvers.common.solution import Solution
from evolvent_base.errors import InputError, nearest

#: Variables that add up over all samples of a run, as does the angle of a constraint; a stepper keeps the first and the
#: last.
_ADDS_UP = ("work",)


class ResultAddress(NamedTuple):
    """Where a result is found.

    Attributes
    ----------
    part, variable : str
    at : int, or array of them, the numbers of its entries in the variable at one time
    magnitude : bool, whether the result is the length of these vectors, the last dimension of `at`
    """

    part: str
    variable: str
    at: int | np.ndarray
    magnitude: bool = False


class StepResults:
    """Results at the start and now.

    Parameters
    ----------
    assembly : Assembly
    solution : function that returns the state at the start and now, as a run of two samples
    """

    def __init__(self, assembly: Assembly, solution: Callable[[], Solution]) -> None:
        self.assembly, self._solution = assembly, solution
        self._observed: dict[str, Observed] = {}
        self._found: dict[str, ResultAddress] = {}
        self._now: View | None = None

    def forget(self) -> None:
        """Forget the values: the state has changed."""
        self._now, self._observed = None, {}

    def value(self, address: ResultAddress) -> float | np.ndarray:
        """A result now, by the address that `address` has found for its name."""
        variable = self._part(address.part).variables[address.variable]
        now = variable.values[-1] if variable.dims[:1] == ("time",) else variable.values
        found = np.asarray(now).reshape(-1)[address.at]
        found = np.linalg.norm(found, axis=-1) if address.magnitude else found
        return float(found) if np.ndim(found) == 0 else found

    def names(self) -> dict[str, tuple[tuple[str, ...], str]]:
        """Names of all that `result` gives, without components and entries: name -> (dimensions, unit)."""
        return {
            f"{part}.{name}": (tuple(d for d in v.dims if d != "time"), v.units)
            for part in self.assembly.parts
            for name, v in self._part(part).variables.items()
            if not self._adds_up(part, name)
        }

    def describe(self, name: str) -> tuple[str, str]:
        """Unit and meaning of a result."""
        address = self.address(name)
        variable = self._part(address.part).variables[address.variable]
        return variable.units, variable.long_name

    def _adds_up(self, part: str, variable: str) -> bool:
        """Whether a variable of a run follows from all of its samples, not from the first and the last."""
        turns = variable == "angle" and self.assembly.names[part][0] in constraining()
        return variable in _ADDS_UP or turns

    def address(self, name: Any) -> ResultAddress:
        """Where a result is found; of the same system it stays the same.

        Raises
        ------
        InputError
            If there is none, or it adds up over all samples of a run, such as the work of a load.
        """
        if name not in self._found:
            self._found[name] = self._address_of_name(name)
        return self._found[name]

    def _address_of_name(self, name: Any) -> ResultAddress:
        part = variables.owner(name) if isinstance(name, str) else ""
        if part not in self.assembly.parts or self.assembly.names[part][0] == "events":
            raise InputError(f"no result is called {name!r}; {nearest(str(name), self.names())}")
        if name == part:
            own = ", ".join(key for key in self._part(part).variables if not self._adds_up(part, key))
            raise InputError(f"{name!r} is a part; give one of its results: {own}")
        numbered = {
            f"{part}.{key}": (tuple(d if d in variables.SHARED else f"{part}.{d}" for d in v.dims), v)
            for key, v in self._part(part).variables.items()
        }
        dataset = variables.numbered(
            {key: (dims, v.values.shape) for key, (dims, v) in numbered.items()},
            {f"{part}.{key}": c.long_name for key, c in self._part(part).coordinates.items()},
        )
        vectors = name.removesuffix(f".{variables.MAGNITUDE}")
        found = variables.get(dataset, vectors)
        if vectors != name:
            variables.get(dataset, name)  # which refuses it of what has no components
        own = str(found.name).partition(".")[2]
        if self._adds_up(part, own):
            raise InputError(
                f"{name!r} adds up over all samples of a run, of which a stepper keeps the first and the last"
            )
        at = found.values[0] if "time" in found.dims else found.values
        return ResultAddress(part, own, int(at) if np.ndim(at) == 0 else np.asarray(at), vectors != name)

    def _part(self, part: str) -> Observed:
        """Results of a part at the start and now."""
        if self._now is None:
            self._now = View.of(self._solution())
        if part not in self._observed:
            self._observed[part] = observe_part(self._now, part)
        return self._observed[part]
