"""Designs against closed forms: a mass on a spring that latches, whose time and rate there are known."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import evolvent as ev
from evolvent import cases, parts
from evolvent.design.optimization import answer
from evolvent.design.optimization.problem import read
from evolvent.design.optimization.runs import Designs, quantile
from evolvent.design.optimization.slopes import Slopes
from evolvent.design.studies import draws
from evolvent_base.errors import InputError, RunFailed

MASS, REST, LATCH = 2.0, 0.6, 0.5
#: x = REST (1 - cos w t) reaches LATCH at PHASE/w.
PHASE = math.acos(1.0 - LATCH / REST)
STIFFNESS = "parts.slide.stiffness"


def slide(stiffness: float = 1.0) -> ev.System:
    """A mass that a spring pulls into a latch."""
    system = ev.System(settings={"until": 8.0, "method": "generalized-alpha", "tolerance": 1e-9})
    system.add(parts.Point(mass=MASS, position=(0.0, 1.0, 0.0)), "mass")
    latch = {"latch": LATCH, "latch_stiffness": 1e4, "latch_damping": 100.0}
    spring = parts.JointSpring(
        a="ground", b="mass", axis=(1.0, 0.0, 0.0), motion="translation", stiffness=stiffness, rest=REST, **latch
    )
    system.add(spring, "slide")
    return system


def rate_at(stiffness: float) -> float:
    """Rate at the latch."""
    return REST * math.sqrt(stiffness / MASS) * math.sin(PHASE)


@pytest.mark.slow
def test_the_softest_spring_that_latches_in_time() -> None:
    """Minimum of the rate where the time is 4 s: stiffness, multiplier and costs of tolerances by closed forms."""
    end = 4.0
    found = ev.optimize(slide(),
        vary={STIFFNESS: "0.1 to 5 N/m"}, minimize="slide.latch_rate", subject_to="slide.latch_time <= 4 s",
        tolerances={STIFFNESS: "1%", "parts.mass.mass": "2%"},
    )  # fmt: skip
    best = MASS * (PHASE / end) ** 2
    assert found.met
    assert found.values[STIFFNESS] == pytest.approx(best, rel=3e-5)
    assert found.objective == pytest.approx(rate_at(best), rel=2e-5)
    assert found.start.result.objective == pytest.approx(rate_at(1.0), rel=1e-6)
    trade = found.trade
    assert trade is not None
    assert trade.multipliers[0] == pytest.approx(rate_at(best) / end, rel=1e-3)  # the rate goes by 1/time
    assert 0.0 <= trade.slacks[0] < 1e-4
    assert trade.residual < 1e-6
    costs = {one.name: one for one in trade.tolerances}
    late = end * (1.02**0.5 - 1.0)  # of a mass that is 2 % heavier
    assert costs["parts.mass.mass"].changes[0] == pytest.approx(max(late, end * (1.0 - 0.98**0.5)), rel=1e-3)
    assert costs["parts.mass.mass"].cost == pytest.approx(rate_at(best) / end * late, rel=0.02)
    assert costs["parts.mass.mass"].exceeds == (0,)
    text = str(found)
    assert "slide.latch_time <= 4 s" in text
    assert "active" in text
    again = slide().with_values(found.values).simulate(keep=["slide.latch_time.last"])
    assert again["slide.latch_time.last"] <= end


@pytest.mark.slow
def test_derivatives_of_the_discrete_solution_lead_to_the_same_design() -> None:
    best = MASS * (PHASE / 4.0) ** 2
    for way, words in (("discrete", "those of the discrete solution"), ("differences", "central differences")):
        found = ev.optimize(slide(),
            vary={STIFFNESS: "0.1 to 5 N/m"}, minimize="slide.latch_rate", subject_to="slide.latch_time <= 4 s",
            derivatives=way,
        )  # fmt: skip
        assert found.values[STIFFNESS] == pytest.approx(best, rel=3e-5)
        assert found.objective == pytest.approx(rate_at(best), rel=2e-5)
        assert found.trade is not None
        assert found.trade.multipliers[0] == pytest.approx(rate_at(best) / 4.0, rel=1e-3)
        assert found.derivatives == words
        assert f"derivatives: {words}" in found.answer().heads


@pytest.mark.slow
def test_derivatives_of_keys_that_vary_together_are_summed() -> None:
    """By the share of both ways: of T = acos(1 - latch/rest) sqrt(m/k)."""
    problem = read(
        cases.parse_yaml(slide(0.9).to_yaml(), "slide"), vary={"slide.stiffness, slide.rest": "50% to 200%"},
        minimize=["slide.latch_time"], subject_to=["slide.latch_rate >= 0.1 m/s"],
    )  # fmt: skip
    place = np.array([0.4])
    with Designs(problem, 1, 100, None) as runs:
        objective, values = Slopes(runs, "discrete").at(place, ())
        assert runs.count == 1 + 2 * 2
        _, differences = Slopes(runs, "differences").at(place, ())
    k, rest = 0.9 * 1.1, REST * 1.1
    u = 1.0 - LATCH / rest
    by_rest = -LATCH / rest**2 / math.sqrt(1.0 - u * u) * math.sqrt(MASS / k)
    by_stiffness = -0.5 * math.acos(u) * math.sqrt(MASS / k) / k
    assert objective[0] == pytest.approx(by_rest * 1.5 * REST + by_stiffness * 1.5 * 0.9, rel=1e-5)
    assert values[0, 0] == pytest.approx(differences[0, 0], rel=1e-3)


def hanging(**settings: Any) -> ev.System:
    """Three masses on springs, which swing."""
    found = ev.System(gravity=(0.0, 0.0, -9.81), settings={"until": 0.5, **settings})
    for k in range(3):
        at, rate = (0.0, 0.0, -0.5 * (k + 1)), (0.2 * k, 0.0, 0.0)
        found.add(parts.Point(mass=0.3, position=at, velocity=rate), f"m{k}")
        ends = {"a": f"m{k - 1}" if k else (0.0, 0.0, 0.0), "b": f"m{k}"}
        found.add(parts.Spring(**ends, stiffness=80.0 + k, damping=0.5, length=0.5), f"s{k}")
    return found


def slopes_of(system: ev.System, ways: tuple[str, ...], keys: list[str]) -> list[tuple[np.ndarray, str, int]]:
    """Derivatives of a height and a rate by keys, how they were found, and the runs that were counted."""
    asked = {"minimize": ["m2.position.z.last"], "subject_to": ["m2.velocity.x.last <= 5 m/s"]}
    problem = read(cases.parse_yaml(system.to_yaml(), "chain"), vary=dict.fromkeys(keys), **asked)  # type: ignore[arg-type]
    found = []
    for way in ways:
        with Designs(problem, 1, 200, None) as runs:
            slopes = Slopes(runs, way)
            objective, values = slopes.at(np.full(len(keys), 0.4), ())
            found.append((np.vstack([objective, values]), slopes.found_by, runs.count))
    return found


def test_many_keys_take_the_adjoint_and_few_differences() -> None:
    system = hanging(method="generalized-alpha", step=5e-3)
    keys = [name for k in range(3) for name in (f"parts.m{k}.mass", f"parts.s{k}.stiffness")]
    (own, how, runs), (differences, _, more) = slopes_of(system, ("auto", "differences"), keys)
    np.testing.assert_allclose(own, differences, rtol=0.0, atol=1e-4 * np.abs(differences).max())
    assert how == "those of the discrete solution, by the adjoint: the time of some 7 runs, where differences take 12"
    assert (runs, more) == (1, 13)
    (few, how, _), (adjoint, forced, _) = slopes_of(system, ("auto", "adjoint"), keys[:1])
    assert how == "central differences (they take 2 runs, the adjoint some 7)"
    assert forced == "those of the discrete solution, by the adjoint"
    np.testing.assert_allclose(adjoint, few, rtol=1e-4)


def test_where_there_is_no_adjoint_differences_are_taken_and_the_screen_says_why() -> None:
    keys = [f"parts.s{k}.stiffness" for k in range(3)]
    ((_, how, runs),) = slopes_of(hanging(method="dopri5"), ("auto",), keys)
    assert how.startswith("central differences (sensitivities are of the steps of ")
    assert runs == 7


@pytest.mark.slow
def test_where_there_are_none_differences_are_taken_and_the_report_says_why() -> None:
    system = slide()
    system.settings = {"until": 8.0, "method": "dopri5"}
    found = ev.optimize(system,
        vary={STIFFNESS: "0.1 to 5 N/m"}, minimize="slide.latch_rate", subject_to="slide.latch_time <= 4 s",
        derivatives="discrete",
    )  # fmt: skip
    assert found.values[STIFFNESS] == pytest.approx(MASS * (PHASE / 4.0) ** 2, rel=3e-5)
    assert found.derivatives.startswith("central differences (sensitivities are of the steps of ")
    assert found._repr_html_().count("<img") == 1
    dispersed = ev.optimize(slide(0.5),
        vary={STIFFNESS: "0.4 to 0.6 N/m"}, minimize="slide.latch_rate", disperse={"mass.mass": "10%"}, samples=2,
        derivatives="discrete",
    )  # fmt: skip
    assert dispersed.derivatives == "central differences (results are quantiles)"


@pytest.mark.slow
def test_a_dispersion_takes_its_quantile() -> None:
    """With dispersed masses the stiffness follows from the order statistic of the masses."""
    found = ev.optimize(
        slide(), vary={"slide.stiffness": "0.1 to 5 N/m"}, minimize="slide.latch_rate",
        subject_to=["slide.latch_time <= 4 s"], disperse={"mass.mass": "10%"}, samples=10, quantile=0.9,
    )  # fmt: skip
    drawn = MASS * (0.9 + 0.2 * np.sort(draws.probabilities("latin-hypercube", 10, 1, 0)[:, 0]))
    heavy = drawn[8]  # the 9th of 10
    assert found.values[STIFFNESS] == pytest.approx(heavy * (PHASE / 4.0) ** 2, rel=1e-4)
    light = drawn[1]  # whose rate is the 9th
    stiffness = found.values[STIFFNESS]
    assert found.objective == pytest.approx(REST * math.sqrt(stiffness / light) * math.sin(PHASE), rel=1e-4)
    assert found.runs % 10 == 0 or found.trade is not None
    assert any("10 runs with dispersed keys" in line for line in found.answer().heads)


@pytest.mark.slow
def test_choices_are_all_tried() -> None:
    found = ev.optimize(slide(0.4),
        vary={STIFFNESS: ["0.2 N/m", 0.25, 0.3, 0.4]}, minimize="slide.latch_rate",
        subject_to="slide.latch_time <= 4 s",
    )  # fmt: skip
    assert found.met
    assert found.values == {STIFFNESS: 0.25}
    assert found.runs == 4
    assert found.trade is None
    rows = answer.end_table(found).rows
    assert [row[3] for row in rows] == ["yes", "no", "yes", "yes"]


@pytest.mark.slow
def test_what_cannot_be_met_is_reported_with_the_nearest_design() -> None:
    found = ev.optimize(slide(),
        vary={STIFFNESS: "0.5 to 2 N/m"}, minimize="slide.latch_rate", subject_to="slide.latch_time <= 1 s",
    )  # fmt: skip
    assert not found.met
    assert found.values[STIFFNESS] == pytest.approx(2.0, rel=1e-6)
    assert found.missed()[0].startswith("slide.latch_time <= 1 s (it is 1.40")
    assert any("meets all requirements" in line for line in found.answer().warnings)


@pytest.mark.slow
@pytest.mark.parametrize("optimizer", ["slsqp", "cobyqa"])
def test_an_inner_optimum(optimizer: str) -> None:
    """The damping that leaves the least of a free oscillation: that of the closed form of a damped mass."""
    system = ev.System(settings={"until": 3.0, "method": "generalized-alpha", "tolerance": 1e-9})
    system.add(parts.Point(mass=1.0, position=(1.0, 0.0, 0.0)), "mass")
    system.add(
        parts.JointSpring(
            a="ground", b="mass", axis=(1.0, 0.0, 0.0), motion="translation", stiffness=4.0, rest=-1.0, damping=1.0
        ),
        "slide",
    )
    found = ev.optimize(system,
        vary={"parts.slide.damping": "0.5 to 12 N s/m"}, minimize="mass.energy_kinetic.last", optimizer=optimizer,
        maximize=(), starts=1,
    )  # fmt: skip

    def left(damping: float) -> float:
        """Kinetic energy after 3 s of a travel of 1 m."""
        w = np.emath.sqrt(4.0 - damping**2 / 4.0)
        return abs(np.exp(-damping * 1.5) * 4.0 / w * np.sin(w * 3.0)) ** 2 / 2.0

    from scipy.optimize import minimize_scalar

    near = found.values["parts.slide.damping"]
    best = minimize_scalar(left, bounds=(max(near - 0.5, 0.5), near + 0.5), method="bounded", options={"xatol": 1e-8})
    assert found.objective == pytest.approx(best.fun, abs=2e-6)
    assert found.objective < 0.2 * left(1.0)


def test_runs_are_limited_and_the_best_so_far_is_kept() -> None:
    found = ev.optimize(slide(),
        vary={STIFFNESS: "0.1 to 5 N/m"}, minimize="slide.latch_rate", subject_to="slide.latch_time <= 4 s",
        most_runs=6,
    )  # fmt: skip
    assert found.exhausted
    assert found.runs <= 6
    assert found.met
    assert any("no runs left" in line for line in found.answer().heads)


def test_a_design_is_a_case(tmp_path) -> None:
    found = ev.optimize(slide(0.4), vary={STIFFNESS: [0.25, 0.4]}, minimize="slide.latch_rate")
    loaded = cases.load(found.content)
    assert loaded.parts["slide"].stiffness == 0.25
    found.report(tmp_path / "design.html")
    page = (tmp_path / "design.html").read_text()
    assert "Design: minimize slide.latch_rate" in page
    assert found.answer().figures[0].panels


def test_quantiles_are_order_statistics() -> None:
    values = [3.0, 1.0, 2.0, 4.0]
    assert quantile(values, 0.75, upper=True) == 3.0
    assert quantile(values, 0.75, upper=False) == 2.0
    assert quantile([*values, math.nan], 0.8, upper=True) == 4.0
    assert math.isnan(quantile([*values, math.nan], 0.95, upper=True))


@pytest.mark.parametrize(
    ("asked", "sentence"),
    [
        ({}, "a design needs one of minimize and maximize"),
        ({"minimize": "slide.latch_rate", "maximize": "slide.angle"}, "a design needs one of minimize and maximize"),
        ({"minimize": "slide.latch_rat"}, "the design asks for 'slide.latch_rat'; no variable is called"),
        ({"minimize": "slide.latch_rate", "vary": {}}, "vary is empty"),
        ({"vary": {"parts.slide.stiffnes": "1 to 2"}}, "vary: unknown key 'parts.slide.stiffnes'; did you mean"),
        ({"vary": {STIFFNESS: "5 to 1 N/m"}}, "the lower bound (5) must be below the upper one (1)"),
        ({"vary": {STIFFNESS: "5"}}, "vary.parts.slide.stiffness is '5'; it must be bounds such as"),
        ({"vary": {STIFFNESS: "1 to 2 m"}}, "vary.parts.slide.stiffness is '1 to 2 m'; '1 m' must be a number in N/m"),
        ({"vary": {STIFFNESS: []}}, "vary.parts.slide.stiffness lists 0 choices"),
        ({"vary": {"parts.slide.a": "1 to 2"}}, "vary.parts.slide.a takes words or lists, so it has no bounds"),
        ({"vary": {STIFFNESS: "1 to 2", f"{STIFFNESS},slide.rest": "1 to 2"}}, "'parts.slide.stiffness' twice"),
        ({"subject_to": "slide.latch_time < 4 s"}, "the requirement 'slide.latch_time < 4 s' is not of the form"),
        ({"subject_to": "slide.latch_time <= 4 m"}, "has the bound '4 m'; it must be a number in s"),
        ({"subject_to": "slide.latch_tim <= 4 s"}, "the design asks for 'slide.latch_tim'"),
        ({"subject_to": "mass.position <= 4 m"}, "'mass.position' has"),
        ({"disperse": {STIFFNESS: "5%"}, "samples": 1}, "samples is 1; it must be a whole number from 2"),
        ({"disperse": {STIFFNESS: "5%"}, "quantile": 0.2}, "quantile is 0.2; it must be from 0.5"),
        ({"disperse": {STIFFNESS: "5"}}, "disperse.parts.slide.stiffness is '5'"),
        ({"optimizer": "newton"}, "optimizer is 'newton'; it must be one of slsqp, cobyqa"),
        ({"derivatives": "exact"}, "derivatives is 'exact'; it must be one of auto, adjoint, discrete, differences"),
        ({"starts": 0}, "starts is 0; it must be a whole number from 1"),
    ],
)  # fmt: skip
def test_what_cannot_be_designed_is_refused(asked: dict, sentence: str) -> None:
    given = {"vary": {STIFFNESS: "0.5 to 2 N/m"}, "minimize": "slide.latch_rate"}
    if not asked:
        given.pop("minimize")
    with pytest.raises(InputError) as error:
        ev.optimize(slide(), **{**given, **asked})
    assert sentence in str(error.value)
    assert "\n" not in str(error.value)


def test_a_case_without_any_result_fails() -> None:
    """A spring that never reaches its latch has no rate there."""
    with pytest.raises(
        RunFailed, match=r"no design that was tried gives a result; of the case itself: slide.latch_rate"
    ):
        ev.optimize(slide(), vary={"parts.slide.rest": ["0.1 m", "0.2 m"]}, minimize="slide.latch_rate")
