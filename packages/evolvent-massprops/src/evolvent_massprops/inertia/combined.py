"""Several recordings of one body, however it was mounted, against one set of unknowns."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from evolvent_base.errors import InputError
from evolvent_massprops.inertia.problem import BODY_NAMES, InertiaProblem, scale_of, value_of
from evolvent_massprops.inertia.stand import Setup

#: What is said where no recording has the body on the stand.
NO_BODY = "mounting.body is false for all recordings; at least one must have the body on the stand"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Combined:
    """Recordings that share unknowns.

    Attributes
    ----------
    problems : tuple of InertiaProblem, one a recording, without priors
    unknown : tuple of str
        Names of the unknowns of all; that of a number that only some recordings have is followed by "@" and a mark.
    own : tuple of tuple of str
        Of each problem, the names in `unknown` behind its own unknowns, in their order.
    prior : tuple of (name, value, standard deviation)
    generalized : bool
        Whether known numbers count with their uncertainties when the data are weighted (generalized least squares).
    """

    problems: tuple[InertiaProblem, ...]
    unknown: tuple[str, ...]
    own: tuple[tuple[str, ...], ...]
    prior: tuple[tuple[str, float, float], ...] = ()
    generalized: bool = False

    @property
    def parts(self) -> tuple[tuple[InertiaProblem, list[int]], ...]:
        """Each problem with the places of its unknowns among all."""
        places = {name: k for k, name in enumerate(self.unknown)}
        return tuple((p, [places[n] for n in own]) for p, own in zip(self.problems, self.own, strict=True))

    @property
    def base(self) -> Setup:
        """Setup of the first recording."""
        return self.problems[0].base

    @property
    def weighted(self) -> bool:
        """Whether the covariances were given and may be propagated."""
        return all(p.weighted for p in self.problems)

    @property
    def has_shapes(self) -> bool:
        """Whether shapes were measured."""
        return any(p.has_shapes for p in self.problems)

    @property
    def free_scales(self) -> int:
        """Number of shapes whose scale is free."""
        return sum(p.free_scales for p in self.problems)

    @property
    def groups(self) -> dict[str, np.ndarray]:
        """Rows of the residual: of frequencies, shapes, and priors."""
        found: dict[str, list[np.ndarray]] = {"frequencies": [], "shapes": []}
        for p, first in zip(self.problems, self.first_rows, strict=False):
            for label, rows in found.items():
                rows.append(first + p.groups[label])
        last = self.first_rows[-1]
        return {label: np.concatenate(rows) for label, rows in found.items()} | {
            "priors": last + np.arange(len(self.prior))
        }

    @property
    def first_rows(self) -> list[int]:
        """(n + 1,) first row of each problem's residual, and of the priors."""
        return [0, *np.cumsum([sum(len(g) for g in p.groups.values()) for p in self.problems]).tolist()]

    @property
    def initial_estimate(self) -> np.ndarray:
        """(p,) values of the unknowns in the problems' setups."""
        return self._each(value_of)

    @property
    def scale(self) -> np.ndarray:
        """(p,) sizes of the unknowns."""
        return self._each(scale_of)

    def _each(self, function: Callable[[Setup, str], float | np.ndarray]) -> np.ndarray:
        found = np.full(len(self.unknown), np.nan)
        for p, places in reversed(self.parts):
            found[places] = [float(function(p.base, name)) for name in p.unknown]
        return found

    @property
    def on(self) -> list[int]:
        """Numbers of the recordings with the body on the stand that is asked; with any, if none is."""
        on = [k for k, p in enumerate(self.problems) if p.base.mounting is None or p.base.mounting.occupied]
        return [k for k in on if set(BODY_NAMES) & set(self.problems[k].unknown)] or on

    def assigned(self, values: np.ndarray) -> Setup:
        """The setup of the first recording with the body on the stand, with values of the unknowns."""
        if not self.on:
            raise InputError(NO_BODY)
        p, places = self.parts[self.on[0]]
        return p.assigned(values[..., places])

    def joined(self, rows: Sequence[np.ndarray], values: np.ndarray) -> np.ndarray:
        """Residuals of the problems, and behind them the rows of the priors."""
        batch = np.broadcast_shapes(*(r.shape[:-1] for r in rows))
        last = [
            np.broadcast_to((values[..., self.unknown.index(name), None] - value) / std, (*batch, 1))
            for name, value, std in self.prior
        ]
        return np.concatenate([*(np.broadcast_to(r, (*batch, r.shape[-1])) for r in rows), *last], axis=-1)

    def residual(self, values: np.ndarray) -> np.ndarray:
        """Model less data (..., r), in standard deviations of the data: one problem after the other, then priors."""
        values = np.asarray(values)
        return self.joined([p.residual(values[..., places]) for p, places in self.parts], values)

    def jacobian(self, values: np.ndarray) -> np.ndarray:
        """(r, p) derivative of the residual by the unknowns; central differences."""
        first = self.first_rows
        J = np.zeros((first[-1] + len(self.prior), len(self.unknown)))
        for k, (p, places) in enumerate(self.parts):
            if places:
                J[first[k] : first[k + 1], places] = p.jacobian(values[places])
        for k, (name, _, std) in enumerate(self.prior):
            J[first[-1] + k, self.unknown.index(name)] = 1.0 / std
        return J

    def with_unknown(self, name: str, values: np.ndarray) -> Combined:
        """The same with one number of the body more among the unknowns, all at given values."""
        problems, own = [], []
        for k, ((p, places), names) in enumerate(zip(self.parts, self.own, strict=True)):
            more = k in self.on or name == "stiffness"
            extra = (name,) if more else ()
            problems.append(dataclasses.replace(p, base=p.assigned(values[places]), unknown=(*p.unknown, *extra)))
            own.append((*names, *extra))
        return dataclasses.replace(self, problems=tuple(problems), own=tuple(own), unknown=(*self.unknown, name))
