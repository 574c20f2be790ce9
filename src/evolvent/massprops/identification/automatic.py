"""The way in: from samples to modes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from evolvent.base.errors import InputError, nearest
from evolvent.massprops.identification.linear_prediction import prony, tls_prony
from evolvent.massprops.identification.modes import Modes
from evolvent.massprops.identification.orders import search
from evolvent.massprops.identification.signals import Sampling, read_signal
from evolvent.massprops.identification.subspace import esprit, matrix_pencil
from evolvent.massprops.identification.swings import DECAY, Kind, refine
from evolvent.massprops.identification.variable_projection import varpro

METHODS: dict[str, Callable[..., Modes]] = {
    "varpro": varpro,
    "esprit": esprit,
    "matrix_pencil": matrix_pencil,
    "tls_prony": tls_prony,
    "prony": prony,
}


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
) -> Modes:
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
    decay : law by which the strongest mode decays: "viscous", "dry" (friction), "quadratic" (drag), "mixed" (all three), or
        "auto": chosen by the data, wherever exponential modes may be parts of one swing. With VARPRO alone.
    swing : what is known of the strongest mode before, such as how a pendulum is turned back

    Returns
    -------
    Modes
        Its `warnings` say what the data do not support; `criteria` what was found for each order.

    Raises
    ------
    InputError
        One sentence, for data that hold no answer: lengths that differ, times that do not rise, a rate below twice the band's
        upper end, a sensor that is empty, constant, clipped, complex or the copy of another, an order that the samples
        do not allow, a fit that does not converge or whose equations are singular, no mode above the noise.

    Examples
    --------
    >>> import numpy as np
    >>> from evolvent.massprops.identification import identify
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
        if order is not None:
            modes = METHODS[method](data, order, **options)
            known = decay != "auto" or swing is not None
            return refine(modes, read_signal(data, **options), swing, decay) if known and method == "varpro" else modes
        modes, criteria = search(read_signal(data, **options), highest_order)
        if modes is None:
            raise InputError("no mode is above the noise; give the order if there must be one")
        if method != "varpro":
            modes = METHODS[method](data, modes.order, **options)
        modes = replace(modes, criteria=criteria)
        return refine(modes, read_signal(data, **options), swing, decay) if method == "varpro" else modes
    except np.linalg.LinAlgError as error:
        asked = f"{order} modes" if order is not None else "the modes"
        raise InputError(
            f"{method} cannot find {asked}: its equations have no solution in floating-point numbers ({error}); "
            "use fewer modes or another method"
        ) from None
