"""The way in: from samples to modes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from evolvent_base.errors import InputError, nearest
from evolvent_massprops.identification.decay_laws import DECAY
from evolvent_massprops.identification.linear_prediction import prony, tls_prony
from evolvent_massprops.identification.modes import IdentifiedModes
from evolvent_massprops.identification.orders import search
from evolvent_massprops.identification.signals import Array, Sampling, Signal, read_signal, refuse_uneven
from evolvent_massprops.identification.subspace import esprit, matrix_pencil
from evolvent_massprops.identification.swing_starts import Kind
from evolvent_massprops.identification.swings import refine
from evolvent_massprops.identification.variable_projection import fit, varpro

METHODS: dict[str, Callable[..., IdentifiedModes]] = {
    "varpro": varpro,
    "esprit": esprit,
    "matrix_pencil": matrix_pencil,
    "tls_prony": tls_prony,
    "prony": prony,
}
#: Times without their scatter are taken where they are more likely by this logarithm.
EVIDENCE = 10.0


def identify(
    data: Any,
    *,
    rate: float | None = None,
    time: Any = None,
    method: str = "varpro",
    order: int | str | None = None,
    highest_order: int | None = None,
    names: Sequence[str] | None = None,
    noise: Any = None,
    band: Sequence[float] | None = None,
    detrend: str = "constant",
    decay: str = "auto",
    swing: Kind | None = None,
) -> IdentifiedModes:
    """Frequencies, decay rates, amplitudes and phases of the modes in free vibrations, with their uncertainties.

    Parameters
    ----------
    data : (N,) or (N, c) array, or mapping from names of sensors to (N,) arrays
        One column a sensor, in any units; NaN where a sample is missing.
    rate : Hz, samples a second; or
    time : (N,) s, rising; the fit is at these times, even or not
    method : "varpro" (maximum likelihood, the only one that gives uncertainties and takes missing samples and uneven
        times), "esprit", "matrix_pencil", "tls_prony" or "prony"
    order : number of modes; found from the data unless given, or where it is "auto"
    highest_order : the largest order to try where none is given; 10 unless given
    names : c names of sensors, for messages
    noise : standard deviation of the sensors' noise, one number or (c,), in the units of `data`; estimated unless given
    band : (low, high) rad/s; only modes inside are fitted. What lies outside stays in the residual: see its warnings.
    detrend : "constant" (an offset is fitted to each sensor) or "linear" (an offset and a drift)
    decay : law by which the strongest mode decays: "viscous", "dry" (friction), "quadratic" (drag), "mixed" (all
        three), or "auto": chosen by the data, wherever exponential modes may be parts of one swing. With VARPRO alone.
    swing : what is known of the strongest mode before, such as how a pendulum is turned back

    Returns
    -------
    IdentifiedModes
        Its `warnings` say what the data do not support; `criteria` what was found for each order.

    Raises
    ------
    InputError
        One sentence, for data that hold no answer: lengths that differ, times that do not rise, a rate below twice the
        band's upper end, a sensor that is empty, constant, clipped, complex or the copy of another, an order that the
        samples do not allow, a fit that does not converge or whose equations are singular, no mode above the noise.

    Examples
    --------
    >>> import numpy as np
    >>> from evolvent_massprops.identification import identify
    >>> t = np.arange(600) / 50.0
    >>> x = np.exp(-0.1 * t) * np.cos(14.0 * t) + 0.01 * np.random.default_rng(1).standard_normal(600)
    >>> modes = identify({"corner": x}, rate=50.0)
    >>> modes.order
    1
    >>> bool(abs(modes.frequency[0] - 14.0) < 3.0 * modes.frequency_std[0])
    True
    """
    if method not in METHODS:
        raise InputError(f"method is {method!r}; {nearest(str(method), METHODS)}")
    if decay not in DECAY:
        raise InputError(f"decay is {decay!r}; {nearest(str(decay), DECAY)}")
    if decay != "auto" and method != "varpro":
        raise InputError(f"decay is {decay!r}, which varpro alone fits; method is {method!r}")
    if isinstance(order, str):
        if order != "auto":
            raise InputError(f"order is {order!r}; it must be a whole number of modes, 1 or more, or 'auto'")
        order = None
    options: Sampling = {
        "rate": rate, "time": time, "names": names, "noise": noise, "band": band, "detrend": detrend
    }  # fmt: skip
    if order is None and highest_order is not None and (isinstance(highest_order, bool) or highest_order < 1):
        raise InputError(f"highest_order is {highest_order!r}; it must be a whole number, 1 or more")
    try:
        modes, signal = _exponential(method, data, order, highest_order, options)
        if method == "varpro":
            modes = refine(modes, signal, swing, decay, fixed=order is not None)
        return _with_clock(modes, signal.unsure)
    except np.linalg.LinAlgError as error:
        asked = f"{order} modes" if order is not None else "the modes"
        raise InputError(
            f"{method} cannot find {asked}: its equations have no solution in floating-point numbers ({error}); "
            "use fewer modes or another method"
        ) from None


def _exponential(
    method: str, data: Any, order: int | None, highest_order: int | None, options: Sampling
) -> tuple[IdentifiedModes, Signal]:
    """Modes that decay exponentially, and the signal that they were found in.

    Notes
    -----
    Where times scatter, either the samples were taken at these times, or at steady ones and the times were read late.
    The modes are fitted at both; the likelihood decides.
    """
    signal = read_signal(data, **options)
    if method != "varpro":
        refuse_uneven(signal, method)
    modes = _found(method, data, order, highest_order, options)
    if signal.steady is not None:
        other: Sampling = {**options, "time": signal.steady}
        calm = read_signal(data, **other)
        if modes is None or _evidence(fit(modes.pole, calm).point.squares, modes, signal) > EVIDENCE:
            modes = _found(method, data, order, highest_order, other)
            if modes is not None:
                rms = float(np.std(signal.time - signal.steady))
                said = (
                    "the modes fit much better if samples were taken steadily and only their times scatter, by "
                    f"{rms:.2g} s rms: times without this scatter were used"
                )
                modes = replace(modes, warnings=(*modes.warnings, said))
                return modes, replace(calm, unsure=_slope(modes, signal.time - signal.steady))
    if modes is None:
        raise InputError("no mode is above the noise; give the order if there must be one")
    return modes, signal


def _found(
    method: str, data: Any, order: int | None, highest_order: int | None, options: Sampling
) -> IdentifiedModes | None:
    """Modes by a method, of the order that is given or that the data hold; None where they hold none."""
    if order is not None:
        return METHODS[method](data, order, **options)
    modes, criteria = search(read_signal(data, **options), highest_order)
    if modes is None:
        return None
    if method != "varpro":
        modes = METHODS[method](data, modes.order, **options)
    return replace(modes, criteria=criteria)


def _slope(modes: IdentifiedModes, scatter: Array) -> float:
    """Relative standard uncertainty of the clock by times that scatter, for the mode with the largest amplitude.

    Notes
    -----
    A frequency follows from the slope of the phase over time; samples count by their square amplitude.
    """
    strongest = int(np.argmax((modes.amplitude / modes.noise).max(axis=1)))
    weight = np.exp(-2.0 * modes.decay_rate[strongest] * modes.time)
    away = modes.time - np.average(modes.time, weights=weight)
    return float(np.std(scatter) * np.sqrt(((weight * away) ** 2).sum()) / (weight * away**2).sum())


def _with_clock(modes: IdentifiedModes, unsure: float) -> IdentifiedModes:
    """The modes with a relative standard uncertainty of the clock, that all frequencies and decay rates share."""
    if unsure == 0.0:
        return modes
    C, poles = modes.covariance.copy(), np.concatenate((modes.frequency, modes.decay_rate))
    C[: poles.size, : poles.size] += unsure**2 * np.outer(poles, poles)
    return replace(modes, covariance=C)


def _evidence(squares: Array, modes: IdentifiedModes, signal: Signal) -> float:
    """Logarithm of the likelihood of a fit that leaves these sums of squares (c,) over that of the modes."""
    own = np.nansum(modes.residual**2, axis=0)
    if signal.noise is not None:
        return float(((own - squares) / (2.0 * signal.noise**2)).sum())
    least = signal.counts * signal.rounding**2
    return float((0.5 * signal.counts * np.log((own + least) / (squares + least))).sum())
