"""One-sided bounds and quantiles from order statistics of independent samples; no distribution is assumed.

The k-th smallest of n independent samples lies at or above the quantile of probability p with the probability that
fewer than k samples lie below it, that is the binomial distribution function B(k - 1; n, p) (Wilks, Ann. Math. Stat. 12
(1941) 91; David and Nagaraja, Order Statistics, 3rd ed. (2003), section 7.1). For ties and discrete distributions these
confidences are lower bounds.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

import numpy as np
import scipy

Array = np.ndarray


def confidence(n: int, rank: int, coverage: float) -> float:
    """Confidence that the sample of a rank is not below the quantile.

    Parameters
    ----------
    n : int, samples
    rank : int, 1 for the smallest sample, n for the largest
    coverage : float, probability of the quantile
    """
    return float(scipy.special.bdtr(rank - 1, n, coverage)) if rank >= 1 else 0.0


def upper_rank(n: int, coverage: float, wanted: float) -> int | None:
    """Lowest rank whose sample is an upper bound with the wanted confidence; None where not even the largest is."""
    if n < 1 or confidence(n, n, coverage) < wanted:
        return None
    low, high = 0, n  # low does not suffice, high does
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if confidence(n, middle, coverage) >= wanted else (middle, high)
    return high


def least_runs(coverage: float, wanted: float) -> int:
    """Number of samples from which the largest is a bound: 59 for 95 % and 95 %."""
    found = max(math.ceil(math.log1p(-wanted) / math.log(coverage)) - 1, 1)
    while confidence(found, found, coverage) < wanted:
        found += 1
    return found


@dataclasses.dataclass(frozen=True, kw_only=True)
class Bound:
    """A one-sided bound.

    Attributes
    ----------
    value : float, NaN where there is none
    confidence : float, that it has; of no bound that of the largest sample, 0 where a run without a value stands there
    rank : int, of the sample that it is, counted from the far end: 1 for the extreme; 0 for none
    why : str, why there is none; else empty
    """

    value: float
    confidence: float
    rank: int
    why: str = ""


def bound(values: Array, lacking: int, *, upper: bool, coverage: float, wanted: float) -> Bound:
    """A one-sided bound of what `coverage` of all runs do not exceed, with a confidence of at least `wanted`.

    Parameters
    ----------
    values : (k,) float, finite, of independent runs
    lacking : int, runs without a value, which count as beyond every bound
    upper : bool
    """
    n = values.size + lacking
    own = np.sort(values if upper else -values)
    rank = upper_rank(n, coverage, wanted)
    if rank is None:
        reached = confidence(n, n, coverage)
        why = (
            f"{n} runs give a confidence of {100 * reached:.3g} %; {least_runs(coverage, wanted)} are needed for "
            f"{100 * wanted:.4g} %"
        )
        return Bound(value=math.nan, confidence=reached, rank=0, why=why)
    if rank > own.size:
        reached = confidence(n, own.size, coverage)
        why = (
            f"{lacking} of {n} runs have no value and count as beyond the bound; the extreme of the others has a "
            f"confidence of {100 * reached:.3g} %"
        )
        return Bound(value=math.nan, confidence=reached, rank=0, why=why)
    value = float(own[rank - 1])
    return Bound(value=value if upper else -value, confidence=confidence(n, rank, coverage), rank=n + 1 - rank)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Quantile:
    """A quantile and the ends of its confidence interval; infinite or NaN where samples do not reach."""

    probability: float
    value: float
    low: float
    high: float


def quantiles(
    values: Array, lacking: int, probabilities: tuple[float, ...], wanted: float, *, independent: bool
) -> list[Quantile]:
    """Quantiles of the values, with two-sided confidence intervals of independent samples (NaN of others).

    Parameters
    ----------
    values : (k,) float, finite
    lacking : int, runs without a value; either tail of an interval takes them as beyond it
    probabilities : of the quantiles
    wanted : float, confidence of an interval, half of the rest in either tail
    """
    own, tail = np.sort(values), 0.5 * (1.0 + wanted)
    found = []
    for p in probabilities:
        value = float(np.quantile(own, p)) if own.size else math.nan
        low = high = math.nan
        if independent:
            n = own.size + lacking
            above, below = upper_rank(n, p, tail), upper_rank(n, 1.0 - p, tail)
            high = float(own[above - 1]) if above is not None and above <= own.size else math.inf
            low = float(own[::-1][below - 1]) if below is not None and below <= own.size else -math.inf
        found.append(Quantile(probability=p, value=value, low=low, high=high))
    return found


def failure_interval(failed: int, n: int, wanted: float) -> tuple[float, float]:
    """Interval of the probability of failure by Clopper and Pearson."""
    tail = 0.5 * (1.0 - wanted)
    low = 0.0 if failed == 0 else float(scipy.special.betaincinv(failed, n - failed + 1, tail))
    return low, 1.0 if failed == n else float(scipy.special.betaincinv(failed + 1, n - failed, 1.0 - tail))


def moments(values: Array) -> Mapping[str, float]:
    """Mean, standard deviation, smallest and largest of finite values."""
    if not values.size:
        return dict.fromkeys(("mean", "std", "least", "largest"), math.nan)
    std = float(values.std(ddof=1)) if values.size > 1 else math.nan
    return {"mean": float(values.mean()), "std": std, "least": float(values.min()), "largest": float(values.max())}
