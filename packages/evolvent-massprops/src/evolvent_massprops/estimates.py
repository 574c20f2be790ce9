"""Results of one recording, and of all of them together."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
import scipy

from evolvent_base.signals import Signals
from evolvent_massprops.description import Description, OnSprings
from evolvent_massprops.inertia import Candidate
from evolvent_massprops.modal import Modal


class Output(NamedTuple):
    """A quantity that was asked for: key, what it is, unit."""

    key: str
    label: str
    unit: str


class Share(NamedTuple):
    """What an input adds to the outputs' uncertainty.

    Attributes
    ----------
    label : str
    unit : str
    value : of the input, nan for a group
    std : standard uncertainty of the input, nan for a group
    contribution : (p,) change of the outputs for a change of the input by its uncertainty, signed; a group's deviation
    own : whether it is a recording's own, independent of others'
    dof : degrees of freedom
    """

    label: str
    unit: str
    value: float
    std: float
    contribution: np.ndarray
    own: bool = False
    dof: float = np.inf


@dataclasses.dataclass(frozen=True, eq=False)
class Evaluation:
    """Results of one recording.

    Attributes
    ----------
    modal : Modal
    used : indices of the modes that were used, by rising frequency
    outputs : (p,) Output
    values : (p,)
    covariance : (p, p) of all inputs and the data
    shares : Share each
    why : sentences: how modes and solution were chosen
    assumed : (what, value) that was not measured
    cannot : (what, why) that these data do not determine
    model_frequency : (used,) rad/s, of the model with the values found; nan without one
    agreement : (used,) MAC of measured and model shapes; nan without one
    model_shapes : (used, c) at the sensors, scaled to the measured ones, or None
    consistency : root mean square of the residual in deviations that hold for all inputs and data; nan if just enough
    candidates : of the way from three frequencies
    draws : (n, p) of a Monte Carlo, or None
    warnings : sentences
    """

    modal: Modal
    used: tuple[int, ...]
    outputs: tuple[Output, ...]
    values: np.ndarray
    covariance: np.ndarray
    shares: tuple[Share, ...]
    why: tuple[str, ...] = ()
    assumed: tuple[tuple[str, str], ...] = ()
    cannot: tuple[tuple[str, str], ...] = ()
    model_frequency: np.ndarray = dataclasses.field(default_factory=lambda: np.empty(0))
    agreement: np.ndarray = dataclasses.field(default_factory=lambda: np.empty(0))
    model_shapes: np.ndarray | None = None
    consistency: float = np.nan
    candidates: tuple[Candidate, ...] = ()
    draws: np.ndarray | None = None
    warnings: tuple[str, ...] = ()

    @property
    def std(self) -> np.ndarray:
        """(p,) standard uncertainties."""
        return np.sqrt(np.diag(self.covariance))


class Stated(Protocol):
    """Values with their uncertainties, as tables state them; attributes as of `Estimates`."""

    @property
    def outputs(self) -> tuple[Output, ...]: ...  # noqa: D102
    @property
    def values(self) -> np.ndarray: ...  # noqa: D102
    @property
    def std(self) -> np.ndarray: ...  # noqa: D102
    @property
    def expanded(self) -> np.ndarray: ...  # noqa: D102
    @property
    def dof(self) -> np.ndarray: ...  # noqa: D102
    @property
    def factor(self) -> np.ndarray: ...  # noqa: D102
    @property
    def interval(self) -> np.ndarray: ...  # noqa: D102
    @property
    def shares(self) -> tuple[Share, ...]: ...  # noqa: D102
    @property
    def has_uncertainties(self) -> bool: ...  # noqa: D102


def degrees(shares: Sequence[Share], variance: np.ndarray) -> np.ndarray:
    """(p,) effective degrees of freedom (Welch and Satterthwaite; GUM, eq. G.2b); infinite without a scatter."""
    part = np.zeros(len(variance))
    for share in shares:
        if np.isfinite(share.dof):
            part = part + share.contribution**4 / share.dof
    return np.divide(variance**2, part, out=np.full(len(variance), np.inf), where=part > 0.0)


def coverage_factors(asked: float, dof: np.ndarray) -> np.ndarray:
    """(p,) coverage factors: Student's, for the probability that the factor asked has in a normal distribution."""
    probability = 2.0 * scipy.stats.norm.cdf(asked) - 1.0
    few = np.where(np.isfinite(dof), dof, 1e9)
    return np.where(np.isfinite(dof), scipy.stats.t.ppf(0.5 + 0.5 * probability, few), asked)


class WithCovariance:
    """Uncertainties of values by their covariance (p, p) and coverage factors (p,), which a subclass has."""

    covariance: np.ndarray
    factor: np.ndarray

    @property
    def std(self) -> np.ndarray:
        """(p,) standard uncertainties."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def expanded(self) -> np.ndarray:
        """(p,) expanded uncertainties U = k u."""
        return self.factor * self.std


@dataclasses.dataclass(frozen=True, eq=False)
class Estimates(WithCovariance):
    """What a measurement gives: values with their uncertainties, and what they rest on.

    Attributes
    ----------
    description : what the user wrote, of all recordings
    signals : the files
    evaluations : one a file
    outputs : (p,) Output
    values : (p,) mean over the recordings
    covariance : (p, p)
    shares : budget of the mean
    dof : (p,) effective degrees of freedom (Welch and Satterthwaite)
    factor : (p,) coverage factor k
    interval : (2, p) coverage interval: value -+ k u, or quantiles of the Monte Carlo
    has_uncertainties : whether there are uncertainties of the data; no certificate is written without
    warnings : sentences
    """

    description: Description
    signals: tuple[Signals, ...]
    evaluations: tuple[Evaluation, ...]
    outputs: tuple[Output, ...]
    values: np.ndarray
    covariance: np.ndarray
    shares: tuple[Share, ...]
    dof: np.ndarray
    factor: np.ndarray
    interval: np.ndarray
    has_uncertainties: bool
    warnings: tuple[str, ...]

    @property
    def combined(self) -> bool:
        """Whether all recordings are in one estimate; their mean is given else."""
        return isinstance(self.description, OnSprings) and self.description.has_mounting

    def __getitem__(self, key: str) -> float:
        """Value of an output, such as 'Ixx'."""
        return float(self.values[[o.key for o in self.outputs].index(key)])

    @property
    def notes(self) -> list[str]:
        """What was done to the recordings, such as samples left out; one sentence for all recordings that share it."""
        return self._grouped(of_reading=True)

    @property
    def cautions(self) -> list[str]:
        """The warnings without the notes; one sentence for all recordings that share it."""
        return self._grouped(of_reading=False)

    def _grouped(self, *, of_reading: bool) -> list[str]:
        """Sentences of `warnings`, those that several recordings share with the names of all of them in front."""
        names = {os.path.basename(e.modal.reading.source.path): e.modal.reading.notes for e in self.evaluations}
        found: dict[str, list[str]] = {}
        for sentence in self.warnings:
            head, colon, text = sentence.partition(": ")
            several = len(self.evaluations) > 1 and bool(colon) and head in names
            name, text = (head, text) if several else ("", sentence)
            noted = text in (names[name] if name else [note for notes in names.values() for note in notes])
            if noted == of_reading:
                found.setdefault(text, []).extend([name] if name else [])
        return [f"{', '.join(of)}: {text}" if of else text for text, of in found.items()]
