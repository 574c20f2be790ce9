"""One swing is one mode: dry friction, drag, large swings; and two modes stay two."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.integrate
import scipy.special

from evolvent import InputError
from evolvent_massprops import swing as kernel
from evolvent_massprops.identification import identify, swing_model
from evolvent_massprops.identification.signals import read_signal
from evolvent_massprops.identification.swing_model import PENDULUM, Component, Reach
from evolvent_massprops.identification.swing_starts import Kind

W, RATE, COUNT = 2.0 * np.pi * 1.3, 50.0, 1000
TIME = np.arange(COUNT) / RATE


def parameters(w: float = W, **changes: float) -> np.ndarray:
    """Of the kernel: a linear swing without resistances from 1, unless changed."""
    p = np.zeros(kernel.SIZE)
    p[[kernel.W, kernel.START, kernel.LINE, kernel.SQUARE]] = w, 1.0, 1.0, 1.0
    for key, value in changes.items():
        p[getattr(kernel, key)] = value
    return p


def motion(p: np.ndarray, time: np.ndarray = TIME) -> np.ndarray:
    out = np.empty((len(time), 3))
    kernel.motion(p, time, out)
    return out


def coulomb(time: np.ndarray, w: float, shift: float) -> np.ndarray:
    """A linear swing from 1 with dry friction: half periods about +-shift, which lose 2 shift each, then rest."""
    half = np.floor(w * time / np.pi)
    last = np.ceil((1.0 / shift - 1.0) / 2.0)
    x = np.where(half % 2 == 0, 1.0, -1.0) * shift + (1.0 - (2.0 * half + 1.0) * shift) * np.cos(w * time)
    return np.where(half < last, x, (1.0 - 2.0 * last * shift) * (1.0 if last % 2 == 0 else -1.0))


def noisy(x: np.ndarray, seed: int = 1, level: float = 0.002) -> np.ndarray:
    return x + level * np.abs(x).max() * np.random.default_rng(seed).standard_normal(x.shape)


# ------------------------------------------------------------------------------------------------ the motion


def test_dry_friction_is_coulombs_solution() -> None:
    found = motion(parameters(DRY=0.011 * W**2))
    exact = coulomb(TIME, W, 0.011)
    np.testing.assert_allclose(found[:, 0], exact, atol=1e-6)
    assert found[-1, 1] == 0.0
    assert np.ptp(exact[-50:]) == 0.0


def test_a_pendulum_has_the_period_of_the_elliptic_integral() -> None:
    first = np.radians(70.0)
    w = np.pi * W / (2.0 * scipy.special.ellipk(np.sin(0.5 * first) ** 2))
    whole = 2.0 * np.pi / w * np.arange(1.0, 11.0)
    found = motion(parameters(START=first, SINE=1.0, LINE=0.0), whole)
    np.testing.assert_allclose(found[:, 0], first, atol=1e-6)


@pytest.mark.parametrize("lift", [0.0, 0.04])
def test_all_terms_against_another_integrator(lift: float) -> None:
    p = parameters(
        VISCOUS=0.02, DRAG=0.3, START=0.6, RATE=0.2, SINE=0.7, LINE=0.3, CUBE=0.05, PRODUCT=0.3, SQUARE=0.5, LIFT=lift
    )

    def rate(_: float, y: np.ndarray) -> list[float]:
        x, v = y
        H, H0 = np.sqrt(0.5 + 0.6 * np.cos(x)), np.sqrt(1.1)
        slope, bend = -0.3 * np.sin(x) / H, -0.3 * np.cos(x) / H - 0.09 * np.sin(x) ** 2 / H**3
        turning = W**2 * (0.7 * np.sin(x) * H0 / H + 0.3 * x + 0.05 * x**3) + W**2 * lift * slope * bend * v * v
        return [v, -(turning + 0.04 * v + 0.3 * v * abs(v)) / (1.0 + W**2 * lift * slope**2)]

    there = scipy.integrate.solve_ivp(
        rate, (0.0, TIME[-1]), [0.6, 0.2 * W], t_eval=TIME, rtol=1e-10, atol=1e-12, max_step=0.02
    )
    found = motion(p)
    np.testing.assert_allclose(found[:, 0], there.y[0], atol=1e-6)
    np.testing.assert_allclose(found[:, 1] * W, there.y[1], atol=1e-5)


def test_the_envelope_of_all_laws() -> None:
    b = np.empty(COUNT)
    kernel.envelope(np.array([0.05, 0.0, 0.1]), TIME, b)
    e = np.exp(-0.05 * TIME)
    np.testing.assert_allclose(b, e / (1.0 + 2.0 * (1.0 - e)), atol=1e-8)
    kernel.envelope(np.array([0.0, 0.1, 0.0]), TIME, b)
    np.testing.assert_allclose(b, np.maximum(1.0 - 0.1 * TIME, 0.0), atol=1e-10)


@pytest.mark.parametrize(("name", "d"), [("DRY", 0), ("DRAG", 1)])
def test_rates_are_those_of_the_envelope(name: str, d: int) -> None:
    """Averaged over a period, the terms of the motion give the envelope's rates."""
    rates = [(0.0, 0.02, 0.0), (0.0, 0.0, 0.05)][d]
    one = Component(1j * W, rates=rates, law=(False, d == 0, d == 1))
    x = one.motion(TIME)
    size = np.hypot(x[:, 0], x[:, 1])
    assert np.abs(size - one.envelope(TIME)).max() < 0.02


# ------------------------------------------------------------------------------------------------ one mode


SINUSOIDAL = {
    "friction, at rest in the end": np.where(TIME < 18.0, 1.0 - TIME / 18.0, 0.0) * np.cos(W * TIME),
    "friction, moving to the end": (1.0 - TIME / 25.0) * np.cos(W * TIME),
    "friction and damping": np.maximum(1.4 * np.exp(-TIME / 10.0) - 0.4, 0.0) * np.cos(W * TIME),
}


@pytest.mark.slow
@pytest.mark.parametrize("x", SINUSOIDAL.values(), ids=SINUSOIDAL)
def test_an_envelope_of_friction_is_one_mode(x: np.ndarray) -> None:
    """Exponential modes made two to six of it."""
    found = identify(noisy(x), rate=RATE)
    assert found.order == 1
    assert found.frequency[0] == pytest.approx(W, abs=4.0 * found.frequency_std[0])
    assert "dry friction" in found.swings[0].law
    assert any("one swing that decays by" in text and "dry friction" in text for text in found.warnings)


SWINGS = {
    "dry": {"DRY": 0.011 * W**2},
    "dry, moving to the end": {"DRY": 0.005 * W**2},
    "quadratic": {"DRAG": 0.3},
    "viscous and dry": {"VISCOUS": 0.02, "DRY": 0.005 * W**2},
}


@pytest.mark.slow
@pytest.mark.parametrize("terms", SWINGS.values(), ids=SWINGS)
def test_the_frequency_is_within_its_uncertainty(terms: dict[str, float]) -> None:
    """Of four motions with each resistance, three at least within two deviations, and all within four."""
    x = motion(parameters(**terms))[:, 0]
    away = []
    for seed in range(4):
        found = identify(noisy(x, seed), rate=RATE)
        k = int(np.argmax(found.amplitude[:, 0]))
        away.append((found.natural_frequency[k] - W) / found.natural_frequency_std[k])
    assert np.sort(np.abs(away))[2] < 2.0
    assert np.abs(away).max() < 4.0


def test_a_pendulum_gives_its_frequency_at_zero_amplitude() -> None:
    """From 30 degrees, in degrees, with two sensors, the second delayed; no amplitude is given."""
    x = motion(parameters(VISCOUS=0.03, START=np.radians(30.0), SINE=1.0, LINE=0.0))
    data = noisy(np.degrees(np.column_stack((x[:, 0], 0.5 * x[:, 0] + 0.1 * x[:, 1]))))
    found = identify(data, rate=RATE, swing=Kind(PENDULUM, Reach(np.radians(1.0))))
    assert found.order == 1
    assert found.natural_frequency[0] == pytest.approx(W, abs=4.0 * found.natural_frequency_std[0])
    assert found.natural_frequency_std[0] < 1e-4 * W
    assert found.swings[0].amplitude == pytest.approx(np.radians(30.0), rel=1e-3)
    assert found.decay_rate[0] == pytest.approx(0.03, rel=0.01)
    np.testing.assert_allclose(found.predict(TIME), found.fitted, atol=1e-6)


@pytest.mark.parametrize("derivative", [1, 2])
def test_gyros_and_accelerometers_read_derivatives(derivative: int) -> None:
    first = np.radians(20.0)
    x = motion(parameters(VISCOUS=0.03, START=first, SINE=1.0, LINE=0.0))[:, derivative] * W**derivative
    found = identify(noisy(x), rate=RATE, swing=Kind(PENDULUM, Reach(1.0), derivative))
    assert found.natural_frequency[0] == pytest.approx(W, abs=4.0 * found.natural_frequency_std[0])
    assert found.swings[0].amplitude == pytest.approx(first, rel=1e-3)


def test_without_an_angle_the_rate_shows_the_amplitude() -> None:
    x = 3.7 * motion(parameters(VISCOUS=0.08, START=np.radians(25.0), SINE=1.0, LINE=0.0))[:, 0]
    found = identify(noisy(x), rate=RATE, swing=Kind(PENDULUM))
    assert found.natural_frequency[0] == pytest.approx(W, abs=4.0 * found.natural_frequency_std[0])
    assert found.swings[0].amplitude == pytest.approx(np.radians(25.0), rel=0.02)


@pytest.mark.parametrize("gain", [0.5, 2.0])
def test_angles_that_the_frequency_contradicts_are_not_used(gain: float) -> None:
    """A sensor of angles with a wrong sensitivity; its reading was taken for the amplitude."""
    x = gain * motion(parameters(VISCOUS=0.05, START=np.radians(25.0), SINE=1.0, LINE=0.0))[:, 0]
    found = identify(noisy(x), rate=RATE, swing=Kind(PENDULUM, Reach(1.0)))
    assert found.natural_frequency[0] == pytest.approx(W, abs=4.0 * found.natural_frequency_std[0])
    assert any("but the sensors show sensor 1" in text and "sensitivities" in text for text in found.warnings)


def test_parts_of_a_swing_do_not_stay_beside_it() -> None:
    """Exponential modes by which a swing was described until its law was known."""
    w, time = 2.0 * np.pi * 0.9, np.arange(1500) / 40.0
    x = motion(parameters(w, DRY=0.011 * w**2), time)[:, 0]
    for seed in range(2):
        assert identify(noisy(x, seed), rate=40.0).order == 1


def test_accelerations_that_jump_with_dry_friction() -> None:
    """A jump that passed a sample in a difference was taken for a slope: u was up to 50 times too small."""
    w, time = 2.0 * np.pi * 0.9, np.arange(1500) / 40.0
    x = motion(parameters(w, DRY=0.006 * w**2), time)[:, 2]
    found = [identify(noisy(x, seed), rate=40.0, swing=Kind(derivative=2)) for seed in range(5)]
    std = [one.natural_frequency_std[0] for one in found]
    assert max(std) < 1.5 * min(std)
    assert max(abs(one.natural_frequency[0] - w) for one in found) < 4.0 * max(std)


def test_two_modes_stay_two() -> None:
    """A beat is no decay: neither of nearly equal decays, nor where the sensors move differently."""
    for shift, second in ((0.3, 0.8), (0.3, -0.8)):
        x = np.exp(-0.02 * TIME) * np.cos(W * TIME) + second * np.exp(-0.03 * TIME) * np.cos((W + shift) * TIME + 1.0)
        found = identify(noisy(x), rate=RATE)
        assert found.order == 2
        assert not found.swings
        np.testing.assert_allclose(found.frequency, [W, W + shift], atol=5e-3)


def test_an_exponential_decay_is_fitted_as_before() -> None:
    x = noisy(np.exp(-0.05 * TIME) * np.cos(W * TIME))
    found = identify(x, rate=RATE)
    assert found.order == 1
    assert not found.swings


def test_the_law_can_be_given() -> None:
    x = noisy(motion(parameters(DRY=0.005 * W**2))[:, 0])
    found = identify(x, rate=RATE, decay="dry")
    assert found.swings[0].law == "dry friction"
    with pytest.raises(InputError, match="decay is 'drag'; did you mean 'dry'"):
        identify(x, rate=RATE, decay="drag")
    with pytest.raises(InputError, match="varpro alone fits; method is 'prony'"):
        identify(x, rate=RATE, decay="dry", method="prony")


@pytest.mark.parametrize("factor", [np.nan, 1.0])
def test_slopes_of_the_residual_are_those_of_differences(factor: float) -> None:
    """A pendulum beside a mode, sensors with gaps of their own; the amplitudes are fitted again at each difference."""
    t = np.arange(150) / 20.0
    data = np.column_stack((np.cos(3.0 * t), 0.5 * np.cos(3.0 * t + 0.4) + 0.2 * np.cos(7.0 * t)))
    data += 0.01 * np.random.default_rng(5).standard_normal(data.shape)
    data[40:50, 1] = np.nan
    signal, noise = read_signal(data, rate=20.0), np.array([0.01, 0.02])
    reach = Reach(factor=factor, mean=0.5, std=0.1)
    swing = Component(
        pole=3.05j, rates=(0.02, 0.01, 0.015), law=(True, True, True), phase=0.1, square=0.5, free_square=True,
        restoring=PENDULUM, reach=reach,
    )  # fmt: skip
    mode = Component(pole=-0.05 + 7.1j)
    now = swing_model.solve((swing, mode), signal)
    found = swing_model._slopes(now, signal, noise)
    values = np.concatenate((swing.values(), mode.values()))
    for k, slope in enumerate(found.T):
        ahead, back = (
            swing_model._stacked(
                swing_model.solve(swing_model.split(now.components, values + h * np.eye(len(values))[k]), signal),
                noise,
            )
            for h in (1e-5, -1e-5)
        )
        np.testing.assert_allclose(slope, (ahead - back) / 2e-5, atol=2e-3 * np.abs(slope).max())
