"""Viscoelastic materials: a Prony series, and the shift of its relaxation times by temperature."""

from __future__ import annotations

import abc
import itertools
import math
from typing import Annotated, Any, Self

import numpy as np
from pydantic import AfterValidator, BeforeValidator, model_validator
from pydantic_core import PydanticCustomError

from evolvent_base import units
from evolvent_base.errors import InputError
from evolvent_base.schema import OneOf, Section, shown

Array = np.ndarray
#: Gas constant, J/(mol K).
GAS = 8.314462618
#: Largest size of the logarithm to base 10 of a shift: beyond it relaxation times are no numbers that could be meant.
MOST_DECADES = 60.0


def wlf_decades(off: Any, c1: Any, c2: Any) -> Any:
    """log10 of the factor of relaxation times by the equation of Williams, Landel and Ferry.

    Parameters
    ----------
    off : float or (n,) float, K, temperatures less that of reference
    c1 : float
    c2 : float, K
    """
    return -c1 * off / (c2 + off)


def arrhenius_decades(temperature: Any, reference: float, energy: Any) -> Any:
    """log10 of the factor of relaxation times by an activation energy.

    Parameters
    ----------
    temperature : float or (n,) float, K
    reference : float, K
    energy : float, J/mol
    """
    return energy / GAS * (1.0 / temperature - 1.0 / reference) / math.log(10.0)


def rows_of(value: Any, columns: str) -> Any:
    """Rows of a table of two columns; a unit that stands in the last row alone is that of its column."""
    rows = value.tolist() if isinstance(value, np.ndarray) else value
    if not isinstance(rows, (list, tuple)) or not rows:
        raise PydanticCustomError("table", "it must be a list of one or more rows {columns}", {"columns": columns})
    for k, row in enumerate(rows):
        if not isinstance(row, (list, tuple)) or len(row) != 2:
            raise PydanticCustomError(
                "table", "every row of it must have two values, {columns}; row {k} is {row}",
                {"columns": columns, "k": k + 1, "row": shown(row)},
            )  # fmt: skip
    try:
        found = [units.shared_unit(list(column)) for column in zip(*rows, strict=True)]
    except (units.UnitError, TypeError, ValueError) as error:
        raise PydanticCustomError("table", "{why}", {"why": str(error)}) from None
    return tuple(zip(*found, strict=True))


def _terms(value: Any) -> Any:
    return rows_of(value, "[share, time]")


def _below_one(terms: tuple[tuple[float, float], ...]) -> Any:
    total = math.fsum(share for share, _ in terms)
    if total >= 1.0:
        raise PydanticCustomError(
            "prony", "the shares of `prony` sum to {total}; they must sum to less than 1: the rest never relaxes",
            {"total": f"{total:.6g}"},
        )  # fmt: skip
    return terms


def _decades(value: Any) -> Any:
    return rows_of(value, "[temperature, decades]")


class Shift(Section):
    """Factor a of relaxation times by temperature."""

    @property
    @abc.abstractmethod
    def range(self) -> tuple[float, float]:
        """Temperatures at which it holds, K."""

    @abc.abstractmethod
    def decades(self, temperature: float) -> float:
        """log10 of the factor of relaxation times."""

    @property
    def kinks(self) -> tuple[float, ...]:
        """Temperatures at which its slope jumps, K."""
        return ()


class WLF(Shift):
    """Shift of polymers above their glass transition: log10 a = -c1 (T - T_r)/(c2 + T - T_r).

    Parameters
    ----------
    c1 : float
    c2 : float, K
        The equation holds above `reference` - c2.
    reference : float, K
        Temperature T_r of the Prony series, at which a = 1.

    Notes
    -----
    Williams, Landel & Ferry (1955), eq. 1.
    """

    c1: units.PositiveNumber
    c2: Annotated[
        float, units.Quantity(what="a change of temperature", unit="K", example="51.6 K", above=0.0, difference=True)
    ]
    reference: units.MaterialTemperature

    @property
    def range(self) -> tuple[float, float]:
        """Temperatures at which it holds, K."""
        return max(self.reference - self.c2, 0.0), math.inf

    def decades(self, temperature: float) -> float:
        """log10 of the factor of relaxation times."""
        return float(wlf_decades(temperature - self.reference, self.c1, self.c2))


class Arrhenius(Shift):
    """Shift by an activation energy: ln a = energy/R (1/T - 1/T_r).

    Parameters
    ----------
    energy : float, J/mol
    reference : float, K
        Temperature T_r of the Prony series, at which a = 1.
    """

    energy: units.EnergyPerMole
    reference: units.MaterialTemperature

    @property
    def range(self) -> tuple[float, float]:
        """Temperatures at which it holds, K."""
        return 0.0, math.inf

    def decades(self, temperature: float) -> float:
        """log10 of the factor of relaxation times."""
        return float(arrhenius_decades(temperature, self.reference, self.energy))


class ShiftTable(Shift):
    """Measured shifts; straight lines between the rows.

    Parameters
    ----------
    rows : rows [temperature, decades]
        Temperatures, K, in rising order; decades, log10 of the factor of relaxation times.
    reference : float, K, optional
        Temperature of the Prony series, within the rows; where the decades are 0 if left out.
    """

    rows: Annotated[tuple[tuple[units.MaterialTemperature, units.Number], ...], BeforeValidator(_decades)]
    reference: units.MaterialTemperature | None = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        if any(b[0] <= a[0] for a, b in itertools.pairwise(self.rows)):
            raise PydanticCustomError("shift", "the temperatures of its rows must rise")
        if any(b[1] >= a[1] for a, b in itertools.pairwise(self.rows)):
            raise PydanticCustomError("shift", "the decades of its rows must fall: warmer is faster")
        low, high = self.range
        if self.reference is None and not self.rows[-1][1] <= 0.0 <= self.rows[0][1]:
            raise PydanticCustomError("shift", "its decades are nowhere 0; give `reference`")
        if self.reference is not None and not low <= self.reference <= high:
            raise PydanticCustomError(
                "shift", "reference is {at} K, outside the rows, {low} to {high} K",
                {"at": f"{self.reference:g}", "low": f"{low:g}", "high": f"{high:g}"},
            )  # fmt: skip
        return self

    @property
    def range(self) -> tuple[float, float]:
        """Temperatures at which it holds, K."""
        return self.rows[0][0], self.rows[-1][0]

    @property
    def kinks(self) -> tuple[float, ...]:
        """Temperatures of its rows, K."""
        return tuple(temperature for temperature, _ in self.rows)

    def _at(self, temperature: float) -> float:
        return float(np.interp(temperature, *np.array(self.rows).T))

    def decades(self, temperature: float) -> float:
        """log10 of the factor of relaxation times."""
        return self._at(temperature) - (0.0 if self.reference is None else self._at(self.reference))


#: Shifts by their names in case files.
SHIFTS = {"wlf": WLF, "arrhenius": Arrhenius, "table": ShiftTable}


class Viscoelastic(Section):
    """Linear viscoelasticity: relaxation of a stiffness by a Prony series, of all strains alike.

    A strain that is held keeps the share 1 - sum g_i (1 - exp(-t/(a tau_i))) of its instantaneous stress, which is that
    of the moduli or the stiffness of the part.

    Parameters
    ----------
    prony : rows [share, time]
        Shares g_i of the instantaneous stiffness, above 0 and in sum below 1, and relaxation times tau_i, s, at the
        reference temperature of `shift`.
    shift : optional
        Factor a of the relaxation times by temperature: ``{wlf: {c1, c2, reference}}``, ``{arrhenius: {energy,
        reference}}`` or ``{table: {rows}}``.
    temperature : float, K, optional
        Of the part while it moves; the reference temperature if left out. That of storage stands in `store`.

    Notes
    -----
    Creep that depends on the stress, ageing, damage and moisture are not modelled.
    """

    prony: Annotated[
        tuple[tuple[units.PositiveNumber, units.Duration], ...], BeforeValidator(_terms), AfterValidator(_below_one)
    ]
    shift: Annotated[WLF | Arrhenius | ShiftTable, OneOf(SHIFTS)] | None = None
    temperature: units.MaterialTemperature | None = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.temperature is not None and self.shift is None:
            raise PydanticCustomError(
                "prony", "`temperature` has no effect without `shift`; leave it out, or give both"
            )
        if self.temperature is not None:
            try:
                self.factor(self.temperature, "temperature")
            except InputError as error:
                raise PydanticCustomError("prony", "{why}", {"why": str(error)}) from None
        return self

    def factor(self, temperature: float | None, key: str, part: str = "") -> float:
        """Factor a of the relaxation times at a temperature (K); 1 where none is given, or without a shift.

        Parameters
        ----------
        key, part : str, that holds the temperature, and that has the series, for messages

        Raises
        ------
        InputError
            If the shift does not hold there.
        """
        if temperature is None or self.shift is None:
            return 1.0
        of, (low, high) = f" of {part!r}" if part else "", self.shift.range
        if not low <= temperature <= high or (temperature == low and math.isinf(high)):
            where = f"above {low:g} K" if math.isinf(high) else f"from {low:g} to {high:g} K"
            raise InputError(f"{key} is {temperature:g} K; the shift of the Prony series{of} holds {where}")
        decades = self.shift.decades(temperature)
        if abs(decades) > MOST_DECADES:
            raise InputError(
                f"{key} is {temperature:g} K, where the relaxation times{of} are shifted by {decades:.3g} decades; "
                f"{MOST_DECADES:g} at most"
            )
        return 10.0**decades

    @property
    def terms(self) -> list[tuple[float, float]]:
        """Shares, and relaxation times (s) at the temperature of the part while it moves."""
        factor = self.factor(self.temperature, "temperature")
        return [(share, time * factor) for share, time in self.prony]

    @property
    def left(self) -> float:
        """Share of the stiffness that never relaxes."""
        return 1.0 - math.fsum(share for share, _ in self.prony)

    def modulus(self, time: Array) -> Array:
        """Share of the stiffness that is left at times (s) after a sudden strain: (n,) float."""
        t = np.asarray(time, dtype=float)
        terms = (share * np.exp(-t / tau) for share, tau in self.terms)
        return self.left + sum(terms, np.zeros(t.shape))

    def dynamic_modulus(self, rate: Array) -> Array:
        """Complex share of the stiffness at complex rates s (1/s), i omega of a steady vibration: (n,) complex."""
        s = np.asarray(rate, dtype=complex)
        terms = (share * s * tau / (1.0 + s * tau) for share, tau in self.terms)
        return self.left + sum(terms, np.zeros(s.shape, dtype=complex))
