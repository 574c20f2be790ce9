"""Viscoelastic memory of strains: the Prony terms of materials, and the strains of their branches."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from evolvent.kernels import calls
from evolvent.kernels.viscoelastic import decay
from evolvent.model.family import Family, Kind, record
from evolvent.model.layout import Accounts
from evolvent.model.questions import AdjointSupport, Explicit, Implicit, Parts, Samples, Stability, Statics, never
from evolvent.model.shares import Shares

Array = np.ndarray
#: Steps beside a relaxation time whose end has the softened stiffness of modes.
_LONG = 4.0
#: Steps beside a relaxation time in which strains of branches lie on straight lines, and beyond which those of dashpots
#: do: with the whole strain.
_SHORT, _WHOLE = 1e-3, 1e6


@calls.force
def load(interval, model):
    """Strains of all branches from the accounts of a state."""
    rows = model.branch_strains
    for k in range(rows.size):
        rows[k].w = rows[k].kept = interval.ym[rows[k].account]


@calls.energy
def load_for_energy(interval, model, out):
    """Strains of all branches from the accounts of a state."""
    rows = model.branch_strains
    for k in range(rows.size):
        rows[k].w = rows[k].kept = interval.ym[rows[k].account]


@calls.force
def start(interval, model):
    """A run in time: what ends in a state is the step, not a time of statics."""
    for k in range(model.prony_terms.size):
        model.prony_terms[k].span = -1.0


class Memory:
    """What storage asks of the viscoelastic records of a model, and lets them do."""

    def __init__(self, model: Any) -> None:
        self._terms, self._rows = model.prony_terms, model.branch_strains
        self._times = model.prony_terms["time"].copy()

    def pass_over(self, step: float, factors: Mapping[int, tuple[Any, float]]) -> None:
        """Let the next state end a time, s; the relaxation times of laws, by their first terms, times factors."""
        for first, (law, factor) in factors.items():
            self._terms["time"][first : first + len(law.prony)] = [time * factor for _, time in law.prony]
        self._terms["span"] = step

    def resume(self, y: Array) -> None:
        """Go on from the strains of branches in a state y, at the strains of the last evaluation."""
        rows = self._rows
        rows["x0"] = rows["x"]
        rows["w0"] = rows["w"] = y[rows["account"]] + np.where(rows["dashpot"] != 0, rows["x"], 0.0)

    def softened(self) -> Iterator[tuple[float, float]]:
        """Relaxation times, and the part of the stiffness that relaxes with them which tangents lack meanwhile.

        That part is what a time over which the strains of branches decay takes. They are raised so that they have
        decayed to what they are after that time: stresses stay.
        """
        terms, rows = self._terms, self._rows
        x, w = rows["x"].copy(), rows["w"].copy()
        rows["x0"] = x
        for time in np.unique(terms["time"]):
            own = terms["time"] == time
            terms["span"] = np.where(own, _LONG * time, 0.0)
            rows["w0"] = w * np.where(own[rows["term"]], np.exp(_LONG), 1.0)
            yield float(time), 1.0 + float(np.expm1(-_LONG)) / _LONG
        terms["span"], rows["w0"] = 0.0, w

    def end(self) -> None:
        """No time passes any more, at the relaxation times of a run."""
        self._terms["time"], self._terms["span"] = self._times, 0.0

    @property
    def shortest(self) -> float:
        """Shortest relaxation time, s."""
        return float(self._terms["time"].min())

    def moved(self) -> Array:
        """What the strains of all branches have changed by since the last state that was accepted."""
        return np.asarray(self._rows["x"] - self._rows["x0"])

    def largest(self, term: int) -> float:
        """Largest strain of a term."""
        return float(np.abs(self._rows["x"][self._rows["term"] == term]).max(initial=0.0))

    def sizes(self, small: float) -> Array:
        """Sizes of the strains, at least `small` times the largest of their term; 0 where all of a term are 0."""
        found = np.abs(self._rows["x"])
        for term in range(self._terms.size):
            own = self._rows["term"] == term
            found[own] = np.maximum(found[own], small * found[own].max(initial=0.0))
        return found

    def accept(self) -> None:
        """The last state becomes the start of what follows."""
        self._rows["x0"], self._rows["w0"] = self._rows["x"], self._rows["w"]
        self._terms["span"] = 0.0

    def give(self, model: Any) -> None:
        """Give the records of another model these strains."""
        for field in ("x0", "w0", "x", "w"):
            model.branch_strains[field] = self._rows[field]


def _owner(assembly: Any, k: int) -> str:
    """Name of the part whose law has a term."""
    return str(assembly.relaxations[max(row for row in assembly.relaxations if row <= k)][0])


# terms of the Prony series of a strain: share of the instantaneous stiffness, relaxation time at the temperature of the
# run; span: s, time of statics that ends in the next state, 0 for the instantaneous stiffness, infinity for that after
# all relaxation; -1 in a run in time, whose steps end in its states
PRONY_TERMS = Family(
    "prony_terms",
    record("", "share time", "span"),
    order=1,
    kinds=(Kind("a Prony term", symmetric=True),),
    isolated=True,
    shares=Shares((), unforced=lambda model: {}),
    smooth=True,
    stiff=False,
    of_step=False,
    adjoint=AdjointSupport(
        "", refused={"a part is viscoelastic": lambda found: np.ones(found.size, dtype=bool)}
    ),
    parts=Parts(owner=_owner, changes="share time", reads_inertia=False),
    explicit=Explicit(force=load, energy=load_for_energy),
    stability=Stability(by_rates=False),
    implicit=Implicit(start=start),
    statics=Statics(uneven=never, memory=Memory),
    samples=Samples(prepare=load, evaluate=load, local=True),
)  # fmt: skip


@calls.force
def end_step(interval, model):
    """Strains at the end of a step become those of its start, but of statics that let time pass; into the accounts."""
    rows, terms = model.branch_strains, model.prony_terms
    for k in range(rows.size):
        span = terms[rows[k].term].span
        interval.y1[rows[k].account] = rows[k].w - (rows[k].x if rows[k].dashpot != 0 else 0.0)
        if interval.step.h > 0.0 or span <= 0.0 or span == np.inf:
            rows[k].x0, rows[k].w0 = rows[k].x, rows[k].w


@calls.force
def explicit_rate(interval, model):
    """Rates of the strains of all branches."""
    rows, terms = model.branch_strains, model.prony_terms
    for k in range(rows.size):
        time = terms[rows[k].term].time
        interval.rates[rows[k].account] = rows[k].rate - rows[k].w / time
        model.info.step = min(model.info.step, time)


@calls.between
def between(theta, t, h, y0, y1, model, y):
    """Strains of all branches at a sample within a step, over which the whole strain changes at a constant rate.

    Notes
    -----
    With u = h/tau and w_1 = w_0 exp(-u) + phi_1(u) dx that is w = w_0 exp(-theta u) + phi_1(theta u) theta dx. Where
    the strain d = w - x of the dashpot stands among the accounts, w_0 follows from d_1 - d_0 and x_1: it fulfils
    w_1 (1 - phi_1) + phi_1 (d_1 - d_0) = w_0 (exp(-u) - phi_1).
    """
    rows = model.branch_strains
    for k in range(rows.size):
        u, a = h / model.prony_terms[rows[k].term].time, rows[k].account
        if u < _SHORT or (rows[k].dashpot != 0 and u > _WHOLE):
            continue
        left, first, _ = decay(u)
        part, of_part, _ = decay(theta * u)
        if rows[k].dashpot == 0:
            y[a] = y0[a] * part + theta * of_part * (y1[a] - y0[a] * left) / first
            continue
        w1, moved = y1[a] + rows[k].x0, y1[a] - y0[a]
        w0 = (w1 * (1.0 - first) + first * moved) / (left - first)
        dx = w1 - w0 - moved
        y[a] = w0 * part + theta * of_part * dx - (rows[k].x0 - (1.0 - theta) * dx)


# strains of the springs of branches (`kernels.viscoelastic`); kept: what stands among the accounts: w, or with dashpot
# 1 w - x, minus the strain of the dashpot
BRANCH_STRAINS = Family(
    "branch_strains",
    record("term account dashpot", "", "x0 w0 x w rate kept"),
    order=600,
    of="prony_terms",
    accounts=(Accounts(1, start="kept", states=(0,), order=5.5),),
    explicit=Explicit(rate=explicit_rate),
    implicit=Implicit(end_step=end_step),
    samples=Samples(between=between),
)  # fmt: skip


def add_terms(builder: Any, law: Any) -> dict[str, int]:
    """Write the Prony terms of a law; returns the fields `prony` and `prony_end` of the records that relax by it.

    Parameters
    ----------
    builder : evolvent.assembly.builder.Builder
    law : evolvent.elements.viscoelastic.Viscoelastic, or None: no terms
    """
    if law is None:
        return {"prony": 0, "prony_end": 0}
    rows = [builder.add("prony_terms", share=share, time=time) for share, time in law.terms]
    builder.relaxations[rows[0]] = builder.part, law
    return {"prony": rows[0], "prony_end": rows[-1] + 1}


def add_branches(builder: Any, terms: dict[str, int], start: Any, *, dashpot: bool = False) -> int:
    """Write the branches of strains that have not relaxed yet; returns the first one, or 0 without terms.

    Parameters
    ----------
    terms : as of `add_terms`
    start : (n,) float, the strains at the start
    dashpot : bool, whether the accounts keep the strains of dashpots, as where a strain follows from them
    """
    rows = [
        builder.add("branch_strains", term=term, x0=x, w0=x, x=x, w=x, kept=0.0 if dashpot else x, dashpot=int(dashpot))
        for term in range(terms["prony"], terms["prony_end"])
        for x in np.atleast_1d(start).tolist()
    ]
    return rows[0] if rows else 0


def set_of(model: Any, row: Any, count: int = 1) -> Array:
    """Strains that a record keeps just after all stress is released at once: sum of g (x - w), (count,) float.

    Parameters
    ----------
    row : record with the fields `prony`, `prony_end` and `branch`
    count : int, strains of the record
    """
    terms = model.prony_terms[int(row["prony"]) : int(row["prony_end"])]
    rows = model.branch_strains[int(row["branch"]) :][: terms.size * count].reshape(terms.size, count)
    return np.asarray(terms["share"] @ (rows["x"] - rows["w"]))


class LineSet(NamedTuple):
    """What a beam or rod keeps just after all stress is released at once, in the middle of each element.

    Attributes
    ----------
    lengths : (n,) float, m, of the elements
    curvatures : mapping of words to values, (n,) float, 1/m
    strain : (n,) float; none of a cable
    """

    lengths: Array
    curvatures: Mapping[str, Array]
    strain: Array | None = None

    def largest(self) -> Iterator[tuple[str, float, str]]:
        """As `Statics.sets`."""
        for words, values in self.curvatures.items():
            yield f"largest {words}", float(values[np.abs(values).argmax()]), "1/m"
            yield f"integral of the {words} from root to tip", float(values @ self.lengths), "rad"
        if self.strain is not None:
            yield "largest strain", float(self.strain[np.abs(self.strain).argmax()]), "1"

    def along(self) -> Iterator[tuple[str, Array, Array, str]]:
        """As `Statics.sets_along`."""
        middles = np.cumsum(self.lengths) - 0.5 * self.lengths
        for words, values in self.curvatures.items():
            yield words, middles, values, "1/m"
