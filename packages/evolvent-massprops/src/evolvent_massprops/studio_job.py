"""The job of the studio that identifies."""

from __future__ import annotations

import pathlib
from typing import Any

from evolvent_base import progress
from evolvent_massprops import description
from evolvent_massprops.certificate import result_table
from evolvent_massprops.measurement import mass_properties
from evolvent_studio.jobkinds import CASE, CERTIFICATE
from evolvent_studio.worker import parsed


def identify(place: pathlib.Path, job: dict[str, Any], report: Any) -> None:
    """Find mass properties, and write their certificate.

    Parameters
    ----------
    place : Path, folder of the job
    job : its kind, its case as YAML, and the files of its signals
    report : takes how far it is, and what came of it
    """
    report.reached(0.0, 1.0)
    with progress.shown_by(report.stage):
        found = mass_properties(job["signals"], description.load(parsed(job["case"], CASE)))
    result = result_table(found)
    modes = found.evaluations[0].modal.modes
    report.send(
        head=list(result.heads),
        rows=list(map(list, result.rows)),
        warnings=found.cautions,
        notes=found.notes,
        modes=[[float(modes.frequency[k]), float(modes.decay_rate[k])] for k in range(modes.order)],
    )
    with progress.shown_by(report.stage):
        progress.report("drawing the certificate")
        found.report(place / CERTIFICATE)
    report.send(status="success", message="")
