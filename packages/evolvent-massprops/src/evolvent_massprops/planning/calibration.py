"""How well stand and body have to be known for a wanted uncertainty, and what a calibration of the stand gives."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from evolvent_base.errors import InputError
from evolvent_massprops.description import OnSprings, load
from evolvent_massprops.inertia.stand import MOMENTS
from evolvent_massprops.planning.expected import Expected, Option, PlanningTask, expected
from evolvent_massprops.planning.predictions import at, predicted, relative
from evolvent_massprops.spring_keys import CALIBRATED
from evolvent_massprops.springs_inputs import first_body
from evolvent_massprops.springs_search import occupied

Array = np.ndarray
#: Relative deviation of the stand's exact numbers at which their influence is computed.
PROBE = 1e-4
#: Parts of U below which an input is not listed, of the wanted uncertainty.
LISTED = 0.02
#: Mass that is added for a calibration, over the body's, and where, over half the springs' spacing.
ADDED, AT = 0.1, 0.8


class Need(NamedTuple):
    """How well an input has to be known.

    Attributes
    ----------
    key, unit : str
    value, std : float, as stated; std 0 for one that is taken as exact
    part : float, largest contribution to an expanded uncertainty, over the value of that quantity
    needed : float, standard uncertainty with which the wanted one is reached, all else as it is; 0 where none suffices
    alone : float, that with which it is reached if all else were exact, without noise
    """

    key: str
    unit: str
    value: float
    std: float
    part: float
    needed: float
    alone: float


class Calibration(NamedTuple):
    """What the stand's half-length, half-width and stiffness are known to after a calibration, and what follows.

    Attributes
    ----------
    label : str, what is done
    option : Option, what all recordings give then, each as long as those of the best plan
    std : mapping, key of `CALIBRATED` -> relative standard uncertainty; NaN for one that is not given
    """

    label: str
    option: Option
    std: dict[str, float]


def needs(task: PlanningTask, wanted: float, best: Option) -> tuple[Need, ...]:
    """How well half-length, half-width and common factor have to be known, and other inputs that count.

    Notes
    -----
    Inputs act in proportion. U of quantity q has the part k |s_q| u of an input; the wanted uncertainty leaves it
    (W q)^2 - (U_q^2 - (k s_q u)^2), of which the least over the quantities counts.
    """
    rows = [k - 1 for k in best.sensors]
    given = predicted(task, best.pulls, best.rate, best.samples, rows)
    probe = task._replace(recordings=tuple(_probed(one) for one in task.recordings))
    found = predicted(probe, best.pulls, best.rate, best.samples, rows)
    k = task.given.uncertainty.coverage_factor
    counts = np.isfinite(relative(task, given.keys, given.values, given.std))
    size = k / np.abs(given.values[counts])
    total, rows_found = size * given.std[counts], []
    stated = {share.label for share in given.shares}
    for share in found.shares:
        if not share.std > 0.0:
            continue
        exact = share.label not in stated
        acts = np.abs(size * share.contribution[counts]) / share.std  # U over the value, of a deviation of 1
        if not np.any(acts > 0.0):
            continue
        own = 0.0 if exact else share.std
        left = wanted**2 - np.maximum(total**2 - (acts * own) ** 2, 0.0)
        acting = acts > 1e-9 * acts.max()
        needed = float(np.min(np.sqrt(np.maximum(left, 0.0))[acting] / acts[acting]))
        if np.any(left[~acting] < 0.0):
            needed = 0.0
        need = Need(share.label, share.unit, share.value, own, float((acts * own).max()), needed,
                    float(np.min(wanted / acts[acting])))  # fmt: skip
        if _of_stand(share.label) or need.part > LISTED * wanted:
            rows_found.append(need)
    return tuple(sorted(rows_found, key=lambda one: (not _of_stand(one.key), -one.part)))


def _of_stand(key: str) -> bool:
    return key.startswith(tuple(f"stand.{name}" for name in CALIBRATED))


def _probed(one: Expected) -> Expected:
    """The recording with a small uncertainty of the stand's numbers that are taken as exact."""
    stand = one.given.stand
    changed: dict[str, Any] = {}
    for key in CALIBRATED:
        value = getattr(stand, key)
        if value is not None and not value.unknown and value.std == 0.0:
            changed[key] = dataclasses.replace(value, std=PROBE * value.value)
    given = one.given.model_copy(update={"stand": stand.model_copy(update=changed)})
    return one._replace(given=given)


def calibrations(task: PlanningTask, wanted: float, best: Option) -> tuple[Calibration, ...]:
    """What ways of calibrating the stand give; none for a stand whose springs are listed one by one.

    Notes
    -----
    Half-length, half-width and the common factor of the stiffnesses become unknowns of the same least squares, with
    what is stated of them as another measurement, of the factor that of the mean stiffness; those without a stated
    uncertainty stay exact. Recordings that are
    added have the length of the others: of the body with a known mass at a known place, and of a body whose mass
    properties are known, `plan.reference` or one like the expected body that is known exactly.
    """
    stand = task.given.stand
    known = {key: v for key in CALIBRATED if (v := getattr(stand, key)) is not None}
    if not stand.common_factor.unknown:
        mean = _stated(task, best)["common_factor"] * stand.common_factor.value
        known["common_factor"] = dataclasses.replace(stand.common_factor, std=mean)
    asked = {key: v for key, v in known.items() if v.std > 0.0 or v.unknown}
    if stand.points is not None or not asked:
        return ()
    rows = [k - 1 for k in best.sensors]
    found = [Calibration("as stated", best, _stated(task, best))]
    keys = {f"stand.{key}": _asked(value) for key, value in asked.items()}
    try:
        own = tuple(_again(one, keys) for one in task.recordings)
        given = load(task.given, keys)
        assert isinstance(given, OnSprings)
        open_task = task._replace(given=given, recordings=own)
    except InputError:
        return ()
    mass = _added_mass(task)
    label = task.planned.reference.name if task.planned.reference is not None else "a body like this, known exactly"
    place = f"x = {mass['offset_x']:.3g} m, z = {mass['offset_z']:.3g} m"
    for text, more in (
        ("estimated too", ()),
        (f"and a record with {mass['mass']:.3g} kg at {place}", (_with_mass(open_task, mass),)),
        (f"and a record of {label}", (_reference(open_task),)),
    ):
        extra = tuple(one for one in more if one is not None)
        if len(extra) < len(more):
            continue
        several = open_task._replace(recordings=(*open_task.recordings, *extra))
        pulls = (*best.pulls, *(max(one.pulls, key=lambda pull: pull.least) for one in extra))
        option = at(several, wanted, pulls, best.rate, best.samples, rows)
        found.append(Calibration(text, option, _found(option)))
    return tuple(found)


def _stated(task: PlanningTask, best: Option) -> dict[str, float]:
    """Relative uncertainties of the stand's numbers as they are known without a calibration; of the mean stiffness."""
    found, stand = _found(best), task.given.stand
    for key in CALIBRATED:
        value = getattr(stand, key)
        if value is not None and not value.unknown:
            found[key] = value.std / value.value
    if not stand.common_factor.unknown:
        apart = np.broadcast_to([v.std / v.value for v in stand.stiffness], (stand.number,))
        found["common_factor"] = math.hypot(found["common_factor"], float(np.linalg.norm(apart)) / stand.number)
    return found


def _found(option: Option) -> dict[str, float]:
    """Relative standard uncertainties of the stand's numbers that are among an option's quantities."""
    pairs = {key: (value, std) for key, value, std in zip(option.keys, option.values, option.std, strict=True)}
    return {key: float(pairs[key][1] / pairs[key][0]) if key in pairs else math.nan for key in CALIBRATED}


def _asked(value: Any) -> str:
    """A known number of the stand as an unknown, with what is stated of it as another measurement."""
    known = f" +- {value.std!r}" if value.std else ""
    return f"unknown near {value.value!r}{known}"


def _again(one: Expected, keys: dict[str, Any]) -> Expected:
    """The recording with other keys of its description."""
    given = load(one.given, keys)
    assert isinstance(given, OnSprings)
    return one._replace(given=given)


def _added_mass(task: PlanningTask) -> dict[str, float]:
    stand, body = task.given.stand, next(one for one in task.recordings if occupied(one.given)).given.body
    assert stand.half_length is not None
    assert stand.half_width is not None
    return {"mass": float(f"{ADDED * body.mass.value:.2g}"), "offset_x": AT * stand.half_length.value,
            "offset_z": AT * stand.half_width.value}  # fmt: skip


def _with_mass(task: PlanningTask, mass: dict[str, float]) -> Expected | None:
    """One more record of the body in its first mounting, with a known mass."""
    one = next(one for one in task.recordings if occupied(one.given))
    more = {"name": "added mass", **mass}
    tare = [*one.given.model_dump(mode="json", exclude_none=True)["tare"], more]
    return _one_more(one.given, {"tare": tare}, "with added mass", ("tare",))


def _reference(task: PlanningTask) -> Expected | None:
    """One more record, of the body that is known."""
    one = next(one for one in task.recordings if occupied(one.given))
    known = task.planned.reference
    if known is not None:
        content = known.model_dump(mode="json", exclude_none=True)
    else:
        body, _ = first_body(one.given, one.stand, np.ones(1))
        content = {"name": "known body", "mass": float(body.mass), "offset_x": float(body.centre[0]),
                   "height": -float(body.centre[1]), "offset_z": float(body.centre[2]),
                   **{name: float(body.inertia[place]) for name, place in MOMENTS.items()}}  # fmt: skip
    return _one_more(one.given, {"body": content, "mounting": None}, "known body", ("body", "mounting"))


def _one_more(given: OnSprings, keys: dict[str, Any], name: str, own: Sequence[str]) -> Expected | None:
    """A record with other keys; None where the stand does not hold what is on it."""
    try:
        more = load(given, {**keys, "recordings": {name: {key: keys[key] for key in own}}})
        assert isinstance(more, OnSprings)
        return expected(name, more, tuple(own))
    except InputError:
        return None
