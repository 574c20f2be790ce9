"""Causes by their patterns: sizes, what they leave, and what is said of them."""

from __future__ import annotations

import numpy as np
import pytest

from evolvent_papers.laboratory import causes
from evolvent_papers.laboratory.causes import Cause

RNG = np.random.default_rng(3)
X = np.linspace(0.0, 1.0, 20)
LOW = X < 0.5
GROUPS = {"low": LOW, "high": ~LOW}
DEVIATION = np.full(X.size, 0.01)


def of(pattern: np.ndarray, differences: np.ndarray, least: float = -np.inf) -> causes.Explanation:
    """One cause beside differences."""
    cause = Cause(name="one", unit="m", pattern=pattern, least=least)
    return causes.explanations([cause], differences, DEVIATION, GROUPS)[0]


def test_the_true_cause_is_found_with_its_uncertainty() -> None:
    """Of 400 measurements the sizes scatter as one fit states, and chi2 is the number of free differences."""
    pattern, sizes, left = 1.0 + X, [], []
    for _ in range(400):
        noisy = 0.3 * pattern + 0.01 * RNG.standard_normal(X.size)
        fit = causes.fitted([Cause(name="one", unit="m", pattern=pattern)], noisy, DEVIATION, X >= 0.0)
        sizes.append(fit.values[0])
        left.append(fit.chi2)
    assert np.mean(sizes) == pytest.approx(0.3, abs=4.0 * fit.deviations[0] / 20.0)
    assert np.std(sizes) == pytest.approx(fit.deviations[0], rel=0.15)
    assert np.mean(left) == pytest.approx(X.size - 1, rel=0.1)


@pytest.mark.parametrize(
    ("differences", "least", "text"),
    [
        (0.3 * (1.0 + X), -np.inf, "explains all"),
        (0.3 * (1.0 + X) * np.where(LOW, 1.0, 1.5), -np.inf, "ruled out: each group asks for another size"),
        (0.3 * (1.0 + X) + np.where(LOW, 0.0, np.sin(40.0 * X)), -np.inf, "explains low, not high"),
        (np.sin(40.0 * X), -np.inf, "ruled out: wrong pattern"),
        (-0.3 * (1.0 + X), 0.0, "ruled out: it would have to be below 0"),
    ],
)
def test_what_is_said_of_a_cause(differences: np.ndarray, least: float, text: str) -> None:
    assert of(1.0 + X, differences, least).text == text


def test_a_cause_without_effect_on_a_group() -> None:
    found = of(np.where(LOW, 1e-9, 1.0), np.full(X.size, 0.2))
    assert found.text == "explains high, not low"
    baseline = causes.fitted([], np.full(X.size, 0.2), DEVIATION, X >= 0.0)
    shown = causes.table([found], baseline, {"again": ("high", LOW)}, "title")
    assert shown.heads == ("cause", "size by 10 low", "chi2", "size by 10 high", "chi2", "chi2 of 10 again", "verdict")
    assert shown.rows[0] == ("none", "-", "4000", "-", "4000", "4000", "")
    assert shown.rows[1][1:5] == ("no effect", "4000", "+0.2 ± 0.0032 m", "0")


def test_two_causes_together_and_the_price_of_one_more() -> None:
    ones = [Cause(name="a", unit="m", pattern=1.0 + X), Cause(name="b", unit="m", pattern=X**2)]
    differences = 0.3 * ones[0].pattern + 0.1 * ones[1].pattern + 0.01 * RNG.standard_normal(X.size)
    both = causes.fitted(ones, differences, DEVIATION, X >= 0.0)
    assert both.values == pytest.approx([0.3, 0.1], abs=4.0 * both.deviations.max())
    assert both.criterion < causes.fitted(ones[:1], differences, DEVIATION, X >= 0.0).criterion


def test_the_best_pair_has_possible_sizes() -> None:
    ones = [Cause(name=name, unit="m", pattern=X**k, least=least) for k, (name, least) in enumerate(
        (("a", -np.inf), ("b", 0.0), ("c", -np.inf)))]  # fmt: skip
    differences = 0.4 * ones[0].pattern - 0.3 * ones[1].pattern
    pair, fit = causes.best_pair(ones, differences, DEVIATION, X >= 0.0)
    assert [one.name for one in pair] == ["a", "c"]
    assert fit.chi2 > 1.0
