"""Wire booms of a spinning spacecraft: spin rates after each step of a flight log, by straight radial wires.

The spheres' mass and the wires' density, in proportion to the spacecraft's moment of inertia, are fitted to a log, and
spin rates that were not fitted are predicted, from the logged rate at the start of their group of steps: of the log of
the package those of the last group, by a fit to the groups before; of another log (`--data`) those of all groups, by a
fit to that of the package. A group whose first row has other clicks of the motor than strokes begins at a length that
the log does not hold: it is fitted, and stated beside the log's.

Source: comments of rbsp_efw_boom_deploy_history.pro in the public repository spedas/bleeding_edge (MIT licence).
"""

from __future__ import annotations

import os
import pathlib
import tempfile
from typing import Any

import numpy as np

from evolvent import cases
from evolvent.design import calibration
from evolvent_base.errors import InputError
from evolvent_base.figures import Figure, Line, Panel
from evolvent_papers.laboratory import book
from evolvent_papers.laboratory.book import Array, Budget, Comparison, Contribution, NoSettings, Set, Verdict, rms
from evolvent_papers.wire_booms import SYSTEM, closed_form, log
from evolvent_papers.wire_booms.structure import timeline

SOURCE = (
    "comments of idl/general/missions/rbsp/efw/calibration_files/rbsp_efw_boom_deploy_history.pro in the public "
    "repository spedas/bleeding_edge; MIT licence"
)
#: Clicks of the motor a metre, and by how much strokes and clicks of a row may differ, m.
CLICKS, SLACK = 21.0, 0.5
#: Standard deviation of a rate that is rounded to 0.01 rpm, and of a length by whole clicks.
ROUNDED, CLICKED = 0.01 / np.sqrt(12.0), 1.0 / CLICKS / np.sqrt(12.0)
#: What the fit may leave, rpm: a digit of the log.
ALLOWED = 0.01
BUDGET = Budget(contributions=(
    Contribution(
        name="rounding", kind="measurement", size="0.0029 rpm, of a rate and of that at the start of its group",
        source="rates of the log have two decimals",
    ),
    Contribution(name="clicks", kind="measurement", size="0.014 m", source="whole clicks, 21 a metre"),
    Contribution(name="fit", kind="parameters", size="covariance of the fit", source="the rates that were fitted"),
))  # fmt: skip
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


def without_last_group(path: str, folder: str) -> str:
    """A file with the log's groups before the last one."""
    groups = log.grouped(log.read(path)[0])
    if len(groups) < 2:
        raise InputError(f"{path!r} holds one group of steps; two or more are needed, the last of which is predicted")
    kept = pathlib.Path(folder) / os.path.basename(path)
    kept.write_text(log.written([row for group in groups[:-1] for row in group]), encoding="utf-8")
    return str(kept)


def rates_after(path: str, masses: Array, starts: dict[int, float]) -> tuple[Array, Array, Array]:
    """Spin rates after the steps of a log from the logged rate at the start of their group.

    Parameters
    ----------
    masses : (2,) float, kg and kg/m, of a sphere and of the wire's metre
    starts : mapping, group -> length at its start, m

    Returns
    -------
    predicted : (n,) float, rpm
    groups : (n,) int
    shares : (n,) float, rate after a step over that at the start of its group
    """
    content = cases.content_of("wire-booms")
    measured = log.measurements(path, content, ["spin_rate"])
    assert measured is not None
    given: dict[str, Any] = dict(measured.overrides)
    given["start_lengths"] = [starts.get(k, one) for k, one in enumerate(given["start_lengths"])]
    given |= {key: float(value) for key, value in zip(MASSES, masses, strict=True)}
    case = cases.load(cases.content_of("wire-booms", given))
    line = timeline(case)
    found = closed_form(case, line.after)["spin_rate"]
    return found / log.RPM, line.groups, found / np.array(case.rates)[line.groups]


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
    predicted, groups, shares = rates_after(path, basis.values[:2], starts)
    by_masses = book.by_parameters(lambda x: rates_after(path, x, starts)[0], basis.values[:2], covariance)
    logged = np.array([row.rate_after for row in rows])
    wanted = np.flatnonzero(np.isfinite(logged) & ((groups == groups[-1]) | (data is not None)))
    comparisons = [
        Comparison(
            what=f"rate after step {k + 1}, by a fit to {label}", unit="rpm", predicted=float(predicted[k]),
            measured=float(logged[k]),
            band=BUDGET.band({"rounding": ROUNDED * np.hypot(1.0, shares[k]), "fit": by_masses[k]}),
        )
        for k in wanted
    ]  # fmt: skip
    comparisons.append(
        Comparison(
            what=f"rms of a fit to all {whole.residuals.size} rates", unit="rpm", predicted=whole.rms, measured=0.0,
            allowed=ALLOWED, goal="at most 0.01 rpm",
            band=BUDGET.band({"rounding": ROUNDED}),
        )
    )  # fmt: skip
    notes = []
    for j, (k, (by_log, by_clicks)) in enumerate(hidden.items()):
        value, error = float(whole.values[2 + j]), float(whole.errors[2 + j])
        comparisons.append(
            Comparison(
                what=f"length at the start of group {k + 1}: fitted, and by clicks", unit="m", predicted=value,
                measured=by_clicks,
                band=BUDGET.band({"clicks": CLICKED, "fit": error}),
            )
        )  # fmt: skip
        notes.append(
            f"group {k + 1} begins at {by_log:g} m by the log, at {by_clicks:g} m by the clicks of its first row, and "
            f"at {value:.2f} m, standard error {error:.2f} m, by the fit"
        )
    for key, value, error in zip(MASSES, whole.values, whole.errors, strict=False):
        notes.append(f"{key}: {value:.5g}, standard error {error:.2g}, beside the round moment of inertia of 500 kg m2")
    notes.append(f"predicted rates differ by {rms(predicted[wanted] - logged[wanted]):.4f} rpm rms")
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
