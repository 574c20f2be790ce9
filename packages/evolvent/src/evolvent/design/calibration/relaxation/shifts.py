"""Shifts of relaxation times by temperature, as functions of what is fitted."""

from __future__ import annotations

import abc
import bisect
import dataclasses

import numpy as np

from evolvent.elements.viscoelastic import MOST_DECADES, SHIFTS, arrhenius_decades, wlf_decades
from evolvent_base.errors import InputError, counted, nearest
from evolvent_base.scales import celsius

Array = np.ndarray
#: Largest c2 of the equation of Williams, Landel and Ferry, K: with it the shift is straight in the temperature.
MOST_C2 = 2000.0


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Shift(abc.ABC):
    """A shift at the temperatures (m,) of the curves, K, in rising order; 0 decades at the reference (K)."""

    temperatures: Array
    reference: float

    @property
    @abc.abstractmethod
    def size(self) -> int:
        """Number of parameters."""

    @abc.abstractmethod
    def at(self, x: Array) -> tuple[Array, Array]:
        """log10 of the factors of relaxation times (m,), and derivatives (m, parameters)."""

    @abc.abstractmethod
    def start(self, decades: Array) -> Array:
        """Parameters near shifts (m,) that were found without a law."""

    def bounds(self) -> tuple[Array, Array]:
        """Between which the parameters stay."""
        return np.full(self.size, -MOST_DECADES), np.full(self.size, MOST_DECADES)


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class NoShift(Shift):
    """Curves of one temperature."""

    @property
    def size(self) -> int:
        """None."""
        return 0

    def at(self, x: Array) -> tuple[Array, Array]:
        """Zero."""
        return np.zeros(self.temperatures.size), np.zeros((self.temperatures.size, 0))

    def start(self, decades: Array) -> Array:
        """None."""
        return np.zeros(0)


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Free(Shift):
    """Decades at each temperature, of which those about the reference are 0 there: straight between temperatures."""

    @property
    def size(self) -> int:
        """One for each temperature but that next to the reference."""
        return self.temperatures.size - 1

    @property
    def matrix(self) -> Array:
        """(m, m - 1) decades by the parameters."""
        T = self.temperatures.tolist()
        k = min(max(bisect.bisect_right(T, self.reference) - 1, 0), len(T) - 2)
        w = (self.reference - T[k]) / (T[k + 1] - T[k])
        base, other = (k, k + 1) if w <= 0.5 else (k + 1, k)
        found = np.zeros((len(T), len(T) - 1))
        rest = [i for i in range(len(T)) if i != base]
        found[rest, np.arange(len(rest))] = 1.0
        ratio = w / (1.0 - w) if base == k else (1.0 - w) / w
        found[base, rest.index(other)] = -ratio
        return found

    def at(self, x: Array) -> tuple[Array, Array]:
        """The decades."""
        return self.matrix @ x, self.matrix

    def start(self, decades: Array) -> Array:
        """The decades but that next to the reference."""
        zero = np.interp(self.reference, self.temperatures, decades)
        found: Array = np.linalg.lstsq(self.matrix, decades - zero, rcond=None)[0]
        return found


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Arrhenius(Shift):
    """An activation energy, 100 kJ/mol."""

    UNIT = 1e5

    @property
    def size(self) -> int:
        """The energy."""
        return 1

    @property
    def _by_energy(self) -> Array:
        return np.asarray(arrhenius_decades(self.temperatures, self.reference, self.UNIT))

    def at(self, x: Array) -> tuple[Array, Array]:
        """In proportion to the energy."""
        return self._by_energy * x[0], self._by_energy[:, None]

    def start(self, decades: Array) -> Array:
        """Of the straight line over 1/T."""
        slope = np.polyfit(self._by_energy, decades, 1)[0]
        return np.array([max(slope, 1e-3)])

    def bounds(self) -> tuple[Array, Array]:
        """Above 0."""
        return np.array([1e-6]), np.array([1e3])


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class WLF(Shift):
    """c1, and c2 in K."""

    @property
    def size(self) -> int:
        """c1 and c2."""
        return 2

    def at(self, x: Array) -> tuple[Array, Array]:
        """The equation of Williams, Landel and Ferry (1955)."""
        off = self.temperatures - self.reference
        by_c1 = wlf_decades(off, 1.0, x[1])
        return np.asarray(wlf_decades(off, x[0], x[1])), np.column_stack([by_c1, -x[0] * by_c1 / (x[1] + off)])

    def start(self, decades: Array) -> Array:
        """Of the straight line of off/decades over off, where its slope allows it."""
        T = self.temperatures
        base = min(max(self.reference, float(T[0])), float(T[-1]))
        off, d = T - base, decades - np.interp(base, T, decades)
        away = np.abs(off) > 1e-6
        slope, level = np.polyfit(off[away], -off[away] / d[away], 1) if np.all(d[away]) else (0.0, 0.0)
        low, high = (side[1] for side in self.bounds())
        c2 = (level / slope if slope > 0.0 else 0.5 * high) + self.reference - base
        c2 = min(max(c2, low + 5.0), 0.5 * high)
        off = T - self.reference
        by_c1 = np.column_stack([wlf_decades(off, 1.0, c2), np.ones(T.size)])  # and an offset of the decades
        return np.array([max(float(np.linalg.lstsq(by_c1, decades, rcond=None)[0][0]), 1e-3), c2])

    def bounds(self) -> tuple[Array, Array]:
        """Above 0, and c2 so that the equation holds at all temperatures."""
        low = max(0.0, self.reference - float(self.temperatures[0]))
        return np.array([1e-6, low + 1e-3]), np.array([1e3, MOST_C2 + low])


#: Laws by their names in case files.
LAWS: dict[str, type[Shift]] = {"wlf": WLF, "arrhenius": Arrhenius, "table": Free}


def law(name: str | None, temperatures: Array, reference: float) -> Shift:
    """The shift that is asked for.

    Parameters
    ----------
    name : str, one of `LAWS`; None for the table, or none where there is one temperature
    temperatures : (m,) float, K, in rising order

    Raises
    ------
    InputError
        If there are too few temperatures for it, or the reference does not lie where it holds.
    """
    if name is not None and name not in SHIFTS:
        raise InputError(f"shift is {name!r}; {nearest(name, SHIFTS)}")
    if temperatures.size < 2:
        if name is not None:
            raise InputError(
                f"shift is {name!r}, but the data have one temperature; curves at two or more determine a shift"
            )
        return NoShift(temperatures=temperatures, reference=reference)
    found = LAWS[name or "table"](temperatures=temperatures, reference=reference)
    if found.size > temperatures.size - 1:
        raise InputError(
            f"shift is {name!r}, which has {counted(found.size, 'constant')}, but the data have "
            f"{counted(temperatures.size, 'temperature')}; {found.size + 1} or more determine them"
        )
    low, high = float(temperatures[0]), float(temperatures[-1])
    if isinstance(found, Free) and not low <= reference <= high:
        raise InputError(
            f"reference is {celsius(reference)}; a table of shifts holds between the temperatures of the data, "
            f"{celsius(low)} to {celsius(high)}"
        )
    return found
