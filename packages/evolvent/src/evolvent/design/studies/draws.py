"""Probabilities that samples are drawn at: plain random, Latin hypercube, Sobol sequence, corners; and correlation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import scipy

from evolvent_base import schema
from evolvent_base.errors import InputError, nearest

Array = np.ndarray
#: Ways to sample that draw; their values are given by distributions.
DRAWN = ("latin-hypercube", "monte-carlo", "sobol", "saltelli", "corners")
#: Most keys with a draw of their own whose corners are all run.
MOST_CORNERS = 16
#: Least and largest probability: a double next to 0 and 1.
_LEAST = 2.0**-53
#: Below this a pivot of a correlation matrix counts as zero.
_PIVOT = 1e-12


def count(sample: str, samples: int, draws: int) -> int:
    """Number of cases of a study.

    Parameters
    ----------
    samples : int, of the study; 0 for corners
    draws : int, number of independent draws
    """
    return {"corners": 2**draws, "saltelli": samples * (draws + 2)}.get(sample, samples)


def check(sample: str, samples: int, draws: int, correlated: bool) -> None:
    """Refuse what a way to sample does not allow.

    Raises
    ------
    InputError
    """
    if sample in ("sobol", "saltelli") and samples & (samples - 1):
        near = 2 ** max(round(np.log2(samples)), 1)
        raise InputError(f"samples is {samples}; with sample: {sample} it must be a power of 2, such as {near}")
    if sample == "corners" and draws > MOST_CORNERS:
        raise InputError(
            f"over varies {draws} keys independently, which have {2.0**draws:.3g} corners; at most {MOST_CORNERS} keys "
            f"are possible, and keys that share a draw (joined by commas) count as one"
        )
    if correlated and sample in ("saltelli", "corners"):
        why = "indices of Sobol are of independent keys" if sample == "saltelli" else "corners take every end"
        raise InputError(f"correlation is given, but {why}; leave it out with sample: {sample}")


def probabilities(sample: str, samples: int, draws: int, seed: int, correlation: Array | None = None) -> Array:
    """Probabilities of all cases: (cases, draws) float, in (0, 1); of corners 0 or 1.

    Parameters
    ----------
    correlation : (draws, draws) float, of the normal scores (Gaussian copula); None for independent draws

    Notes
    -----
    A correlated Latin hypercube keeps the strata of every key: its probabilities have the ranks of the copula's.
    """
    if sample == "corners":
        return ((np.arange(2**draws)[:, None] >> np.arange(draws)[::-1]) & 1).astype(float)
    rng = np.random.default_rng(np.random.SeedSequence(seed))
    if sample == "monte-carlo":
        found = rng.random((samples, draws))
    else:
        if sample == "latin-hypercube":
            found = scipy.stats.qmc.LatinHypercube(draws, rng=rng).random(samples)
        else:
            size = 2 * draws if sample == "saltelli" else draws
            found = scipy.stats.qmc.Sobol(size, rng=rng).random_base2(samples.bit_length() - 1)
    if sample == "saltelli":
        found = saltelli(found[:, :draws], found[:, draws:])
    found = np.clip(found, _LEAST, 1.0 - _LEAST)
    if correlation is None:
        return found
    drawn = correlated(found, correlation)
    if sample == "latin-hypercube":
        ranks = np.argsort(np.argsort(drawn, axis=0, kind="stable"), axis=0, kind="stable")
        inside = found * samples - np.floor(found * samples)
        drawn = (ranks + inside) / samples
    return np.clip(drawn, _LEAST, 1.0 - _LEAST)


def saltelli(a: Array, b: Array) -> Array:
    """Rows of two samples, and of the first with each column in turn from the second: (n (d + 2), d)."""
    mixed = []
    for k in range(a.shape[1]):
        one = a.copy()
        one[:, k] = b[:, k]
        mixed.append(one)
    return np.concatenate([a, b, *mixed])


def correlated(u: Array, correlation: Array) -> Array:
    """Probabilities with the dependence of a Gaussian copula, from independent ones.

    Parameters
    ----------
    u : (n, d) float, in (0, 1)
    correlation : (d, d) float, positive semi-definite, of the normal scores
    """
    z, factor = scipy.special.ndtri(u), _factor(correlation)
    drawn = np.zeros_like(z)
    for i in range(z.shape[1]):
        for j in range(i + 1):  # sums of one order, the same for any number of threads
            drawn[:, i] += factor[i, j] * z[:, j]
    return np.asarray(scipy.special.ndtr(drawn))


def _factor(matrix: Array) -> Array:
    """Lower triangular L with L L^T = matrix.

    Raises
    ------
    InputError
        If the matrix is not positive semi-definite.
    """
    size = len(matrix)
    L = np.zeros((size, size))
    for j in range(size):
        pivot = matrix[j, j] - float(L[j, :j] @ L[j, :j])
        rest = [matrix[i, j] - float(L[i, :j] @ L[j, :j]) for i in range(j + 1, size)]
        if pivot < -_PIVOT or (pivot <= _PIVOT and any(abs(one) > np.sqrt(_PIVOT) for one in rest)):
            raise InputError("correlation is not possible: its matrix is not positive semi-definite; make one smaller")
        if pivot > _PIVOT:
            L[j, j] = np.sqrt(pivot)
            L[j + 1 :, j] = np.array(rest) / L[j, j]
    return L


def correlation_matrix(given: Any, draw_of: Mapping[str, int], draws: int) -> Array | None:
    """The correlation between draws that a study states; None for none.

    Parameters
    ----------
    given : list of [key, key, value]
    draw_of : mapping, key -> its draw

    Raises
    ------
    InputError
        One sentence that names the keys and the value.
    """
    if not given:
        return None
    if not isinstance(given, list):
        raise InputError(f"correlation is {schema.shown(given)}; it must be a list of [key, key, value]")
    found, stated = np.eye(draws), set()
    for k, one in enumerate(given):
        i, j = _pair(k, one, draw_of)
        value = one[2]
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not -1.0 <= value <= 1.0:
            raise InputError(f"correlation.{k}.2 is {schema.shown(value)}; it must be a number from -1 to 1")
        if (i, j) in stated:
            raise InputError(f"correlation states {one[0]!r} and {one[1]!r} twice; state them once")
        stated.add((i, j))
        found[i, j] = found[j, i] = float(value)
    _factor(found)
    return found


def _pair(place: int, one: Any, draw_of: Mapping[str, int]) -> Sequence[int]:
    """The draws of a statement, in order."""
    if not isinstance(one, list) or len(one) != 3 or not all(isinstance(key, str) for key in one[:2]):
        raise InputError(
            f"correlation.{place} is {schema.shown(one)}; it must be [key, key, value], such as [a, b, 0.5]"
        )
    for key in one[:2]:
        if key not in draw_of:
            raise InputError(f"correlation.{place} names {key!r}, which over does not vary; {nearest(key, draw_of)}")
    i, j = sorted(draw_of[key] for key in one[:2])
    if i == j:
        raise InputError(f"correlation.{place} names {one[0]!r} and {one[1]!r}, which share one draw already")
    return i, j
