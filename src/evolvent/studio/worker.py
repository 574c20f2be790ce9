"""The process that computes one job: ``python -m evolvent.studio.worker FOLDER``.

It reads ``job.json`` and what belongs to it in FOLDER, writes results there, and tells on stdout, one JSON object a
line, how far it is. A line on stdin, or its end, stops the work; what was computed is kept.
"""

from __future__ import annotations

import json
import os
import pathlib
import sys
import threading
from typing import Any

#: Files of a job.
JOB, CASE, RUN, STUDY, CERTIFICATE = "job.json", "case.yaml", "run.nc", "study", "certificate.html"
#: Kinds of jobs that keep nothing when they are cancelled.
AT_ONCE = ("equilibrium", "modes", "identify")
#: Modes, and the packed motion of one of them.
MODES, MODE = "modes.nc", "mode-{}.motion"


def main(folder: str) -> int:
    """Compute the job in `folder`."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    from evolvent.errors import EvolventError

    place = pathlib.Path(folder)
    job = json.loads((place / JOB).read_text(encoding="utf-8"))
    report = _Report(at_once=job["kind"] in AT_ONCE)
    try:
        compute = {
            "run": _run, "equilibrium": _equilibrium, "modes": _modes, "sweep": _sweep, "identify": _identify,
        }[job["kind"]]  # fmt: skip
        compute(place, job, report)
    except EvolventError as error:
        report.send(status="failed", message=str(error))
    except KeyboardInterrupt:
        report.send(status="interrupted", message="cancelled")
    return 0


class _Report:
    """What goes back and forth between the studio and this process.

    Parameters
    ----------
    at_once : bool, whether the process ends as soon as it is asked to
    """

    def __init__(self, *, at_once: bool = False) -> None:
        self._at_once = at_once
        self._out = os.fdopen(os.dup(1), "w", encoding="utf-8")
        os.dup2(2, 1)  # whatever else prints does not come between
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
            self._out.write(json.dumps(what) + "\n")
            self._out.flush()
        except OSError:  # the studio is gone; the results are kept all the same
            self._stop.set()

    def compiling(self, state: Any) -> None:
        """Report how many functions are compiled, of `evolvent.jit.Progress`."""
        self.send(note=f"compiling for this machine, once: {state.done} of {state.needed} functions")

    def stage(self, stage: Any) -> None:
        """Report a stage, of `evolvent.progress.Stage`."""
        counted = f": {stage.done:.0f} of {stage.total:.0f}" if stage.total > 1.0 else ""
        self.send(note=f"{stage.what}{counted}")

    def reached(self, reached: float, end: float) -> None:
        """Report how far the work is; raises KeyboardInterrupt where it is to stop."""
        self.send(reached=float(reached), end=float(end))
        if self._stop.is_set():
            raise KeyboardInterrupt


def _case(place: pathlib.Path) -> tuple[Any, str]:
    """The case of a job, and its text with values as the user wrote them."""
    from evolvent import cases

    content = cases.content_of(os.fspath(place / CASE))
    case = cases.load(content)
    return case, cases.to_yaml(case, content)


def _run(place: pathlib.Path, job: dict[str, Any], report: _Report) -> None:
    from evolvent import cases, jit, results

    case, text = _case(place)
    plan = cases.system(case.system).plan(case)
    report.reached(0.0, plan.duration)

    with jit.reporting(report.compiling):
        found = plan.run(lambda reached: report.reached(reached, plan.duration))
    found.attrs["case"] = text
    results.save(found, place / RUN)
    report.send(status=found.attrs["status"], message=found.attrs["message"])


def _equilibrium(place: pathlib.Path, job: dict[str, Any], report: _Report) -> None:
    from evolvent import cases, jit, results

    case, text = _case(place)
    report.reached(0.0, 1.0)
    with jit.reporting(report.compiling):
        found = cases.system(case.system).equilibrium(case, lambda factor: report.reached(min(factor, 1.0), 1.0))
    found.attrs["case"] = text
    results.save(found, place / RUN)
    report.send(status=found.attrs["status"], message=found.attrs["message"])


def _modes(place: pathlib.Path, job: dict[str, Any], report: _Report) -> None:
    from evolvent import animation, cases, jit

    case = _case(place)[0]
    report.reached(0.0, 1.0)
    with jit.reporting(report.compiling):
        found = cases.system(case.system).modes(case)
    count = len(found.pole)
    for k in range(count):
        (place / MODE.format(k)).write_bytes(animation.pack(found.motion(k)))
        report.reached(k + 1.0, count)
    head, *rows = found.rows()
    report.send(head=head, rows=rows)
    found.save(place / MODES)
    report.send(status="success", message="")


def _sweep(place: pathlib.Path, job: dict[str, Any], report: _Report) -> None:
    from evolvent import studies

    found = studies.sweep(
        os.fspath(place / CASE),
        output=place / STUDY,
        workers=1,
        progress=lambda done, count: report.reached(done, count),
        tell=lambda sentence: report.send(note=sentence),
    )
    failed = int((found.status == "failed").sum())
    message = f"{failed} of {found.status.size} cases failed" if failed else ""
    report.send(status="failed" if failed == found.status.size else "success", message=message)


def _identify(place: pathlib.Path, job: dict[str, Any], report: _Report) -> None:
    import numpy as np

    from evolvent import progress
    from evolvent.massprops import certificate, description
    from evolvent.massprops.measurement import mass_properties
    from evolvent.massprops.rounding import rounded

    report.reached(0.0, 1.0)
    with progress.shown_by(report.stage):
        found = mass_properties(job["signals"], description.load(os.fspath(place / CASE)))
    rows = []
    for k, output in enumerate(found.outputs):
        u, U = found.std[k], found.expanded[k]
        known = found.certain and np.isfinite(u) and u > 0.0
        value = rounded(found.values[k], u) if known else f"{found.values[k]:.6g}"
        rows.append([output.key, value, rounded(u, u) if known else "-", rounded(U, U) if known else "-", output.unit])
    modes = found.evaluations[0].modal.modes
    report.send(
        rows=rows,
        warnings=found.cautions,
        notes=found.notes,
        modes=[[float(modes.frequency[k]), float(modes.decay_rate[k])] for k in range(modes.order)],
    )
    with progress.shown_by(report.stage):
        progress.report("drawing the certificate")
        certificate.write(found, place / CERTIFICATE)
    report.send(status="success", message="")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
