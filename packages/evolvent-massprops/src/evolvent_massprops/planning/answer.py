"""A planned measurement as an answer: what is recommended, what was compared, what limits it."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from evolvent_base import answer as an
from evolvent_base.figures import Figure, Line, Panel
from evolvent_base.showing import Shown
from evolvent_massprops.rounding import shown
from evolvent_massprops.spring_keys import CALIBRATED

if TYPE_CHECKING:
    from evolvent_massprops.planning.calibration import Calibration, Need
    from evolvent_massprops.planning.expected import Option
    from evolvent_massprops.planning.mountings import Further, MountingSet
    from evolvent_massprops.planning.predictions import Mode
    from evolvent_massprops.planning.rules import Rule

#: Inputs that are shown, and quantities of which each has its column.
_MOST_ROWS, _MOST_QUANTITIES = 6, 3


def answer_of(found: MeasurementPlan) -> an.Answer:
    """What is recommended, what was compared, what limits it, the paper's rules, and a figure of `curves`."""
    figures: list[an.Block] = [] if found.curves is None else [_figure(*found.curves, found)]
    best, several = found.best, len(found.names) > 1
    record = f"{best.duration:.3g} s at {best.rate:.4g} Hz ({best.samples} samples)"
    verdict = f"release the pull at {best.label} and record {record}"
    if several:
        verdict = f"make {len(found.names)} recordings, each of {record}"
    if not best.reached:
        verdict = f"{100.0 * found.wanted:.3g} % is not reached; nearest: {verdict}"
    options = (("pulls", found.pulls), ("rates", found.rates), ("sensors", found.sensors))
    sets = [(", ".join(one.names), one.option) for one in found.sets]
    further = [(one.rotation, one.option) for one in found.further]
    floor = [(label, f"{100.0 * share:.3g} %") for label, share in found.floor]
    tables = [
        *([_recordings(found)] if several else []),
        _expected(found),
        *(_options(title, listed) for title, listed in options if len(listed) > 1),
        _mountings("mountings that suffice", "recordings with the body", sets),
        _mountings("one mounting more, each recording as long", "rotation", further),
        _modes(found),
        an.Table(heads=("", "part of U, over the value"), rows=floor[:_MOST_ROWS],
                 title="what a longer record does not improve"),
        _needs(found),
        _calibrations(found),
        an.Table(heads=("", "asks", "the bound gives", "holds"),
                 rows=[(rule.name, rule.asks, rule.finds, rule.verdict) for rule in found.rules],
                 title="the paper's rules and the Cramér-Rao bound"),
    ]  # fmt: skip
    return an.Answer(
        title="Plan of a measurement",
        heads=[verdict, f"U (k = {found.factor:g}) over the value; in brackets what the noise alone gives"],
        sections=[an.Section(title="", blocks=[one]) for one in (*tables, *figures)],
        warnings=found.warnings,
    )


def _expected(found: MeasurementPlan) -> an.Table:
    """Every quantity that is asked, with the uncertainties of the recommended plan."""
    best = found.best
    rows = []
    for key, value, std, unit, share, noise in zip(
        best.keys, best.values, best.std, found.units, best.relative, best.noise, strict=True
    ):
        relative = ["-" if math.isnan(x) else f"{100.0 * x:.3g} %" for x in (share, noise)]
        rows.append((key, f"{value:.6g}", f"{found.factor * std:.3g}", unit, *relative))
    heads = ("", "expected", "U", "unit", "over the value", "by noise alone")
    return an.Table(heads=heads, rows=rows, title="what it gives")


def _recordings(found: MeasurementPlan) -> an.Table:
    """How the body is mounted and set swinging in each of several recordings."""
    rows = [
        (name, rotation, pull.label, f"{pull.least:.3g}")
        for name, rotation, pull in zip(found.names, found.rotations, found.best.pulls, strict=True)
    ]
    return an.Table(heads=("", "rotation", "pull", "least energy J"), rows=rows, title="recordings")


def _modes(found: MeasurementPlan) -> an.Table:
    """The modes of every recording as they will be identified."""
    heads = ("", "frequency rad/s", "decay rate 1/s", "damping ratio", "energy J", "amplitude mm")
    last, rows = None, []
    for k, m in enumerate(found.modes):
        first = f"mode {k + 1}" if not m.recording else "" if m.recording == last else m.recording
        last = m.recording
        rows.append((
            first, shown(m.frequency, m.frequency_std), shown(m.decay_rate, m.decay_rate_std),
            shown(m.damping_ratio, m.damping_ratio_std), f"{m.energy:.3g}", f"{1e3 * m.amplitude:.3g}",
        ))  # fmt: skip
    return an.Table(heads=heads, rows=rows, title="modes")


def _needs(found: MeasurementPlan) -> an.Table:
    """How well the stand has to be known, and other inputs that count."""
    rows = []
    title = f"u that {100.0 * found.wanted:.3g} % needs, with the others as stated, and with all else exact"
    for one in found.needs[: len(CALIBRATED) + _MOST_ROWS]:
        stated = f"{one.std:.3g}" if one.std else "exact"
        part = f"{100.0 * one.part:.3g} %" if one.std else "-"
        needed = f"{one.needed:.3g}" if one.needed > 0.0 else "not by it alone"
        rows.append((one.key, f"{one.value:.6g}", stated, part, needed, f"{one.alone:.3g}", one.unit))
    heads = ("", "value", "u stated", "part of U", "needed", "all else exact", "unit")
    return an.Table(heads=heads, rows=rows, title=title)


def _calibrations(found: MeasurementPlan) -> an.Table:
    """What ways of calibrating the stand give."""
    rows = []
    for one in found.calibrations:
        worst = f"{100.0 * one.option.worst:.3g} %" if math.isfinite(one.option.worst) else "-"
        cells = ["-" if math.isnan(one.std[key]) else f"{100.0 * one.std[key]:.2g} %" for key in CALIBRATED]
        text = one.option.reason.removeprefix("the data do not determine the unknowns: ")
        rows.append((one.label, worst, *cells, text or ("reached" if one.option.reached else "not reached")))
    title = "half-length a, half-width b and mean stiffness k, calibrated"
    return an.Table(heads=("", "largest U", "u(a)/a", "u(b)/b", "u(k)/k", ""), rows=rows, title=title)


def _mountings(title: str, head: str, of: list[tuple[str, Option]]) -> an.Table:
    """The largest uncertainty with some recordings, or what they leave open."""
    rows = []
    for label, option in of:
        text = option.reason.removeprefix("the data do not determine the unknowns: ")
        text = re.sub(r"; \d mountings? of the body (is|are) recorded.*", "", text)
        worst = f"{100.0 * option.worst:.3g} %" if math.isfinite(option.worst) else "-"
        rows.append((label, worst, text or ("reached" if option.reached else "not reached")))
    return an.Table(heads=(head, "largest U, over the value", ""), rows=rows, title=title)


def _options(title: str, options: tuple[Option, ...]) -> an.Table:
    """Options one below the other; of more than a few quantities that of the largest uncertainty."""
    keys = next((o.keys for o in options if o.keys), ())
    few = len(keys) <= _MOST_QUANTITIES
    energy = ("least energy J",) if title == "pulls" else ()
    heads, rows = ("", *energy, "record s", "rate Hz", *(keys if few else ("largest",))), []
    for o in options:
        first = {"pulls": o.label, "rates": f"{o.samples} samples"}.get(
            title, "sensors " + " ".join(map(str, o.sensors))
        )
        cells = [
            "-" if math.isnan(r) else f"{100.0 * r:.3g} % ({100.0 * n:.2g} %)"
            for r, n in zip(o.relative, o.noise, strict=True)
        ]
        if cells and not few:
            worst = max(range(len(cells)), key=lambda k: -1.0 if math.isnan(o.relative[k]) else o.relative[k])
            cells = [f"{keys[worst]} {cells[worst]}"]
        length = f"{o.duration:.3g}" + ("" if o.reached else " at most")
        least = (f"{o.pulls[0].least:.3g}",) if energy else ()
        rows.append((first, *least, length, f"{o.rate:.4g}", *(cells or [o.reason])))
    return an.Table(heads=heads, rows=rows, title=title)


def _figure(duration: np.ndarray, worst: np.ndarray, labels: Sequence[str], found: MeasurementPlan) -> Figure:
    """Largest relative uncertainty over the length of the record (n,), of every pull (pulls, n)."""
    lines = [
        Line(x=duration, y=100.0 * row, label=label, color=k, width=1.0)
        for k, (row, label) in enumerate(zip(worst, labels, strict=True))
    ]
    wanted = Line(x=duration[[0, -1]], y=np.full(2, 100.0 * found.wanted), label="wanted", color="gray", width=0.8)
    label = f"largest expanded uncertainty (k = {found.factor:g}), %"
    panel = Panel(x_label="length of the record, s", y_label=label, lines=[*lines, wanted], log_x=True, log=True)
    return Figure(name="plan", title="Uncertainty over the length of the record", panels=[panel], columns=1)


class Curves(NamedTuple):
    """Uncertainty over the length of the record, of every pull of one recording, or of the pulls chosen for several.

    Attributes
    ----------
    duration : (points,) float, s
    worst : (pulls, points) float, largest relative expanded uncertainty; NaN where there is none
    labels : tuple of str, of the pulls
    """

    duration: np.ndarray
    worst: np.ndarray
    labels: tuple[str, ...]


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class MeasurementPlan(Shown):
    """A planned measurement.

    Attributes
    ----------
    wanted : float, relative expanded uncertainty
    factor : float, coverage factor k
    best : Option, the recommended one
    names : tuple of str, of the recordings; "" of the only one
    pulls : tuple of Option, of one recording: the pulls at the rate of `best`, all sensors
    rates : tuple of Option, with the best pulls, all sensors
    sensors : tuple of Option, with the best pulls and fewer and fewer sensors
    sets : tuple of MountingSet, of several mountings: the best of each number of them
    further : tuple of Further, what one more mounting would give, the best first
    modes : tuple of Mode, what `best` gives of the modes
    units : tuple of str, of the quantities of `best`
    rotations : tuple of str, of the body in the recordings, in words
    needs : tuple of Need, how well half-length, half-width, stiffness and other inputs have to be known
    calibrations : tuple of Calibration, what calibrating the stand gives
    floor : tuple of (label, relative contribution), largest first: what a longer record does not improve
    rules : tuple of Rule
    warnings : tuple of str
    curves : Curves, uncertainty over the length of the record, which the figure shows; None where it was not asked for
    """

    named = "plans"

    wanted: float
    factor: float
    best: Option
    names: tuple[str, ...]
    pulls: tuple[Option, ...]
    rates: tuple[Option, ...]
    sensors: tuple[Option, ...]
    sets: tuple[MountingSet, ...]
    further: tuple[Further, ...]
    modes: tuple[Mode, ...]
    units: tuple[str, ...]
    rotations: tuple[str, ...]
    needs: tuple[Need, ...]
    calibrations: tuple[Calibration, ...]
    floor: tuple[tuple[str, float], ...]
    rules: tuple[Rule, ...]
    warnings: tuple[str, ...]
    curves: Curves | None = None

    def answer(self) -> an.Answer:
        """What is recommended, what was compared, what limits it, the paper's rules, and the figure of `curves`."""
        return answer_of(self)
