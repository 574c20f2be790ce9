"""Searches for mass properties from recordings in several mountings, and what is refused of what they find."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from evolvent_base.errors import InputError
from evolvent_massprops import mounting_keys
from evolvent_massprops.description import OnSprings
from evolvent_massprops.inertia import Inertia
from evolvent_massprops.inertia.combined import Combined
from evolvent_massprops.inertia.least_squares import CENTRE_SHARE, PRODUCT_SHARE, solve
from evolvent_massprops.inertia.problem import undetermined
from evolvent_massprops.inertia.stand import inertia_defect
from evolvent_massprops.modal import Modal

#: Factors on moments without a start at which searches may begin, and how many of the best do.
FACTORS, SEARCHES = (0.3, 1.0, 3.0), 4
#: Searches end at the same values within so much of each unknown's scale, and fit as well within so much of chi-square.
APART, AS_WELL = 1e-3, 4.0


class Recording(NamedTuple):
    """One recording: its description, its modes, keys that are its own, and its file's name."""

    given: OnSprings
    modal: Modal
    own: tuple[str, ...]
    name: str


def mountings(recordings: Sequence[Recording]) -> list[int]:
    """Number of the first recording of the same body in the same mounting, for each."""
    found = [
        ((r.given.mounting or mounting_keys.Mounting()).model_dump(mode="json"), r.given.body.model_dump(mode="json"))
        for r in recordings
    ]
    return [found.index(one) for one in found]


def best_of_searches(p: Combined, recordings: Sequence[Recording], first: int) -> Inertia:
    """The best of searches from several starts.

    Raises
    ------
    InputError
        Where none ends at a body, or two end at different ones that fit as well.
    """
    given = recordings[first].given
    base = p.initial_estimate
    free = [
        k
        for k, name in enumerate(p.unknown)
        if (name in ("Ixx", "Iyy", "Izz") and np.isnan(getattr(given.body, name).value))
        or (name[:4] == "tare" and name[-3:] in ("Ixx", "Iyy", "Izz"))
    ]
    nudge = np.array([_nudge(name) for name in p.unknown])
    begins = []
    for factors in itertools.product(FACTORS, repeat=min(len(free), 6)):
        start = base + nudge * p.scale
        start[free[: len(factors)]] = base[free[: len(factors)]] * factors
        begins.append(start)
    begins = _cheapest(p, begins)
    open_at = [undetermined_near(p, start) for start in begins[:2]]
    if all(open_at):  # no search would converge
        raise InputError(open_sentence(open_at[0], recordings))
    ends: list[tuple[float, np.ndarray, Inertia]] = []
    failure: InputError | None = None
    for start in begins:
        try:
            found = solve(p, "least squares", [start])
        except InputError as error:
            failure = failure or error
            continue
        values = np.array([found.values[name] for name in p.unknown])
        ends.append((float(_costs(p, values[None])[0]), values, found))
    if not ends:
        assert failure is not None
        text = str(failure)
        raise InputError(text + _hint(recordings, text) if text.startswith("the data do not determine") else text)
    cost, values, best = min(ends, key=lambda end: end[0])
    for other_cost, other, _ in ends:
        apart = np.abs(other - values) > APART * p.scale
        if other_cost < cost + AS_WELL and apart.any():
            pairs = ", ".join(
                f"{n} {a:.6g} and {b:.6g}" for n, a, b, far in zip(p.unknown, values, other, apart, strict=True) if far
            )
            raise InputError(
                f"the data do not determine the unknowns: two solutions fit as well ({pairs}); give a start"
            )
    return best


def open_sentence(reasons: Sequence[str], recordings: Sequence[Recording]) -> str:
    """The sentence on unknowns that the recordings do not determine."""
    text = "; ".join(reasons)
    return f"the data do not determine the unknowns: {text}{_hint(recordings, text)}"


def undetermined_near(p: Combined, values: np.ndarray) -> list[str]:
    """Sentences naming the unknowns that the data do not determine where products of inertia are small.

    A product that acts on the data through itself alone may have a far value that fits as well.
    """
    near = values.copy()
    for k, name in enumerate(p.unknown):
        if _nudge(name) == PRODUCT_SHARE:
            near[k] = PRODUCT_SHARE * p.scale[k]
    try:
        return undetermined(p.jacobian(near), p.unknown, p.scale)
    except (InputError, np.linalg.LinAlgError):
        return []


def _hint(recordings: Sequence[Recording], reasons: str) -> str:
    """What may be done where unknowns are not determined."""
    if "tare" in reasons and all(occupied(r.given) for r in recordings):
        return "; record the stand without the body as well (mounting.body: false), or state what is known"
    groups = zip(mountings(recordings), recordings, strict=True)
    mounted = {g for g, r in groups if occupied(r.given) and r.given.body.unknown}
    if not mounted:
        return ""
    text = "1 mounting of the body is" if len(mounted) == 1 else f"{len(mounted)} mountings of the body are"
    return f"; {text} recorded: turn it about another axis, or state what is known"


def occupied(given: OnSprings) -> bool:
    """Whether the body is on the stand."""
    return given.mounting is None or given.mounting.body


def _nudge(name: str) -> float:
    """Share of an unknown's scale by which a search begins off a symmetry."""
    last = name.partition("@")[0].rpartition("_")[2]
    if last in ("ex", "h", "ez", "x", "y", "z"):
        return CENTRE_SHARE
    return PRODUCT_SHARE if last in ("Ixy", "Ixz", "Iyz") else 0.0


def _cheapest(p: Combined, begins: list[np.ndarray]) -> list[np.ndarray]:
    """The starts of least misfit, at most `SEARCHES`."""
    cost = _costs(p, np.array(begins))
    if np.any(np.isinf(cost)):  # one that cannot be evaluated stops all: one by one
        cost = np.concatenate([_costs(p, start[None]) for start in begins])
    return [begins[k] for k in np.argsort(cost, kind="stable")[:SEARCHES]]


def _costs(p: Combined, values: np.ndarray) -> np.ndarray:
    """(n,) sum of squares of the residual; infinite where it cannot be evaluated."""
    try:
        r = p.residual(values)
    except (InputError, np.linalg.LinAlgError):
        return np.full(len(values), np.inf)
    return np.asarray(np.sum(np.where(np.isfinite(r), r, 1e9) ** 2, axis=-1))


def refuse_tare(p: Combined, found: Inertia, recordings: Sequence[Recording]) -> None:
    """Refuse a tare that nothing can be."""
    tares = recordings[0].given.tare
    asked_of = [name for name in p.unknown if name.startswith("tare")]
    for name in asked_of:
        number, _, what = name[4:].partition("_")
        if what in ("mass", "Ixx", "Iyy", "Izz") and not found.values[name] > 0.0:
            unit, own = "kg" if what == "mass" else "kg m2", tares[int(number) - 1].name
            raise InputError(
                f"the data give {what} = {found.values[name]:.6g} {unit} of the tare {own!r}; nothing has it, "
                "check the data"
            )
    values = np.array([found.values[name] for name in p.unknown])
    for part, places in p.parts:
        mounting = part.assigned(values[places]).mounting
        for k, tensor in enumerate(() if mounting is None else mounting.tare_inertia):
            names = [f"tare{k + 1}_I{a}" for a in ("xx", "yy", "zz")]
            moments = np.linalg.eigvalsh(tensor)
            spread = 3.0 * float(np.sqrt(np.nansum([found.std.get(n, 0.0) ** 2 for n in names])))
            if not set(names) & set(asked_of) or not np.all(np.diag(tensor) > 0.0):
                continue  # nothing of it is found, or a moment that does not act was left out
            if moments[0] <= 0.0 or moments[2] - moments[0] - moments[1] > spread:
                raise InputError(
                    f"the data give an inertia of the tare {tares[k].name!r} that no body has: "
                    f"{inertia_defect(tensor)}; check the data"
                )
