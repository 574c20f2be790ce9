"""Budgets: linear propagation against Monte Carlo, and the typical budget of the paper's stand."""

import numpy as np
import pytest

from evolvent_base.errors import InputError
from evolvent_massprops.inertia import (
    Body,
    Stand,
    fit,
    from_three_frequencies,
    linear_model,
    monte_carlo,
    propagate,
    vertical_model,
    with_budget,
)

STAND = Stand.rectangle(2.0, 0.8696, stiffness=740250.0, length=0.5)
BODY = Body(mass=15190.0, centre=(0.4, 0.0, 0.1), inertia=(3703.0, 43920.0, 43920.0))
TYPICAL = {
    "a": 0.3e-3, "b": 0.3e-3, "ex": 0.5e-3, "ez": 0.5e-3, "k1": 740.25, "k2": 740.25, "k3": 740.25, "k4": 740.25,
    "mass": 0.0002 * 15190.0, "h": 5e-3, "Ixz": 0.0005 * 43920.0,
}  # fmt: skip


def typical():
    w = linear_model(STAND, BODY).modes().natural_frequency[3:]
    C = np.diag((2e-5 * w) ** 2)
    return fit(STAND, BODY, ("stiffness", "Ixx", "Izz"), w, frequency_covariance=C, inputs=TYPICAL)


def test_typical_budget():
    found = typical()
    assert 100 * found.std["Ixx"] / 3703.0 == pytest.approx(0.11, abs=0.005)
    assert 100 * found.std["Izz"] / 43920.0 == pytest.approx(0.15, abs=0.005)
    b = found.budget
    np.testing.assert_allclose(b.std, np.sqrt(np.diag(found.covariance)))
    np.testing.assert_allclose(b.share.sum(axis=0), 100.0)
    share = dict(zip(b.inputs, b.share[:, 1:], strict=True))
    assert share["frequencies"].max() < 1.0  # geometry and springs dominate
    assert share["b"][0] > 30.0
    assert share["h"][0] > 4.0
    text = str(b)
    for name in (*TYPICAL, "frequencies", "all", "%"):
        assert name in text


@pytest.mark.slow
def test_linear_propagation_against_monte_carlo():
    found = typical()
    drawn = monte_carlo(found, TYPICAL, samples=4000, seed=1)
    std = drawn.std(axis=0, ddof=1)
    np.testing.assert_allclose(std, found.budget.std, rtol=0.05)
    np.testing.assert_allclose(drawn.mean(axis=0), found.budget.value, atol=4 * np.max(std / np.sqrt(4000)))
    correlation = lambda C: C[1, 2] / np.sqrt(C[1, 1] * C[2, 2])  # noqa: E731
    assert correlation(np.cov(drawn, rowvar=False)) == pytest.approx(correlation(found.covariance), abs=0.05)
    low, high = np.quantile(drawn, [0.025, 0.975], axis=0)
    np.testing.assert_allclose(high - low, 2 * 1.96 * found.budget.std, rtol=0.07)
    again = monte_carlo(found, TYPICAL, samples=4000, seed=1)
    np.testing.assert_array_equal(drawn, again)


def test_shapes_and_priors_against_monte_carlo():
    modes = vertical_model(STAND, BODY).modes()
    P = STAND.points
    A = modes.amplitude(modes.release((0, -9806.65, 0), P[0]), P).real
    found = fit(
        STAND,
        BODY,
        ("mass", "ex", "ez", "Ixx", "Izz", "stiffness"),
        modes.natural_frequency,
        frequency_covariance=np.diag((1e-5 * modes.natural_frequency) ** 2),
        shapes=A,
        shape_covariance=np.einsum("m,ij->mij", (1e-3 * np.abs(A).max(axis=1)) ** 2, np.eye(4)),
        points=P,
        model="vertical",
        prior={"mass": (15190.0, 3.0)},
        inputs={"b": 1e-3, "Ixz": 20.0},
    )
    assert found.budget.inputs == ("b", "Ixz", "frequencies", "shapes", "priors")
    drawn = monte_carlo(found, {"b": 1e-3, "Ixz": 20.0}, samples=3000, seed=2)
    np.testing.assert_allclose(drawn.std(axis=0, ddof=1), found.budget.std, rtol=0.06)


def test_sensitivities_are_those_of_identifying_anew():
    found = typical()
    i = found.budget.inputs.index("ex")
    w = found.problem.frequency
    moved = Body(mass=15190.0, centre=(0.4 + 1e-4, 0.0, 0.1), inertia=BODY.inertia)
    again = fit(STAND, moved, found.identified, w)
    assert "without shapes the start decides" in again.warnings[0]
    for j, name in enumerate(found.identified):
        assert again[name] - found[name] == pytest.approx(1e-4 * found.budget.sensitivity[i, j], rel=1e-2)


def test_what_was_not_given_is_not_claimed():
    modes = vertical_model(STAND, BODY).modes()
    given = {"shapes": modes.at(STAND.points), "points": STAND.points}
    found = from_three_frequencies(STAND, BODY, modes.natural_frequency, **given)
    assert np.all(np.isnan(found.covariance))
    assert found.budget is None
    only = with_budget(found, {"b": 1e-3})
    assert only.budget.inputs == ("b",)
    assert 100 * only.std["Ixx"] / 3703.0 == pytest.approx(0.22, abs=0.005)
    with pytest.raises(InputError, match="identified and not an input"):
        with_budget(found, {"Ixx": 1.0})
    with pytest.raises(InputError, match="did you mean"):
        with_budget(found, {"gravty": 1.0})
    with pytest.raises(InputError, match="0 or above"):
        with_budget(found, {"b": -1.0})


def test_propagation_of_any_function():
    values, std = {"x": 3.0, "y": 2.0, "z": 1.0}, {"x": 0.01, "y": 0.02}
    f = lambda v: np.stack([v[..., 0] * v[..., 1], v[..., 0] / v[..., 1] + v[..., 2]], axis=-1)  # noqa: E731
    budget, C = propagate(f, values, std, outputs=("product", "quotient"))
    J = np.array([[2.0, 0.5], [3.0, -0.75], [0.0, 1.0]])
    np.testing.assert_allclose(budget.sensitivity, J, rtol=1e-4, atol=1e-9)
    np.testing.assert_allclose(C, J.T @ np.diag([1e-4, 4e-4, 0.0]) @ J, rtol=1e-3)
    draws = np.random.default_rng(4).normal(list(values.values()), [0.01, 0.02, 0.0], (100_000, 3))
    np.testing.assert_allclose(f(draws).std(axis=0), budget.std, rtol=0.01)
    r = np.array([[1, 0.9, 0], [0.9, 1, 0], [0, 0, 1.0]])
    assert propagate(f, values, std, outputs=("p", "q"), correlation=r)[1][1, 1] < C[1, 1]
    with pytest.raises(InputError, match="not among the values"):
        propagate(f, values, {"w": 1.0}, outputs=("p", "q"))
