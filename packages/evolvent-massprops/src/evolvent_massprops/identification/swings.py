"""One swing is one mode: which of the modes found belong together, and by which law they decay.

Dry friction, the drag of air and a frequency that follows the amplitude are no sums of a few exponentials. Fitted by
such, one swing becomes two to six modes nearer to each other than the record resolves, or modes at its odd harmonics,
all with small uncertainties. Here such a group is fitted again as one swing (`swing_model`), which is kept where it
describes the record better (Bayesian information criterion).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import product

import numpy as np

from evolvent_massprops.identification import swing_model as model
from evolvent_massprops.identification.decay_laws import DECISIVE, Choice, best_law, density_at, is_white
from evolvent_massprops.identification.modes import IdentifiedModes
from evolvent_massprops.identification.orders import WHITE, search, whiteness
from evolvent_massprops.identification.signals import Array, Signal, information
from evolvent_massprops.identification.swing_covariance import covariance, summary
from evolvent_massprops.identification.swing_laws import Swing
from evolvent_massprops.identification.swing_model import Component, Found
from evolvent_massprops.identification.swing_starts import Kind, start_of
from evolvent_massprops.identification.variable_projection import colour, own_unknowns, remarks, unsupported

#: Share of a group's amplitude below which a mode may be a part of it, at odd harmonics, or nearer than these lines.
WEAK, HARMONICS, SIDE = 0.15, (3, 5, 7, 9), 10.0
#: Share of the strongest amplitude below which a swing is not examined.
SMALL = 1e-3
#: Share of a swing's amplitude below which a mode near it does not speak for another law of decay.
FAINT = 1e-5
#: Share of the strongest swing in the squares of all amplitudes above which what is left is its own.
DOMINANT = 0.8
#: Lines that may be added beside swings.
_LINES = 3


def resolved(signal: Signal) -> float:
    """Distance of frequencies, rad/s, that the record resolves: one line, 1 / T in Hz."""
    return 2.0 * np.pi / float(signal.time[-1])


def groups(modes: IdentifiedModes, signal: Signal) -> list[list[int]]:
    """Modes nearer to each other than the record, or their own decay, resolves; the strongest group first."""
    found: list[list[int]] = []
    for k in range(modes.order):
        if found:
            j = found[-1][-1]
            near = max(resolved(signal), abs(modes.decay_rate[j]), abs(modes.decay_rate[k]))
            if modes.frequency[k] - modes.frequency[j] < near:
                found[-1].append(k)
                continue
        found.append([k])
    weight = ((modes.amplitude / modes.noise) ** 2).sum(axis=1)
    return sorted(found, key=lambda group: -float(weight[group].sum()))


def refine(
    modes: IdentifiedModes, signal: Signal, kind: Kind | None = None, decay: str = "auto", *, fixed: bool = False
) -> IdentifiedModes:
    """The same record with swings in place of groups of exponential modes, where they describe it better.

    Parameters
    ----------
    modes : of the exponential fit
    signal : Signal
    kind : of the strongest swing
    decay : one of `DECAY`; its law
    fixed : whether the number of modes is given: then only the strongest becomes a swing, where it is known to be one
    """
    given = kind or Kind()
    main = [one for one in groups(modes, signal) if not _is_avoided(modes, one, given.avoid)]
    known = given.restoring is not None and not given.restoring.linear
    squares = np.nansum(modes.residual**2, axis=0)
    unknowns = own_unknowns(modes, signal) * len(squares) + 2 * modes.order
    poles = {k: Component(pole=complex(pole)) for k, pole in enumerate(modes.pole)}
    plain = Kind(given.restoring and model.LINEAR, derivative=given.derivative)
    swings: list[Component] = []
    spreads: list[float] = []
    best: Found | None = None
    for place, group in enumerate(main):
        first = place == 0
        suspicious = not fixed and _suspicious(modes, group, signal)
        if not (set(group) <= set(poles) and ((first and (known or decay != "auto")) or suspicious)):
            continue
        law = decay if first else "auto"
        tried = [given, plain][: 1 + known * suspicious] if first else [plain]
        for own in tried:
            ways = [({*group}, {*group})] if fixed else _parts(modes, group, signal)
            beside = own is given and known and not fixed and len(ways[0][0]) > 1
            if beside:  # what is near the strongest may be modes of their own
                ways.append(({_strongest(modes, group)},) * 2)
            choice, parts = _choose(modes, signal, own, ways, (swings, poles), law, every=beside)
            if choice is None:
                continue
            frequency = np.array([choice.found.solution.components[0].pole.imag])
            colour = np.minimum(choice.colour, density_at(frequency, modes.residual, modes.noise, signal))
            before = information(signal, squares, unknowns, colour) if best is None else best.bic(signal, colour)
            # a pendulum is taken for one unless exponential modes are plainly better
            allowed = np.inf if law != "auto" else DECISIVE * (own is given and known)
            if choice.found.bic(signal, colour) < before + allowed:
                break
        else:
            continue
        best, now = choice.found, choice.found.solution.components
        kept = choice.kept[len(swings) :]
        swings, spreads = [one for one in now if one.is_swing], [choice.spread, *spreads]
        stay = [k for k, stays in zip((k for k in poles if k not in parts), kept, strict=True) if stays]
        poles = dict(zip(stay, now[len(swings) :], strict=True))
    if best is None or all(one.is_exponential for one in swings):
        return replace(modes, warnings=(*modes.warnings, *_near(modes, signal)))
    found = _modes(best if fixed else _with_lines(best, signal), spreads, signal, modes)
    return replace(found, warnings=(*found.warnings, *_misread(found, given)))


def _choose(
    modes: IdentifiedModes,
    signal: Signal,
    own: Kind,
    ways: list[tuple[set[int], set[int]]],
    beside: tuple[list[Component], dict[int, Component]],
    decay: str,
    *,
    every: bool,
) -> tuple[Choice, set[int]] | tuple[None, set[int]]:
    """The best description of a swing over the modes that may be its parts, and these.

    An amplitude that only the change of the frequency shows counts where the swing leaves nothing but white noise:
    other motions change the frequency as well.
    """
    trials: list[tuple[Choice, set[int]]] = []
    swings, poles = beside
    for (parts, begun), read in product(ways, _readings(own)):
        begin = start_of(modes, sorted(begun), signal, read)
        if begin is None:
            continue
        others = [*swings, *(poles[k] for k in poles if k not in parts)]
        cubic = own.restoring is None and _share(modes, parts) > DOMINANT
        trial = best_law(begin, others, signal, modes.noise, decay, cubic=cubic)
        if trial is None:
            continue
        white = is_white(trial.found, signal)
        shown = begin.free_square and not begin.fixed_gain and not np.isfinite(read.reach.mean)
        if white or not shown:
            trials.append((trial, parts))
        if white and not every:
            break
    if not trials:
        return None, set()
    return min(trials, key=lambda one: _judged(one[0], own, signal))


def _judged(choice: Choice, kind: Kind, signal: Signal) -> float:
    """Information criterion; a fit that drops the sensors' angles must better it by `DECISIVE`."""
    read = choice.found.solution.components[0].fixed_gain or not np.isfinite(kind.reach.factor)
    return choice.found.bic(signal) + (0.0 if read else DECISIVE)


def _readings(kind: Kind) -> list[Kind]:
    """What is known of a swing, and that without what its sensors say of its angle, should they disagree with it."""
    if not np.isfinite(kind.reach.factor):
        return [kind]
    return [kind, kind._replace(reach=kind.reach._replace(factor=np.nan))]


def _misread(modes: IdentifiedModes, given: Kind) -> tuple[str, ...]:
    """A sentence on sensors of angles that do not show the amplitude by which the frequency changes."""
    if not np.isfinite(given.reach.factor):
        return ()
    found = []
    for k, one in enumerate(modes.swings):
        if one is not None and one.component.free_square and not one.component.fixed_gain:
            size = modes.amplitude[k] * given.reach.factor / modes.frequency[k] ** given.derivative
            listed = ", ".join(f"{name} {np.degrees(x):.3g}" for name, x in zip(modes.names, size, strict=True))
            found.append(
                f"the frequency of mode {k + 1} changes as that of a swing of {np.degrees(one.amplitude):.3g} ± "
                f"{np.degrees(one.amplitude_std):.1g} deg at first, but the sensors show {listed} deg: these are not "
                "used; check their units, their sensitivities and where they are"
            )
    return tuple(found)


def _is_avoided(modes: IdentifiedModes, group: Iterable[int], avoid: float) -> bool:
    return bool(np.any(np.abs(modes.natural_frequency[list(group)] / avoid - 1.0) < 0.05))


def _share(modes: IdentifiedModes, parts: Iterable[int]) -> float:
    """Share of some modes in the squares of all amplitudes."""
    weight = ((modes.amplitude / modes.noise) ** 2).sum(axis=1)
    return float(weight[list(parts)].sum() / weight.sum())


def _strongest(modes: IdentifiedModes, group: list[int]) -> int:
    return max(group, key=lambda k: float((modes.amplitude[k] ** 2).sum()))


def _suspicious(modes: IdentifiedModes, group: list[int], signal: Signal) -> bool:
    """Whether a group of exponential modes may be one swing, or leaves something of it."""
    strength = np.sqrt((modes.amplitude**2).sum(axis=1))
    if strength[group].max() < SMALL * strength.max():
        return False
    parts = [k for k in _parts(modes, group, signal)[0][0] if strength[k] > FAINT * strength[group].max()]
    near = [k for k in parts if modes.frequency[k] < 2.0 * modes.frequency[group[0]]]
    if len(near) > 1:
        return True
    alone = _share(modes, parts) > DOMINANT
    return alone and (
        len(parts) > 1 or whiteness(signal, modes.residual, modes.noise, own_unknowns(modes, signal)) < WHITE
    )


def _parts(modes: IdentifiedModes, group: list[int], signal: Signal) -> list[tuple[set[int], set[int]]]:
    """Modes that may be parts of a swing, and those of them by which it begins.

    First a group with weaker modes near it or near odd multiples of its frequency; then with strong ones near it too.
    """
    strength = np.sqrt((modes.amplitude**2).sum(axis=1))
    strongest = _strongest(modes, group)
    w, line = modes.frequency[strongest], resolved(signal)
    away = np.abs(modes.frequency[:, None] / np.array((1, *HARMONICS)) - w).min(axis=1)
    near = np.abs(modes.frequency - w) < SIDE * line
    weak = strength < WEAK * strength[strongest]
    parts = {*group, *np.flatnonzero(weak & (near | (away < 2.0 * line))).tolist()}
    beside = {*group, *np.flatnonzero(near).tolist()}
    found = [(parts, set(group))]
    return found if beside <= parts else [*found, (parts | beside, beside)]


def _near(modes: IdentifiedModes, signal: Signal) -> tuple[str, ...]:
    """Sentences on exponential modes that are nearer than the record resolves and yet no single swing."""
    found = []
    for group in groups(modes, signal):
        if len(group) > 1:
            listed = ", ".join(f"{modes.frequency[k]:.6g}" for k in group)
            found.append(
                f"the modes at {listed} rad/s are nearer to each other than the record resolves "
                f"({resolved(signal):.2g} rad/s); no single swing with viscous damping, dry friction or quadratic drag "
                "describes the record as well"
            )
    return tuple(found)


# ------------------------------------------------------------------------------------------------ others beside


def _with_lines(found: Found, signal: Signal) -> Found:
    """With exponential modes that are left in the residual, where they better the criterion."""
    for _ in range(_LINES):
        if is_white(found, signal):
            return found
        more, _ = search(replace(signal, data=found.solution.residual, noise=None), 1)
        if more is None:
            return found
        new = Component(pole=complex(more.pole[0]))
        trial = model.fit((*found.solution.components, new), signal, found.noise)
        if not trial.converged or _wild(trial, signal):
            return found
        line = np.array([trial.solution.components[-1].pole.imag])
        colour = density_at(line, trial.solution.residual, trial.noise, signal)
        if trial.bic(signal, colour) > found.bic(signal, colour) - DECISIVE:
            return found
        found = trial
    return found


def _wild(found: Found, signal: Signal) -> bool:
    """Whether an exponential mode has left the band or come to a swing."""
    poles = [one.pole for one in found.solution.components]
    swings = [one.pole.imag for one in found.solution.components if one.is_swing]
    low, high = signal.band
    return any(
        not max(low, 1e-300) <= p.imag <= high or min(abs(p.imag - w) for w in swings) < resolved(signal)
        for p, one in zip(poles, found.solution.components, strict=True)
        if not one.is_swing
    )


# ------------------------------------------------------------------------------------------------ result


def _modes(found: Found, spreads: list[float], signal: Signal, before: IdentifiedModes) -> IdentifiedModes:
    """Modes of the fit by rising frequency."""
    now = found.solution
    order = np.argsort([one.pole.imag for one in now.components], kind="stable")
    components = tuple(now.components[k] for k in order)
    rows = [*(2 * k + j for k in order for j in (0, 1)), *range(2 * len(order), len(now.coefficients))]
    found = found._replace(solution=now._replace(components=components, coefficients=now.coefficients[rows]))
    C, own = covariance(found, signal)
    for place, k in enumerate(order.tolist()):  # swings are the first components
        if k < len(spreads):
            C[place, place] += spreads[k]
    m, sensors = len(components), signal.data.shape[1]
    values = summary(components, found.solution.coefficients)
    a = values[2 * m :][: m * sensors].reshape(m, sensors) + 1j * values[2 * m + m * sensors :][: m * sensors].reshape(
        m, sensors
    )
    swings: list[Swing | None] = []
    first = 0
    for one in components:
        size = len(one.values())
        std = np.sqrt(np.maximum(np.diag(own)[first : first + size], 0.0))
        swings.append(_swing(one, std, signal) if one.is_swing else None)
        first += size
    coefficients = found.solution.coefficients
    drift = coefficients[2 * m + 1] / signal.time[-1] if signal.degree else np.zeros(sensors)
    modes = IdentifiedModes(
        method=before.method,
        order=m,
        names=signal.names,
        frequency=values[:m],
        decay_rate=values[m : 2 * m],
        amplitude=np.abs(a),
        phase=np.angle(a),
        offset=coefficients[2 * m].copy(),
        drift=drift,
        covariance=C,
        noise=found.noise,
        time=signal.time,
        data=signal.data,
        fitted=signal.data - found.solution.residual,
        residual=found.solution.residual,
        criteria=before.criteria,
        iterations=found.steps,
        swings=tuple(swings),
    )
    warnings = (*unsupported(modes), *remarks(modes), *colour(modes, signal), *_near(modes, signal), *_sentences(modes))
    return replace(modes, warnings=warnings)


def _sentences(modes: IdentifiedModes) -> tuple[str, ...]:
    """What is said of swings that do not decay exponentially, or whose stand is not known."""
    found = []
    for k, (w, one) in enumerate(zip(modes.natural_frequency, modes.swings, strict=True)):
        name = f"mode {k + 1} ({w:.6g} rad/s)"
        if one is not None and not one.exponential:
            found.append(f"{name} is one swing that decays by {one.law}, not exponentially alone")
        if one is not None and one.component.free_cube:
            found.append(
                f"{name} is one swing whose frequency follows its amplitude; that at zero amplitude holds for a cubic "
                "restoring force: describe the stand if it is a pendulum"
            )
    return tuple(found)


def _swing(one: Component, std: Array, signal: Signal) -> Swing:
    rest = list(std[2:])
    rates = np.array([rest.pop(0) if free else 0.0 for free in one.law])
    amplitude = amplitude_std = np.nan
    if one.free_square:
        amplitude, square_std = float(np.sqrt(max(one.square, 0.0))), float(rest.pop(0))
        amplitude_std = square_std / (2.0 * max(amplitude, 0.5 * np.sqrt(square_std)))
    return Swing(one, rates, float(one.envelope(signal.time)[-1]), amplitude, amplitude_std)
