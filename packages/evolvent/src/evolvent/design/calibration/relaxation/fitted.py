"""Numbers of a Prony series that is fitted: terms, shifts, forces, with their uncertainties; the section of a case."""

from __future__ import annotations

import dataclasses
import itertools
import math
from typing import Any, NamedTuple

import numpy as np
from scipy import special

from evolvent.design.calibration.relaxation import shifts
from evolvent.design.calibration.relaxation.curves import ROUND_OFF, Measured
from evolvent.design.calibration.relaxation.search import Solved
from evolvent.elements.viscoelastic import Viscoelastic
from evolvent_base.scales import celsius
from evolvent_base.showing import Shown

Array = np.ndarray
#: Years of storage for which the share that is left is stated.
YEARS = 10.0


class Value(NamedTuple):
    """A number, its standard uncertainty and its 95 % bounds."""

    value: float
    error: float
    low: float
    high: float


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Fitted(Shown):
    """Numbers of a Prony series that is fitted to relaxation curves.

    Attributes
    ----------
    measured : Measured, the curves
    solved : Solved, the least squares
    free : Solved, with a shift of each temperature and no law; None where there is one temperature
    scale : float, force that counts as 1 in `solved`
    deviation : float, of the forces, as given; None where the residuals show it
    tried : tuple of Solved, with other numbers of terms
    levels : tuple of int, of each curve, at which of the temperatures it was measured
    warnings : tuple of str
    """

    measured: Measured
    solved: Solved
    free: Solved | None
    scale: float
    deviation: float | None
    tried: tuple[Solved, ...]
    levels: tuple[int, ...]
    warnings: tuple[str, ...]

    named = "relaxation series"
    endings = (".json", ".yaml")

    # -------------------------------------------------------------------------------------------- numbers

    @property
    def terms(self) -> int:
        """Number of terms."""
        return self.solved.terms

    @property
    def factor(self) -> float:
        """Standard uncertainties in a 95 % bound: Student's t."""
        return 1.96 if self.deviation is not None else float(special.stdtrit(self.solved.freedom, 0.975))

    def covariance(self, of: Solved) -> Array:
        """Covariance of the parameters of a solution."""
        rms = math.sqrt(float(of.residuals @ of.residuals) / of.freedom)
        scatter = max(rms, ROUND_OFF) if self.deviation is None else self.deviation / self.scale
        assert of.covariance is not None
        return scatter**2 * of.covariance

    def _value(self, value: float, slope: Array) -> Value:
        error = math.sqrt(max(float(slope @ self.covariance(self.solved) @ slope), 0.0))
        return Value(value, error, value - self.factor * error, value + self.factor * error)

    def _slope(self, place: int) -> Array:
        found = np.zeros(self.solved.x.size)
        found[place] = 1.0
        return found

    @property
    def instantaneous(self) -> Value:
        """Force just after a sudden step, of the first curve, in its unit."""
        total = self.scale * self._slope(0)
        total[self.solved.response.places[0]] = self.scale
        return self._value(float(total @ self.solved.x), total)

    @property
    def equilibrium(self) -> Value:
        """Force that never relaxes, of the first curve, in its unit."""
        slope = self.scale * self._slope(0)
        return self._value(float(slope @ self.solved.x), slope)

    def share_left(self, time: float) -> Value:
        """Share of the instantaneous force that is left at a time (s) after a step, at the reference temperature."""
        amplitudes, times, _, _ = self.solved.response.places
        A, tau = self.solved.x[amplitudes], np.exp(self.solved.x[times])
        held = np.concatenate([[1.0], np.exp(-time / tau)])
        share, slope = float(held @ A / A.sum()), self._slope(0)
        slope[amplitudes] = (held - share) / A.sum()
        slope[times] = A[1:] / A.sum() * held[1:] * (time / tau if math.isfinite(time) else 0.0)
        found = self._value(share, slope)
        return found._replace(low=max(found.low, 0.0), high=min(found.high, 1.0))

    @property
    def left(self) -> Value:
        """Share of the force that never relaxes by the series."""
        return self.share_left(math.inf)

    @property
    def shares(self) -> tuple[Value, ...]:
        """Share of each term, by rising time."""
        amplitudes = self.solved.response.places[0]
        A = self.solved.x[amplitudes]
        found = []
        for k in range(1, self.terms + 1):
            slope = self._slope(0)
            slope[amplitudes] = -A[k] / A.sum() ** 2
            slope[k] += 1.0 / A.sum()
            one = self._value(float(A[k] / A.sum()), slope)
            found.append(one._replace(low=max(one.low, 0.0), high=min(one.high, 1.0)))
        return tuple(found)

    @property
    def times(self) -> tuple[Value, ...]:
        """Relaxation time of each term, s, at the reference temperature; the bounds are a factor about it."""
        place = self.solved.response.places[1]
        logs = [self._value(float(self.solved.x[k]), self._slope(k)) for k in range(place.start, place.stop)]
        return tuple(Value(math.exp(v), math.exp(v) * e, math.exp(low), math.exp(high)) for v, e, low, high in logs)

    @property
    def reference(self) -> float | None:
        """Temperature of the series, K; None if it is not known."""
        known = self.measured.curves[0].temperature is not None
        return self.solved.response.shift.reference if known else None

    @property
    def temperatures(self) -> Array:
        """(m,) temperatures of the curves, K, in rising order."""
        return self.solved.response.shift.temperatures

    @property
    def constants(self) -> tuple[Value, ...]:
        """Parameters of the shift: of each temperature but the first of the table, of the law."""
        place = self.solved.response.places[2]
        return tuple(self._value(float(self.solved.x[k]), self._slope(k)) for k in range(place.start, place.stop))

    def decades(self, of: Solved | None = None) -> tuple[Value, ...]:
        """log10 of the factor of relaxation times at each temperature, of the series or another solution (`free`)."""
        of = of or self.solved
        place = of.response.places[2]
        value, slope = of.response.shift.at(of.x[place])
        error = np.sqrt(np.einsum("ij,jk,ik->i", slope, self.covariance(of)[place, place], slope))
        return tuple(
            Value(v, e, v - self.factor * e, v + self.factor * e) for v, e in zip(value.tolist(), error, strict=True)
        )

    def reduced(self, k: int) -> Array:
        """Times of a curve, s, as at the reference temperature."""
        decades = self.decades()[self.levels[k]].value
        return self.measured.curves[k].times / 10.0**decades

    @property
    def longest(self) -> float:
        """Longest time that was measured, s, as at the reference temperature."""
        return max(float(self.reduced(k)[-1]) for k in range(len(self.measured.curves)))

    @property
    def shortest(self) -> float:
        """Shortest time after the step that was measured, s, as at the reference temperature."""
        times = [self.reduced(k) for k in range(len(self.measured.curves))]
        return min(float(one[one > 0.0][0]) for one in times)

    def overlap(self) -> tuple[float, float, float]:
        """Least overlap in reduced time of a temperature with those before it, decades, and the two temperatures."""
        ends: dict[int, list[float]] = {}
        for k, level in enumerate(self.levels):
            time = self.reduced(k)
            time = np.log10(time[time > 0.0])
            low, high = ends.get(level, [math.inf, -math.inf])
            ends[level] = [min(low, float(time[0])), max(high, float(time[-1]))]
        order = sorted(ends, key=lambda level: ends[level][0])
        found, last = (math.inf, 0.0, 0.0), order[0]
        for level in order[1:]:
            over = min(ends[last][1], ends[level][1]) - ends[level][0]
            pair = sorted((float(self.temperatures[last]), float(self.temperatures[level])))
            found = min(found, (over, pair[0], pair[1]))
            last = level if ends[level][1] > ends[last][1] else last
        return found

    def modelled(self, k: int, times: Array) -> Array:
        """Force of the series at times (s) of a curve, in its unit."""
        response = self.solved.response
        one = self.measured.curves[k]
        rows = response.rows._replace(
            time=times, force=np.zeros(times.size), ramp=np.full(times.size, one.ramp), merged=np.ones(times.size),
            curve=np.full(times.size, k), level=np.full(times.size, self.levels[k]),
        )  # fmt: skip
        return self.scale * dataclasses.replace(response, rows=rows).at(self.solved.x)[0]

    def whole(self, k: int) -> float:
        """Instantaneous force of a curve, in its unit."""
        own = self.solved.x[self.solved.response.places[3]]
        factor = math.exp(own[k - 1]) if k and own.size else 1.0
        return factor * self.instantaneous.value

    @property
    def is_exact(self) -> bool:
        """Whether the residuals are those of round-off."""
        return self.solved.rms < 10.0 * ROUND_OFF

    @property
    def residuals(self) -> list[Array]:
        """Modelled less measured forces of each curve."""
        sizes = np.cumsum([one.times.size for one in self.measured.curves])[:-1]
        return np.split(self.scale * self.solved.residuals, sizes)

    # -------------------------------------------------------------------------------------------- case

    @property
    def section(self) -> str:
        """The section for a case, as a line of YAML; the series holds at the reference temperature."""
        values = [share.value for share in self.shares]
        shares = [rounded(share.value, share.error) for share in self.shares]
        digits = itertools.count(4)
        while math.fsum(map(float, shares)) >= 1.0:  # what stays is next to 0
            more = next(digits)
            shares = [f"{value:.{more}g}" for value in values]
        times = [rounded(time.value, time.error) for time in self.times]
        rows = [f"[{share}, {time} s]" for share, time in zip(shares, times, strict=True)]
        shift = self._shift()
        return f"viscoelastic: {{prony: [{', '.join(rows)}]{f', shift: {shift}' if shift else ''}}}"

    def _shift(self) -> str:
        law = self.solved.response.shift
        if isinstance(law, shifts.NoShift):
            return ""
        at = celsius(law.reference)
        if isinstance(law, shifts.Arrhenius):
            energy = self.constants[0]
            text = rounded(energy.value * law.UNIT / 1e3, energy.error * law.UNIT / 1e3)
            return f"{{arrhenius: {{energy: {text} kJ/mol, reference: {at}}}}}"
        if isinstance(law, shifts.WLF):
            c1, c2 = (rounded(one.value, one.error) for one in self.constants)
            return f"{{wlf: {{c1: {c1}, c2: {c2} K, reference: {at}}}}}"
        rows = ", ".join(
            f"[{celsius(T)}, {rounded(one.value, one.error) if one.error else 0}]"
            for T, one in zip(self.temperatures, self.decades(), strict=True)
        )
        return f"{{table: {{rows: [{rows}], reference: {at}}}}}"

    @property
    def viscoelastic(self) -> Viscoelastic:
        """The section for a case, checked."""
        prony = [[share.value, time.value] for share, time in zip(self.shares, self.times, strict=True)]
        law = self.solved.response.shift
        values = [one.value for one in self.constants]
        given: dict[str, Any] = {"prony": prony}
        if isinstance(law, shifts.Arrhenius):
            given["shift"] = {"arrhenius": {"energy": values[0] * law.UNIT, "reference": law.reference}}
        elif isinstance(law, shifts.WLF):
            given["shift"] = {"wlf": {"c1": values[0], "c2": values[1], "reference": law.reference}}
        elif isinstance(law, shifts.Free):
            rows = [[float(T), one.value] for T, one in zip(self.temperatures, self.decades(), strict=True)]
            given["shift"] = {"table": {"rows": rows, "reference": law.reference}}
        return Viscoelastic(**given)


def rounded(value: float, error: float) -> str:
    """A number to a hundredth of its standard uncertainty."""
    digits = math.ceil(math.log10(abs(value) / error)) + 2 if 0.0 < error < abs(value) else 3
    return f"{value:.{min(max(digits, 3), 10)}g}"
