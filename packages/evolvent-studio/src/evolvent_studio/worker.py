"""The process that computes one job, as `evolvent_studio.child` starts it with the job's folder.

The first line of stdin is the job, one JSON object: its kind, its case as YAML, and the files of its signals. Results
are written to FOLDER, and its progress to stdout, one JSON object a line. Another line on stdin, or its end, stops the
work; what was computed is kept.
"""

from __future__ import annotations

import json
import os
import pathlib
import sys
import threading
from collections.abc import Callable
from typing import Any

import lazy_loader as lazy

from evolvent import cases, results
from evolvent.analysis.margins.factors import Unstated
from evolvent.results import limits
from evolvent.view import animation
from evolvent_base import progress, showing
from evolvent_base.answer import Table
from evolvent_base.errors import EvolventError, InputError, counted
from evolvent_studio import added_jobs, child
from evolvent_studio.jobkinds import (
    CALIBRATION,
    CASE,
    CORDS,
    CUT,
    DISPERSED,
    DISPERSION,
    KINDS,
    MARGINS,
    MODE,
    MODES,
    REFLECTOR,
    RELAXED,
    RUN,
    STORAGE,
    STORED,
    STUDY,
)

# what most jobs do without
studies = lazy.load("evolvent.design.studies", suppress_warning=True)
dispersed = lazy.load("evolvent.design.dispersions.dispersed", suppress_warning=True)
fit = lazy.load("evolvent.design.calibration.fit", suppress_warning=True)
relaxation = lazy.load("evolvent_studio.relaxation", suppress_warning=True)


def main(folder: str) -> int:
    """Compute the job in `folder`."""
    send = child.channel()
    job = json.loads(sys.stdin.readline())
    report = _Report(send, at_once=KINDS[job["kind"]].at_once)
    place = pathlib.Path(folder)
    try:
        known = {
            "run": _run, "equilibrium": _equilibrium, "modes": _modes, "margin": _margin, "storage": _storage,
            "reflector": _reflector, "sweep": _sweep, "disperse": _disperse, "calibrate": _calibrate,
            "relaxation": _relaxation,
        }  # fmt: skip
        compute = known.get(job["kind"]) or added_jobs.computation(job["kind"])
        compute(place, job, report)
    except EvolventError as error:
        cause: BaseException | None = error
        while cause is not None and not isinstance(cause, Unstated):
            cause = cause.__cause__
        if isinstance(cause, Unstated):
            report.send(unstated=[cause.coordinate, *cause.missing])
        report.send(status="failed", message=str(error))
    except KeyboardInterrupt:
        report.send(status="interrupted", message="cancelled")
    return 0


def parsed(text: str, name: str) -> dict[str, Any]:
    """Content of a case, study or description of a job.

    Raises
    ------
    InputError
        If it is no mapping.
    """
    content = cases.parse_yaml(text, name)
    if not isinstance(content, dict):
        raise InputError(f"{name} holds no mapping of keys to values")
    return content


class _Report:
    """What goes back and forth between the studio and this process.

    Parameters
    ----------
    send : sends a message
    at_once : bool, whether the process ends as soon as it is asked to
    """

    def __init__(self, send: Callable[..., None], *, at_once: bool) -> None:
        self._send, self._at_once = send, at_once
        self._stop = threading.Event()
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        sys.stdin.readline()
        self._stop.set()
        if self._at_once:
            self.send(status="interrupted", message="cancelled")
            os._exit(0)

    def send(self, **what: Any) -> None:
        """Send one message."""
        try:
            self._send(**what)
        except OSError:  # the studio is gone; the results are kept all the same
            self._stop.set()

    def compiling(self, state: Any) -> None:
        """Report how many functions are compiled, of `evolvent_base.progress.Compilation`."""
        self.send(note=f"compiling for this machine, once: {state.done} of {state.needed} functions")

    def stage(self, stage: Any) -> None:
        """Report a stage, of `evolvent_base.progress.Stage`."""
        counted = f": {stage.done:.0f} of {stage.total:.0f}" if stage.total > 1.0 else ""
        self.send(note=f"{stage.what}{counted}")

    def reached(self, reached: float, end: float) -> None:
        """Report how far the work is; raises KeyboardInterrupt where it is to stop."""
        self.send(reached=float(reached), end=float(end))
        self.check()

    def check(self) -> None:
        """Raise KeyboardInterrupt where the work is to stop."""
        if self._stop.is_set():
            raise KeyboardInterrupt


def _case(job: dict[str, Any]) -> tuple[Any, str]:
    """The case of a job, and its text with values as the user wrote them, but rows in the place of their files."""
    content = cases.in_place(parsed(job["case"], CASE))
    case = cases.load(content)
    return case, cases.to_yaml(case, content)


def _run(place: pathlib.Path, job: dict[str, Any], report: _Report) -> None:
    case, text = _case(job)
    plan = cases.system(case.system).plan(case)
    report.reached(0.0, plan.duration)

    with progress.compilation_shown_by(report.compiling):
        found = plan.run(lambda reached: report.reached(reached, plan.duration))
    found.attrs["case"] = text
    results.save(found, place / RUN)
    if checked := limits.of_run(found):
        report.send(limits=[sum(one.is_met for one in checked), len(checked)])
    report.send(status=found.attrs["status"], message=found.attrs["message"])


def _equilibrium(place: pathlib.Path, job: dict[str, Any], report: _Report) -> None:
    case, text = _case(job)
    report.reached(0.0, 1.0)
    with progress.compilation_shown_by(report.compiling):
        found = cases.system(case.system).equilibrium(case, lambda factor: report.reached(min(factor, 1.0), 1.0))
    found.attrs["case"] = text
    results.save(found, place / RUN)
    report.send(status=found.attrs["status"], message=found.attrs["message"])


def _modes(place: pathlib.Path, job: dict[str, Any], report: _Report) -> None:
    case = _case(job)[0]
    report.reached(0.0, 1.0)
    with progress.compilation_shown_by(report.compiling):
        found = cases.system(case.system).modes(case)
    count = len(found.pole)
    for k in range(count):
        (place / MODE.format(k)).write_bytes(animation.pack(found.motion(k)))
        report.reached(k + 1.0, count)
    table = found.answer().of_kind(Table)[0]
    report.send(head=table.heads, rows=table.rows)
    found.save(place / MODES)
    report.send(status="success", message="")


def _margin(place: pathlib.Path, job: dict[str, Any], report: _Report) -> None:
    case = _case(job)[0]
    report.reached(0.0, 1.0)
    with progress.compilation_shown_by(report.compiling), progress.shown_by(report.stage):
        found = cases.system(case.system).margin(
            case, progress=lambda reached: report.send(note=f"margins along the run: {reached:.4g} s")
        )
        found.report(place / MARGINS)
    below = f"the margin of {', '.join(map(repr, found.negative))} is below 0"
    report.send(
        status="success", message=below if found.negative else f"every margin holds, the least is {found.least:.4g}"
    )


def _storage(place: pathlib.Path, job: dict[str, Any], report: _Report) -> None:
    case = _case(job)[0]
    report.reached(0.0, 1.0)
    with progress.compilation_shown_by(report.compiling), progress.shown_by(report.stage):
        found = (
            cases.system(case.system)
            .system(case)
            .storage(progress=lambda reached: report.send(note=f"deployment before and after storage: {reached:.4g} s"))
        )
        for name in (STORED, RELAXED):
            found.save(place / name)
        found.report(place / STORAGE)
    report.send(status="success", message="; ".join(found.answer().warnings) or f"stored for {found.stored_for}")


def _reflector(place: pathlib.Path, job: dict[str, Any], report: _Report) -> None:
    case = _case(job)[0]
    report.reached(0.0, 1.0)
    with progress.compilation_shown_by(report.compiling), progress.shown_by(report.stage):
        found = cases.system(case.system).system(case).reflector()
        for name in (CUT, CORDS):
            found.save(place / name)
        found.report(place / REFLECTOR)
    report.send(status="success", message="; ".join(found.fails))


def _cases(job: dict[str, Any], place: pathlib.Path, report: _Report) -> dict[str, Any]:
    """Arguments with which the many cases of a job are run."""
    return {
        "study": parsed(job["case"], CASE), "output": place / STUDY, "workers": 1, "progress": report.reached,
        "report": lambda sentence: report.send(note=sentence),
    }  # fmt: skip


def _end_cases(report: _Report, failed: int, count: int, what: str) -> None:
    """Report how many cases of a job have failed; the job itself has where all have."""
    message = f"{failed} of {count} {what} failed" if failed else ""
    report.send(status="failed" if failed == count else "success", message=message)


def _sweep(place: pathlib.Path, job: dict[str, Any], report: _Report) -> None:
    found = studies.sweep(**_cases(job, place, report))
    _end_cases(report, int((found.status == "failed").sum()), found.status.size, "cases")


def _disperse(place: pathlib.Path, job: dict[str, Any], report: _Report) -> None:
    found = dispersed.disperse(**_cases(job, place, report))
    report.send(note="drawing the report")
    found.save(place / DISPERSED)
    found.report(place / DISPERSION)
    _end_cases(report, len(found.failures), found.count, "runs")


def _calibrate(place: pathlib.Path, job: dict[str, Any], report: _Report) -> None:
    asked = parsed(job["case"], CASE)

    def show(count: int, rms: float) -> None:
        report.send(note=f"{count} evaluations, root mean square {rms:.4g}")
        report.check()

    with progress.compilation_shown_by(report.compiling):
        found = fit.calibrate(
            asked["case"], job["signals"][0], folder=place / CALIBRATION, progress=show,
            report=lambda sentence: report.send(note=sentence),
            **{name: asked[name] for name in ("fit", "observe", "deviations", "bounds") if name in asked},
        )  # fmt: skip
    showing.fill(found.answer(), place / CALIBRATION)
    count = len(found.parameters)
    message = f"{count} parameter{'s' * (count > 1)} fitted, root mean square {found.rms:.3g} {found.series[0].unit}"
    report.send(status="success", message=message.strip())


def _relaxation(place: pathlib.Path, job: dict[str, Any], report: _Report) -> None:
    asked = relaxation.asked(parsed(job["case"], CASE))
    found = relaxation.fitted(
        asked, job["signals"], report=lambda count: report.send(note=f"fitting a Prony series of {count} terms")
    )
    report.send(note="drawing the report")
    showing.fill(found.answer(), place / CALIBRATION)
    left = found.left
    message = f"{counted(found.terms, 'term')}; the share that stays is {left.value:.4g}, from {left.low:.4g} to "
    report.send(status="success", message=f"{message}{left.high:.4g} (95 %)")
