"""The paper's rules for sampling beside the Cramér-Rao bound of a planned measurement."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from evolvent_massprops.identification import IdentifiedModes
from evolvent_massprops.identification.signals import DETREND
from evolvent_massprops.planning.expected import Expected, Option, lines, modal_of
from evolvent_massprops.planning.pulls import Pull

#: What is measured of (2.5), in `evolvent claims stand-rule-2-5`.
PRONY = "is refuted for Prony's method, which is best at 2.5 samples a period and fails from 6 on"
#: Deviations within this share of one another make no difference.
SAME = 0.05


class Rule(NamedTuple):
    """A rule of the paper beside the bound.

    Attributes
    ----------
    name : str, its number
    asks : str, what it asks here
    finds : str, what the bound gives here
    verdict : str, "yes" where it holds here, "no", "makes no difference" or "cannot be sampled"
    """

    name: str
    asks: str
    finds: str
    verdict: str


def rules(one: Expected, pull: Pull, best: Option) -> tuple[Rule, ...]:
    """The paper's rules (2.5) to (2.7) for a recording of the recommended option, beside the Cramér-Rao bound.

    Notes
    -----
    Belyakov (2002), as this package reads it: (2.5) the samples in a period of the fastest mode lie between 2 and about
    10, and the frequencies become more accurate towards 2; (2.6) for the amplitude of a mode a period of it has as many
    samples as the record has periods, T = 2 pi/(w sqrt N); (2.7) where that leaves (2.5), only every m-th sample is
    used for the frequencies. They were made for Prony's method, whose bias the bound does not have.
    """
    rows = [k - 1 for k in best.sensors]
    w = lines(one, pull, rows).frequency
    least = 4 * w.size + 2 + DETREND[one.given.identification.detrend]
    fastest, N = float(w.max()), best.samples

    def modes(rate: float, samples: int) -> IdentifiedModes:
        return modal_of(one, pull, rate, samples, rows).modes

    def deviation(rate: float, samples: int) -> float:
        """Largest relative deviation of a frequency."""
        return float(np.max(modes(rate, samples).frequency_std / w))

    per_period = 2.0 * math.pi * best.rate / fastest
    near, far = (fastest * n / (2.0 * math.pi) for n in (2.5, 10.0))
    same_time = deviation(near, max(round(best.duration * near) + 1, least)) / deviation(
        far, max(round(best.duration * far) + 1, least)
    )
    same_count = deviation(near, N) / deviation(far, N)
    kept = "holds" if same_count < 1.0 else "does not hold"
    found = [
        Rule(
            "(2.5)",
            f"2 to 10 samples in a period of the fastest mode, better towards 2 (the plan has {per_period:.3g})",
            f"2.5 instead of 10 samples a period: deviations of the frequencies times {same_count:.2g} for as many "
            f"samples, times {same_time:.2g} for a record as long. (2.5) {kept} for the Cramér-Rao bound of as many "
            f"samples, and {PRONY}",
            "yes" if same_count < 1.0 else "no",
        )
    ]
    by_rule = [float(x) * math.sqrt(N) / (2.0 * math.pi) for x in w]
    usual, ratios = _of_amplitudes(modes(near, N)), []
    for k, rate in enumerate(by_rule):
        sampled = math.pi * rate > fastest
        ratios.append(_of_amplitudes(modes(rate, N))[k] / usual[k] if sampled else math.nan)
    texts = ", ".join("-" if math.isnan(ratio) else f"{ratio:.2g}" for ratio in ratios)
    found.append(
        Rule(
            "(2.6)",
            f"for amplitudes, with {N} samples: {', '.join(f'{r:.3g}' for r in by_rule)} Hz for the modes by rising "
            "frequency",
            f"deviations of the amplitudes times {texts} against 2.5 samples a period of the fastest mode and as many "
            "samples (-: below two samples a period)",
            _verdict(np.array(ratios)),
        )
    )
    skip = max(1, math.ceil(per_period / 2.0) - 1)
    loss = deviation(best.rate / skip, max((N - 1) // skip + 1, least)) / deviation(best.rate, N) if skip > 1 else 1.0
    found.append(
        Rule(
            "(2.7)",
            f"one of {skip} samples for the frequencies" if skip > 1 else "all samples for the frequencies",
            f"leaving samples out widens the deviations {loss:.2g} times" if skip > 1 else "nothing is left out",
            "makes no difference" if skip == 1 else _verdict(np.array([loss])),
        )
    )
    return tuple(found)


def _of_amplitudes(modes: IdentifiedModes) -> np.ndarray:
    """(m,) deviation of the largest amplitude of each mode."""
    largest = modes.amplitude.argmax(axis=1)
    return modes.amplitude_std[np.arange(modes.order), largest]


def _verdict(ratios: np.ndarray) -> str:
    """Of deviations with a rule over those without it."""
    ratios = ratios[np.isfinite(ratios)]
    if not ratios.size:
        return "cannot be sampled"
    if np.all(np.abs(ratios - 1.0) <= SAME):
        return "makes no difference"
    return "yes" if np.all(ratios <= 1.0 + SAME) else "no"
