"""Files and a description in, a measurement out."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import scipy

from evolvent_base import progress, signals as files
from evolvent_base.errors import InputError
from evolvent_massprops import modal, pendulum, springs, springs_combined, springs_search
from evolvent_massprops.certificate import MassProperties
from evolvent_massprops.description import Description, OnSprings, Signalling, for_recording, load, without_stand
from evolvent_massprops.estimates import Evaluation, Share, coverage_factors, degrees
from evolvent_massprops.identification.swing_model import LINEAR
from evolvent_massprops.identification.swing_starts import Kind
from evolvent_massprops.recordings import read


def mass_properties(
    signals: str | os.PathLike[str] | files.Signals | Sequence[Any],
    stand: Any,
    overrides: Mapping[str, Any] | None = None,
) -> MassProperties:
    """Mass properties of a body from recordings of its free vibration.

    Parameters
    ----------
    signals : path or Signals, or several of them
        Several recordings are evaluated one by one, and their mean is given.
    stand : path or mapping
        The description of signals, stand and body.
    overrides : mapping, dotted key -> value, put in place of the description's own

    Returns
    -------
    MassProperties

    Raises
    ------
    InputError
        One sentence, for anything that does not support a result.

    Notes
    -----
    The mean of n recordings has what they share (GUM, 2008, eq. 10) and what is each one's own: the larger of the
    scatter s / sqrt(n) (GUM, eq. 5) and of what noise and own inputs let expect. Degrees of freedom by Welch and
    Satterthwaite (GUM, eq. G.2b); with few of them k is Student's, for the probability that the factor asked has in a
    normal distribution.
    """
    given = load(stand, overrides)
    several = [signals] if isinstance(signals, (str, os.PathLike, files.Signals)) else list(signals)
    if not several:
        raise InputError("no signals are given; name at least one file")
    combined = isinstance(given, OnSprings) and given.has_mounting
    if len(several) > 1 and given.uncertainty.method == "monte-carlo" and not combined:
        raise InputError(
            f"uncertainty.method is 'monte-carlo', which takes one recording, not {len(several)}; use 'gum'"
        )
    sources = [_source(item, given) for item in several]
    same = [s.path for k, s in enumerate(sources) if s.sha256 in [other.sha256 for other in sources[:k]]]
    if same:
        raise InputError(f"{same[0]!r} holds the same bytes as another of the files; a recording counts once")
    if combined:
        return _combined(given, sources)
    evaluations = []
    for source in progress.track(sources, "evaluating recordings"):
        try:
            evaluations.append(_evaluation(given, source))
        except InputError as error:
            if len(sources) == 1:
                raise
            raise InputError(f"{source.path}: {error}") from None
    return _together(given, sources, evaluations)


def _combined(given: Description, sources: Sequence[files.Signals]) -> MassProperties:
    """One estimate of recordings on springs in several mountings, with tare and air."""
    recordings, quiets = [], []
    for source in progress.track(sources, "evaluating recordings"):
        try:
            own_given, own, found, quiet = _modes(given, source)
        except InputError as error:
            raise InputError(f"{source.path}: {error}" if len(sources) > 1 else str(error)) from None
        assert isinstance(own_given, OnSprings)
        recordings.append(springs_search.Recording(own_given, found, own, os.path.basename(source.path)))
        quiets.append(quiet)
    progress.report("computing mass properties from all recordings")
    joint = springs_combined.evaluate(recordings)
    evaluations = [
        dataclasses.replace(e, warnings=(quiet, *e.warnings)) if quiet else e
        for e, quiet in zip(joint.evaluations, quiets, strict=True)
    ]
    return _measured(given, sources, evaluations, joint.values, joint.shares, joint.covariance, joint.draws)


def _source(item: Any, given: Signalling) -> files.Signals:
    """The columns of a file; of a run, the variables that the sensors name."""
    if isinstance(item, files.Signals):
        return item
    return files.read(item, [s.column for s in given.signals.sensors if isinstance(s.column, str)])


def vibration(
    signals: str | os.PathLike[str] | files.Signals,
    columns: Sequence[str] = (),
    overrides: Mapping[str, Any] | None = None,
) -> modal.Modal:
    """Modes of one recording of free vibration, or of variables of a run.

    Parameters
    ----------
    signals : path or Signals
    columns : names of columns, or of a run's variables ("boom.tip_deflection.y"); all columns but the time if left out
    overrides : mapping, keys of a description's `signals` and `identification`, such as ``{"signals.start": "2 s"}``

    Returns
    -------
    evolvent_massprops.modal.Modal

    Raises
    ------
    InputError
        One sentence, for columns and signals that do not support a result.
    """
    given = without_stand(columns, overrides)
    reading = read(_source(signals, given), given.signals)
    quiet = modal.late_start_warning(reading)
    try:
        found = modal.find(reading, given)
    except InputError as error:
        raise InputError(f"{error}; {quiet}" if quiet else str(error)) from None
    return dataclasses.replace(found, warnings=(quiet, *found.warnings)) if quiet else found


def _modes(given: Description, source: files.Signals) -> tuple[Description, tuple[str, ...], modal.Modal, str]:
    """The description for one recording, keys that are its own, its modes, and a warning of a late start."""
    name = os.path.basename(source.path)
    own_given, own = for_recording(given, name)
    progress.report(f"reading {name}")
    reading = read(source, own_given.signals)
    quiet = modal.late_start_warning(reading)
    try:
        progress.report(f"identifying the modes of {name}")
        if isinstance(own_given, OnSprings):
            swing = Kind(restoring=LINEAR)
        else:
            swing = pendulum.swing(own_given, reading.unit, reading.rate)
        return own_given, own, modal.find(reading, own_given, swing), quiet
    except InputError as error:
        raise InputError(f"{error}; {quiet}" if quiet else str(error)) from None


def _evaluation(given: Description, source: files.Signals) -> Evaluation:
    own_given, own, found, quiet = _modes(given, source)
    try:
        progress.report(f"computing mass properties from {os.path.basename(source.path)}")
        if isinstance(own_given, OnSprings):
            evaluation = springs.evaluate(own_given, found, own)
        else:
            evaluation = pendulum.evaluate(own_given, found, own)
    except InputError as error:
        raise InputError("; ".join([str(error), *([quiet] if quiet else []), *found.clipped])) from None
    return dataclasses.replace(evaluation, warnings=(quiet, *evaluation.warnings)) if quiet else evaluation


def _together(given: Description, sources: Sequence[files.Signals], evaluations: list[Evaluation]) -> MassProperties:
    first, n = evaluations[0], len(evaluations)
    if any(e.outputs != first.outputs for e in evaluations):
        raise InputError("recordings have different unknowns; they must have the same")
    values = np.array([e.values for e in evaluations])
    mean = values.mean(axis=0)
    if n == 1:
        shares, covariance = first.shares, first.covariance
    else:
        shares, covariance = _mean_shares(evaluations, values)
    measured = _measured(given, sources, evaluations, mean, shares, covariance, first.draws if n == 1 else None)
    if n == 1:
        return measured
    more = [*_scattered(evaluations, values), *_outliers(evaluations, values)]
    return dataclasses.replace(measured, warnings=(*measured.warnings, *more))


def _measured(
    given: Description,
    sources: Sequence[files.Signals],
    evaluations: list[Evaluation],
    values: np.ndarray,
    shares: tuple[Share, ...],
    covariance: np.ndarray,
    draws: np.ndarray | None,
) -> MassProperties:
    """The result, with coverage intervals and the recordings' warnings."""
    n = len(evaluations)
    asked = given.uncertainty.coverage_factor
    dof = degrees(shares, np.diag(covariance))
    probability = 2.0 * scipy.stats.norm.cdf(asked) - 1.0
    factor = coverage_factors(asked, dof)
    std = np.sqrt(np.diag(covariance))
    interval = np.array([values - factor * std, values + factor * std])
    if draws is not None:
        interval = np.quantile(draws, [0.5 - 0.5 * probability, 0.5 + 0.5 * probability], axis=0)
    warnings = []
    for e in evaluations:
        texts = [*e.modal.reading.notes, *e.warnings]
        name = os.path.basename(e.modal.reading.source.path)
        warnings += [f"{name}: {text}" if n > 1 else text for text in texts]
    if not any(np.isfinite(s.std) and s.label[:6] != "noise:" for e in evaluations for s in e.shares):
        warnings.append(
            "the description states no uncertainty of any mass, length or stiffness; u includes the signals alone, "
            "not the stand's calibration"
        )
    return MassProperties(
        description=given,
        signals=tuple(sources),
        evaluations=tuple(evaluations),
        outputs=evaluations[0].outputs,
        values=values,
        covariance=covariance,
        shares=shares,
        dof=dof,
        factor=factor,
        interval=interval,
        has_uncertainties=all(e.modal.has_uncertainties for e in evaluations),
        warnings=tuple(warnings),
    )


def _mean_shares(evaluations: list[Evaluation], values: np.ndarray) -> tuple[tuple[Share, ...], np.ndarray]:
    """Budget and covariance of the mean over recordings."""
    n = len(evaluations)
    shares = []
    own = np.zeros((n, values.shape[1]))
    labels = [s.label for s in evaluations[0].shares if not s.own]
    for label in labels:
        rows = [s for e in evaluations for s in e.shares if s.label == label]
        shares.append(rows[0]._replace(contribution=np.mean([s.contribution for s in rows], axis=0)))
    for k, e in enumerate(evaluations):
        own[k] = np.sum([s.contribution**2 for s in e.shares if s.own], axis=0)
    expected = own.mean(axis=0) / n
    scatter = np.cov(values, rowvar=False).reshape(values.shape[1], values.shape[1]) / n
    larger = np.diag(scatter) >= expected
    both = np.sqrt(np.where(larger, np.diag(scatter), expected))
    label = f"scatter of {n} recordings" if larger.all() else f"noise and own inputs of {n} recordings"
    shares.append(Share(label, "", np.nan, np.nan, both, True, float(n - 1) if larger.all() else np.inf))
    common = np.array([s.contribution for s in shares[:-1]]).reshape(len(shares) - 1, values.shape[1])
    s = np.sqrt(np.diag(scatter))
    correlation = np.divide(scatter, np.outer(s, s), out=np.eye(len(s)), where=np.outer(s, s) > 0.0)
    return tuple(shares), common.T @ common + correlation * np.outer(both, both)


def _scattered(evaluations: list[Evaluation], values: np.ndarray) -> list[str]:
    """Values that scatter more than their own uncertainties let expect (chi squared, 1 %)."""
    own = np.mean([np.sum([s.contribution**2 for s in e.shares if s.own], axis=0) for e in evaluations], axis=0)
    scatter = values.var(axis=0, ddof=1)
    n = len(values) - 1
    return [
        f"{output.key} scatters over the recordings by {np.sqrt(s):.2g} {output.unit}, {np.sqrt(s / o):.1f} times what "
        "noise and own inputs predict: u of the mean includes it, u of a single recording does not"
        for output, s, o in zip(evaluations[0].outputs, scatter, own, strict=True)
        if o > 0.0 and s / o > scipy.stats.chi2.ppf(0.99, n) / n
    ]


def _outliers(evaluations: list[Evaluation], values: np.ndarray) -> list[str]:
    """Recordings far from the others: more than 4.5 of the scaled median deviations (three recordings at least)."""
    if len(values) < 5:
        return []
    off = np.abs(values - np.median(values, axis=0))
    scale = 1.4826 * np.median(off, axis=0)
    bad = np.flatnonzero(np.any(off > 4.5 * np.where(scale > 0.0, scale, np.inf), axis=1))
    names = [os.path.basename(evaluations[k].modal.reading.source.path) for k in bad]
    return [f"{name} is far from the other recordings; it is still used" for name in names]
