"""A study with drawn keys, run and evaluated: every result with its bounds, quantiles and sensitivities."""

from __future__ import annotations

import dataclasses
import json
import math
import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from evolvent import cases
from evolvent.analysis import limits
from evolvent.design.dispersions import order, sensitivity
from evolvent.design.dispersions.answer import Dispersion, Draw, Failure, Met, Output
from evolvent.design.evaluator.evaluator import Progress
from evolvent.design.evaluator.pools import Report
from evolvent.design.studies import draws, runner
from evolvent.design.studies.study import Study, first_plan, read as read_study
from evolvent.results import variables
from evolvent.results.kept import ENDINGS, split, stored_name
from evolvent.results.limits import LIMITS
from evolvent_base.errors import InputError
from evolvent_base.units import unit_text

Array = np.ndarray
#: Probabilities of the quantiles that are stated.
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
#: Most entries of a variable that are each a result.
_MOST_ENTRIES = 24


def disperse(
    study: str | os.PathLike[str] | Mapping[str, Any] | Study,
    *,
    coverage: float = 0.95,
    confidence: float = 0.95,
    until: Any = None,
    output: str | os.PathLike[str] | None = None,
    workers: int | None = 1,
    scheduler: str | None = None,
    progress: Progress | None = None,
    report: Report | None = None,
) -> Dispersion:
    """Run a study whose keys are drawn, and state bounds, quantiles and sensitivities of its results.

    Parameters
    ----------
    study : str, path, mapping or Study
        As of `evolvent.sweep`, with ``sample: monte-carlo``, ``latin-hypercube``, ``sobol``, ``saltelli`` or
        ``corners``. Its case may be a `System`.
    coverage : float
        Share of all runs that a bound covers.
    confidence : float
        Of bounds and intervals.
    until : float, s, or with a unit
        How long a structure is followed; as its case or the settings of a `System` say if left out.
    output, workers, scheduler, progress, report
        As of `evolvent.sweep`.

    Returns
    -------
    Dispersion

    Raises
    ------
    InputError
        As of `evolvent.sweep`, or if the study draws nothing or keeps a variable with a value at every sample.

    Examples
    --------
    >>> import evolvent
    >>> study = {
    ...     "case": "solar-array", "sample": "monte-carlo", "samples": 59,
    ...     "over": {"parts.hinge 1.stiffness": "normal(nominal, 5%)"}, "keep": ["hinge 1.latch_time.last"],
    ... }
    >>> evolvent.disperse(study)["hinge 1.latch_time.last"].upper.value  # doctest: +SKIP
    """
    for name, value in (("coverage", coverage), ("confidence", confidence)):
        check_share(name, value)
    if until is not None and isinstance(study, Study):
        raise InputError(f"until is {until!r}, but the study is read already; give simulate.until in its 'set'")
    changes = {} if until is None else {"set": {"simulate.until": until}}
    asked = study if isinstance(study, Study) else read_study(study, changes)
    wanted = _limits(asked)
    keep = tuple(dict.fromkeys((*asked.keep, *(one.keep for one in wanted))))
    asked = dataclasses.replace(asked, keep=keep, limits=tuple(dataclasses.asdict(one) for one in wanted))
    check(asked)
    found = runner.sweep(asked, output=output, workers=workers, scheduler=scheduler, progress=progress, report=report)
    return evaluate(found, coverage=coverage, confidence=confidence)


def _limits(study: Study) -> tuple[limits.Requirement, ...]:
    """Limits of the case of a study; none of one in stages.

    Raises
    ------
    InputError
        For a text that is no limit, and a name that runs of the case do not have.
    """
    texts = study.content.get(LIMITS) if isinstance(study.content, Mapping) and not study.stages else None
    if not texts:
        return ()

    def start() -> xr.DataTree | None:
        plan = first_plan(study)
        return None if plan.start is None else plan.start()

    def coordinates() -> Sequence[str]:
        case = cases.load(study.content, study.fixed)
        return list(cases.system(case.system).margin(case, motion=False).names)

    def parts() -> Mapping[str, Any]:
        case = cases.load(study.content, study.fixed)
        return cases.system(case.system).system(case).parts

    return limits.of_texts(texts, limits.Names(start, coordinates, parts, "it asks for"))


def _met(one: limits.Requirement, dataset: xr.Dataset) -> Met:
    """How many runs meet a limit; those that failed do not."""
    values = dataset[stored_name(one.keep)].values
    well = dataset["status"].values != "failed"
    met = sum(one.is_met(float(value)) for value, is_well in zip(values, well, strict=True) if is_well)
    return Met(text=one.text, count=int(met), share=float(met) / well.size)


def check_share(name: str, value: Any) -> None:
    """Refuse a coverage or a confidence that is none.

    Raises
    ------
    InputError
    """
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0.0 < value < 1.0:
        raise InputError(f"{name} is {value!r}; it must be above 0 and below 1, such as 0.95")


def check(study: Study) -> None:
    """Refuse, before any run, a study that draws nothing or keeps what has a value at every sample.

    Raises
    ------
    InputError
    """
    if study.sample not in draws.DRAWN:
        raise InputError(
            f"the study {study.name!r} has sample: {study.sample}, which draws nothing; a dispersion needs one of "
            f"{', '.join(draws.DRAWN)}"
        )
    whole = [name for name in study.keep if not split(name)[1]]
    start = first_plan(study).start if whole and not study.stages else None
    if start is None:
        return
    run = start()
    for name in whole:
        try:
            values = variables.get(run, name)
        except InputError:  # of a margin or a statistic
            continue
        if "time" in values.dims:
            raise InputError(
                f"keep holds {name!r}, which has a value at every sample, but a dispersion needs one of each run; "
                f"write '{name}.last', or another of .{', .'.join(ENDINGS)} in the place of .last"
            )


def evaluate(dataset: xr.Dataset, *, coverage: float = 0.95, confidence: float = 0.95) -> Dispersion:
    """Bounds, quantiles and sensitivities of a study that was run.

    Parameters
    ----------
    dataset : of `evolvent.sweep` or `evolvent.design.studies.open`
    coverage : share of all runs that a bound covers
    confidence : of bounds and intervals

    Returns
    -------
    Dispersion

    Raises
    ------
    InputError
        If the study drew nothing, or keeps nothing that can be evaluated.
    """
    check_share("coverage", coverage)
    check_share("confidence", confidence)
    sample = str(dataset.attrs["sample"])
    content = cases.parse_yaml(dataset.attrs["study"], "the study")
    if sample not in draws.DRAWN or "draws" not in dataset.attrs:
        raise InputError(f"the study has sample: {sample}, which draws nothing; a dispersion needs {draws.DRAWN[1]}")
    own = _draws(dataset)
    failed = dataset["status"].values == "failed"
    evaluated = _Evaluation(sample, own, coverage, confidence)
    outputs: list[Output] = []
    notes: list[str] = []
    bounds = [limits.Requirement(**one) for one in json.loads(dataset.attrs.get(LIMITS, "[]"))]
    wanted = {stored_name(name): name for name in [*(one.keep for one in bounds), *(content.get("keep") or [])]}
    for name, variable in dataset.data_vars.items():
        if name in ("status", "reason") or variable.dtype.kind != "f" or variable.dims[:1] != ("case",):
            continue
        if variable[0].size > _MOST_ENTRIES:
            notes.append(
                f"{wanted.get(str(name), name)} has {variable[0].size} values in every run and is not evaluated; "
                f"reduce it with .last, .max or another reduction"
            )
            continue
        outputs += evaluated.of(wanted.get(str(name), str(name)), variable, failed)
    if not outputs:
        raise InputError(
            "the study keeps no number that can be evaluated; give keep a variable with a reduction, such as "
            "'hinge 1.latch_time.last'"
        )
    notes += _notes(sample, outputs, int(failed.sum()), failed.size, confidence)
    keys = json.loads(dataset.attrs["keys"])
    failures = tuple(
        Failure(
            case=int(k), reason=str(dataset["reason"].values[k]), keys={key: dataset[key].values[k] for key in keys}
        )
        for k in np.flatnonzero(failed)
    )
    return Dispersion(
        dataset=dataset, name=str(content.get("study", "study")), sample=sample, count=failed.size, coverage=coverage,
        confidence=confidence, draws=own, outputs=tuple(outputs), failures=failures, notes=tuple(notes),
        limits=tuple(_met(one, dataset) for one in bounds),
    )  # fmt: skip


def _draws(dataset: xr.Dataset) -> tuple[Draw, ...]:
    keys, of, texts = (json.loads(dataset.attrs[name]) for name in ("keys", "draws", "distributions"))
    found = []
    for k in sorted(set(of)):
        own = [key for key, draw in zip(keys, of, strict=True) if draw == k]
        first = dataset[own[0]]
        values = first.values.astype(float) if first.dtype.kind in "iuf" else np.full(first.size, np.nan)
        unit = str(first.attrs.get("units", "1"))
        found.append(
            Draw(keys=tuple(own), text=texts[keys.index(own[0])], unit="" if unit == "1" else unit, values=values)
        )
    return tuple(found)


@dataclasses.dataclass(frozen=True)
class _Evaluation:
    """Evaluates variables of a study."""

    sample: str
    draws: tuple[Draw, ...]
    coverage: float
    confidence: float

    def of(self, name: str, variable: xr.DataArray, failed: Array) -> list[Output]:
        """The results of a variable, one for every entry."""
        text, unit = str(variable.attrs.get("long_name", name)), str(variable.attrs.get("units", "1"))
        unit = "" if unit == "1" else unit_text(unit)
        found = []
        for place in np.ndindex(variable.shape[1:]):
            labels = [
                str(variable[dim].values[k]) if dim in variable.coords else str(k)
                for dim, k in zip(variable.dims[1:], place, strict=True)
            ]
            entry = f"{name}[{', '.join(labels)}]" if labels else name
            values = np.where(failed, np.nan, variable.values[(slice(None), *place)])
            found.append(self._one(entry, text, unit, values))
        return found

    def _one(self, name: str, text: str, unit: str, values: Array) -> Output:
        size, d = values.size, len(self.draws)
        seen = np.arange(size) < (2 * size // (d + 2) if self.sample == "saltelli" else size)
        own = values[seen]
        finite, lacking = own[np.isfinite(own)], int(np.sum(~np.isfinite(own)))
        independent = self.sample == "monte-carlo"
        return Output(
            name=name, text=text, unit=unit, values=values, seen=seen, moments=order.moments(finite),
            upper=self._bound(finite, lacking, upper=True), lower=self._bound(finite, lacking, upper=False),
            quantiles=[] if self.sample == "corners" else order.quantiles(
                finite, lacking, QUANTILES, self.confidence, independent=independent
            ),
            regression=self._regression(own, seen),
            indices=sensitivity.sobol(values, d, self.confidence) if self.sample == "saltelli" else None,
        )  # fmt: skip

    def _bound(self, finite: Array, lacking: int, *, upper: bool) -> order.Bound:
        if self.sample == "monte-carlo":
            return order.bound(finite, lacking, upper=upper, coverage=self.coverage, wanted=self.confidence)
        why = f"runs of sample: {self.sample} are not independent; monte-carlo gives bounds"
        return order.Bound(value=math.nan, confidence=math.nan, rank=0, why=why)

    def _regression(self, y: Array, seen: Array) -> sensitivity.Regression:
        x = np.stack([one.values[seen] for one in self.draws], axis=1)
        kept = np.isfinite(y) & np.all(np.isfinite(x), axis=1)
        return sensitivity.regression(x[kept], y[kept], self.confidence)


def _notes(sample: str, outputs: list[Output], failed: int, count: int, confidence: float) -> list[str]:
    found = []
    if failed:
        if sample == "monte-carlo":
            low, high = order.failure_interval(failed, count, confidence)
            share = f"; their probability is between {100 * low:.2g} % and {100 * high:.2g} %"
            counts = "every bound counts them as beyond it, and sensitivities leave them out"
        else:
            share, counts = "", "statistics and sensitivities leave them out"
        found.append(f"{failed} of {count} runs failed{share}; {counts}")
    for one in outputs:
        if one.lacking and int(np.sum(~np.isfinite(one.values))) > failed:
            found.append(
                f"{one.name} has no value in {int(np.sum(~np.isfinite(one.values))) - failed} runs that did not fail, "
                f"which count as failed ones do"
            )
    return found
