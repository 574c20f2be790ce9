"""Viscoelastic memory of strains: the Prony terms of materials, and the strains of their branches."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.kernels import calls
from evolvent.model.family import Family, Kind, record
from evolvent.model.layout import Accounts
from evolvent.model.questions import AdjointSupport, never
from evolvent.model.shares import Shares

Array = np.ndarray
#: Steps beside a relaxation time whose end has the softened stiffness of modes.
_LONG = 4.0


@calls.force
def load(interval, model):
    """Strains of all branches from the accounts of a state."""
    rows = model.branch_strains
    for k in range(rows.size):
        rows[k].w = interval.ym[rows[k].account]


@calls.energy
def load_for_energy(interval, model, out):
    """Strains of all branches from the accounts of a state."""
    rows = model.branch_strains
    for k in range(rows.size):
        rows[k].w = interval.ym[rows[k].account]


@calls.force
def start(interval, model):
    """A run in time: what ends in a state is the step, not a time of statics."""
    for k in range(model.prony_terms.size):
        model.prony_terms[k].span = -1.0


def _relax_over(model: Any, time: float) -> None:
    model.prony_terms["span"] = time


def _resume(model: Any, y: Array) -> None:
    """Strains of all branches from the accounts of a state, at the strains of the last evaluation."""
    rows = model.branch_strains
    rows["x0"] = rows["x"]
    rows["w0"] = rows["w"] = y[rows["account"]]


def _softened(model: Any) -> Iterator[tuple[float, float]]:
    """Relaxation times, and the part of the stiffness of their terms that a time over which they decay takes.

    Strains of branches are raised so that they have decayed to what they are after that time.
    """
    terms, rows = model.prony_terms, model.branch_strains
    x, w = rows["x"].copy(), rows["w"].copy()
    rows["x0"] = x
    for time in np.unique(terms["time"]):
        own = terms["time"] == time
        terms["span"] = np.where(own, _LONG * time, 0.0)
        rows["w0"] = w * np.where(own[rows["term"]], np.exp(_LONG), 1.0)
        yield float(time), 1.0 + float(np.expm1(-_LONG)) / _LONG
    terms["span"], rows["w0"] = 0.0, w


# terms of the Prony series of a strain: share of the instantaneous stiffness, relaxation time at the temperature of the
# run; span: s, time of statics that ends in the next state, 0 for the instantaneous stiffness, infinity for that after
# all relaxation; -1 in a run in time, whose steps end in its states
PRONY_TERMS = Family(
    "prony_terms",
    record("", "share time", "span"),
    order=1,
    kinds=(Kind("a Prony term", symmetric=True),),
    explicit_force=load,
    explicit_energy=load_for_energy,
    prepare_sample=load,
    evaluate=load,
    start=start,
    by_rates=False,
    isolated=True,
    stiff=False,
    of_step=False,
    local=True,
    smooth=True,
    changes="share time",
    shares=Shares((), unforced=lambda model: {}),
    reads_inertia=False,
    relax_over=_relax_over,
    resume=_resume,
    softened=_softened,
    uneven=never,
    adjoint=AdjointSupport(
        "", refused={"a part is viscoelastic": lambda found: np.ones(found.size, dtype=bool)}
    ),
)  # fmt: skip


@calls.force
def end_step(interval, model):
    """Strains at the end of a step become those of its start, but of statics that let time pass; into the accounts."""
    rows, terms = model.branch_strains, model.prony_terms
    for k in range(rows.size):
        span = terms[rows[k].term].span
        interval.y1[rows[k].account] = rows[k].w
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


# strains of the springs of branches (`kernels.viscoelastic`)
BRANCH_STRAINS = Family(
    "branch_strains",
    record("term account", "", "x0 w0 x w rate"),
    order=600,
    of="prony_terms",
    end_step=end_step,
    explicit_rate=explicit_rate,
    accounts=(Accounts(1, start="w0", states=(0,), order=5.5),),
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
    builder.relaxations[builder.part] = rows[0], law
    return {"prony": rows[0], "prony_end": rows[-1] + 1}


def add_branches(builder: Any, terms: dict[str, int], start: Any) -> int:
    """Write the branches of strains that have not relaxed yet; returns the first one, or 0 without terms.

    Parameters
    ----------
    terms : as of `add_terms`
    start : (n,) float, the strains at the start
    """
    rows = [
        builder.add("branch_strains", term=term, x0=float(x), w0=float(x), x=float(x), w=float(x))
        for term in range(terms["prony"], terms["prony_end"])
        for x in np.atleast_1d(start)
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
