"""What the claims of Belyakov (2002) on Prony's method are measured by; each function returns numbers by name."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from evolvent_massprops.identification import IdentifiedModes, prony
from evolvent_papers.papers.stand_prony import (
    DAMPINGS,
    Record,
    accuracy,
    bound,
    errors,
    frequencies,
    maximum_likelihood,
    plain_prony,
    single_mode_bounds,
)

Values = Mapping[str, float]
TRIALS = 100
#: Decay rates, 1/s, of a record with damping.
DECAYS = np.array([0.05, 0.08, 0.1])


def _rms(values: np.ndarray) -> np.ndarray:
    """Root of the mean square over records, %."""
    return np.asarray(100.0 * np.sqrt(np.mean(np.square(values), axis=0)))


def model() -> Values:
    """Errors, ppm, of 100 damped samples without noise, of frequencies, decay rates, amplitudes; roots of (2.3)."""
    record = Record()
    time = np.arange(record.samples)[:, None] / record.rate
    data = (np.exp(-DECAYS * time) * np.cos(frequencies() * time)).sum(axis=1)
    found = prony(data, 3, rate=record.rate, samples_per_period=None, detrend="constant")
    pairs = ((found.frequency, frequencies()), (found.decay_rate, DECAYS), (found.amplitude[:, 0], np.ones(3)))
    names = ("frequency", "decay", "amplitude")
    apart = {n: 1e6 * float(np.abs(a / b - 1.0).max()) for n, (a, b) in zip(names, pairs, strict=True)}
    windows = sliding_window_view(data + 0.5, 8)  # 2 P + 2 samples; the constant A0 is 0.5
    coefficients = np.linalg.lstsq(windows[:, :-1], -windows[:, -1], rcond=None)[0]
    roots = np.roots(np.concatenate(([1.0], coefficients[::-1])))
    real = roots[np.abs(roots.imag) < 1e-9].real
    return apart | {"real": float(len(real)), "pairs": 0.5 * (len(roots) - len(real)), "root": float(real[0])}


def at_best() -> Values:
    """Errors of the frequencies, %, from 100 samples at 2.5 a period of the highest mode.

    With normal noise of 1 %: of the worst and the best mode by Prony's method, and of the worst by VARPRO. With noise
    evenly distributed in +-1 %: of the best mode, and the same of the mean of four sensors.
    """
    normal = _rms(errors(plain_prony, Record(), 2 * TRIALS)[0])
    even = errors(plain_prony, Record(uniform=True), 4 * TRIALS)[0]
    return {
        "worst": float(normal.max()),
        "best": float(normal.min()),
        "even": float(_rms(even).min()),
        "four": float(_rms(even.reshape(-1, 4, 3).mean(axis=1)).min()),
        "varpro": 100.0 * accuracy(maximum_likelihood, Record(), TRIALS // 2).error,
    }


def decrements() -> Values:
    """Errors of the decrements of heave, pitch and roll, %, from 100 samples at 2.5 a period with 1 % normal noise.

    At the damping ratios 0.002 ("low") and 0.01 ("high"), by Prony's method, by VARPRO, and by the Cramér-Rao bound in
    closed form; `any` is the least of the closed form over all damping ratios from 1e-4 to 1.
    """
    found: dict[str, float] = {}
    for name, damping in zip(("low", "high"), DAMPINGS, strict=True):
        record = Record(damping=damping)
        rows = {
            "prony": _rms(errors(plain_prony, record, 2 * TRIALS)[1]),
            "varpro": _rms(errors(maximum_likelihood, record, TRIALS // 2)[1]),
            "bound": 100.0 * single_mode_bounds(record),
        }
        for what, values in rows.items():
            found |= {f"{what}_{name}_{k}": float(value) for k, value in enumerate(values, start=1)}
    every = [single_mode_bounds(Record(damping=damping)).min() for damping in np.geomspace(1e-4, 1.0, 401)]
    return found | {"any": 100.0 * float(min(every))}


def interval() -> Values:
    """Errors of the worst frequency, %, of 100 samples with 1 % noise at 2.05 to 9 samples a period; the best number.

    More than 10 % counts as that. `least_near` and `least_far` are the Cramér-Rao bound at 2.05 and at 9.
    """
    rates = (2.05, 2.1, 2.2, 2.3, 2.4, 2.5, 2.6, 2.7, 2.8, 3.0, 4.0, 6.0, 9.0)
    found = [100.0 * accuracy(plain_prony, Record(per_period=rate), TRIALS).error for rate in rates]
    kept = (2.05, 2.1, 2.4, 2.5, 2.7, 3.0, 4.0, 6.0, 9.0)
    chosen = {f"p{100 * r:.0f}": min(e, 10.0) for r, e in zip(rates, found, strict=True) if r in kept}
    least = {name: 100.0 * bound(Record(per_period=rate)) for name, rate in (("near", 2.05), ("far", 9.0))}
    return chosen | {"best": rates[int(np.argmin(found))]} | {f"least_{name}": value for name, value in least.items()}


def sampling_theorem() -> Values:
    """Error of the highest frequency, %, without noise, at 1.9 samples a period and at 2.1."""
    found = {}
    for name, rate in (("p190", 1.9), ("p210", 2.1)):
        record = Record(per_period=rate, noise=0.0)
        highest = float(plain_prony(record.data(1)[0], record.rate).frequency.max())
        found[name] = 100.0 * abs(highest / float(frequencies()[-1]) - 1.0)
    return found


def equal_amplitudes() -> Values:
    """Errors of the pitch's frequency, %, where its amplitude is so many hundredths of that of the other modes."""
    found = {}
    for share in (1.0, 0.3, 0.1, 0.03):
        record = Record(amplitudes=(1.0, share, 1.0))
        found[f"a{100 * share:.0f}"] = float(_rms(errors(plain_prony, record, TRIALS)[0])[1])
    return found


def _amplitude_bound(record: Record) -> float:
    """Standard deviation, %, of the worst amplitude of a fit to the samples with the poles known."""
    angle = np.arange(record.samples)[:, None] / record.rate * frequencies()
    basis = np.hstack([np.cos(angle), np.sin(angle), np.ones((record.samples, 1))])
    deviations = record.noise * np.sqrt(np.diag(np.linalg.inv(basis.T @ basis)))
    return 100.0 * float(deviations[:3].max())


def _amplitude_error(record: Record) -> float:
    """Error, %, of the worst amplitude by Prony's poles, from every m-th sample by (2.7), 2.5 a period."""
    found = [prony(d, 3, rate=record.rate, samples_per_period=2.5).amplitude[:, 0] for d in record.data(TRIALS)]
    return float(_rms(np.array(found) - 1.0).max())


def amplitude_rule() -> Values:
    """Errors of the worst amplitude, %, of 100 samples with 1 % noise, sampled by (2.6) and at 2.5 a period.

    With known poles and by Prony's. `least` is what the number of samples allows, noise sqrt(2 / N); `alias` is at
    2.5 a period of the pitch, on which the roll is folded; `crowded` is at 50 a period of the roll.
    """
    record = Record(samples=100)
    by_rule = record._replace(per_period=np.sqrt(record.samples))
    alias = record._replace(per_period=2.5 * float(frequencies()[1] / frequencies()[2]))
    return {
        "least": 100.0 * record.noise * float(np.sqrt(2.0 / record.samples)),
        "rule": _amplitude_bound(by_rule),
        "highest": _amplitude_bound(record),
        "alias": _amplitude_bound(alias),
        "crowded": _amplitude_bound(record._replace(per_period=50.0)),
        "prony_rule": _amplitude_error(by_rule),
        "prony_highest": _amplitude_error(record),
    }


def decimation() -> Values:
    """Errors of the worst frequency, %, of 1000 samples by (2.6): of all of them (at most 100), and of each m-th."""
    record = Record(samples=1000, per_period=float(np.sqrt(1000.0)))
    m = int(record.per_period / 2.5)

    def every(data: np.ndarray, rate: float) -> IdentifiedModes:
        return plain_prony(data[::m], rate / m)

    few = TRIALS // 2
    return {
        "all": min(100.0 * accuracy(plain_prony, record, few).error, 100.0),
        "every": 100.0 * accuracy(every, record, few).error,
        "m": float(m),
    }
