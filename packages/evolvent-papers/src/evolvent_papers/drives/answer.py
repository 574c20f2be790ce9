"""A designed drive as an answer: measures beside bounds, models of the blade, corners, a figure."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy

from evolvent import cases
from evolvent_base import answer as an
from evolvent_base.figures import Figure, Line, Panel, stacked
from evolvent_base.showing import Shown
from evolvent_papers.drives import motion as mo
from evolvent_papers.drives.bounds import DriveTask

Array = np.ndarray
#: Words, unit and factor to it of each measure.
WORDS = {
    "peak_lag": ("peak lag", "deg", np.degrees(1.0)),
    "tip_swing": ("residual swing of the tip", "deg", np.degrees(1.0)),
    "spool_swing": ("residual swing at the spool", "deg", np.degrees(1.0)),
    "lag_rate": ("rate of the lag", "deg/s", np.degrees(1.0)),
    "tension": ("tension at the spool", "mN", 1e3),
    "spool_torque": ("torque on the spool", "mN m", 1e3),
}


#: Heads of lags.
_LAGS = ("peak lag, deg", "swing of the tip, deg", "swing at the spool, deg")


def answer_of(found: Design) -> an.Answer:
    """Measures beside bounds, models of the blade, corners, a figure and a file."""
    last = ("worst corner",) if found.corners else ()
    missed = text(found)
    tables = {
        "Designed drive": (("", "bound", "constant rate", "designed", "other models", *last), rows(found)),
        "Models of the blade": (("segments", *_LAGS), models(found)),
        "Errors of inertia and spin": (("inertia", "spin", *_LAGS), corners(found)),
    }
    first = "A designed drive; " + (f"bounds not met: {missed}" if missed else "all bounds are met")
    return an.Answer(
        title="Designed drive of the spools", warnings=[f"bounds are not met: {missed}"] if missed else [],
        sections=[
            *(an.Section(title=title, blocks=[an.Table(heads=heads, rows=of)])
              for title, (heads, of) in tables.items()),
            an.Section(title="Drive", blocks=[figure(found)], level=an.PAGE),
        ],
        files={"drive.yaml": lambda: f"# {first}\n{cases.dump(found.content)}"},
    )  # fmt: skip


def rows(found: Design) -> list[tuple[str, ...]]:
    """Rows of a table: measure, bound, constant rate, this drive, largest of all models, worst corner."""
    columns = [found.constant.measures(), found.nominal.measures(), found.largest]
    corners = [one.measures() for one in found.corners.values()]
    table = []
    for key, (words, unit, factor) in WORDS.items():
        bound = getattr(found.task.bounds, mo.BOUND_OF[key])
        values = [getattr(one, key) for one in columns]
        values += [max(getattr(one, key) for one in corners)] if corners else []
        cells = [f"{factor * value:.4g}" for value in values]
        table.append((f"{words}, {unit}", "-" if bound is None else f"{factor * bound:.4g}", *cells))
    times = [found.task.constant_time, *[found.end] * (len(columns) - 1 + bool(corners))]
    bound = found.task.bounds.time or found.end
    table.append(("time, s", f"{bound:.4g}", *(f"{value:.4g}" for value in times)))
    return table


def text(found: Design) -> str:
    """What the bounds are missed by and the corners whose runs failed, one sentence; '' where all are met."""
    parts = []
    for key, value, bound in found.missed():
        words, unit, factor = WORDS[key]
        parts.append(f"{words} {factor * value:.4g} {unit}, {factor * (value - bound):.2g} above {factor * bound:.4g}")
    for factors, one in found.corners.items():
        if one.failed:
            inertia, spin = (f"{100.0 * (factor - 1.0):+.3g} %" for factor in factors)
            parts.append(f"the run with inertia {inertia}, spin {spin} failed: {one.failed}")
    return "; ".join(parts)


def models(found: Design) -> list[tuple[str, ...]]:
    """Rows of a table: model of the blade, peak lag, residual swing of the tip and at the spool in degrees."""
    all_models = {f"{found.task.case.blade.nodes} links": found.nominal, **found.others}
    return [(name, *_degrees(one.measures())) for name, one in all_models.items()]


def _degrees(of: mo.Measures) -> tuple[str, str, str]:
    """Peak lag and both swings in degrees."""
    return f"{np.degrees(of.peak_lag):.4g}", f"{np.degrees(of.tip_swing):.3g}", f"{np.degrees(of.spool_swing):.3g}"


def corners(found: Design) -> list[tuple[str, ...]]:
    """Rows of a table: inertia, spin, peak lag, residual swing of the tip and at the spool in degrees."""
    return [
        (f"{100.0 * (inertia - 1.0):+.3g} %", f"{100.0 * (spin - 1.0):+.3g} %", *_degrees(one.measures()))
        for (inertia, spin), one in found.corners.items()
    ]


def figure(found: Design) -> Figure:
    """Rate of the spools, lag of the tip under it and under the constant rate, and the lag at the corners."""
    one, constant = found.nominal, found.constant
    fine = np.linspace(0.0, float(one.time[-1]), 1001)
    rate = [Line(x=fine, y=rates(found, fine), label="designed")]
    steps = np.array([0.0, 0.0, 1.0, 1.0]) * found.task.constant_time
    rate.append(
        Line(x=steps, y=np.array([0.0, 1.0, 1.0, 0.0]) * found.task.rate, label="constant", color=1, style="--")
    )
    lags = [Line(x=one.time, y=np.degrees(one.lag), label="designed, tip")]
    lags.append(
        Line(x=constant.time, y=np.degrees(constant.lag), label="constant, tip", color=1, style="--", width=1.0)
    )
    after, words = one.ended, "designed, at the spool after the stop"
    lags.append(Line(x=one.time[after], y=np.degrees(one.spool_lag[after]), label=words, color=2, width=0.8))
    bound = np.degrees(found.task.bounds.peak_lag or np.nan) * np.sign(found.task.rate)
    lags.append(Line(x=one.time[[0, -1]], y=np.full(2, bound), label="bound", color="gray", width=0.8))
    panels = [
        Panel(x_label="time, s", y_label="rate of the spools, rad/s", lines=rate),
        Panel(x_label="time, s", y_label="lag, deg", lines=lags),
    ]
    if found.corners:
        panels.append(
            Panel(x_label="time, s", y_label="lag of the tip, deg", lines=_corner_lines(found), title="corners")
        )
    title = "Designed drive of the spools"
    return Figure(name="drive", title=title, panels=panels, height=stacked(len(panels)), columns=1)


def _corner_lines(found: Design) -> list[Line]:
    lines = []
    for k, ((inertia, spin), one) in enumerate(found.corners.items()):
        label = f"inertia {100.0 * (inertia - 1.0):+.0f} %, spin {100.0 * (spin - 1.0):+.0f} %"
        lines.append(Line(x=one.time, y=np.degrees(one.lag), label=label, color=k, width=1.0))
    return lines


def rates(found: Design, time: mo.Array) -> mo.Array:
    """Rate of the spools at times, rad/s."""
    at, rate = np.array(found.table).T
    return np.where(time <= at[-1], scipy.interpolate.PchipInterpolator(at, rate)(np.minimum(time, at[-1])), 0.0)


@dataclasses.dataclass(frozen=True)
class Design(Shown):
    """A drive that was found.

    Attributes
    ----------
    task : DriveTask, what was asked
    table : list of (time s, rate rad/s) rows
    end : float, s
    nominal, constant : Motion, under this drive, and under the constant rate that starts and stops at once
    others : mapping, name -> Motion, of other models of the blade: more nodes, and springs where the case has them
    corners : mapping, (factor of the inertia, factor of the spin) -> Motion
    evaluations : int, runs of the search
    """

    task: DriveTask
    table: list[list[float]]
    end: float
    nominal: mo.Motion
    constant: mo.Motion
    others: Mapping[str, mo.Motion]
    corners: Mapping[tuple[float, float], mo.Motion]
    evaluations: int

    named = "drives"
    endings = (".yaml",)

    def answer(self) -> an.Answer:
        """Measures beside bounds, models of the blade, corners, a figure and a file."""
        return answer_of(self)

    @property
    def largest(self) -> mo.Measures:
        """The largest values of all models of the blade."""
        models = [one.measures() for one in (self.nominal, *self.others.values())]
        return mo.Measures(*map(max, zip(*models, strict=True)))

    def missed(self) -> list[tuple[str, float, float]]:
        """Bounds that are not met by one of the models: (key of the measure, largest value, bound)."""
        found = zip(mo.Measures._fields, self.largest, strict=True)
        given = ((key, value, getattr(self.task.bounds, mo.BOUND_OF[key])) for key, value in found)
        return [(key, value, bound) for key, value, bound in given if bound is not None and value > bound]

    @property
    def content(self) -> dict[str, Any]:
        """The case with the drive, as a file holds it."""
        given = mo.table_keys(self.table) | {"solver.duration": round(self.end + mo.after(self.task), 3)}
        return cases.written(cases.load(self.task.case.model_dump(mode="json"), given))
