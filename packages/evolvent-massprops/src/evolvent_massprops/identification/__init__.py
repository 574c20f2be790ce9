"""Frequencies, decay rates and amplitudes of free vibrations from sampled signals; no mechanics is needed.

The signal model, with t from the first sample, for every sensor c::

    x_c(t) = offset_c + sum_k amplitude_kc exp(-decay_rate_k t) cos(frequency_k t + phase_kc)

The poles -decay_rate + i frequency are common to all sensors. `identify` is the way in: it finds the number of modes,
the noise of each sensor and the modes, and refuses signals that hold none. The methods behind it can be called one by
one (`prony`, `tls_prony`, `matrix_pencil`, `esprit`, `varpro`); all return the same `IdentifiedModes`.

>>> import numpy as np
>>> from evolvent_massprops.identification import identify
>>> t = np.arange(500) / 50.0
>>> x = 0.3 + 2.0 * np.exp(-0.1 * t) * np.cos(14.0 * t + 0.5) + 0.01 * np.random.default_rng(1).standard_normal(500)
>>> modes = identify(x, rate=50.0)
>>> modes.order, round(float(modes.frequency[0]), 2)
(1, 14.0)
"""

from evolvent_massprops.identification.automatic import identify
from evolvent_massprops.identification.bounds import cramer_rao
from evolvent_massprops.identification.linear_prediction import prony, tls_prony
from evolvent_massprops.identification.modes import IdentifiedModes, ModeShapes, OrderCriteria, mode_variables
from evolvent_massprops.identification.signals import recorded
from evolvent_massprops.identification.subspace import esprit, matrix_pencil
from evolvent_massprops.identification.variable_projection import frequencies_in, varpro

__all__ = [
    "IdentifiedModes",
    "ModeShapes",
    "OrderCriteria",
    "cramer_rao",
    "esprit",
    "frequencies_in",
    "identify",
    "matrix_pencil",
    "mode_variables",
    "prony",
    "recorded",
    "tls_prony",
    "varpro",
]
