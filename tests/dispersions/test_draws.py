"""Distributions and the samples that they are drawn at."""

import numpy as np
import pytest
from scipy import stats

from evolvent.design.studies import distributions, draws
from evolvent_base import units
from evolvent_base.errors import InputError

LENGTH = units.Quantity(unit="m", what="a length", example="2 m")
WHOLE = units.Whole(least=0, most=100)


def read(text, reader=LENGTH, nominal=2.0):
    return distributions.read("over.a", text, reader, lambda: nominal)


def middles(n=20_000):
    """Probabilities in the middle of n strata."""
    return (np.arange(n) + 0.5) / n


@pytest.mark.parametrize(
    ("text", "frozen"),
    [
        ("10%", stats.uniform(1.8, 0.4)),
        ("tolerance(20 cm)", stats.uniform(1.8, 0.4)),
        ("tolerance(-5%, 10%)", stats.uniform(1.9, 0.3)),
        ("uniform(1 m, 300 cm)", stats.uniform(1.0, 2.0)),
        ("uniform(50%, 150%)", stats.uniform(1.0, 2.0)),
        ("triangular(1 m, nominal, 4 m)", stats.triang(1.0 / 3.0, 1.0, 3.0)),
        ("triangular(1 m, 1 m, 4 m)", stats.triang(0.0, 1.0, 3.0)),
        ("normal(nominal, 5%)", stats.norm(2.0, 0.1)),
        ("normal(3 m, 10 cm)", stats.norm(3.0, 0.1)),
        ("normal(110%, 10%)", stats.norm(2.2, 0.22)),
        ("truncated-normal(2 m, 10%, 1.9 m, 2.5 m)", stats.truncnorm(-0.5, 2.5, 2.0, 0.2)),
    ],
)
def test_quantiles_are_those_of_scipy(text, frozen):
    u = middles()
    np.testing.assert_allclose(read(text).quantiles(u), frozen.ppf(u), rtol=1e-9)


def test_moments_of_draws():
    u = draws.probabilities("monte-carlo", 20_000, 1, 4)[:, 0]
    values = np.array(read("truncated-normal(2 m, 10%, 1.9 m, 2.5 m)").quantiles(u))
    exact = stats.truncnorm(-0.5, 2.5, 2.0, 0.2)
    assert abs(values.mean() - exact.mean()) < 5.0 * exact.std() / np.sqrt(values.size)
    assert values.std() == pytest.approx(exact.std(), rel=0.03)
    assert 1.9 <= values.min() < values.max() <= 2.5


def test_a_table_has_each_of_its_values_as_often():
    found = read("table(1 m, 2 m, 2 m, 50 cm)").quantiles(middles(400))
    assert {v: found.count(v) for v in set(found)} == {1.0: 100, 2.0: 200, 0.5: 100}
    assert read("table(3 m)").ends() == (3.0, 3.0)


def test_quantiles_of_a_table_are_the_empirical_ones():
    values = np.random.default_rng(3).normal(2.0, 0.1, 37).round(2)
    found = read(f"table({', '.join(map(repr, values.tolist()))})").quantiles(middles(997))
    np.testing.assert_array_equal(found, np.quantile(values, middles(997), method="inverted_cdf"))
    assert np.all(stats.ecdf(values).cdf.evaluate(found) >= middles(997))


def test_correlated_tables_follow_one_another():
    """The third highest of one table is drawn with the third highest of the other, whatever their order."""
    u = draws.probabilities("monte-carlo", 200, 2, 1, np.ones((2, 2)))
    a, b = (np.array(read(f"table({text})").quantiles(u[:, k])) for k, text in enumerate(("3, 1, 2", "10, 30, 20")))
    np.testing.assert_array_equal(10.0 * a, b)


def test_whole_numbers():
    found = read("uniform(2, 4)", WHOLE, 3).quantiles(middles(300))
    assert {v: found.count(v) for v in set(found)} == {2: 100, 3: 100, 4: 100}
    assert {type(v) for v in read("normal(nominal, 20%)", WHOLE, 10).quantiles(middles(50))} == {int}


def test_ends_of_the_worst_case():
    assert read("normal(2 m, 10 cm)").ends() == pytest.approx((1.7, 2.3))
    assert read("10%").ends() == pytest.approx((1.8, 2.2))
    assert read("truncated-normal(2 m, 1 m, 1.5 m, 2.1 m)").ends() == (1.5, 2.1)
    assert read("table(3 m, 1 m, 2 m)").ends() == (1.0, 3.0)
    assert draws.probabilities("corners", 0, 2, 0).tolist() == [[0, 0], [0, 1], [1, 0], [1, 1]]


def test_strata_of_a_latin_hypercube_with_and_without_correlation():
    matrix = np.array([[1.0, 0.8, 0.0], [0.8, 1.0, 0.0], [0.0, 0.0, 1.0]])
    for correlation in (None, matrix):
        u = draws.probabilities("latin-hypercube", 500, 3, 9, correlation)
        for column in u.T:
            assert sorted(np.floor(column * 500).astype(int)) == list(range(500))
    z = stats.norm.ppf(u)
    assert np.corrcoef(z.T)[0, 1] == pytest.approx(0.8, abs=0.06)
    assert abs(np.corrcoef(z.T)[0, 2]) < 0.15


@pytest.mark.parametrize("sample", ["monte-carlo", "sobol"])
def test_the_correlation_of_draws(sample):
    matrix = np.array([[1.0, -0.6, 0.3], [-0.6, 1.0, 0.0], [0.3, 0.0, 1.0]])
    z = stats.norm.ppf(draws.probabilities(sample, 8192, 3, 1, matrix))
    np.testing.assert_allclose(np.corrcoef(z.T), matrix, atol=0.04)
    np.testing.assert_allclose(z.std(axis=0), 1.0, atol=0.03)


def test_a_full_correlation_is_one_draw():
    u = draws.probabilities("monte-carlo", 50, 2, 1, np.ones((2, 2)))
    np.testing.assert_allclose(u[:, 0], u[:, 1], rtol=1e-12)


def test_draws_follow_from_the_seed_alone():
    for sample in draws.DRAWN[:-1]:
        first = draws.probabilities(sample, 16, 3, 5)
        assert np.array_equal(first, draws.probabilities(sample, 16, 3, 5))
        assert not np.array_equal(first, draws.probabilities(sample, 16, 3, 6))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("norml(2 m, 5%)", "no distribution is called 'norml'; did you mean 'normal'?"),
        ("normal(2 m)", "it must have the form normal(MEAN, STD)"),
        ("normal(2 kg, 5%)", "'2 kg' must be a number in m"),
        ("normal(2 m, -5%)", "its standard deviation is -0.1, but must be above zero"),
        ("uniform(3 m, 1 m)", "its limits must rise, but are 3, 1"),
        ("triangular(1 m, 5 m, 4 m)", "its limits must rise"),
        ("uniform(1 m, 1e999 m)", "'1e999 m' must be a number in m"),
        ("nan%", "'nan%' is not a percentage"),
        ("x%", "'x%' is not a percentage"),
        ("0%", "its limits must rise"),
        ("table()", "it must have the form table(VALUE, ...)"),
        ("2 m", "it must be a tolerance such as '10%', or a distribution"),
        ("normal(__import__('os'), 5%)", "must be a number in m"),
        (7, "it must be {from, to} (uniform), {mean, std} (normal) or a text"),
        (None, "it must be {from, to}"),
    ],
)
def test_what_is_no_distribution_is_refused(text, sentence):
    with pytest.raises(InputError) as refused:
        read(text)
    assert sentence in str(refused.value)
    assert str(refused.value).startswith("over.a is")


def test_a_share_needs_a_number_in_the_case():
    with pytest.raises(InputError, match="the case's own value of the key is empty, no number"):
        read("10%", nominal=None)
    with pytest.raises(InputError, match="takes words or lists, so it has no range"):
        read("10%", reader=None)
