"""The law by which one swing decays, chosen by how well each describes the record."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from evolvent_massprops.identification import swing_model as model
from evolvent_massprops.identification.noise_density import density_near
from evolvent_massprops.identification.orders import WHITE, whiteness
from evolvent_massprops.identification.signals import Array, Signal
from evolvent_massprops.identification.swing_laws import LAWS
from evolvent_massprops.identification.swing_model import Component, Found

DECAY = ("auto", *LAWS)
#: Gain of the information criterion below which two descriptions are not distinguished.
DECISIVE = 10.0
#: Share of a signal's square that a fit may leave which has followed the swing from the first period to the last.
FOLLOWED = 0.25
#: Parts of the motion of a swing that comes to rest, that are fitted one after the other.
GROWN = (0.3, 0.5, 0.7, 0.85, 0.95)


def _with_law(one: Component, law: tuple[bool, bool, bool], mean: float) -> Component:
    """The same decay at the mean amplitude, shared among the terms of another law."""
    assert one.rates is not None
    total = one.rates[0] + one.rates[1] / mean + one.rates[2] * mean
    count = sum(law)
    scale = (1.0, mean, 1.0 / mean)
    d, dry, drag = (total / count * s if free else 0.0 for s, free in zip(scale, law, strict=True))
    return replace(one, law=law, rates=(d, dry, drag))


class Choice(NamedTuple):
    """The best description of a swing.

    Attributes
    ----------
    found : Found
    spread : (rad/s)^2, of the frequencies that others give, which describe the record about as well
    colour : (c,) density of the noise near the swing over its mean, 1 where it is white
    kept : which of the other components are left
    """

    found: Found
    spread: float
    colour: Array
    kept: list[bool]


def best_law(
    start: Component, others: list[Component], signal: Signal, noise: Array, decay: str, *, cubic: bool
) -> Choice | None:
    """The best fit of one swing beside other components, over laws of decay and waveforms.

    Notes
    -----
    The spread is that of Bayesian model averaging, with weights exp(-BIC / 2).
    """
    mean = float(np.clip(start.envelope(signal.time).mean(), 0.05, 1.0))
    others = [replace(one, held=True) for one in others]  # until the law is found
    begun = _followed(start, others, signal, noise)
    found: list[Found] = []
    for sinusoidal in (False, True)[: 1 + start.restoring.linear]:
        now = replace(begun, sinusoidal=sinusoidal)
        names = ("viscous", "dry", "quadratic") if decay == "auto" else (decay,)
        singles = [_grown(_with_law(now, LAWS[name], mean), others, signal, noise) for name in names]
        found += _greedy(singles, signal) if decay == "auto" else singles
    best = _least(found, signal)
    if best is not None and cubic and not is_white(best, signal):
        one = replace(best.solution.components[0], free_cube=True, sinusoidal=False)
        more = model.fit((one, *best.solution.components[1:]), signal, noise)
        found += _greedy([more], signal) if decay == "auto" else [more]
        best = _least(found, signal)
    if best is None:
        return None
    good = [one for one in found if one.converged and _plausible(one)]
    colour = _colour(best, signal)
    best = min(good, key=lambda one: one.bic(signal, colour))
    weight = np.exp(-0.5 * (np.array([one.bic(signal, colour) for one in good]) - best.bic(signal, colour)))
    away = np.array([_natural(one) - _natural(best) for one in good])
    freed = [replace(one, held=False) for one in best.solution.components]
    last = model.fit(tuple(freed), signal, best.noise) if others else best
    least, kept = _without_idle(_least([last, best], signal) or best, signal)
    return Choice(least, float(weight @ away**2 / weight.sum()), colour, kept)


def density_at(frequency: Array, residual: Array, noise: Array, signal: Signal) -> Array:
    """(c,) density of the noise near a frequency (1,) over its mean, 1 at least."""
    return np.maximum(density_near(frequency, residual, noise, signal)[0], 1.0)


def _colour(found: Found, signal: Signal) -> Array:
    """(c,) density of the noise near the first component over its mean; 1 where the residual is white."""
    if is_white(found, signal):
        return np.ones(len(found.noise))
    frequency = np.array([found.solution.components[0].pole.imag])
    return density_at(frequency, found.solution.residual, found.noise, signal)


def _without_idle(found: Found, signal: Signal) -> tuple[Found, list[bool]]:
    """Without exponential modes that do not better the criterion beside the swing, and which of them stay."""
    kept = [True] * len(found.solution.components)
    for k in reversed(range(1, len(kept))):
        components = found.solution.components
        if not components[k].is_swing:
            less = model.fit((*components[:k], *components[k + 1 :]), signal, found.noise)
            if less.converged and _plausible(less) and less.bic(signal) < found.bic(signal):
                found, kept[k] = less, False
    return found, kept[1:]


def _natural(found: Found) -> float:
    """Undamped frequency of the first component, rad/s."""
    one = found.solution.components[0]
    return float(np.hypot(one.pole.imag, (one.rates or (0.0,))[0])) if one.sinusoidal else one.pole.imag


def _least(found: Iterable[Found | None], signal: Signal) -> Found | None:
    """The plausible fit of the least criterion."""
    good = [one for one in found if one is not None and one.converged and _plausible(one)]
    return min(good, key=lambda one: one.bic(signal), default=None)


def is_white(found: Found, signal: Signal) -> bool:
    """Whether nothing but white noise is left."""
    unknowns = 2 * len(found.solution.components) + 1 + signal.degree
    return whiteness(signal, found.solution.residual, found.noise, unknowns) >= WHITE


def _plausible(found: Found) -> bool:
    """Whether each of the terms of decay acts, and the first component is none of too low a frequency to be seen."""
    one = found.solution.components[0]
    assert one.rates is not None
    acting = one.law == LAWS["viscous"] or min(r for r, acts in zip(one.rates, one.law, strict=True) if acts) > 0.0
    return bool(np.all(np.isfinite(one.rates)) and one.pole.imag > 0.0 and acting)


def _greedy(found: list[Found], signal: Signal) -> list[Found]:
    """The fits, and more with further terms of decay, as long as they better the criterion."""
    found, best = list(found), _least(found, signal)
    tried = {one.solution.components[0].law for one in found}
    while best is not None:
        one, rest = best.solution.components[0], best.solution.components[1:]
        trials = []
        for k in range(3):
            law = (one.law[0] != (k == 0), one.law[1] != (k == 1), one.law[2] != (k == 2))
            if any(law) and law not in tried:
                tried.add(law)
                d, dry, drag = (r if acts else 0.0 for r, acts in zip(one.rates or (), law, strict=True))
                trials.append(_grown(replace(one, law=law, rates=(d, dry, drag)), list(rest), signal, best.noise))
        found += trials
        better = _least(trials, signal)
        if better is None or better.bic(signal) >= best.bic(signal):
            break
        best = better
    return found


def _followed(start: Component, others: list[Component], signal: Signal, noise: Array) -> Component:
    """A start that has been fitted to longer and longer parts of the record, where the whole is not reached at once."""
    direct = model.fit((start, *others), signal, noise)
    whole = signal.counts * np.nanvar(signal.data, axis=0)
    if direct.converged and direct.squares[start.reference] < FOLLOWED * whole[start.reference]:
        return direct.solution.components[0]
    now, period = start, 2.0 * np.pi / start.pole.imag
    length, whole = 6.0 * period, float(signal.time[-1])
    while length < whole:
        count = int(np.searchsorted(signal.time, length))
        if count > 20 + 4 * len(others):
            near = [one for one in others if 2.0 * np.pi / max(one.pole.imag, 1e-300) < 0.5 * length]
            part = model.fit((now, *near), signal.part(slice(0, count)), noise)
            if part.converged and _plausible_frequency(part, start):
                now = part.solution.components[0]
        length *= 1.6
    last = model.fit((now, *others), signal, noise)
    return min((direct, last), key=lambda one: float((one.squares / noise**2).sum())).solution.components[0]


def _grown(one: Component, others: list[Component], signal: Signal, noise: Array) -> Found:
    """A fit; of a swing that dry friction brings to rest, by way of longer and longer parts of its motion.

    Where it rests depends on how often it has turned, so that the sum of squares has many minima.
    """
    found = model.fit((one, *others), signal, noise)
    moves = np.count_nonzero(found.solution.components[0].envelope(signal.time) > 0.0)
    if not one.law[1] or moves == len(signal.time):
        return found
    now = one
    for share in GROWN:
        part = signal.part(slice(0, max(int(share * moves), 20 + 4 * len(others))))
        trial = model.fit((now, *others), part, noise)
        if trial.converged and _plausible(trial):
            now = trial.solution.components[0]
    other = model.fit((now, *others), signal, noise)
    return _least([found, other], signal) or found


def _plausible_frequency(found: Found, start: Component) -> bool:
    return 0.8 < found.solution.components[0].pole.imag / start.pole.imag < 1.25
