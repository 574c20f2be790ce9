"""Bands of predictions: which causes of uncertainty they contain, stated before anything is compared."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal

from evolvent_base.schema import Section

#: Half width of a band of 95 %, in standard deviations.
COVER = 1.96
#: Goal: share of the differences of all sets that is within bands of 95 %, from and to.
COVERED = (0.85, 0.99)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Band:
    """Standard uncertainties of the difference between prediction and measurement, stated before they are compared.

    Attributes
    ----------
    measurement : float, of the measured values
    parameters : float, of the prediction by what the model takes from elsewhere
    numerics : float, of the prediction by steps, meshes and tolerances
    how : str, what is special to this band, beside what the set states of all
    shares : mapping, contribution of the set's `Budget` -> its standard uncertainty; `Budget.band` fills it
    """

    measurement: float
    parameters: float
    numerics: float
    how: str = ""
    shares: Mapping[str, float] = dataclasses.field(default_factory=dict)

    @property
    def half_width(self) -> float:
        """Half width of the band of 95 %."""
        return COVER * math.sqrt(self.measurement**2 + self.parameters**2 + self.numerics**2)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Contribution:
    """A cause of uncertainty that the bands of a set contain.

    Attributes
    ----------
    name : str, as the bands name it
    kind : str, part of the band that it belongs to
    size : str, standard uncertainty with its unit; `{key}` is a key of the set's settings
    source : str, where the size is from
    """

    name: str
    kind: Literal["measurement", "parameters", "numerics"]
    size: str
    source: str


@dataclasses.dataclass(frozen=True, kw_only=True)
class Budget:
    """What the bands of a set contain, stated before anything is compared.

    Attributes
    ----------
    contributions : tuple of Contribution
    widened : str, which contributions were chosen or widened with the measurements at hand, and why; empty where all
        were fixed before prediction and measurement were compared
    decided : str, new measurements that were compared with the widened bands; empty without
    """

    contributions: tuple[Contribution, ...]
    widened: str = ""
    decided: str = ""

    @property
    def blind(self) -> bool:
        """Whether the coverage is a test: bands were fixed before, or new measurements have decided since."""
        return not self.widened or bool(self.decided)

    @property
    def marked(self) -> str:
        """When the bands were fixed, in few words."""
        if not self.widened:
            return "fixed before"
        return "widened, " + (f"then compared with {self.decided}" if self.decided else "a new set must decide")

    @property
    def text(self) -> str:
        """When the bands were fixed, with the reason why they were widened."""
        return f"bands: {self.marked}" + (f"; {self.widened}" if self.widened else ", and not widened since")

    def content(self, settings: Section) -> dict[str, Any]:
        """What is stated, for JSON."""
        keys = ("name", "kind", "standard_uncertainty", "source")
        return {
            "contributions": [dict(zip(keys, row[:-1], strict=True)) for row in self.rows(settings)],
            "fixed_before": not self.widened, "widened": self.widened, "decided": self.decided,
        }  # fmt: skip

    def band(self, shares: Mapping[str, float], how: str = "") -> Band:
        """A band by the standard uncertainties of contributions, in the unit of the comparison.

        Raises
        ------
        ValueError
            If a contribution is not stated.
        """
        kinds = {one.name: one.kind for one in self.contributions}
        unknown = sorted(set(shares) - set(kinds))
        if unknown:
            raise ValueError(f"the band contains {', '.join(unknown)}, which the budget of the set does not state")
        sums = dict.fromkeys(("measurement", "parameters", "numerics"), 0.0)
        for name, value in shares.items():
            sums[kinds[name]] = math.hypot(sums[kinds[name]], value)
        return Band(**sums, how=how, shares={name: float(value) for name, value in shares.items()})

    def unstated(self, bands: Sequence[Band]) -> list[str]:
        """Parts of bands that no contribution states."""
        stated = {one.kind for one in self.contributions}
        return [kind for kind in ("measurement", "parameters", "numerics")
                if kind not in stated and any(getattr(one, kind) > 0.0 for one in bands)]  # fmt: skip

    def rows(self, settings: Section, bands: Sequence[Band] = ()) -> list[tuple[str, ...]]:
        """Contributions, a row each: name, part of the band, standard uncertainty, source, share of the variance."""
        values = {key: getattr(settings, key) for key in type(settings).model_fields}
        found = list[tuple[str, ...]]()
        for one in self.contributions:
            shares = [100.0 * (band.shares[one.name] * COVER / band.half_width) ** 2 for band in bands
                      if one.name in band.shares and band.half_width > 0.0]  # fmt: skip
            ends = [f"{x:.0f}" for x in (min(shares), max(shares))] if shares else ["-"]
            found.append((
                one.name, one.kind, one.size.format(**values), one.source, " to ".join(dict.fromkeys(ends)),
            ))  # fmt: skip
        return found
