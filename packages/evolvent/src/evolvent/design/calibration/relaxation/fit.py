"""A Prony series fitted to relaxation curves of one or several temperatures."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy import special

from evolvent.design.calibration.relaxation import curves as measured_curves, shifts
from evolvent.design.calibration.relaxation.answer import Relaxation
from evolvent.design.calibration.relaxation.curves import Curve, Measured, kelvin
from evolvent.design.calibration.relaxation.response import LN10, Response, rows_of
from evolvent.design.calibration.relaxation.search import MOST_TERMS, Search, Solved, aligned, span
from evolvent_base import units
from evolvent_base.errors import InputError, counted
from evolvent_base.scales import celsius

Array = np.ndarray
#: Reference temperature next to which one of the data is taken, K.
ROOM = 293.15
#: Probability below which a law of shifts, or one instantaneous force, is said not to fit.
UNLIKELY = 0.001


def fit_relaxation(
    times: Any, forces: Any, *, temperatures: Any = None, shift: str | None = None, reference: Any = None,
    ramp: Any = None, deviation: float | None = None, terms: int | None = None, own_forces: bool = False,
    report: Callable[[int], None] | None = None,
) -> Relaxation:  # fmt: skip
    """Fit a Prony series to relaxation curves.

    Parameters
    ----------
    times : (n,) float, s since the position is held, or a list of arrays, one for each curve
    forces : as `times`, force, torque or stress, of one sign; a loading ramp at the beginning is recognised
    temperatures : of the curve, of each curve, or of each row, K or texts such as "20 degC"; None if not known
    shift : {"table", "wlf", "arrhenius"}, of several temperatures; the table unless given
    reference : temperature of the series, K or a text; that of the data next to 20 degC unless given
    ramp : length of the loading ramp before the hold, s or a text; that of the data, or 0, unless given
    deviation : standard deviation of the forces; that of the residuals unless given
    terms : number of terms; by the data unless given
    own_forces : bool, whether each curve has an instantaneous force of its own, as of other specimens
    report : called with the number of terms that is tried

    Returns
    -------
    Relaxation

    Raises
    ------
    InputError
        If the data are no relaxation, or do not determine what is asked for.
    """
    measured = measured_curves.of_arrays(times, forces, temperatures, duration(ramp))
    return fit_curves(
        measured,
        shift=shift,
        reference=reference,
        deviation=deviation,
        terms=terms,
        own_forces=own_forces,
        report=report,
    )


def fit_files(
    paths: Sequence[str], column: str, *, temperatures: Sequence[str] = (), ramp: Any = None, **asked: Any
) -> Relaxation:
    """Fit a Prony series to curves in files.

    Parameters
    ----------
    paths : of one file, with one curve or those of several temperatures; or of several, one for each curve
    column : name of the column of forces or torques
    temperatures : name of a column of temperatures, or the temperature (K, or with a unit) of each file
    ramp, asked : as of `fit_relaxation`

    Raises
    ------
    InputError
        As of `fit_relaxation`, and for columns and units that cannot be used.
    """
    return fit_curves(measured_curves.read(paths, column, temperatures=temperatures, ramp=duration(ramp)), **asked)


def duration(ramp: Any) -> float | None:
    """Length of a ramp, s."""
    if ramp is None:
        return None
    try:
        return units.parse(ramp, "s") if isinstance(ramp, str) else float(ramp)
    except (units.UnitError, TypeError, ValueError):
        raise InputError(f"ramp is {ramp!r}; it must be a duration, such as '2 s'") from None


def fit_curves(
    measured: Measured, *, shift: str | None = None, reference: Any = None, deviation: float | None = None,
    terms: int | None = None, own_forces: bool = False, report: Callable[[int], None] | None = None,
) -> Relaxation:  # fmt: skip
    """Fit a Prony series to curves; parameters as of `fit_relaxation`."""
    curves = measured.curves
    _check(curves, deviation, terms)
    warm, levels = _levels(curves)
    law = shifts.law(shift, warm, _reference(warm, reference, shift, stated=curves[0].temperature is not None))
    scale = max(float(one.forces.max()) for one in curves)
    rows = rows_of(curves, levels, scale)
    own = len(curves) - 1 if own_forces else 0
    _check_falling(curves, warm.size)
    if not own:
        _check_forces(curves, levels, law)
    places = []
    for is_scaled in (False, True) if own else (False,):
        decades, logs = aligned(rows, warm.size, own=is_scaled)
        places.append((law.at(law.start(decades))[0], logs))
    search = Search(rows, own, None if deviation is None else deviation / scale, span(rows, places[0][0]))
    found, tried = search.chosen(law, places, terms=terms, report=report)
    if found is None:
        raise _not_determined(curves, terms)
    _check_falls(found, rows, search)
    warnings = []
    free = _without_law(found, search)
    if free is not None:
        _check_shifts(free)
        if free is not found:
            warnings += _misfit(found, free, f"the {_NAMES[shift or '']}", "shifts without a law", search)
    if not own and len(curves) > 1:
        warnings += _own_forces(found, search)
    result = Relaxation(
        measured=measured, solved=_sorted(found), free=free, scale=scale, deviation=deviation,
        tried=tuple(tried if terms is None else tried[-1:]),
        levels=tuple(levels), warnings=tuple(warnings),
    )  # fmt: skip
    _check_overlap(result)
    return result


#: Laws of shifts, as sentences name them.
_NAMES = {"wlf": "equation of Williams, Landel and Ferry", "arrhenius": "law of Arrhenius"}


# ------------------------------------------------------------------------------------------------ checks


def _check(curves: Sequence[Curve], deviation: float | None, terms: int | None) -> None:
    if deviation is not None and not (np.isfinite(deviation) and deviation > 0.0):
        raise InputError(f"the standard deviation is {deviation:g}; it must be above 0")
    if terms is not None and not 1 <= terms <= MOST_TERMS:
        raise InputError(f"terms is {terms}; it must be from 1 to {MOST_TERMS}")
    count = sum(one.times.size for one in curves)
    need = 2 * (terms or 1) + 1
    if count <= need:
        raise InputError(
            f"the data have {count} values from the hold on, but {counted(terms or 1, 'term')} and what stays are "
            f"{need} parameters; more values than parameters are needed"
        )


def _levels(curves: Sequence[Curve]) -> tuple[Array, list[int]]:
    """Temperatures in rising order, K, and which of them each curve has; one that is not known is ROOM."""
    known = [one.temperature for one in curves]
    if all(one is None for one in known):
        return np.array([ROOM]), [0] * len(curves)
    lacking = next((one.label for one in curves if one.temperature is None), None)
    if lacking is not None:
        raise InputError(f"the temperature of {lacking} is not known, but that of others is; give it for each curve")
    T = np.array(known, dtype=float)
    order = np.argsort(T, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(T[order]) > 1.0) + 1)
    level = np.empty(T.size, dtype=int)
    for k, part in enumerate(parts):
        level[part] = k
    return np.array([T[part].mean() for part in parts]), level.tolist()


def _reference(warm: Array, reference: Any, shift: str | None, *, stated: bool) -> float:
    if reference is None:
        return float(warm[int(np.argmin(np.abs(warm - ROOM)))])
    found = kelvin(reference, "reference")
    if warm.size < 2 and shift is None and (not stated or abs(found - warm[0]) > 1e-6):
        raise InputError(
            f"reference is {celsius(found)}, but the data have one temperature, or none that is stated; curves "
            "at two or more determine a shift"
        )
    return found


def _check_falling(curves: Sequence[Curve], temperatures: int) -> None:
    """Refuse curves of several temperatures that are flat."""
    for one in curves if temperatures > 1 else ():
        third = one.times.size // 3
        fall = float(one.forces[:third].mean() - one.forces[-third:].mean()) if third else 0.0
        if fall < 5.0 * one.noise * np.sqrt(2.0 / max(third, 1)):
            raise InputError(
                f"{one.label}: the force does not fall by more than it scatters, so that its shift is not determined; "
                "leave the curve out"
            )


def _check_forces(curves: Sequence[Curve], levels: Sequence[int], law: shifts.Shift) -> None:
    """Refuse temperatures whose forces have no value in common: nothing says how far they are shifted."""
    count = law.temperatures.size
    own = [[one for one, level in zip(curves, levels, strict=True) if level == k] for k in range(count)]
    high = np.array([max(_end(one.forces[:3]) + 3.0 * one.noise for one in part) for part in own])
    low = np.array([min(_end(one.forces[-3:]) - 3.0 * one.noise for one in part) for part in own])
    for k in range(1, count):
        if low[:k].min() > high[k:].max():
            raise InputError(
                f"the curves at {celsius(law.temperatures[k - 1])} and {celsius(law.temperatures[k])} do "
                f"not overlap: the force ends at {low[:k].min():.4g} in the colder and begins at {high[k:].max():.4g} "
                "in the warmer; measure longer, or at a temperature between, or take "
                "`own_forces` for curves of different specimens"
            )


def _end(forces: Array) -> float:
    return float(np.median(forces))


def _not_determined(curves: Sequence[Curve], terms: int | None) -> InputError:
    if terms is not None:
        return InputError(
            f"the data do not determine {counted(terms, 'term')}; take fewer, or leave the number to the data"
        )
    what = "the force does not fall by more than it scatters"
    more = "" if len(curves) == 1 else ", or no shift brings the curves onto one another"
    return InputError(f"the data determine no term: {what}{more}")


def _check_falls(best: Solved, rows: Any, search: Search) -> None:
    """Refuse data that a constant force fits as well."""
    groups = rows.curve if search.curves else np.zeros(rows.time.size, dtype=int)
    means = np.bincount(groups, weights=rows.force) / np.bincount(groups)
    if search.criterion(rows.force - means[groups], means.size) <= best.criterion:
        raise InputError(
            "the force does not fall by more than it scatters: a constant force fits the data as well as a Prony series"
        )


def _check_shifts(free: Solved) -> None:
    """Refuse shifts that do not fall with temperature."""
    warm = free.response.shift.temperatures
    decades = free.response.shift.at(free.x[free.response.places[2]])[0]
    rising = np.flatnonzero(np.diff(decades) >= 0.0)
    if rising.size:
        k = int(rising[0])
        raise InputError(
            f"the curve at {celsius(warm[k + 1])} relaxes no faster than that at {celsius(warm[k])} "
            f"(shift by {decades[k + 1] - decades[k]:+.2g} decades); time-temperature superposition needs warmer to be "
            "faster"
        )


def _check_overlap(result: Relaxation) -> None:
    """Refuse temperatures that do not overlap in reduced time."""
    gap, first, second = result.overlap()
    if gap < 0.0:
        raise InputError(
            f"the curves at {celsius(first)} and {celsius(second)} do not overlap in reduced time: "
            f"{-gap:.2g} decades lie between them; measure longer, or at a temperature between"
        )


# ------------------------------------------------------------------------------------------------ fits


def _without_law(found: Solved, search: Search) -> Solved | None:
    """The fit with a shift of each temperature and no law, from that with one; None where there is one temperature."""
    law = found.response.shift
    if not law.size or isinstance(law, shifts.Free):
        return found if law.size else None
    warm = law.temperatures
    free = shifts.Free(temperatures=warm, reference=float(np.clip(law.reference, warm[0], warm[-1])))
    amplitudes, times, of_shift, own = found.response.places
    decades = law.at(found.x[of_shift])[0]
    off = float(np.interp(free.reference, warm, decades))
    x = np.concatenate([found.x[amplitudes], found.x[times] + LN10 * off, free.start(decades), found.x[own]])
    low, high = search.span
    moved = dataclasses.replace(search, span=(low + LN10 * off, high + LN10 * off))
    solved = moved.solve(Response(search.rows, free, found.terms, search.curves), x)
    if solved.covariance is None:
        raise InputError(
            "the data do not determine the shift of every temperature: the curves do not overlap, or are flat"
        )
    return solved


def _misfit(found: Solved, better: Solved, what: str, than: str, search: Search) -> list[str]:
    """A sentence where a fit with more parameters is better by more than chance: F test, chi^2 with known deviation."""
    more, square = better.response.size - found.response.size, float(better.residuals @ better.residuals)
    gain = float(found.residuals @ found.residuals) - square
    if more <= 0 or gain <= 0.0 or search.is_exact(found.residuals):
        return []
    if search.deviation is not None:
        chance = float(special.chdtrc(more, gain / search.deviation**2))
    else:
        chance = float(special.fdtrc(more, better.freedom, gain / more / (square / better.freedom)))
    if chance > UNLIKELY:
        return []
    return [
        f"{what} fits worse than {than}: root mean square of the residuals {found.rms / better.rms:.3g} times as large"
    ]


def _own_forces(found: Solved, search: Search) -> list[str]:
    """A sentence where curves have instantaneous forces of their own."""
    count = int(search.rows.curve.max())
    other = dataclasses.replace(search, curves=count)
    response = Response(found.response.rows, found.response.shift, found.terms, count)
    better = other.solve(response, np.concatenate([found.x, np.zeros(response.size - found.response.size)]))
    said = _misfit(found, better, "one instantaneous force of all curves", "one of each (own forces)", search)
    return said if better.covariance is not None else []


def _sorted(found: Solved) -> Solved:
    """A solution whose terms are in the order of their times."""
    n = found.terms
    order = np.argsort(found.x[found.response.places[1]], kind="stable")
    at = np.concatenate([[0], 1 + order, n + 1 + order, np.arange(2 * n + 1, found.x.size)])
    assert found.covariance is not None
    return found._replace(x=found.x[at], covariance=found.covariance[np.ix_(at, at)])
