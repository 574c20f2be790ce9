"""Times of samples: on an even grid, rounded, scattered, with gaps, or of a clock whose rate wanders."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import scipy

from evolvent_base.errors import InputError

Array = np.ndarray

#: Largest distance of a time from the even grid, in steps.
UNEVEN = 0.01
#: Longest and shortest time between two samples, s; beyond, powers of times and rates leave the numbers.
LONGEST_STEP, SHORTEST_STEP = 1e12, 1e-12
#: Cells of the grid for each sample at most.
MOST_CELLS = 100
#: A step longer than so many may be a gap ...
GAP = 1.5
#: ... which the medians of so many deviations before and after it decide.
BESIDE = 25
#: Times follow no grid where so large a share of steps may be gaps, or where they scatter by so many steps, rms.
IRREGULAR, SCATTERED = 0.25, 0.6
#: Times that are equal to the one before are blocks where they are so many, and so large a share of all; else refused.
BLOCKS, BLOCK_SHARE = 10, 0.05
#: The largest block has so many times the samples of a usual one at most; a clock that stood still has more.
MOST_UNLIKE = 4.0
#: Largest number of stretches by which the wander of a clock is seen, and least number of samples in one.
STRETCHES, STRETCH = 64, 16
#: A clock wanders where a stretch's mean deviation exceeds that of the scatter so many times.
WANDER = 6.0
#: ... and where so many stretches or more are alike to their neighbours.
FOLLOW = 12
#: Times scatter where their rms distance from a smooth clock exceeds this share of UNEVEN.
SCATTER = 0.25
#: Steps that differ by less than this share are one; times from 1970 on in s are kept to 2e-7 s.
ALIKE = 1e-4
#: Rounds of constraints in the search for a grid at most.
MOST_CUTS = 60


class Times(NamedTuple):
    """What the times of samples are.

    Attributes
    ----------
    time : (N,) s, from 0: those of the grid where all differ from it by no more than their rounding, else as stated
    step : s, of the nearest grid
    origin : s, the stated time of the first sample
    place : (N,) int, cells of that grid; more than 1 apart over gaps
    grid : whether `time` is on it
    steady : (N,) s, the times without their scatter; None where they do not scatter
    notes : sentences on what the times are, none where they are even
    unsure : relative standard uncertainty of the step that rounded times leave open; else 0
    """

    time: Array
    step: float
    origin: float
    place: Array
    grid: bool
    steady: Array | None
    notes: tuple[str, ...]
    unsure: float = 0.0

    @property
    def even(self) -> bool:
        """Whether samples follow each other on the grid without gaps."""
        return self.grid and int(self.place[-1]) == len(self.place) - 1


def read_times(times: Array) -> Times:
    """What times (N,), s, are.

    Raises
    ------
    InputError
        Times that are not finite, fall, stand still, or are absurdly near or far apart.

    Notes
    -----
    Tried in this order: an even grid, without and with gaps; a grid whose times were rounded, by a constant, to
    significant digits or to 32 bits; and a line with gaps, from which a slow deviation is the wander of the clock and
    the rest a scatter.
    """
    times = np.asarray(times, dtype=float)
    notes: tuple[str, ...] = ()
    if _in_blocks(times):
        found = _rounded_grid(times)
        if found is not None:
            return found
        times, notes = _spread(times)
    check_times(times)
    length, origin = len(times), float(times[0])
    t = times - origin
    step, row = float(t[-1]) / (length - 1), np.arange(length)
    if float(np.abs(t - step * row).max()) <= UNEVEN * step:
        return Times(step * row, step, origin, row, True, None, notes)
    place = np.concatenate(([0], np.cumsum(np.maximum(np.rint(np.diff(t) / np.median(np.diff(t))), 1.0)))).astype(int)
    step = float(t[-1] / place[-1])
    if float(np.abs(t - step * place).max()) <= UNEVEN * step:
        _refuse_sparse(place, t)
        return Times(step * place, step, origin, place, True, None, (*notes, *_gaps(place, times, step)))
    found = _rounded_grid(times)
    if found is not None:
        return found._replace(notes=(*notes, *found.notes))
    place = _places(t, 0.0)
    _refuse_sparse(place, t)
    step = float(_line(place, t, np.ones(length))[0])
    steady, scattered = _deviation(t, place, min((float(q.max()) for q in _resolutions(times)), default=0.0))
    return Times(t, step, origin, place, False, steady, (*notes, *_gaps(place, times, step), *scattered))


def instead_of(times: Array, rate: float, whose: str, what: str) -> tuple[str, ...]:
    """A sentence where a rate, Hz, stands for times (N,), s, that it does not explain.

    Parameters
    ----------
    whose : of the times, such as "the column 't'"
    what : the rate, such as "signals.rate"
    """
    found = read_times(times)
    row = np.arange(len(times))
    off = found.time - row / rate
    most = float(np.ptp(off)) / 2.0
    if most <= UNEVEN * found.step:
        return ()
    part = max(1, len(times) // 4)
    error = float(np.abs((off[part:] - off[:-part]) * rate / part).max())
    why = "".join(f"; {note}" for note in found.notes)
    return (
        f"{what}, {rate:.6g} Hz, stands for the times of {whose}, which differ from it by up to {most:.3g} s: "
        f"frequencies may be off by {100.0 * error:.2g} %; leave it out to use these times{why}",
    )


def cells(time: Array, step: float) -> Array:
    """(N,) int, cells of an even grid from 0 that times are nearest to; several may be in one."""
    return np.rint(time / step).astype(int)


def check_rate(rate: float, what: str) -> None:
    """Refuse a sampling rate, Hz, that is absurdly low or high; `what` begins the sentence."""
    least, most = 1.0 / LONGEST_STEP, 1.0 / SHORTEST_STEP
    if not 0.999 * least <= rate <= 1.001 * most:
        raise InputError(f"{what} is {rate:.6g} samples a second; it must be between {least:g} and {most:g}")


def check_times(times: Array) -> None:
    """Refuse times (N,), s, that are not finite, do not rise, or are absurdly near or far apart."""
    infinite = np.flatnonzero(~np.isfinite(times))
    if infinite.size:
        raise InputError(
            f"{infinite.size} of {times.size} times are empty or not finite, the first at sample {infinite[0] + 1}; "
            "time must be finite and rise"
        )
    with np.errstate(over="ignore"):
        steps = np.diff(times)
    longest, median = float(np.abs(steps).max()), float(np.median(np.abs(steps)))
    if longest == 0.0:
        raise InputError(f"all {times.size} samples have the same time, {times[0]:.9g} s; time must be finite and rise")
    if longest > 1.001 * LONGEST_STEP or 0.0 < median < 0.999 * SHORTEST_STEP:
        apart = longest if longest > 1.001 * LONGEST_STEP else median
        raise InputError(
            f"the times of samples are {apart:.3g} s apart, where {SHORTEST_STEP:g} s to {LONGEST_STEP:g} s are "
            "allowed; check the unit of the time"
        )
    if np.any(steps <= 0.0):
        raise InputError(_falling(times, steps))


def _falling(times: Array, steps: Array) -> str:
    """What to say of times that do not rise."""
    back = np.flatnonzero(steps < 0.0)
    row = int(np.argmax(steps <= 0.0)) + 1
    said = (
        f"the time does not rise at sample {row + 1} ({times[row]:.12g} s after {times[row - 1]:.12g} s); time must be "
        "finite and rise"
    )
    if back.size > 1:
        return f"{said}, and it falls {back.size} times in all: sort the samples by their time, or split the file"
    if back.size == 0:
        equal = np.count_nonzero(steps == 0.0)
        return f"{said}: {equal} of {times.size} samples have the time of the one before; take doubled ones out"
    if np.any(times[back[0] + 2 : back[0] + 4] > times[back[0]]):
        return f"{said}: two samples there are out of order"
    return f"{said}: the clock started again there, or two recordings follow each other; evaluate the parts one by one"


def _refuse_sparse(place: Array, t: Array) -> None:
    if place[-1] > MOST_CELLS * len(place):
        wide = int(np.argmax(np.diff(place)))
        raise InputError(
            f"the time is not even: sample {wide + 2} is {t[wide + 1] - t[wide]:.6g} s after the one before, where "
            f"{np.median(np.diff(t)):.6g} s are usual; evaluate the parts one by one"
        )


# ------------------------------------------------------------------------------------------------ rounding


def _in_blocks(times: Array) -> bool:
    """Whether many times are equal to the one before, and none falls."""
    if not np.all(np.isfinite(times)):
        return False
    with np.errstate(over="ignore"):
        steps = np.diff(times)
    ends = np.flatnonzero(steps > 0.0)
    equal = steps.size - ends.size
    if np.any(steps < 0.0) or equal < max(BLOCKS, BLOCK_SHARE * len(times)) or ends.size < BLOCKS:
        return False
    sizes = np.diff(np.concatenate(([-1], ends, [steps.size])))
    return bool(sizes.max() <= MOST_UNLIKE * np.median(sizes))


def _spread(times: Array) -> tuple[Array, tuple[str, ...]]:
    """Times in which blocks of samples with equal stamps are spread; and what to say of it."""
    row = np.arange(len(times))
    # a stamp is that of the last sample of its block, as written when the block came in; the last block may be cut
    ends = np.flatnonzero(np.diff(times) > 0.0)
    step = float(times[ends[-1]] - times[ends[0]]) / float(ends[-1] - ends[0])
    found = np.interp(row, ends, times[ends])
    found[: ends[0]] = times[ends[0]] - step * (ends[0] - row[: ends[0]])
    found[ends[-1] :] = times[ends[-1]] + step * (row[ends[-1] :] - ends[-1])
    equal = len(times) - 1 - len(ends)
    return found, (
        f"{equal} of {len(times)} samples have the time of the one before, as where they are written in blocks: each "
        "time was taken as that of the last sample of its block, and the others spread evenly",
    )


def _rounded_grid(times: Array) -> Times | None:
    """The grid that explains all times by their rounding; None where there is none."""
    t = times - times[0]
    for resolution in _resolutions(times):
        place = _places(t, float(np.median(resolution)))
        if place[-1] > MOST_CELLS * len(place):
            continue
        steps = _steps_within(place, t, 0.5 * resolution + ALIKE * float(t[-1]) / len(t))
        if steps is None:
            continue
        step, half = 0.5 * (steps[1] + steps[0]), 0.5 * (steps[1] - steps[0])
        off = t - step * place
        first = 0.5 * float((off + 0.5 * resolution).min() + (off - 0.5 * resolution).max())
        q = float(resolution.max())
        unsure = half / (step * np.sqrt(3.0))  # all steps in between explain the times
        known = f", known to {100.0 * half / step:.1g} %" if unsure > 1e-6 else ""
        rounded = (
            f"the times are rounded, by up to {q:.3g} s ({100.0 * q / step:.3g} % of a step): samples are taken as "
            f"even, {1.0 / step:.8g} a second{known}"
        )
        notes = (*_gaps(place, times, step), rounded)
        return Times(step * place, step, float(times[0]) + first, place, True, None, notes, unsure)
    return None


def _steps_within(place: Array, t: Array, most: Array) -> tuple[float, float] | None:
    """The least and the largest step of grids that no time is off by more than `most` (N,); None where there is none.

    Notes
    -----
    Two linear programs in step and offset, with the constraints of the samples that are worst so far.
    """
    line, size = np.polyfit(place, t, 1), float(most.max())
    x, y, most = place / place[-1], (t - np.polyval(line, place)) / size, (1.0 + 1e-9) * most / size
    found = []
    for sign in (1.0, -1.0):
        rows = [0, len(t) - 1]
        for _ in range(MOST_CUTS):
            A = np.column_stack((x[rows], np.ones(len(rows))))
            limits = np.concatenate((y[rows] + most[rows], most[rows] - y[rows]))
            best = scipy.optimize.linprog([sign, 0.0], A_ub=np.vstack((A, -A)), b_ub=limits, bounds=(None, None))
            if best.x is None:
                return None
            excess = y - best.x[0] * x - best.x[1]
            high, low = int(np.argmax(excess - most)), int(np.argmin(excess + most))
            new = [k for k, over in ((high, excess[high]), (low, -excess[low])) if over > most[k] + 1e-9]
            if not new:
                break
            rows += new
        else:
            return None
        found.append(float(line[0] + best.x[0] * size / place[-1]))
    return found[0], found[1]


def _resolutions(times: Array) -> Iterator[Array]:
    """(N,) s, by how much times may be rounded: to multiples of a constant, to significant digits, to 32 bits."""
    tiny = 16.0 * np.finfo(float).eps * float(np.abs(times).max())
    steps = np.diff(times)
    merge = max(tiny, ALIKE * float(np.median(steps)))
    kinds = np.sort(steps)
    kinds = kinds[np.concatenate(([True], np.diff(kinds) > 4.0 * merge))]
    if kinds.size < max(4, len(times) // 4):
        q = float(np.min(np.concatenate((np.diff(kinds), kinds[kinds > 4.0 * merge])), initial=np.inf))
        if np.isfinite(q) and float(np.abs(steps - q * np.rint(steps / q)).max()) <= 8.0 * merge < 0.1 * q:
            yield np.full(len(times), q)
    size = np.floor(np.log10(np.maximum(np.abs(times), 1e-300)))
    for digits in range(4, 11):
        q = 10.0 ** (np.maximum(size, size.max() - 6.0) + 1.0 - digits)
        if float((np.abs(times - q * np.rint(times / q)) / q).max()) <= max(1e-6, tiny / float(q.min())):
            yield q
            break
    if np.array_equal(times.astype(np.float32).astype(float), times):
        yield np.spacing(np.abs(times).astype(np.float32)).astype(float)


# ------------------------------------------------------------------------------------------------ gaps


def _places(t: Array, resolution: float) -> Array:
    """(N,) int, cells of the nearest grid: a step is a gap where the times after it stay late.

    Notes
    -----
    A late stamp makes a long step as well, but the times after it are not late: the medians of the deviations before
    and after a long step tell them apart.
    """
    steps = np.diff(t)
    length = len(t)
    many = BESIDE if resolution > 0.1 * float(np.median(steps)) and length > 4 * BESIDE else 1
    step = float(np.median(t[many:] - t[:-many])) / many or float(t[-1]) / (length - 1)
    lost = np.zeros(length - 1, dtype=int)
    edges = wide = np.flatnonzero(steps > GAP * step + 1.001 * resolution)
    for _ in range(8):
        if wide.size > IRREGULAR * length:
            return np.arange(length)
        deviation = t - step * np.arange(length)
        before, lost = lost, np.zeros(length - 1, dtype=int)
        # the samples after the last edge, up to the next one
        bounds = np.concatenate(([-1], edges, [length - 1]))
        first, last = bounds[np.searchsorted(edges, wide)] + 1, bounds[np.searchsorted(edges, wide, side="right") + 1]
        back, on = wide[:, np.newaxis] - np.arange(BESIDE), wide[:, np.newaxis] + 1 + np.arange(BESIDE)
        early = np.where(back >= first[:, np.newaxis], deviation[np.maximum(back, 0)], np.nan)
        late = np.where(on <= last[:, np.newaxis], deviation[np.minimum(on, length - 1)], np.nan)
        jump = np.nanmedian(late, axis=1) - np.nanmedian(early, axis=1)
        lost[wide] = np.maximum(0.0, np.rint(jump / step)).astype(int)
        place = np.concatenate(([0], np.cumsum(1 + lost)))
        step = float(_line(place, t, np.ones(length))[0])
        if np.array_equal(lost, before):
            break
        edges, wide = np.flatnonzero(lost), np.flatnonzero(steps > GAP * step + 1.001 * resolution)
    return place


def _gaps(place: Array, times: Array, step: float) -> tuple[str, ...]:
    """A sentence on rows that are missing."""
    lost = np.diff(place) - 1
    if not lost.any():
        return ()
    k = int(np.argmax(lost))
    number = np.count_nonzero(lost)
    return (
        f"{lost.sum()} rows that are missing in the file are gaps: {number} in all, the longest of "
        f"{lost[k]} from {times[k]:.9g} to {times[k + 1]:.9g} s"
        if number > 1
        else f"{lost.sum()} rows that are missing in the file are gaps, from {times[k]:.9g} to {times[k + 1]:.9g} s",
    )


# ------------------------------------------------------------------------------------------------ deviation


def _line(place: Array, t: Array, resolution: Array) -> Array:
    """Slope and intercept of the times over cells, weighted by their resolution (N,)."""
    return np.asarray(np.polyfit(place, t, 1, w=1.0 / resolution))


def _deviation(t: Array, place: Array, resolution: float) -> tuple[Array | None, tuple[str, ...]]:
    """The times without their scatter, and sentences on the scatter and on a wandering clock."""
    length = len(t)
    line = _line(place, t, np.ones(length))
    step = float(line[0])
    off = t - np.polyval(line, place)
    parts = np.array_split(np.arange(length), max(1, min(STRETCHES, length // STRETCH)))
    mean = np.array([off[part].mean() for part in parts])
    within = np.concatenate(
        [off[part] - np.polyval(np.polyfit(place[part], off[part], 1), place[part]) for part in parts]
    )
    scatter = float(np.sqrt((within**2).sum() / (length - 2 * len(parts))))
    if scatter > SCATTERED * step:
        no_grid = f"the times follow no even grid: steps are {np.diff(t).min():.3g} to {np.diff(t).max():.3g} s long"
        return None, (f"{no_grid}, {1.0 / step:.6g} samples a second on average",)
    least = len(parts[-1])
    clear = max(WANDER * scatter / np.sqrt(least), UNEVEN * step, 0.5 * resolution)
    # means of a scatter that lasts over a few samples are large as well, but do not follow each other
    follow = len(parts) < FOLLOW or float((np.diff(mean) ** 2).sum()) < 1.4 * float((mean**2).sum())
    wanders = len(parts) >= 4 and float(np.abs(mean).max()) > clear and follow
    slow = np.zeros(length)
    said = []
    if wanders:
        slow, rate = _smooth(place, off, step)
        said.append(
            f"the clock wanders: the times deviate from even ones by up to {np.abs(slow).max():.3g} s, and the "
            f"sampling rate by {100.0 * rate:.2g} % of its mean of {1.0 / step:.6g} a second"
        )
    fast = off - slow
    rms, most = float(np.sqrt(np.mean(fast**2))), float(np.abs(fast).max())
    scatters = most > UNEVEN * step and rms > SCATTER * UNEVEN * step
    if scatters:
        said.append(
            f"the times scatter about {'a smooth clock' if wanders else f'even ones, {1.0 / step:.6g} a second'}, by "
            f"{rms:.3g} s rms ({100.0 * rms / step:.3g} % of a step) and {most:.3g} s at most"
        )
    steady = np.polyval(line, place) + slow
    usable = scatters and bool(np.all(np.diff(steady) > 0.0))
    return steady - steady[0] if usable else None, tuple(said)


def _smooth(place: Array, off: Array, step: float) -> tuple[Array, float]:
    """A slow deviation from even times (N,), and the largest change of the step by it, relative.

    Notes
    -----
    A cubic spline with as few intervals as the Bayesian information criterion asks for.
    """
    length, best, found = len(off), np.inf, None
    count = 1
    while count <= STRETCHES and length >= STRETCH * count:
        inner = place[np.linspace(0, length - 1, count + 1).astype(int)[1:-1]]
        knots = np.concatenate((np.full(4, place[0]), inner, np.full(4, place[-1]))).astype(float)
        spline = scipy.interpolate.make_lsq_spline(place.astype(float), off, knots)
        square = float(np.mean((off - spline(place)) ** 2)) + (1e-4 * step) ** 2
        criterion = length * np.log(square) + (count + 3) * np.log(length)
        if criterion < best:
            best, found = criterion, spline
        count *= 2
    assert found is not None
    return np.asarray(found(place)), float(np.abs(found.derivative()(place)).max()) / step
