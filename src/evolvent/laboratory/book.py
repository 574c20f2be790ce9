"""Predictions of measured quantities: what was predicted with which band, what was measured, and the verdict."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from evolvent.base.errors import InputError
from evolvent.base.schema import Section
from evolvent.results.figures import Figure

Array = np.ndarray
#: Half width of a band of 95 %, in standard deviations.
COVER = 1.96


@dataclasses.dataclass(frozen=True, kw_only=True)
class Band:
    """Standard uncertainties of the difference between prediction and measurement, stated before they are compared.

    Attributes
    ----------
    measurement : float, of the measured values
    parameters : float, of the prediction by what the model takes from elsewhere
    numerics : float, of the prediction by steps, meshes and tolerances
    how : str, where each of them is from
    """

    measurement: float
    parameters: float
    numerics: float
    how: str = ""

    @property
    def half_width(self) -> float:
        """Half width of the band of 95 %."""
        return COVER * math.sqrt(self.measurement**2 + self.parameters**2 + self.numerics**2)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Comparison:
    """One predicted quantity beside the measured one.

    Attributes
    ----------
    what : str
    unit : str
    predicted, measured : float; of a record, the root mean square of the difference and 0; measured is NaN where
        nothing is
    band : Band
    allowed : float, largest difference by which the goal is met; NaN without a goal
    goal : str, the goal in words
    """

    what: str
    unit: str
    predicted: float
    measured: float
    band: Band
    allowed: float = math.nan
    goal: str = ""

    @property
    def difference(self) -> float:
        """Predicted less measured."""
        return self.predicted - self.measured

    @property
    def compared(self) -> bool:
        """Whether there is a measurement: without one the prediction stands alone, with its band."""
        return math.isfinite(self.measured)

    @property
    def covered(self) -> bool:
        """Whether the difference lies within the band."""
        return abs(self.difference) <= self.band.half_width

    @property
    def meets(self) -> bool:
        """Whether the goal is met; True without one, and without a measurement."""
        return not (self.compared and math.isfinite(self.allowed)) or abs(self.difference) <= self.allowed


@dataclasses.dataclass(frozen=True, kw_only=True)
class Verdict:
    """What a set says.

    Attributes
    ----------
    comparisons : tuple of Comparison
    figures : tuple of Figure
    notes : tuple of str, sentences on what was done and what a reader must know
    """

    comparisons: tuple[Comparison, ...]
    figures: tuple[Figure, ...]
    notes: tuple[str, ...] = ()

    @property
    def missed(self) -> list[Comparison]:
        """Comparisons that do not meet their goals."""
        return [one for one in self.comparisons if not one.meets]

    @property
    def coverage(self) -> tuple[int, int]:
        """Comparisons within their bands, and all of them; not those without a measurement."""
        return sum(one.covered for one in self.comparisons), sum(one.compared for one in self.comparisons)

    @property
    def text(self) -> str:
        """The verdict in one sentence."""
        goals = sum(one.compared and math.isfinite(one.allowed) for one in self.comparisons)
        within, all_ = self.coverage
        if all_ == 0:
            return "nothing is measured: the predictions stand with their bands"
        met = f"{goals - len(self.missed)} of {goals} goals are met; " if goals else ""
        return f"{met}{within} of {all_} differences are within their bands of 95 %"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Set:
    """A set of measurements.

    Attributes
    ----------
    name, title : str
    source : str, where the measurements are from, with their licence
    Settings : class of the keys that `--set` changes
    run : function of the settings, and of a folder or file with measurements of the same form (None for those of the
        package), to the verdict
    """

    name: str
    title: str
    source: str
    Settings: type[Section]
    run: Callable[[Any, str | None], Verdict]

    def validate(self, overrides: Mapping[str, Any] | None = None, data: str | None = None) -> Verdict:
        """Predict and compare.

        Parameters
        ----------
        overrides : mapping, keys of the settings
        data : str, folder or file with measurements of the same form

        Raises
        ------
        InputError
            For keys and files that cannot be used.
        """
        try:
            settings = self.Settings(**dict(overrides or {}))
        except InputError as error:
            raise InputError(str(error).replace(f"{self.Settings.__name__}.", "")) from None
        return self.run(settings, data)


def rows(found: Verdict) -> list[list[str]]:
    """A table of the comparisons: its head, then a row each."""
    head = ["what", "predicted", "measured", "difference", "band, 95 %", "goal", "verdict"]
    table = [head]
    for one in found.comparisons:
        unit = f" {one.unit}" if one.unit and one.unit != "1" else ""
        measured, difference, verdict = "-", "-", "predicted"
        if one.compared:
            measured, difference = f"{one.measured:.4g}{unit}", f"{one.difference:+.3g}"
            verdict = ("met" if one.meets else "MISSED") if math.isfinite(one.allowed) else "-"
            verdict += ", within" if one.covered else ", outside"
        table.append([
            one.what, f"{one.predicted:.4g}{unit}", measured, difference, f"{one.band.half_width:.2g}",
            one.goal or "-", verdict,
        ])  # fmt: skip
    return table


def as_json(of: Set, found: Verdict) -> str:
    """A set with its comparisons as JSON."""
    content = {
        "set": of.name, "title": of.title, "source": of.source, "verdict": found.text, "notes": list(found.notes),
        "comparisons": [
            {
                "what": one.what, "unit": one.unit, "predicted": one.predicted,
                "measured": one.measured if one.compared else None,
                "difference": one.difference if one.compared else None, "half_width": one.band.half_width,
                "uncertainty": {
                    "measurement": one.band.measurement, "parameters": one.band.parameters,
                    "numerics": one.band.numerics, "how": one.band.how,
                },
                "covered": one.covered, "goal": one.goal, "meets": one.meets,
                "allowed": one.allowed if math.isfinite(one.allowed) else None,
            }
            for one in found.comparisons
        ],
    }  # fmt: skip
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


def rms(differences: Sequence[Array] | Array) -> float:
    """Root mean square of all entries."""
    joined = np.concatenate([np.ravel(one) for one in differences])
    return float(np.sqrt(np.mean(joined**2)))
