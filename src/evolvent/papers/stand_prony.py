"""Accuracy of Prony's method over samples per period, number of samples and noise, with VARPRO compared."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from evolvent.base.errors import InputError
from evolvent.massprops.identification import Modes, cramer_rao, prony, varpro
from evolvent.papers import Made, Options
from evolvent.papers.stand import grid
from evolvent.papers.winding import markdown
from evolvent.results.figures import Figure, Line, Panel

#: Samples per period of the highest mode; those of the table, and those between them in the figure.
TABLE_RATES = (2.1, 2.4, 2.7, 3.0, 4.0, 6.0, 9.0)
RATES = (2.05, 2.1, 2.2, 2.3, 2.4, 2.5, 2.6, 2.7, 2.8, 3.0, 3.5, 4.0, 5.0, 6.0, 7.0, 9.0)
#: Numbers of samples, and standard deviations of the noise as shares of a mode's amplitude.
SAMPLES, NOISES = (50, 100, 200, 500, 1000), (1e-5, 1e-4, 1e-3, 3e-3, 1e-2, 3e-2)
#: The paper's accuracy, and the usual number of samples, noise, and samples per period.
CLAIMED, USUAL, NOISE, RATE = 1e-5, 100, 0.01, 2.5
#: Random records a point: in full and of the quick form.
TRIALS, QUICK_TRIALS = 200, 20
SEED = 1
#: Modes from samples (n,) and their rate, Hz.
Method = Callable[[np.ndarray, float], Modes]
HEAD = (
    "samples a period", "Prony, %", "without result", "VARPRO, %", "least that is possible, %",
)  # fmt: skip
NOTE = f"""\
Sensor 1 of the stand without offset: three undamped modes of one amplitude at {{0}} rad/s.
{USUAL} samples with white noise of {100 * NOISE:g} % of that amplitude, {{1}} records. Error: root of the mean square
of the relative error of the worst frequency, of the records in which the method finds three modes. Least that is
possible: Cramér-Rao bound. The paper's accuracy is {100 * CLAIMED:g} %.
"""


class Record(NamedTuple):
    """How records are taken.

    Attributes
    ----------
    per_period : float, samples a period of the highest mode
    samples : int
    noise : float, standard deviation of the noise, of the amplitude of a mode; or its bound, where it is `uniform`
    amplitudes : (3,) float, of the modes
    uniform : bool, whether the noise is evenly distributed between bounds; False: normally distributed
    """

    per_period: float = RATE
    samples: int = USUAL
    noise: float = NOISE
    amplitudes: tuple[float, float, float] = (1.0, 1.0, 1.0)
    uniform: bool = False

    @property
    def rate(self) -> float:
        """Samples a second, Hz."""
        return float(frequencies()[-1]) * self.per_period / (2.0 * np.pi)

    def data(self, trials: int) -> np.ndarray:
        """(trials, samples) seeded random records."""
        time = np.arange(self.samples) / self.rate
        clean = np.cos(time[:, None] * frequencies()) @ np.array(self.amplitudes)
        random, size = np.random.default_rng(SEED), (trials, self.samples)
        return clean + self.noise * (random.uniform(-1.0, 1.0, size) if self.uniform else random.standard_normal(size))


class Accuracy(NamedTuple):
    """Errors of a method over random records.

    Attributes
    ----------
    error : float, root of the mean square of the relative error of the worst frequency; nan where there is no result
    failed : float, share of the records in which the method finds no three modes
    """

    error: float
    failed: float


@functools.cache
def frequencies() -> np.ndarray:
    """(3,) rad/s, of the stand without offset; the amplitudes at sensor 1 are equal."""
    over = grid()
    return np.asarray(over.modes(0.0, 0.0).natural_frequency)


def plain_prony(data: np.ndarray, rate: float) -> Modes:
    """Prony's method on all samples."""
    return prony(data, 3, rate=rate, samples_per_period=None)


def maximum_likelihood(data: np.ndarray, rate: float) -> Modes:
    """VARPRO on all samples."""
    return varpro(data, 3, rate=rate)


def errors(method: Method, record: Record, trials: int) -> np.ndarray:
    """(n, 3) relative errors of the frequencies over so many records of sensor 1, of those with a result."""
    w, found = frequencies(), []
    for data in record.data(trials):
        try:
            found.append(np.sort(method(data, record.rate).frequency) / w - 1.0)
        except InputError:
            continue
    return np.array(found).reshape(-1, 3)


def accuracy(method: Method, record: Record, trials: int) -> Accuracy:
    """Errors of a method over so many records."""
    found = errors(method, record, trials)
    worst = float(np.sqrt(np.mean(np.square(found), axis=0)).max()) if len(found) else float("nan")
    return Accuracy(worst, 1.0 - len(found) / trials)


def bound(record: Record) -> float:
    """Cramér-Rao bound of the relative error of the worst frequency."""
    w = frequencies()
    covariance = cramer_rao(
        w, 0.0, np.array(record.amplitudes), rate=record.rate, length=record.samples, noise=record.noise
    )
    return float((np.sqrt(np.diag(covariance)[:3]) / w).max())


def figure_prony(options: Options) -> Made:
    """Error of the worst frequency over samples per period, number of samples and noise."""
    trials = QUICK_TRIALS if options.quick else TRIALS
    rates = TABLE_RATES if options.quick else RATES
    options.report(f"{trials} records a point")
    panels = [_over_rates(rates, trials), _over_samples(trials), _over_noise(trials)]
    rows = []
    for record in (Record(per_period=rate) for rate in TABLE_RATES):
        first, second = accuracy(plain_prony, record, trials), accuracy(maximum_likelihood, record, _fewer(trials))
        values = [f"{100 * value:.2g}" for value in (first.error, second.error, bound(record))]
        rows.append([f"{record.per_period:g}", values[0], f"{100 * first.failed:.0f} %", *values[1:]])
    listed = ", ".join(f"{w:.3f}" for w in frequencies())
    text = f"{NOTE.format(listed, trials)}\n{markdown(HEAD, rows)}"
    title = "Error of the frequencies by Prony's method (claimed by Belyakov 2002: 0.001 %) and by VARPRO"
    figure = Figure(name="stand-prony", title=title, panels=panels, columns=3, height=96.0)
    return Made(text=text, figure=figure)


def _panel(
    x_label: str, title: str, x: Sequence[float], lines: list[Line], *, log_x: bool = True, named: bool = False
) -> Panel:
    ends = np.array([x[0], x[-1]])
    label = "the paper's accuracy" if named else ""
    claimed = Line(x=ends, y=np.full(2, 100.0 * CLAIMED), style=":", color="gray", label=label)
    y_label = "error of the worst frequency, %"
    return Panel(x_label=x_label, y_label=y_label, lines=[*lines, claimed], title=title, log=True, log_x=log_x)


def _fewer(trials: int) -> int:
    """Number of records for VARPRO, whose error needs fewer to be known and which takes longer."""
    return max(trials // 4, 10)


def _curves(
    x: Sequence[float], records: Sequence[Record], trials: int, *, style: str = "-", named: bool = False
) -> list[Line]:
    """Errors of both methods, %."""
    lines = []
    for color, (method, name, count, marker) in enumerate(
        ((plain_prony, "Prony", trials, "o"), (maximum_likelihood, "VARPRO", _fewer(trials), "s")), start=1
    ):
        y = 100.0 * np.array([accuracy(method, record, count).error for record in records])
        label = name if named else ""
        lines.append(Line(x=np.array(x), y=y, color=color, style=style, marker=marker, width=1.2, label=label))
    return lines


def _least(x: Sequence[float], records: Sequence[Record], *, style: str = "-", named: bool = False) -> Line:
    """The bound, %."""
    y = 100.0 * np.array([bound(record) for record in records])
    return Line(x=np.array(x), y=y, color=0, width=0.9, style=style, label="Cramér-Rao bound" if named else "")


def _over_rates(rates: Sequence[float], trials: int) -> Panel:
    """Over samples per period, for several numbers of samples."""
    lines = []
    for k, samples in enumerate((100, 1000)):
        records = [Record(per_period=rate, samples=samples) for rate in rates]
        lines += _curves(rates, records, trials, style=("-", "--")[k], named=k == 0)
        lines.append(_least(rates, records, style=("-", "--")[k], named=k == 0))
    title = f"noise {100 * NOISE:g} %; solid: 100 samples, dashed: 1000"
    return _panel("samples per period of the highest mode", title, rates, lines, log_x=False, named=True)


def _over_samples(trials: int) -> Panel:
    """Over the number of samples."""
    records = [Record(samples=n) for n in SAMPLES]
    lines = [*_curves(SAMPLES, records, trials), _least(SAMPLES, records)]
    return _panel("number of samples", f"noise {100 * NOISE:g} %, {RATE:g} samples per period", SAMPLES, lines)


def _over_noise(trials: int) -> Panel:
    """Over the noise."""
    records, x = [Record(noise=noise) for noise in NOISES], [100.0 * noise for noise in NOISES]
    lines = [*_curves(x, records, trials), _least(x, records)]
    return _panel("noise relative to a mode's amplitude, %", f"{USUAL} samples, {RATE:g} per period", x, lines)
