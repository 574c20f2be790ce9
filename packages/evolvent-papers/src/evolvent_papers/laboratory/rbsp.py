"""Wire booms of a spinning spacecraft: spin rates after each step of a flight log, by straight radial wires.

The spheres' mass and the wires' density, in proportion to the spacecraft's moment of inertia, are fitted to a log, and
spin rates that were not fitted are predicted, from the logged rate at the start of their group of steps: of the log of
the package those of the last group, by a fit to the groups before; of another log (`--data`) those of all groups, by a
fit to that of the package. A group whose first row has other clicks of the motor than strokes begins at a length that
the log does not hold: it is that by the clicks in predictions, with its uncertainty in their bands, and it is fitted,
and stated beside the log's.

Source: comments of rbsp_efw_boom_deploy_history.pro in the public repository spedas/bleeding_edge (MIT licence).
"""

from __future__ import annotations

import dataclasses
import functools
import math
import os
import pathlib
import tempfile
from collections.abc import Mapping
from typing import Any

import numpy as np

from evolvent import cases
from evolvent.design import calibration
from evolvent_base.errors import InputError
from evolvent_base.figures import Figure, Line, Panel
from evolvent_papers.laboratory import book
from evolvent_papers.laboratory.book import Array, Budget, Comparison, Contribution, NoSettings, Set, Verdict, rms
from evolvent_papers.wire_booms import SYSTEM, Case, closed_form, inertia, log
from evolvent_papers.wire_booms.structure import Timeline, timeline

SOURCE = (
    "comments of idl/general/missions/rbsp/efw/calibration_files/rbsp_efw_boom_deploy_history.pro in the public "
    "repository spedas/bleeding_edge; MIT licence"
)
#: Clicks of the motor a metre, and by how much strokes and clicks of a row may differ, m.
CLICKS, SLACK = 21.0, 0.5
#: Standard deviation of a rate that is rounded to 0.01 rpm, and of a length by whole clicks.
ROUNDED, CLICKED = 0.01 / math.sqrt(12.0), 1.0 / CLICKS / math.sqrt(12.0)
#: The same of the metres that a click pays out, part of them: clicks a metre are a whole number.
SPOOL = 0.5 / CLICKS / math.sqrt(3.0)
#: The same of another spacecraft's moment of inertia, part of it.
CRAFT = 0.01
#: What the fit may leave, rpm: a digit of the log.
ALLOWED = 0.01
BUDGET = Budget(
    contributions=(
        Contribution(
            name="rounding", kind="measurement", size=f"{ROUNDED:.4f} rpm of a rate, and of that at the start",
            source="the log has two decimals",
        ),
        Contribution(
            name="clicks", kind="measurement", size=f"{CLICKED:.3f} m of each length",
            source="the motor counts whole ones",
        ),
        Contribution(
            name="fit", kind="parameters", size="covariance of the masses, or of a length",
            source="residuals of the fitted rates",
        ),
        Contribution(
            name="straight wires", kind="parameters", size="residuals of the fit beyond rounding",
            source="the fitted rates",
        ),
        Contribution(
            name="spool", kind="parameters", size=f"{SPOOL:.1%} of the metres that a click pays out",
            source=f"{CLICKS:.0f} clicks a metre are rounded to a whole number",
        ),
        Contribution(
            name="start", kind="parameters", size="of the length at the start of a group that the log does not hold",
            source="clicks and fit differ by it in the log of the package",
        ),
        Contribution(
            name="spacecraft", kind="parameters", size=f"{CRAFT:.0%} of another one's moment of inertia",
            source="assumed, of two that are built alike",
        ),
    ),
    widened="clicks, spool, start, spacecraft and straight wires were added since 8 of 10 differences were within the "
    "bands without them, and the rates of a second log were missed by 0.024 rpm",
)  # fmt: skip
MASSES = ("wire.tip_mass", "wire.line_density")


def hidden_starts(path: str) -> dict[int, tuple[float, float]]:
    """Groups whose first row has other clicks than strokes: length before it by the log, and by the clicks, m."""
    rows, _ = log.read(path)
    found = {}
    for number, group in enumerate(log.grouped(rows)):
        first = group[0]
        by_clicks = first.after - first.clicks / CLICKS
        if number and abs(by_clicks - first.before) > SLACK:
            found[number] = (first.before, by_clicks)
    return found


def fitted(path: str) -> calibration.Calibration:
    """Masses of the wires, lengths that the log does not hold and the rate of each group, by `evolvent calibrate`."""
    starts = [f"start_lengths.{k}" for k in hidden_starts(path)]
    return calibration.calibrate(
        "wire-booms", path, fit=[*MASSES, *starts, "rates"], observe=["spin_rate"], references=False
    )


def start_uncertainty(basis: calibration.Calibration, path: str) -> float:
    """Standard uncertainty of a length by clicks at the start of a group, m, by the fit to a log where it is hidden.

    Notes
    -----
    Root mean square of the differences of fitted lengths and those by clicks, with the standard errors of the fit.
    """
    hidden = hidden_starts(path).values()
    squares = [
        (float(value) - by_clicks) ** 2 + float(error) ** 2
        for value, error, (_, by_clicks) in zip(basis.values[2:], basis.errors[2:], hidden, strict=False)
    ]
    return math.sqrt(float(np.mean(squares))) if squares else CLICKED


def without_last_group(path: str, folder: str) -> str:
    """A file with the log's groups before the last one."""
    groups = log.grouped(log.read(path)[0])
    if len(groups) < 2:
        raise InputError(f"{path!r} holds one group of steps; two or more are needed, the last of which is predicted")
    kept = pathlib.Path(folder) / os.path.basename(path)
    kept.write_text(log.written([row for group in groups[:-1] for row in group]), encoding="utf-8")
    return str(kept)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Prediction:
    """Spin rates after the steps of a log from the logged rate at the start of their group.

    Attributes
    ----------
    path : str, of the log
    masses : (2,) float, kg and kg/m, of a sphere and of the wire's metre
    starts : mapping, group -> length at its start, m
    spool, inertia : float, by which lengths, and the spacecraft's moment of inertia, are multiplied
    """

    path: str
    masses: Array
    starts: Mapping[int, float]
    spool: float = 1.0
    inertia: float = 1.0

    @functools.cached_property
    def case(self) -> Case:
        """The case `wire-booms` with the steps of the log."""
        content = cases.content_of("wire-booms")
        measured = log.measurements(self.path, content, ["spin_rate"])
        assert measured is not None
        given: dict[str, Any] = dict(measured.overrides)
        lengths = [self.starts.get(k, one) for k, one in enumerate(given["start_lengths"])]
        given["start_lengths"] = [self.spool * one for one in lengths]
        given["groups"] = [[[pair, self.spool * before, self.spool * after, duration]
                            for pair, before, after, duration in group] for group in given["groups"]]  # fmt: skip
        plain = cases.load(content)
        given["wire.length"] = self.spool * given.get("wire.length", plain.wire.length)
        given["body.inertia"] = (self.inertia * np.asarray(plain.body.inertia)).tolist()
        given |= {key: float(value) for key, value in zip(MASSES, self.masses, strict=True)}
        found: Case = cases.load(cases.content_of("wire-booms", given))
        return found

    @functools.cached_property
    def line(self) -> Timeline:
        """When the steps are."""
        return timeline(self.case)

    @functools.cached_property
    def rates(self) -> Array:
        """(n,) rpm."""
        return np.asarray(closed_form(self.case, self.line.after)["spin_rate"] / log.RPM)

    @property
    def shares(self) -> Array:
        """(n,) rate after a step over that at the start of its group."""
        return np.asarray(self.rates * log.RPM / np.array(self.case.rates)[self.line.groups])

    @property
    def by_clicks(self) -> Array:
        """(n,) rpm, standard uncertainty by whole clicks: of the lengths at the start of the group and after a step."""
        firsts = np.searchsorted(self.line.groups, self.line.groups)
        squares = np.zeros(self.rates.size)
        for time in (self.line.before[firsts], self.line.after):
            lengths = closed_form(self.case, time)["boom_length"]
            for moved in CLICKED * np.eye(2):
                slope = np.log(inertia(self.case, lengths + moved) / inertia(self.case, lengths))
                squares += np.where(lengths[:, moved > 0.0][:, 0] > 0.0, slope, 0.0) ** 2  # a stowed boom has no error
        return np.asarray(self.rates * np.sqrt(squares))

    def contributions(self, covariance: Array, start: float, craft: float) -> dict[str, Array]:
        """Standard uncertainties of the rates by what the bands contain, (n,) rpm each.

        Parameters
        ----------
        covariance : (2, 2) float, of the masses
        start : float, m, standard uncertainty of the lengths in `starts`
        craft : float, that of the spacecraft's moment of inertia, part of it

        Notes
        -----
        Masses that were fitted take up a common scale s of the lengths: those of spheres and wires are divided by s^2
        and s^3.
        """
        s = 1.0 + SPOOL
        scaled = dataclasses.replace(self, spool=s, masses=self.masses / np.array([s**2, s**3]))
        by_start = np.zeros(self.rates.size)
        for k, length in self.starts.items():
            moved = dataclasses.replace(self, starts={**self.starts, k: length + start})
            by_start = np.hypot(by_start, moved.rates - self.rates)
        return {
            "rounding": ROUNDED * np.hypot(1.0, self.shares), "clicks": self.by_clicks,
            "fit": book.by_parameters(lambda x: dataclasses.replace(self, masses=x).rates, self.masses, covariance),
            "spool": np.abs(scaled.rates - self.rates), "start": by_start,
            "spacecraft": np.abs(dataclasses.replace(self, inertia=1.0 + craft).rates - self.rates),
        }  # fmt: skip


def unexplained(basis: calibration.Calibration) -> float:
    """Standard deviation of fitted rates beyond rounding, rpm."""
    free = max(basis.residuals.size - len(basis.values), 1)
    return math.sqrt(max(basis.residuals.size * basis.rms**2 / free - ROUNDED**2, 0.0))


def run(settings: NoSettings, data: str | None) -> Verdict:
    """Fit a log, and predict what was not fitted."""
    shipped = SYSTEM.data_files["rbsp-a.csv"]
    path = shipped if data is None else data
    if not log.is_log(path):
        raise InputError(f"{path!r} is no log of wire booms: it has the columns {', '.join(log.COLUMNS)}")
    whole, hidden = fitted(path), hidden_starts(path)
    rows = log.read(path)[0]
    if data is None:
        with tempfile.TemporaryDirectory() as folder:
            basis = fitted(without_last_group(path, folder))
        label = "the groups before"
    else:
        basis, label = fitted(shipped), "the log of the package"
    starts = {k: by_clicks for k, (_, by_clicks) in hidden.items()}
    covariance = (basis.correlation * np.outer(basis.errors, basis.errors))[:2, :2]
    prediction = Prediction(path=path, masses=basis.values[:2], starts=starts)
    start = start_uncertainty(basis, shipped) if data is not None else 0.0
    parts = prediction.contributions(covariance, start, 0.0 if data is None else CRAFT)
    parts["straight wires"] = np.full(prediction.rates.size, unexplained(basis))
    predicted, groups = prediction.rates, prediction.line.groups
    logged = np.array([row.rate_after for row in rows])
    wanted = np.flatnonzero(np.isfinite(logged) & ((groups == groups[-1]) | (data is not None)))
    comparisons = [
        Comparison(
            what=f"rate after step {k + 1}, by a fit to {label}", unit="rpm", predicted=float(predicted[k]),
            measured=float(logged[k]),
            band=BUDGET.band({name: float(values[k]) for name, values in parts.items()}),
        )
        for k in wanted
    ]  # fmt: skip
    comparisons.append(
        Comparison(
            what=f"rms of a fit to all {whole.residuals.size} rates", unit="rpm", predicted=whole.rms, measured=0.0,
            allowed=ALLOWED, goal="at most 0.01 rpm",
            band=BUDGET.band({"rounding": ROUNDED, "clicks": rms(prediction.by_clicks)}),
        )
    )  # fmt: skip
    notes = []
    for j, (k, (by_log, by_clicks)) in enumerate(hidden.items()):
        value, error = float(whole.values[2 + j]), float(whole.errors[2 + j])
        first = log.grouped(rows)[k][0]
        comparisons.append(
            Comparison(
                what=f"length at the start of group {k + 1}: fitted, and by clicks", unit="m", predicted=value,
                measured=by_clicks,
                band=BUDGET.band({
                    "clicks": math.sqrt(2.0) * CLICKED, "spool": SPOOL * first.clicks / CLICKS, "fit": error,
                }),
            )
        )  # fmt: skip
        notes.append(
            f"group {k + 1} begins at {by_log:g} m by the log, at {by_clicks:g} m by the clicks of its first row, and "
            f"at {value:.2f} m, standard error {error:.2f} m, by the fit"
        )
    for key, value, error in zip(MASSES, whole.values, whole.errors, strict=False):
        notes.append(f"{key}: {value:.5g}, standard error {error:.2g}, beside the round moment of inertia of 500 kg m2")
    inside = sum(one.covered for one in comparisons[: wanted.size])
    notes.append(
        f"predicted rates differ by {rms(predicted[wanted] - logged[wanted]):.4f} rpm rms, and {inside} of "
        f"{wanted.size} are within their bands; those of a group share the errors of its start and of the masses"
    )
    notes += [one for one in whole.notes if "Row" in one]
    return Verdict(comparisons=tuple(comparisons), figures=(_figure(predicted, logged, wanted),), notes=tuple(notes))


def _figure(predicted: Array, logged: Array, wanted: Array) -> Figure:
    """Rates after the steps, and the differences of predicted ones."""
    steps = np.arange(logged.size) + 1.0
    rates = [
        Line(x=steps, y=logged, label="logged", style="", marker="o", color="gray"),
        Line(x=steps[wanted], y=predicted[wanted], label="predicted", color=0),
    ]
    off = [Line(x=steps[wanted], y=1e3 * (predicted - logged)[wanted], label="predicted less logged", marker="o")]
    panels = [
        Panel(x_label="step", y_label="spin rate after it, rpm", lines=rates),
        Panel(x_label="step", y_label="predicted less logged, 0.001 rpm", lines=off),
    ]
    return Figure(name="rbsp", title="Spin rate as wire booms pay out", panels=panels)


SETS = {
    "rbsp": Set(
        name="rbsp", title="Spin rates of Van Allen Probe A as its wire booms paid out", source=SOURCE,
        Settings=NoSettings, run=run, budget=BUDGET,
    ),
}  # fmt: skip
