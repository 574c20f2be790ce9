"""Accuracy of Prony's method over samples per period, number of samples and noise, with VARPRO compared.

Frequencies of undamped modes, and decrements of damped ones: delta of exp(-delta t) is called so in the paper.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from evolvent_base.errors import InputError
from evolvent_base.figures import Figure, Line, Panel
from evolvent_massprops.identification import IdentifiedModes, cramer_rao, prony, varpro
from evolvent_papers.papers import Made, Options
from evolvent_papers.papers.stand import grid
from evolvent_papers.papers.winding import markdown

#: Samples per period of the highest mode; those of the table, and those between them in the figure.
TABLE_RATES = (2.1, 2.4, 2.7, 3.0, 4.0, 6.0, 9.0)
RATES = (2.05, 2.1, 2.2, 2.3, 2.4, 2.5, 2.6, 2.7, 2.8, 3.0, 3.5, 4.0, 5.0, 6.0, 7.0, 9.0)
#: Numbers of samples, and standard deviations of the noise as shares of a mode's amplitude.
SAMPLES, NOISES = (50, 100, 200, 500, 1000), (1e-5, 1e-4, 1e-3, 3e-3, 1e-2, 3e-2)
#: The paper's accuracy, and the usual number of samples, noise, and samples per period.
CLAIMED, USUAL, NOISE, RATE = 1e-5, 100, 0.01, 2.5
#: Damping ratios at which decrements are measured; the decrement of a mode is its ratio times its frequency.
DAMPINGS = (0.002, 0.01)
#: Random records a point: in full and of the quick form.
TRIALS, QUICK_TRIALS = 200, 20
SEED = 1
#: Modes from samples (n,) and their rate, Hz.
Method = Callable[[np.ndarray, float], IdentifiedModes]
HEAD = (
    "damping ratio", "samples a period", "Prony, %", "without result", "VARPRO, %", "least that is possible, %",
)  # fmt: skip
NOTE = f"""\
Sensor 1 of the stand without offset: three modes of one amplitude at {{0}} rad/s.
{USUAL} samples with normal white noise of {100 * NOISE:g} % of that amplitude, {{1}} records. Error: root of the mean
square of the relative error of the worst mode, of the records in which the method finds three modes: of the frequency
of undamped modes, of the decrement of damped ones. Least that is possible: Cramér-Rao bound. The paper's accuracy of
both is {100 * CLAIMED:g} %.
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
    damping : float, damping ratio of the modes
    """

    per_period: float = RATE
    samples: int = USUAL
    noise: float = NOISE
    amplitudes: tuple[float, float, float] = (1.0, 1.0, 1.0)
    uniform: bool = False
    damping: float = 0.0

    @property
    def decrements(self) -> np.ndarray:
        """(3,) 1/s, of the modes."""
        return self.damping * frequencies()

    @property
    def rate(self) -> float:
        """Samples a second, Hz."""
        return float(frequencies()[-1]) * self.per_period / (2.0 * np.pi)

    def data(self, trials: int) -> np.ndarray:
        """(trials, samples) seeded random records."""
        time = np.arange(self.samples)[:, None] / self.rate
        clean = (np.exp(-self.decrements * time) * np.cos(frequencies() * time)) @ np.array(self.amplitudes)
        random, size = np.random.default_rng(SEED), (trials, self.samples)
        return clean + self.noise * (random.uniform(-1.0, 1.0, size) if self.uniform else random.standard_normal(size))


class Accuracy(NamedTuple):
    """Errors of a method over random records.

    Attributes
    ----------
    error : float, root of the mean square of the relative error of the worst frequency; nan where there is no result
    failed : float, share of the records in which the method finds no three modes
    decrement : float, as `error`, of the worst decrement; nan of undamped modes
    """

    error: float
    failed: float
    decrement: float


@functools.cache
def frequencies() -> np.ndarray:
    """(3,) rad/s, of the stand without offset; the amplitudes at sensor 1 are equal."""
    over = grid()
    return np.asarray(over.modes(0.0, 0.0).natural_frequency)


def plain_prony(data: np.ndarray, rate: float) -> IdentifiedModes:
    """Prony's method on all samples."""
    return prony(data, 3, rate=rate, samples_per_period=None)


def maximum_likelihood(data: np.ndarray, rate: float) -> IdentifiedModes:
    """VARPRO on all samples."""
    return varpro(data, 3, rate=rate)


def errors(method: Method, record: Record, trials: int) -> np.ndarray:
    """(2, n, 3) relative errors of frequencies and decrements over so many records of sensor 1, of those with a result.

    Those of decrements are nan of undamped modes.
    """
    found = []
    for data in record.data(trials):
        try:
            modes = method(data, record.rate)
        except InputError:
            continue
        order = np.argsort(modes.frequency)
        found.append((modes.frequency[order], modes.decay_rate[order]))
    true = np.array([frequencies(), record.decrements if record.damping else np.full(3, np.nan)])
    return (np.array(found).reshape(-1, 2, 3) / true - 1.0).transpose(1, 0, 2)


def accuracy(method: Method, record: Record, trials: int) -> Accuracy:
    """Errors of a method over so many records."""
    found = errors(method, record, trials)
    if not found.size:
        return Accuracy(float("nan"), 1.0, float("nan"))
    worst = np.sqrt(np.mean(np.square(found), axis=1)).max(axis=1)
    return Accuracy(float(worst[0]), 1.0 - found.shape[1] / trials, float(worst[1]))


def bounds(record: Record) -> np.ndarray:
    """(2, 3) Cramér-Rao bounds of the relative errors of frequencies and decrements, nan of undamped modes."""
    amplitudes, length = np.array(record.amplitudes), record.samples
    w, delta = frequencies(), record.decrements
    covariance = cramer_rao(w, delta, amplitudes, rate=record.rate, length=length, noise=record.noise)
    deviations = np.sqrt(np.diag(covariance)).reshape(2, 3)
    return np.asarray(deviations / np.array([w, delta if record.damping else np.full(3, np.nan)]))


def bound(record: Record) -> float:
    """Cramér-Rao bound of the relative error of the worst frequency."""
    return float(bounds(record)[0].max())


def single_mode_bounds(record: Record) -> np.ndarray:
    """(3,) Cramér-Rao bounds of the relative errors of the decrements, of each mode as if it were alone; closed form.

    Notes
    -----
    Of a damped cosine of amplitude A that swings often in the record, in white noise of the deviation s:
    var(delta) = 2 s^2 / (A^2 sum w (t - t_w)^2), w = exp(-2 delta t), t_w = sum w t / sum w.
    """
    time, delta = np.arange(record.samples)[:, None] / record.rate, record.decrements
    weight = np.exp(-2.0 * delta * time)
    middle = (weight * time).sum(axis=0) / weight.sum(axis=0)
    spread = (weight * np.square(time - middle)).sum(axis=0)
    return np.asarray(record.noise * np.sqrt(2.0 / spread) / (np.array(record.amplitudes) * delta))


def figure_prony(options: Options) -> Made:
    """Errors of the worst frequency and of the worst decrement over samples per period, samples and noise."""
    trials = QUICK_TRIALS if options.quick else TRIALS
    rates = TABLE_RATES if options.quick else RATES
    options.report(f"{trials} records a point")
    panels = [_over_rates(rates, trials), _over_samples(trials), _over_noise(trials), *_of_decrements(rates, trials)]
    rows = []
    for damping in (0.0, *DAMPINGS):
        rows += [_row(Record(per_period=rate, damping=damping), trials) for rate in TABLE_RATES]
    listed = ", ".join(f"{w:.3f}" for w in frequencies())
    text = f"{NOTE.format(listed, trials)}\n{markdown(HEAD, rows)}"
    title = (
        "Errors of frequencies (above, undamped modes) and of decrements (below, damped ones) by Prony's method and by "
        "VARPRO; claimed by Belyakov 2002 for both: 0.001 %"
    )
    figure = Figure(name="stand-prony", title=title, panels=panels, columns=3, height=176.0)
    return Made(text=text, figure=figure)


def _row(record: Record, trials: int) -> list[str]:
    """A row of the table: errors of the frequencies of undamped modes, of the decrements of damped ones."""
    first, second = accuracy(plain_prony, record, trials), accuracy(maximum_likelihood, record, _fewer(trials))
    values = [100.0 * value for value in (_error(first), _error(second), _least_error(record))]
    prony_error, *others = (f"{value:.2g}" for value in values)
    damping = f"{record.damping:g}" if record.damping else "0 (frequency)"
    return [damping, f"{record.per_period:g}", prony_error, f"{100 * first.failed:.0f} %", *others]


def _error(found: Accuracy) -> float:
    """Error of the decrement of damped modes, of the frequency of undamped ones."""
    return found.error if np.isnan(found.decrement) else found.decrement


def _least_error(record: Record) -> float:
    """The bound of the same."""
    return float(bounds(record)[1 if record.damping else 0].max())


def _panel(
    x_label: str, title: str, x: Sequence[float], lines: list[Line], *, of: str = "frequency", **look: bool
) -> Panel:
    ends = np.array([x[0], x[-1]])
    label = "the paper's accuracy" if look.pop("named", False) else ""
    claimed = Line(x=ends, y=np.full(2, 100.0 * CLAIMED), style=":", color="gray", label=label)
    log_x = look.pop("log_x", True)
    y_label = f"error of the worst {of}, %"
    return Panel(x_label=x_label, y_label=y_label, lines=[*lines, claimed], title=title, log=True, log_x=log_x)


def _fewer(trials: int) -> int:
    """Number of records for VARPRO, whose error needs fewer to be known and which takes longer."""
    return max(trials // 4, 10)


def _curves(
    x: Sequence[float], records: Sequence[Record], trials: int, *, style: str = "-", named: bool = False
) -> list[Line]:
    """Errors of both methods, %, and the bound."""
    lines = []
    for color, (method, name, count, marker) in enumerate(
        ((plain_prony, "Prony", trials, "o"), (maximum_likelihood, "VARPRO", _fewer(trials), "s")), start=1
    ):
        y = 100.0 * np.array([_error(accuracy(method, record, count)) for record in records])
        label = name if named else ""
        lines.append(Line(x=np.array(x), y=y, color=color, style=style, marker=marker, width=1.2, label=label))
    least = 100.0 * np.array([_least_error(record) for record in records])
    label = "Cramér-Rao bound" if named else ""
    return [*lines, Line(x=np.array(x), y=least, color=0, width=0.9, style=style, label=label)]


PER_PERIOD = "samples per period of the highest mode"
OF_NOISE = "noise relative to a mode's amplitude, %"


def _over_rates(rates: Sequence[float], trials: int) -> Panel:
    """Over samples per period, for several numbers of samples."""
    lines = []
    for k, samples in enumerate((100, 1000)):
        records = [Record(per_period=rate, samples=samples) for rate in rates]
        lines += _curves(rates, records, trials, style=("-", "--")[k], named=k == 0)
    title = f"noise {100 * NOISE:g} %; solid: 100 samples, dashed: 1000"
    return _panel(PER_PERIOD, title, rates, lines, log_x=False, named=True)


def _over_samples(trials: int) -> Panel:
    """Over the number of samples."""
    lines = _curves(SAMPLES, [Record(samples=n) for n in SAMPLES], trials)
    return _panel("number of samples", f"noise {100 * NOISE:g} %, {RATE:g} samples per period", SAMPLES, lines)


def _over_noise(trials: int) -> Panel:
    """Over the noise."""
    x = [100.0 * noise for noise in NOISES]
    lines = _curves(x, [Record(noise=noise) for noise in NOISES], trials)
    return _panel(OF_NOISE, f"{USUAL} samples, {RATE:g} per period", x, lines)


def _of_decrements(rates: Sequence[float], trials: int) -> list[Panel]:
    """The same three for the decrements of damped modes."""
    low, high = DAMPINGS
    over: list[tuple[str, Sequence[float], list[Record], str]] = [
        (PER_PERIOD, rates, [Record(per_period=rate) for rate in rates], f"noise {100 * NOISE:g} %, {USUAL} samples"),
        ("number of samples", SAMPLES, [Record(samples=n) for n in SAMPLES],
         f"noise {100 * NOISE:g} %, {RATE:g} samples per period"),
        (OF_NOISE, [100.0 * noise for noise in NOISES], [Record(noise=noise) for noise in NOISES],
         f"{USUAL} samples, {RATE:g} per period"),
    ]  # fmt: skip
    panels = []
    for x_label, x, records, title in over:
        lines = []
        for damping, style in ((low, "-"), (high, "--")):
            damped = [record._replace(damping=damping) for record in records]
            lines += _curves(x, damped, trials, style=style)
        title = f"{title}; damping ratio solid: {low:g}, dashed: {high:g}"
        panels.append(_panel(x_label, title, x, lines, of="decrement", log_x=x_label != PER_PERIOD))
    return panels
