"""Uneven times: what they are is stated, modes are fitted at them, and the uncertainty covers the truth."""

from __future__ import annotations

import pathlib
from collections.abc import Callable

import numpy as np
import pytest

from evolvent import InputError
from evolvent_base.signals.times import instead_of, read_times
from evolvent_massprops import mass_properties, vibration
from evolvent_massprops.identification import identify
from evolvent_massprops.identification.signals import exponentials, read_signal
from evolvent_massprops.identification.subspace import interpolated
from evolvent_massprops.identification.variable_projection import varpro, whiteness
from massprops import rig
from massprops.test_refusals import EXAMPLE, call

Array = np.ndarray
Times = Callable[[np.random.Generator], Array]

RATE, N = 25.0, 600
ROW = np.arange(N)
EVEN = ROW / RATE
LOST = np.r_[100:160, 300:302, 400]
FREQUENCY, DECAY = np.array([14.0, 22.0]), np.array([0.05, 0.08])


def swing(t: Array) -> Array:
    """Two modes, in metres."""
    return np.exp(-0.05 * t) * np.cos(14.0 * t + 0.3) + 0.5 * np.exp(-0.08 * t) * np.cos(22.0 * t)


def scattered(share: float, t: Array = EVEN) -> Times:
    """Times that scatter by a share of a step, rms."""
    return lambda rng: np.sort(t + share / RATE * rng.standard_normal(len(t)))


def wandering(rng: np.random.Generator) -> Array:
    """A clock whose rate wanders by 0.5 %."""
    return EVEN + 0.005 * 6.0 * np.sin(EVEN / 6.0 + rng.uniform(0.0, 6.0))


KINDS: dict[str, Times] = {
    "scatter of 1 %": scattered(0.01),
    "scatter of 5 %": scattered(0.05),
    "scatter of 30 %": scattered(0.30),
    "gaps": lambda rng: np.delete(EVEN, LOST),
    "gaps and a scatter of 5 %": scattered(0.05, np.delete(EVEN, LOST)),
    "a clock that wanders": wandering,
    "a clock that wanders, and a scatter of 5 %": lambda rng: scattered(0.05, wandering(rng))(rng),
    "no grid at all": lambda rng: np.cumsum(rng.exponential(1.0 / RATE, N)),
}


# ------------------------------------------------------------------------------------------------ what times are


@pytest.mark.parametrize(
    ("times", "words"),
    [
        (EVEN, []),
        (EVEN + 1.7e9, []),
        (EVEN + 0.004 / RATE * np.sin(ROW), []),  # within a hundredth of a step
        (np.delete(EVEN, LOST), ["63 rows that are missing in the file are gaps: 3 in all, the longest of 60 from"]),
        (np.delete(EVEN, [7]), ["1 rows that are missing in the file are gaps, from 0.24 to 0.32 s"]),
        (KINDS["scatter of 5 %"], [r"times scatter about even ones, .* by 0.0019\d* s rms \(4.\d+ % of"]),
        (KINDS["scatter of 30 %"], [r"times scatter about even ones, .* \((29|30|31)\.?\d* % of a step\)"]),
        (KINDS["gaps and a scatter of 5 %"], ["63 rows .* gaps: 3 in all", "times scatter about even ones"]),
        (wandering, [r"the clock wanders: .* up to 0.02\d* s, and the sampling rate by 0.6\d* % of"]),
        (KINDS["a clock that wanders, and a scatter of 5 %"], ["clock wanders", "times scatter about a smooth clock"]),
        (np.cumsum(np.where(ROW < 300, 1.0, 1.001)) / RATE, [r"the clock wanders: .* rate by 0.0(5|6)\d* % of"]),
        (EVEN + 0.8 / RATE * (ROW % 50 == 17), ["times scatter about even ones, .* 0.03\\d* s at most"]),
        (KINDS["no grid at all"], ["the times follow no even grid: steps are .* samples a second on average"]),
        (np.round(ROW / 33.3, 3), ["the times are rounded, by up to 0.001 s .*: samples are taken as even, 33.3"]),
        (1.7e9 + np.round(ROW / 33.3, 3), ["the times are rounded, by up to 0.001 s"]),
        (np.floor(10.0 * ROW / 33.3) / 10.0, [r"by up to 0.1 s \(333 % of a step\): .* 33.\d+ a second, known to"]),
        (np.round(np.delete(ROW / 33.3, LOST), 3), ["63 rows .* gaps", "the times are rounded, by up to 0.001 s"]),
        ((300.0 + ROW / 1000.3).astype(np.float32).astype(float), ["the times are rounded, by up to 3.05e-05 s"]),
        (np.array([float(f"{k / 128:.4g}") for k in range(2000)]), ["the times are rounded, by up to 0.01 s"]),
        (np.floor(ROW / 100 * 64) / 64, ["the times are rounded, by up to 0.0156 s"]),
        (
            lambda rng: np.repeat(0.1 * ROW[:60] + 0.004 * rng.standard_normal(60), 10),
            ["540 of 600 samples have the time of the one before, as where they are written in blocks", "scatter"],
        ),
    ],
)  # fmt: skip
def test_times_are_told_apart(times: Array | Times, words: list[str]) -> None:
    given = times(np.random.default_rng(5)) if callable(times) else times
    found = read_times(given)
    assert len(found.notes) == len(words), found.notes
    for note, word in zip(found.notes, words, strict=True):
        with pytest.raises(AssertionError, match=word):
            raise AssertionError(note)
    assert np.all(np.diff(found.time) > 0.0)
    assert found.time[0] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("rate", [33.3, 100.0 / 3.0, 47.77, 123.456])
@pytest.mark.parametrize("places", [1, 2, 3])
def test_the_rate_of_rounded_times_is_known_as_stated(rate: float, places: int) -> None:
    """The step of the grid is the true one within the bounds that all the times leave."""
    t = np.arange(3000) / rate
    for stamps in (np.round(t, places), np.floor(t * 10**places) / 10**places):
        found = read_times(stamps)
        assert found.even
        assert abs(found.step * rate - 1.0) <= np.sqrt(3.0) * found.unsure + 3e-6 / len(t)
        assert found.unsure < 10.0**-places / t[-1]
        np.testing.assert_allclose(found.time, t, atol=1.1 * 10.0**-places)


def test_gaps_are_found_among_late_times() -> None:
    """A time that is late is no gap; the rows that are missing are counted in spite of it, and of a scatter of 30 %."""
    late = EVEN + 0.9 / RATE * (np.random.default_rng(1).random(N) < 0.05)
    for times in (late, scattered(0.3)(np.random.default_rng(2))):
        np.testing.assert_array_equal(read_times(times).place, ROW)
        np.testing.assert_array_equal(read_times(np.delete(times, LOST)).place, np.delete(ROW, LOST))


# ------------------------------------------------------------------------------------------------ the fit


def test_exponentials_at_any_times() -> None:
    poles = np.array([-0.05 + 14.0j, 0.3 + 200.0j])
    for times in KINDS.values():
        t = times(np.random.default_rng(1))
        t = t - t[0]
        np.testing.assert_allclose(exponentials(poles, t), np.exp(np.multiply.outer(t, poles)), rtol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_without_noise_the_modes_are_exact(kind: str) -> None:
    t = KINDS[kind](np.random.default_rng(3))
    modes = varpro(swing(t), 2, time=t)
    np.testing.assert_allclose(modes.frequency, FREQUENCY, rtol=1e-9)
    np.testing.assert_allclose(modes.decay_rate, DECAY, rtol=1e-7)


def test_the_covariance_is_that_of_the_times() -> None:
    """The inverse of J^T J of the model's own derivatives, by differences, at times that follow no grid."""
    t = KINDS["no grid at all"](np.random.default_rng(4))
    t = t - t[0]
    x = swing(t) + 0.01 * np.random.default_rng(5).standard_normal(N)
    modes = varpro(x, 2, time=t)

    def model(p: Array) -> Array:
        w, d, re, im = p[:8].reshape(4, 2)
        return p[8] + sum(np.exp(-d[k] * t) * (re[k] * np.cos(w[k] * t) - im[k] * np.sin(w[k] * t)) for k in range(2))

    a = modes.complex_amplitude[:, 0]
    p = np.concatenate((modes.frequency, modes.decay_rate, a.real, a.imag, modes.offset))
    J = np.column_stack([(model(p + h) - model(p - h)) / 2e-6 for h in 1e-6 * np.eye(9)])
    expected = modes.noise[0] ** 2 * np.linalg.inv(J.T @ J)
    size = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(modes.covariance / np.outer(size, size), expected / np.outer(size, size), atol=1e-4)


@pytest.mark.parametrize("kind", ["scatter of 30 %", "gaps and a scatter of 5 %", "no grid at all"])
def test_white_noise_is_white_at_any_times(kind: str) -> None:
    """p-values of white noise are uniform, and a line that even times show is not lost."""
    rng, found, seen, trials = np.random.default_rng(6), [], 0, 100
    for _ in range(trials):
        t = KINDS[kind](rng)
        t = t - t[0]
        noise = rng.standard_normal((len(t), 1))
        signal = read_signal(noise, time=t)
        found.append(whiteness(signal, noise, np.ones(1)))
        line = 0.5 * np.cos(3.0 * np.pi * t + rng.uniform(0.0, 6.0))[:, np.newaxis]
        seen += whiteness(signal, noise + line, np.ones(1)) < 1e-3
    apart = np.abs(np.sort(found) - (np.arange(trials) + 0.5) / trials).max()
    assert apart < 1.63 / np.sqrt(trials) + 0.03  # Kolmogorov and Smirnov at 1 %; fewer independent lines than cells
    assert seen > 0.94 * trials  # N / 16 = 37 times above the noise, 33 with the gaps; 12.6 is the limit


def test_starts_are_near_even_with_little_more_than_two_samples_a_period() -> None:
    t = scattered(0.3)(np.random.default_rng(8))
    x = np.exp(-0.02 * t) * np.cos(70.0 * t) + 0.01 * np.random.default_rng(9).standard_normal(N)
    signal = interpolated(read_signal(x, time=t))
    assert signal.even
    assert signal.present.all()
    assert identify(x, time=t).frequency == pytest.approx([70.0], abs=3e-3)  # half the rate: 78.5 rad/s


# ------------------------------------------------------------------------------------------------ coverage


def scores(times: Times, trials: int, *, stamps: Times | None = None) -> Array:
    """(trials, 4) errors of two modes' frequency and decay rate over their standard deviations."""
    rng, found = np.random.default_rng(11), []
    for _ in range(trials):
        t = times(rng)
        stated = t if stamps is None else t + stamps(rng) - EVEN
        modes = identify(swing(t) + 0.01 * rng.standard_normal(len(t)), time=stated, order=2)
        errors = np.concatenate((modes.frequency - FREQUENCY, modes.decay_rate - DECAY))
        found.append(errors / np.concatenate((modes.frequency_std, modes.decay_rate_std)))
    return np.array(found)


@pytest.mark.parametrize("kind", KINDS)
def test_deviations_cover_the_truth(kind: str) -> None:
    z = scores(KINDS[kind], 40)
    assert np.mean(np.abs(z) < 2.0) > 0.88
    assert np.sqrt(np.mean(z**2)) == pytest.approx(1.0, abs=0.25)


@pytest.mark.slow
@pytest.mark.release
@pytest.mark.parametrize("kind", KINDS)
def test_deviations_cover_the_truth_in_95_per_cent(kind: str) -> None:
    """200 records of each kind of times; the test above checks 40 of each in every run."""
    inside = np.abs(scores(KINDS[kind], 200)) < 2.0
    assert 0.93 <= inside.mean() <= 0.975  # 800 numbers, most of them independent: 0.954 ± 0.008
    assert inside.mean(axis=0).min() > 0.90  # 200 numbers: 0.954 ± 0.015


@pytest.mark.slow
@pytest.mark.parametrize("share", [*(pytest.param(one, marks=pytest.mark.release) for one in (0.01, 0.05)), 0.2])
def test_scatter_of_the_stamps_alone(share: float) -> None:
    """Samples taken evenly, whose stamps scatter: seen by the likelihood, and the rate's uncertainty is taken along."""
    inside = np.abs(scores(lambda rng: EVEN, 200, stamps=scattered(share))) < 2.0
    assert 0.93 <= inside.mean() <= 0.985


@pytest.mark.parametrize("share", [0.02, 0.3])
def test_whether_samples_or_only_their_stamps_scatter(share: float) -> None:
    rng = np.random.default_rng(13)
    t = scattered(share)(rng)
    x = 0.003 * rng.standard_normal(N)
    own, stamped = identify(swing(t) + x, time=t), identify(swing(EVEN) + x, time=t)
    assert own.warnings == ()
    assert "only their times scatter" in stamped.warnings[0]
    for modes in (own, stamped):
        assert modes.order == 2
        assert modes.noise[0] == pytest.approx(0.003, rel=0.1)
        assert np.all(np.abs(modes.frequency - FREQUENCY) < 4.0 * modes.frequency_std)
    # a frequency cannot be known better than the rate: a line through N times that scatter
    rate = share / RATE * np.sqrt(12.0 / N) / EVEN[-1]
    assert np.all(stamped.frequency_std > 0.8 * rate * FREQUENCY)


def test_rounded_times_leave_the_rate_open() -> None:
    t = np.arange(400) / 33.3
    x = swing(t) + 1e-5 * np.random.default_rng(1).standard_normal(400)
    for stamps in (np.round(t, 1), np.round(t, 2)):
        modes = identify(x, time=stamps)
        assert np.all(np.abs(modes.frequency - FREQUENCY) < 2.0 * modes.frequency_std)
        assert np.all(modes.frequency_std > read_times(stamps).unsure * FREQUENCY)
        assert np.all(identify(x, time=t).frequency_std < 0.1 * modes.frequency_std)


def test_many_samples_are_fast_enough_to_wait_for() -> None:
    """A telephone's record of five minutes: 60 000 samples, scatter, gaps and a wander of 0.1 %."""
    rng, n = np.random.default_rng(3), 60_000
    steps = np.clip(rng.normal(1.0, 0.02, n), 0.3, 3.0) * (1.0 + 0.001 * np.sin(np.arange(n) / 7000.0)) / 200.0
    t = np.delete(np.cumsum(steps), np.r_[20000:20150, 41000, 50000:50003])
    x = 2.0 * np.exp(-0.004 * t) * np.cos(3.938874 * t + 0.3) + 0.02 * rng.standard_normal(len(t))
    modes = identify(x, time=t)
    assert modes.order == 1
    assert modes.frequency[0] == pytest.approx(3.938874, abs=4.0 * modes.frequency_std[0])
    assert modes.frequency_std[0] < 1e-5


# ------------------------------------------------------------------------------------------------ files


def written(folder: pathlib.Path, stamps: Array, x: Array) -> str:
    return rig.write_csv(folder / "a.csv", stamps, x[:, np.newaxis])


def test_a_file_with_uneven_times(tmp_path: pathlib.Path) -> None:
    t = KINDS["gaps and a scatter of 5 %"](np.random.default_rng(1))
    x = swing(t) + 0.01 * np.random.default_rng(2).standard_normal(len(t))
    done = call(written(tmp_path, t, x))
    assert done.exit_code == 0, done.output
    said = " ".join(done.output.split())
    assert "63 rows that are missing in the file are gaps" in said
    assert "the times scatter about even ones" in said
    assert "13.99" in said or "14.00" in said
    later = call(written(tmp_path, t, x), "--set", "signals.start=4 s", "--set", "signals.clock=1.0001")
    assert later.exit_code == 0, later.output


def test_rows_that_are_missing_between_uneven_times(tmp_path: pathlib.Path) -> None:
    t = KINDS["gaps and a scatter of 5 %"](np.random.default_rng(1))
    path = written(tmp_path, t, swing(t))
    with pytest.raises(InputError, match="lacks 63 of 600 rows, and signals"):
        vibration(path, (), {"signals.gaps": "refuse"})
    few = scattered(0.05, np.delete(EVEN, np.s_[100:450]))(np.random.default_rng(1))
    with pytest.raises(InputError, match="lacks 350 of 600 rows, more than half"):
        vibration(written(tmp_path, few, swing(few)))


def test_a_rate_in_place_of_the_times(tmp_path: pathlib.Path) -> None:
    for times, said in (
        (EVEN, ""),
        (EVEN * 1.0005, "frequencies may be off by 0.05 %"),
        (wandering(np.random.default_rng(1)), "the clock wanders"),
        (scattered(0.05)(np.random.default_rng(1)), "the times scatter about even ones"),
    ):
        changes = {"signals.rate": "25 Hz", "identification.order": "2"}
        found = " ".join(vibration(written(tmp_path, times, swing(times)), (), changes).reading.notes)
        assert ("signals.rate, 25 Hz, stands for the times of the column 'time'" in found) == bool(said)
        assert said in found


def test_a_rate_explains_times_that_are_rounded() -> None:
    assert instead_of(np.round(ROW / 33.3, 2), 33.3, "the column 't'", "signals.rate") == ()
    (said,) = instead_of(ROW / 33.3, 33.31, "the column 't'", "signals.rate")
    assert said.startswith("signals.rate, 33.31 Hz, stands for the times of the column 't', which differ from it by")
    assert "off by 0.03 %" in said


def test_a_stand_with_uneven_times(tmp_path: pathlib.Path) -> None:
    """The mass properties are those of even times."""
    t, x = rig.knock()
    rng = np.random.default_rng(1)
    moved = np.sort(t + 0.1 * (t[1] - t[0]) * rng.uniform(-1.0, 1.0, len(t)))
    modes = identify(x, time=t)
    there = modes.predict(moved - t[0]) + modes.residual
    even = mass_properties(rig.write_csv(tmp_path / "a.csv", t, x), EXAMPLE, rig.THREE)
    uneven = mass_properties(rig.write_csv(tmp_path / "b.csv", moved, there), EXAMPLE, rig.THREE)
    np.testing.assert_allclose(uneven.values, even.values, rtol=1e-4)
    np.testing.assert_allclose(uneven.std, even.std, rtol=0.02)
    assert any("the times scatter" in text for text in uneven.warnings)


def test_methods_that_need_even_times() -> None:
    t = scattered(0.05)(np.random.default_rng(1))
    for method in ("esprit", "matrix_pencil", "tls_prony", "prony"):
        with pytest.raises(InputError, match=f"the time is not even, but {method} needs even times; varpro fits at"):
            identify(swing(t), time=t, method=method, order=2)
