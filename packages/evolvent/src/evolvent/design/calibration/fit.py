"""Least squares on the runs of a case, or on its closed form."""

from __future__ import annotations

import dataclasses
import math
import os
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import scipy

from evolvent import cases
from evolvent.design.calibration import data, observed, uncertainty
from evolvent.design.calibration.answer import Calibration, Parameter, Reference
from evolvent.design.calibration.residuals import Residuals, SeriesRuns
from evolvent.results.measurements import Series
from evolvent_base import schema, units
from evolvent_base.errors import InputError, RunFailed, nearest

Array = np.ndarray
#: Smallest singular value of the scaled derivatives over the largest, below which the data cannot separate parameters:
#: of runs, whose central differences have an error of some 1e-6, and of closed forms.
LEAST_OF_RUNS, LEAST_OF_FORMULAS = 1e-4, 1e-7
#: Share of a standard error, and of a value, by which finer integration may change it; else the fit is repeated with
#: it, up to so many levels (`evolvent.analysis.accuracy`).
SHARE, LEAST_OFF, LEVELS = 0.1, 1e-6, 4
#: What may be fitted.
MODELS = ("auto", "runs", "closed-form")
#: Parameters that may be fitted at most.
MOST = 40


def calibrate(
    case: Any, source: str, *, fit: Sequence[str], observe: Sequence[str], model: str = "auto",
    deviations: Sequence[float] | None = None, folder: str | os.PathLike[str] | None = None,
    progress: Callable[[int, float], None] | None = None, references: bool = True,
    fixed: Mapping[str, Any] | None = None, report: Callable[[str], None] | None = None,
    bounds: Mapping[str, Sequence[Any]] | None = None,
) -> Calibration:  # fmt: skip
    """Fit parameters of a case to measured data.

    Parameters
    ----------
    case : name of a built-in case, file, or content
    source : str, file of the data (see `evolvent.design.calibration.data`)
    fit : keys of the case; a key that holds a list stands for all its entries
    observe : variables that were measured, "NAME" or "NAME=COLUMN"; in a table of runs with a reduction ("NAME.last")
    model : {"auto", "runs", "closed-form"}, what is fitted; "auto" takes the system's closed form where it has one
    deviations : standard deviation of the values of each variable, in their units; needed where several are observed
    folder : folder that keeps every evaluation, so that the same call goes on where it was stopped
    progress : called with the number of evaluations and the root mean square reached
    references : bool, whether the formulas that the system has beside its model are fitted as well
    fixed : mapping, keys of the case that are set after those that the data set
    report : called with a sentence about evaluations in the folder that are damaged
    bounds : mapping, fitted key -> (low, high), numbers (SI) or texts with units, within which the fit stays; without
        them within what the key allows

    Returns
    -------
    Calibration

    Raises
    ------
    InputError
        For keys, columns and units that cannot be used, and parameters that the data do not distinguish.
    RunFailed
        Where the run with the values at the start fails.
    """
    measured = data.read(source, case, observe)
    content = cases.in_place(cases.content_of(case, {**measured.overrides, **(fixed or {})}))
    parameters = _bounded(_parameters(content, fit), bounds or {})
    content = cases.content_of(content, _plain_lists(content, parameters))
    runs = SeriesRuns(
        content=content, measured=measured, weights=_weights(measured.series, deviations),
        closed_form=_is_closed_form(model, content), files=cases.files_of(content),
    )  # fmt: skip
    count = sum(one.values.size for one in measured.series)
    if count <= len(parameters):
        raise InputError(
            f"--fit names {len(parameters)} parameters, but {source!r} holds {count} values of them; more values "
            f"than parameters are needed"
        )
    with runs.kept_in(folder, report) as log:
        run = Residuals(runs, parameters, log, progress)
        found, errors, correlation, integration, note = _fitted(run, deviations is not None)
        modelled = run.values(found.x)
    best = run.overrides(found.x)
    others = _references(content, best, source, fit, observe) if references else {}
    return Calibration(
        parameters=parameters, values=found.x * run.scales, errors=errors + integration, integration=integration,
        accuracy=note or run.accuracy(), correlation=correlation, series=measured.series, modelled=modelled,
        references=others, evaluations=run.evaluator.evaluations, reused=run.evaluator.reused,
        residuals=np.concatenate([m - s.values for m, s in zip(modelled, measured.series, strict=True)]),
        message=found.message, notes=(*measured.notes, *observed.offsets(measured.series, modelled)),
        case=cases.content_of(content, best), source=source,
        model="closed form" if runs.closed_form else "runs", derivatives=run.derived_by,
    )  # fmt: skip


def _fitted(run: Residuals, is_weighted: bool) -> tuple[Any, Array, Array, Array, str]:
    """The least squares, standard errors, correlation, errors of integration, and why these are not known.

    Parameters
    ----------
    is_weighted : bool, whether the standard deviations of the data are given
    """
    parameters, scales, closed_form = run.parameters, run.scales, run.runs.closed_form
    start, low, high = (
        np.array([getattr(p, side) / p.scale for p in parameters]) for side in ("start", "least", "most")
    )
    least = LEAST_OF_FORMULAS if closed_form else LEAST_OF_RUNS
    run.at(start, first=True)

    def solved(x: Array) -> Any:
        found = scipy.optimize.least_squares(
            run.at, x, jac=lambda x: run.derivatives(x, low, high), bounds=(low, high), x_scale="jac",
            xtol=1e-9, ftol=1e-10, gtol=1e-12, max_nfev=100,
        )  # fmt: skip
        if found.status <= 0:
            raise RunFailed(f"the fit did not converge in {found.nfev} steps: {found.message}", None)
        return found, *uncertainty.of_data(found.jac, found.fun, parameters, least, given=is_weighted)

    found, errors, correlation = solved(start)
    off, note = np.zeros(start.size), ""
    while not closed_form:
        off, note = run.off(found)
        limit = np.maximum(SHARE * errors / scales, LEAST_OFF * np.abs(found.x))
        if note or np.all(off <= limit) or run.level == LEVELS:
            break
        run.level += 1
        found, errors, correlation = solved(found.x)
    return found, errors, correlation, off * scales, note


# ------------------------------------------------------------------------------------------------ parameters


def _parameters(content: Mapping[str, Any], fit: Sequence[str]) -> tuple[Parameter, ...]:
    kind = cases.system(content["system"]).Case
    checked = cases.load(dict(content)).model_dump()
    found: list[Parameter] = []
    for key in (key for word in fit for key in word.split(",") if key):
        schema.locate(kind, key, content)
        value = _at(checked, key)
        if isinstance(value, (list, tuple)):
            found += [_parameter(kind, content, f"{key}.{k}", one) for k, one in enumerate(value)]
        elif value is None:
            raise InputError(f"--fit names {key!r}, which the case does not give; set it to where the fit should start")
        else:
            found.append(_parameter(kind, content, key, value))
    if not found:
        raise InputError("--fit names no key; give one or more keys of the case, such as body.inertia")
    if len(found) > MOST:
        raise InputError(f"--fit names {len(found)} parameters; at most {MOST} are fitted")
    names = [p.key for p in found]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"--fit names {twice!r} twice")
    return tuple(found)


def _bounded(parameters: tuple[Parameter, ...], bounds: Mapping[str, Sequence[Any]]) -> tuple[Parameter, ...]:
    """Parameters that stay within bounds as well."""
    known = {p.key: p for p in parameters}
    for key, given in bounds.items():
        if key not in known:
            raise InputError(f"--bounds names {key!r}, which is not fitted; {nearest(key, known)}")
        one = known[key]
        try:
            low, high = (units.parse(end, one.unit) if isinstance(end, str) else float(end) for end in given)
        except (units.UnitError, TypeError, ValueError):
            unit = one.unit or "plain numbers"
            raise InputError(
                f"--bounds of {key!r} are {', '.join(map(str, given))}; they must be two numbers in {unit}"
            ) from None
        low, high = max(low, one.least), min(high, one.most)
        if not low < high or not low <= one.start <= high:
            raise InputError(
                f"--bounds of {key!r} are {low:.6g} to {high:.6g} {one.unit}; they must hold the value "
                f"{one.start:.6g} at which the fit starts"
            )
        known[key] = dataclasses.replace(one, least=low, most=high)
    return tuple(known.values())


def _plain_lists(content: Mapping[str, Any], parameters: Sequence[Parameter]) -> dict[str, Any]:
    """Lists and tables of which entries are fitted, as plain numbers in SI units, as which the entries are then set."""
    checked = cases.load(dict(content)).model_dump()
    lists = {re.sub(r"(\.\d+)+$", "", p.key) for p in parameters if p.key.rpartition(".")[2].isdigit()}
    return {key: cases.copied(list(_at(checked, key))) for key in lists}


def _is_closed_form(model: str, content: Mapping[str, Any]) -> bool:
    """Whether the system's closed form is fitted."""
    if model not in MODELS:
        raise InputError(f"--model is {model!r}; {nearest(model, MODELS)}")
    if model == "runs":
        return False
    has_one = bool(cases.system(content["system"]).closed_form(cases.load(dict(content)), np.zeros(1)))
    if model == "closed-form" and not has_one:
        raise InputError(f"--model is 'closed-form', but the system {content['system']!r} has none; use 'runs'")
    return has_one


def _at(values: Any, key: str) -> Any:
    """The value of a key of a checked case."""
    passed: list[str] = []
    for name in key.split("."):
        if isinstance(values, list | tuple):
            if not name.isdigit() or int(name) >= len(values):
                raise InputError(f"--fit names {key!r}, but {'.'.join(passed)} has entries 0 to {len(values) - 1}")
            values = values[int(name)]
        elif isinstance(values, Mapping) and schema.member(values, name) in values:
            values = values[schema.member(values, name)]
        else:
            raise InputError(f"--fit names {key!r}, which the case does not give; set it to where the fit should start")
        passed.append(name)
    return values


def _parameter(kind: Any, content: Mapping[str, Any], key: str, value: Any) -> Parameter:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(f"--fit names {key!r}, which is {schema.shown(value)}; only numbers are fitted")
    place = schema.locate(kind, key, content)
    marks = [getattr(mark, "quantity", mark) for _, own in place.types for mark in own]
    quantity = next((mark for mark in marks if isinstance(mark, units.Quantity)), None)
    if quantity is None:
        raise InputError(f"--fit names {key!r}, which is no quantity; only numbers with a unit are fitted")
    scale = abs(float(value)) or 1.0
    lows = [
        b for b in (quantity.least, None if quantity.above is None else quantity.above + 1e-9 * scale) if b is not None
    ]
    highs = [
        b for b in (quantity.most, None if quantity.below is None else quantity.below - 1e-9 * scale) if b is not None
    ]
    return Parameter(
        key=key, unit=quantity.unit, start=float(value), least=max(lows, default=-math.inf),
        most=min(highs, default=math.inf), scale=scale,
    )  # fmt: skip


def _weights(series: Sequence[Series], deviations: Sequence[float] | None) -> list[float]:
    if deviations is None:
        if len(series) > 1:
            raise InputError(
                "several variables are observed; give the standard deviation of each by --std, which weights them"
            )
        return [1.0]
    if len(deviations) != len(series):
        raise InputError(f"--std has {len(deviations)} values for {len(series)} observed variables; give one for each")
    if not all(math.isfinite(d) and d > 0.0 for d in deviations):
        raise InputError(
            f"--std is {', '.join(f'{d:g}' for d in deviations)}; every standard deviation must be above 0"
        )
    return [1.0 / d for d in deviations]


def _references(
    content: Any, best: Mapping[str, Any], source: str, fit: Sequence[str], observe: Sequence[str]
) -> dict[str, Reference]:
    """Other formulas fitted to the same data, where the system has some (`SystemDefinition.reference_formulas`)."""
    module, found = cases.system(content["system"]), {}
    for label, changes in module.reference_formulas.items():
        other = calibrate(
            cases.content_of(content, {**best, **changes}), source, fit=fit, observe=observe, model="closed-form",
            references=False, fixed=changes,
        )  # fmt: skip
        found[label] = Reference(modelled=other.modelled, rms=other.rms)
    return found
