"""Contact: derivatives, energy, bounces with closed forms, friction that sticks."""

from __future__ import annotations

import decimal
import functools
import math
from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st
from numpy.testing import assert_allclose
from scipy.optimize import brentq

from book import Book
from evolvent.kernels import contact_laws, surfaces

Array = np.ndarray
K = 1e4
cylinder_gap = functools.partial(surfaces.gap_to, surfaces.CYLINDER)
may_touch = functools.partial(surfaces.may_touch, surfaces.CYLINDER)
LAWS = [contact_laws.PAPER, contact_laws.HUNT_CROSSLEY]

exponents = st.sampled_from([1.0, 1.5, 2.0, 3.0])
gaps = st.floats(-0.1, 0.1)


def difference(f: Callable[[float], float], x: float, h: float) -> float:
    """Central difference of sixth order, so that round-off and not the step limits it."""
    weights = {1: 45.0, 2: -9.0, 3: 1.0}
    return sum(w * (f(x + k * h) - f(x - k * h)) for k, w in weights.items()) / (60.0 * h)


def gradient(f: Callable[[Array], Array | float], x: Array, h: float) -> Array:
    """Central differences by every entry of x, last axis."""
    columns = []
    for step in h * np.eye(x.size):
        columns.append(sum(w * (np.array(f(x + k * step)) - f(x - k * step)) for k, w in ((1, 45), (2, -9), (3, 1))))
    return np.moveaxis(np.array(columns), 0, -1) / (60.0 * h)


def unit(rng: np.random.Generator) -> Array:
    n = rng.standard_normal(3)
    return n / np.linalg.norm(n)


def curvature(n: Array, hub: tuple, distance: float) -> Array:
    """Second derivative of the gap to a cylinder."""
    point = SimpleNamespace(n=n, distance=distance, offset=0.0)
    row = SimpleNamespace(surface=surfaces.CYLINDER, half_length=math.inf)
    _, share, part, total = getattr(surfaces.end_slope, "py_func", surfaces.end_slope)(
        row, point, (0.0, 0.0, 0.0), hub[3:6], 0.0
    )
    a = np.array(hub[3:6])
    return part * (np.eye(3) - share * np.outer(a, a) - np.outer(n, n)) / total


# ------------------------------------------------------------------------------------------------ gaps


def test_gap_to_a_cylinder() -> None:
    hub = (0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.6, 1.5)
    assert_allclose(cylinder_gap(3.0, 4.0, 2.0, *hub), (4.4, 0.6, 0.8, 0.0, 5.0), rtol=1e-15)
    assert_allclose(cylinder_gap(0.0, -0.5, 2.5, *hub), (-0.1, 0.0, -1.0, 0.0, 0.5), rtol=1e-15)
    assert cylinder_gap(0.0, 0.5, 2.51, *hub)[0] == math.inf
    assert cylinder_gap(0.0, 0.0, 0.0, *hub) == (-0.6, 0.0, 0.0, 0.0, 0.0)
    assert cylinder_gap(0.0, 0.5, 1e9, *hub[:7], math.inf)[0] == 0.5 - 0.6


def test_derivatives_of_the_gap_to_a_cylinder(rng: np.random.Generator) -> None:
    for _ in range(20):
        hub = (*rng.standard_normal(3), *unit(rng), 0.6, math.inf)
        x = rng.standard_normal(3) * 2.0

        def normal(x: Array, hub: tuple = hub) -> Array:
            return np.array(cylinder_gap(*x, *hub)[1:4])

        _, nx, ny, nz, distance = cylinder_gap(*x, *hub)
        n = gradient(lambda x, hub=hub: cylinder_gap(*x, *hub)[0], x, 1e-3)
        H = curvature(np.array([nx, ny, nz]), hub, distance)
        assert_allclose((nx, ny, nz), n, atol=1e-7)
        assert_allclose(H, gradient(normal, x, 1e-3), atol=1e-7 * np.abs(H).max())


def test_tangent_of_a_damped_contact_on_a_cylinder(rng: np.random.Generator) -> None:
    hub = (0.1, 0.2, 0.3, *unit(rng), 3.0, math.inf)
    x, v = np.array([1.0, -0.5, 0.7]), rng.standard_normal(3)
    v -= 2.0 * v.dot(cylinder_gap(*x, *hub)[1:4]) * np.array(cylinder_gap(*x, *hub)[1:4])

    def force(x: Array, v: Array) -> Array:
        gap, *n, _ = cylinder_gap(*x, *hub)
        return contact_laws.normal_force(contact_laws.HUNT_CROSSLEY, gap, v.dot(n), 0.0, K, 1.5, 0.1, 0.0)[
            0
        ] * np.array(n)

    gap, *normal, distance = cylinder_gap(*x, *hub)
    n = np.array(normal)
    H = curvature(n, hub, distance)
    f, d_gap, d_rate = contact_laws.normal_force(contact_laws.HUNT_CROSSLEY, gap, v.dot(n), 0.0, K, 1.5, 0.1, 0.0)
    assert f > 0.0
    by_x = d_gap * np.outer(n, n) + d_rate * np.outer(n, H @ v) + f * H
    assert_allclose(by_x, gradient(lambda x: force(x, v), x, 1e-3), atol=1e-7 * np.abs(by_x).max())
    by_v = d_rate * np.outer(n, n)
    assert_allclose(by_v, gradient(lambda v: force(x, v), v, 1e-3), atol=1e-7 * np.abs(by_v).max())


coordinate = st.floats(-5.0, 5.0)


@given(
    x=st.tuples(coordinate, coordinate, coordinate),
    c=st.tuples(coordinate, coordinate, coordinate),
    towards=st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(0.1, 1.0)),
    offset=st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)),
    reach=st.floats(0.0, 4.0),
    radius=st.floats(0.1, 3.0),
    half_length=st.one_of(st.floats(0.1, 5.0), st.just(math.inf)),
)
def test_coarse_test_misses_nothing(
    x: tuple, c: tuple, towards: tuple, offset: tuple, reach: float, radius: float, half_length: float
) -> None:
    a = np.array(towards) / np.linalg.norm(towards)
    near = np.array(x) + reach * np.array(offset) / max(1.0, float(np.linalg.norm(offset)))
    if cylinder_gap(*near, *c, *a, radius, half_length)[0] < -1e-12:
        # a metre's round-off is granted to the point, not to the test
        assert may_touch(*x, reach + 1e-14, *c, *a, radius, half_length)


def test_coarse_test_drops_what_is_far() -> None:
    hub = (0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.6, 1.5)
    assert not may_touch(1.7, 0.0, 0.0, 1.0, *hub)
    assert not may_touch(0.0, 0.0, 2.6, 1.0, *hub)
    assert may_touch(1.5, 0.0, 2.4, 1.0, *hub)


# ------------------------------------------------------------------------------------------------ normal laws


@given(gap=st.floats(-0.1, -1e-4), exponent=exponents)
def test_elastic_force_is_the_slope_of_its_energy(gap: float, exponent: float) -> None:
    force, slope = contact_laws.elastic_force(gap, K, exponent)
    h = -gap * 1e-2
    energy = difference(lambda g: contact_laws.contact_energy(g, K, exponent), gap, h)
    assert_allclose(force, -energy, rtol=1e-7)
    assert_allclose(slope, difference(lambda g: contact_laws.elastic_force(g, K, exponent)[0], gap, h), rtol=1e-7)
    assert contact_laws.elastic_force(-gap, K, exponent) == (0.0, 0.0)
    assert contact_laws.contact_energy(-gap, K, exponent) == 0.0


@pytest.mark.parametrize("law", LAWS)
@given(gap=st.floats(-0.1, -1e-3), before=gaps, rate=st.floats(-2.0, 2.0), exponent=exponents)
def test_derivatives_of_the_normal_laws(law: int, gap: float, before: float, rate: float, exponent: float) -> None:
    damping = 0.2 if law != contact_laws.PAPER else 30.0

    def force(gap: float, rate: float) -> float:
        return contact_laws.normal_force(law, gap, rate, before, K, exponent, damping, 0.0)[0]

    value, d_gap, d_rate = contact_laws.normal_force(law, gap, rate, before, K, exponent, damping, 0.0)
    ends = [force(g, r) for g in (gap * 0.97, gap * 1.03) for r in (rate - 0.03, rate + 0.03)]
    if law != contact_laws.PAPER and min(ends) == 0.0:
        assume(max(ends) == 0.0)  # the kink where the force is clipped
    scale = K * 0.1**exponent / 0.1
    assert_allclose(d_gap, difference(lambda g: force(g, rate), gap, -gap * 1e-2), rtol=1e-7, atol=1e-7 * scale)
    assert_allclose(d_rate, difference(lambda r: force(gap, r), rate, 1e-2), rtol=1e-7, atol=1e-9 * K)
    assert law == contact_laws.PAPER or value >= 0.0


@given(gap=st.floats(-0.1, -1e-3), before=st.floats(-0.1, 0.1), rate=st.floats(-2.0, 2.0), exponent=exponents)
def test_damper_of_points_that_slide(gap: float, before: float, rate: float, exponent: float) -> None:
    """It takes energy, and acts where the step begins in contact, with the share of critical damping."""
    assume(abs(before) > 1e-6 and (rate == 0.0 or abs(rate) > 1e-6))
    zeta, mass = 0.1, 2.0
    viscous = contact_laws.sliding_viscosity(zeta, mass)
    value, d_rate = contact_laws.sliding_damper(before, gap, rate, K, exponent, viscous)
    assert value * rate <= 0.0
    assert (value == 0.0) == (before >= 0.0 or rate == 0.0)
    assert contact_laws.sliding_damper(before, 0.0, rate, K, exponent, viscous) == (0.0, 0.0)
    if before < 0.0:
        critical = 2.0 * math.sqrt(mass * exponent * K * (-before) ** (exponent - 1.0))
        assert (value, d_rate) == pytest.approx((-zeta * critical * rate, -zeta * critical), rel=1e-12)


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.5])
@pytest.mark.parametrize("step", [0.0, 1e-15, 1e-9, 1e-4, 3e-3, 0.1999, 0.2001, 0.5, 1.0, -0.1999, -0.2001, -0.8])
def test_conservative_law_is_smooth_at_nearby_ends(exponent: float, step: float) -> None:
    # mean of s^n between a and b = a (1 + step) in long arithmetic
    a = 0.01
    b = a * (1.0 + step)
    with decimal.localcontext() as context:
        context.prec = 50
        n, p, q = decimal.Decimal(exponent), decimal.Decimal(a), decimal.Decimal(b)
        if p == q:
            mean, slope = p**n, n * p ** (n - 1) / 2
        else:
            mean = (q ** (n + 1) - p ** (n + 1)) / ((n + 1) * (q - p))
            slope = (q**n - mean) / (q - p)
    force, d_gap = contact_laws.mean_force(-a, -b, K, exponent)
    assert_allclose(force, K * float(mean), rtol=1e-14)
    assert_allclose(d_gap, -K * float(slope), rtol=1e-13)


@given(gap=gaps, before=gaps, exponent=exponents, nearby=st.sampled_from([None, 1e-12, 1e-7, 1e-3]))
def test_work_of_the_conservative_law_is_the_change_of_energy(
    gap: float, before: float, exponent: float, nearby: float | None
) -> None:
    before = before if nearby is None else gap * (1.0 + nearby)
    force, _ = contact_laws.mean_force(before, gap, K, exponent)
    after, first = contact_laws.contact_energy(gap, K, exponent), contact_laws.contact_energy(before, K, exponent)
    assert_allclose(force * (gap - before), first - after, rtol=0.0, atol=1e-14 * max(first, after))


def test_ends_of_an_obstacle_do_not_push() -> None:
    inf = math.inf
    for law in LAWS:
        assert contact_laws.normal_force(law, inf, 1.0, -0.01, K, 1.5, 0.1, 0.0) == (0.0, 0.0, 0.0)
        assert contact_laws.normal_force(law, inf, 1.0, inf, K, 1.5, 0.1, 0.0) == (0.0, 0.0, 0.0)
    entered = contact_laws.mean_force(inf, -0.01, K, 1.5)
    assert entered == contact_laws.mean_force(0.0, -0.01, K, 1.5)


def test_the_laws_at_first_touch_and_at_release() -> None:
    deep, shallow = -1e-2, -1e-12
    assert_allclose(
        contact_laws.normal_force(contact_laws.PAPER, shallow, -2.0, 0.0, K, 1.0, 30.0, 0.0)[0], 60.0
    )  # jumps by c v
    assert contact_laws.normal_force(contact_laws.PAPER, shallow, 2.0, 0.0, K, 1.0, 30.0, 0.0)[0] < 0.0  # pulls
    assert contact_laws.normal_force(contact_laws.HUNT_CROSSLEY, shallow, -2.0, 0.0, K, 1.0, 0.3, 0.0)[0] < 1e-7
    assert contact_laws.normal_force(contact_laws.HUNT_CROSSLEY, deep, 9.0, 0.0, K, 1.0, 0.3, 0.0) == (0.0, 0.0, 0.0)


MASS, SPEED = 2.0, 1.5


def bounce(law: int, exponent: float, damping: float, stop: Callable[[float, float], float], h: float) -> list:
    """Gaps and speeds of a mass that meets a plane, under RK4, until `stop(gap, speed)` rises through zero."""

    def slope(g: float, w: float) -> tuple[float, float]:
        return w, contact_laws.normal_force(law, g, w, g, K, exponent, damping, 0.0)[0] / MASS

    def step(g: float, w: float, h: float) -> tuple[float, float]:
        k1 = slope(g, w)
        k2 = slope(g + 0.5 * h * k1[0], w + 0.5 * h * k1[1])
        k3 = slope(g + 0.5 * h * k2[0], w + 0.5 * h * k2[1])
        k4 = slope(g + h * k3[0], w + h * k3[1])
        return tuple(
            y + h / 6.0 * (a + 2.0 * b + 2.0 * c + d) for y, a, b, c, d in zip((g, w), k1, k2, k3, k4, strict=True)
        )

    states = [(-1e-18, -SPEED)]
    while True:
        following = step(*states[-1], h)
        if stop(*following) > 0.0:
            last = brentq(lambda part: stop(*step(*states[-1], part)), 0.0, h) if stop(*states[-1]) < 0.0 else 0.0
            return [*states, step(*states[-1], last)]
        states.append(following)


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [0.05, 0.3, 0.7])
def test_restitution_of_the_paper_law(ratio: float, book: Book) -> None:
    damping = 2.0 * ratio * math.sqrt(K * MASS)
    angle = math.asin(ratio)
    h = 1e-4 / math.sqrt(K / MASS)
    # as it stands, to the surface: half a period of the damped oscillator
    states = bounce(contact_laws.PAPER, 1.0, damping, lambda g, w: g, h)
    assert_allclose(states[-1][1] / SPEED, math.exp(-math.pi * math.tan(angle)), rtol=1e-4)
    # until it would pull
    pull = next(k for k, (g, w) in enumerate(states) if -K * g - damping * w < 0.0)
    assert_allclose(states[pull][1] / SPEED, math.exp(-(math.pi - 2.0 * angle) * math.tan(angle)), rtol=1e-4)
    book(
        "Contact", f"Bounce by the linear law, damping ratio {ratio:g} (kernel): to no gap",
        reference="exp(-pi tan asin zeta)", source="closed form",
        error=abs(states[-1][1] / SPEED / math.exp(-math.pi * math.tan(angle)) - 1.0), allowed=1e-4,
    )  # fmt: skip


@pytest.mark.parametrize("exponent", [1.0, 1.5])
@pytest.mark.parametrize("damping", [0.05, 0.6])
def test_bounce_of_hunt_and_crossley_keeps_its_first_integral(exponent: float, damping: float, book: Book) -> None:
    states = bounce(contact_laws.HUNT_CROSSLEY, exponent, damping, lambda g, w: g, 1e-3 / math.sqrt(K / MASS))

    def integral(g: float, w: float) -> float:
        x = -damping * w
        return MASS * (x - math.log1p(x)) / damping**2 + contact_laws.contact_energy(g, K, exponent)

    values = np.array([integral(*state) for state in states])
    assert_allclose(values, values[0], rtol=1e-7)
    out = brentq(lambda w: integral(0.0, w) - integral(0.0, -SPEED), 1e-3, min(SPEED, (1.0 - 1e-12) / damping))
    assert_allclose(states[-1][1], out, rtol=1e-6)
    assert states[-1][1] < SPEED
    book(
        "Contact", f"Bounce by Hunt and Crossley, exponent {exponent:g}, d {damping:g} (kernel)",
        reference="first integral", source="closed form", error=abs(states[-1][1] / out - 1.0), allowed=1e-6,
    )  # fmt: skip


@pytest.mark.parametrize("h", [1e-4, 2e-3, 2e-2])
def test_bounces_of_the_conservative_law_keep_energy_at_any_step(h: float) -> None:
    # a ball under gravity, midpoint steps; a contact lasts 0.01 s or so
    gravity, g, w = 9.81, 0.3, 0.0
    energy = MASS * gravity * g
    impacts = 0
    for _ in range(4000):
        after = g + h * w  # Newton on the gap at the end: gap = g + h (w + w_after) / 2
        for _ in range(50):
            f, d_gap = contact_laws.mean_force(g, after, K, 1.5)
            miss = after - g - h * w - 0.5 * h * h * (f / MASS - gravity)
            move = miss / (1.0 - 0.5 * h * h * d_gap / MASS)
            after -= move
            if abs(move) < 1e-16 + 1e-15 * abs(after):
                break
        else:
            pytest.fail("Newton")
        impacts += g > 0.0 >= after
        g, w = after, 2.0 * (after - g) / h - w
        now = 0.5 * MASS * w * w + MASS * gravity * g + contact_laws.contact_energy(g, K, 1.5)
        assert_allclose(now, energy, rtol=1e-9)
    assert impacts > 0


# ------------------------------------------------------------------------------------------------ friction


def along(x: float) -> tuple[float, float, float]:
    return x, 0.0, 0.0


def rub(u: Array, s: Array, normal: float, *, mu: float = 0.4, k: float = 1e4, c: float = 0.0, h: float = 0.1) -> tuple:
    """Force, new state, slipping, dissipated, tangent by s, slope by the normal force."""
    f, after, slipping, t, along, across, by_normal = contact_laws.friction(tuple(u), tuple(s), normal, mu, k, c, h)
    slid, t = np.array(u) + s - after, np.array(t)
    work = mu * normal * float(np.linalg.norm(slid))
    tangent = -(along * np.outer(t, t) + across * (np.eye(3) - np.outer(t, t)))
    return np.array(f), np.array(after), slipping, work, tangent, -by_normal * t


@pytest.mark.parametrize("c", [0.0, 300.0])
@pytest.mark.parametrize("slip", [False, True])
def test_derivatives_and_work_of_friction(rng: np.random.Generator, slip: bool, c: float) -> None:
    for _ in range(20):
        normal, mu, k, h = 5.0, 0.4, 1e4, 0.1  # k, mu and h as in `rub`
        n = unit(rng)
        u = np.array(contact_laws.tangential(rng.standard_normal(3), n)) * 2e-5
        s = np.array(contact_laws.tangential(rng.standard_normal(3), n)) * (1e-2 if slip else 3e-5)
        F, after, slipping, work, tangent, by_normal = rub(u, s, normal, c=c)
        assert slipping == slip
        assert_allclose(after @ n, 0.0, atol=1e-15)
        assert np.linalg.norm(F) <= mu * normal * (1.0 + 1e-15)
        by_s = gradient(lambda s, u=u: rub(u, s, 5.0, c=c)[0], s, 1e-3 * np.linalg.norm(s))
        assert_allclose(tangent, by_s, atol=1e-7 * k)
        slope = gradient(lambda N, u=u, s=s: rub(u, s, N[0], c=c)[0], np.array([normal]), 1e-3)[:, 0]
        assert_allclose(by_normal, slope, atol=1e-7)
        change = 0.5 * k * (after @ after - u @ u)
        moved = after - u
        assert_allclose(-F @ s, change + work + (c / h + 0.5 * k) * moved @ moved, rtol=1e-12, atol=1e-17)
        assert work >= 0.0


def test_friction_without_normal_force_lets_go() -> None:
    F, after, slipping, work, tangent, by_normal = rub(np.array([1e-4, 0, 0]), np.array([0, 1e-4, 0]), 0.0)
    assert slipping
    assert work == 0.0
    assert not np.any([F, after, by_normal])
    assert not tangent.any()
    still = rub(np.zeros(3), np.zeros(3), 3.0)
    assert not still[2]
    assert_allclose(still[4], -1e4 * np.eye(3))


@pytest.mark.slow
def test_stuck_point_does_not_creep() -> None:
    """A mass on a slope below the angle of friction, shaken: implicit steps, 1e5 of them."""
    normal, mu, k, c, h, mass = 9.0, 0.4, 1e4, 60.0, 1e-3, 1.0
    load = 0.9 * mu * normal
    x = u = load / k
    w = 0.0
    places = []
    for step in range(100_000):
        shake = 0.05 * mu * normal * math.sin(0.1 * math.pi * step)  # 20 steps a period
        # backward Euler; linear as long as the point sticks, which the kernel must confirm
        w_after = (w + h / mass * (load + shake - k * u)) / (1.0 + h / mass * (c + k * h))
        s = h * w_after
        (fx, *_), (u_after, *_), slipping, *_ = contact_laws.friction(along(u), along(s), normal, mu, k, c, h)
        assert not slipping
        w, x, u = w + h / mass * (load + shake + fx), x + s, u_after
        if step % 20 == 0 and step > 2000:
            places.append(x)
    assert_allclose(u, x, rtol=1e-10)  # the bristle holds all of the displacement
    assert np.ptp(places) <= 1e-12 * abs(places[0])
    assert_allclose(np.mean(places), load / k, rtol=0.1)


@pytest.mark.slow
def test_constant_load_below_the_limit_moves_nothing_at_all() -> None:
    u, load, k = 0.0, 3.5, 1e4
    x = 0.0
    for step in range(100_000):
        # quasi-static: the displacement that balances the load
        (fx, *_), *_ = contact_laws.friction(along(u), along(0.0), 9.0, 0.4, k, 0.0, 1.0)
        s = (load + fx) / k
        (fx, *_), (u, *_), slipping, *_ = contact_laws.friction(along(u), along(s), 9.0, 0.4, k, 0.0, 1.0)
        x += s
        assert not slipping
        if step == 10:
            settled = x
    assert x == settled
    assert_allclose(x, load / k, rtol=1e-15)


def glide(x: float, w: float, steps: int, h: float, *, spring: float, belt: float, normal: float) -> tuple:
    """A block of 1 kg with a spring on a belt: midpoint steps with the force at their end (Newton on the speed)."""
    u, heat, mu, k = 0.0, 0.0, 0.5, 1e6
    stuck_at = math.inf
    history = []
    for step in range(steps):
        after = w
        for _ in range(30):
            s = h * (0.5 * (w + after) - belt)
            (f, *_), (bristle, *_), slipping, _, stiffness, *_ = contact_laws.friction(
                along(u), along(s), normal, mu, k, 600.0, h
            )
            miss = after - w - h * (f - spring * (x + 0.25 * h * (w + after)))
            move = miss / (1.0 + 0.5 * h * h * (stiffness + 0.5 * spring))
            after -= move
            if abs(move) < 1e-13:
                break
        else:
            pytest.fail("Newton")
        x, w, u, heat = x + 0.5 * h * (w + after), after, bristle, heat + abs(f * (u + s - bristle)) * slipping
        if not slipping:
            stuck_at = min(stuck_at, step * h)
        history.append(x)
    return x, w, heat, stuck_at, history


def test_sliding_block_stops_and_stays(book: Book) -> None:
    normal, mu, speed = 9.81, 0.5, 3.0
    x, w, heat, stuck_at, history = glide(0.0, speed, 20_000, 1e-4, spring=0.0, belt=0.0, normal=normal)
    assert_allclose(x, speed**2 / (2.0 * mu * normal), rtol=1e-4)
    assert_allclose(stuck_at, speed / (mu * normal), rtol=1e-3)
    assert_allclose(heat, 0.5 * speed**2, rtol=1e-4)
    assert abs(w) < 1e-12
    assert np.ptp(history[10_000:]) < 1e-12
    book(
        "Contact", "Sliding block stops (kernel, midpoint)", reference="v^2/(2 mu g)", source="closed form",
        error=abs(x / (speed**2 / (2.0 * mu * normal)) - 1.0), allowed=1e-4,
    )  # fmt: skip


def test_block_on_a_belt_is_caught_carried_and_let_go(book: Book) -> None:
    normal, mu, spring, belt = 9.81, 0.5, 40.0, 0.3
    omega, reach = math.sqrt(spring), mu * normal / spring
    caught = math.asin(belt / (reach * omega)) / omega
    place = reach * (1.0 - math.cos(omega * caught))
    let_go = caught + (reach - place) / belt
    end = let_go + 0.25 * 2.0 * math.pi / omega
    h = 5e-5
    steps = round(end / h)
    x, _, _, stuck_at, history = glide(0.0, 0.0, steps, h, spring=spring, belt=belt, normal=normal)
    assert_allclose(stuck_at, caught, atol=2e-4)
    middle = round(0.5 * (caught + let_go) / h)
    assert_allclose(history[middle], place + belt * (middle * h - caught), atol=2e-5)
    assert_allclose(x, reach + belt / omega, rtol=1e-3)
    book(
        "Contact", "Block on a belt is released (kernel, midpoint)", reference="place half a swing later",
        source="closed form", error=abs(x / (reach + belt / omega) - 1.0), allowed=1e-3,
    )  # fmt: skip


@pytest.mark.slow
def test_capstan(rng: np.random.Generator, book: Book) -> None:
    """Tension of a string that slides on a drum, point by point, with the friction of each under its own pressure."""
    mu, turn, points = 0.3, 2.0 * math.pi, 400
    half = 0.5 * turn / points
    tension = 1.0
    for _ in range(points):
        following = tension
        for _ in range(60):  # equilibrium along and across each point
            normal = (tension + following) * math.sin(half)
            f = rub(np.zeros(3), np.array([-0.1, 0.0, 0.0]), normal, mu=mu)[0]
            following = tension + f[0] / math.cos(half)
        tension = following
    assert_allclose(tension, math.exp(mu * turn), rtol=1e-4)
    book(
        "Contact", "Capstan, a whole turn on 400 points (kernel)", reference="e^(mu beta)", source="closed form",
        error=abs(tension / math.exp(mu * turn) - 1.0), allowed=1e-4,
    )  # fmt: skip
