"""The job of the studio that identifies."""

from __future__ import annotations

import pathlib
from typing import Any

from evolvent_base import progress
from evolvent_massprops import description, torsion_rig
from evolvent_massprops.certificate import MassProperties, result_table
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
    content = parsed(job["case"], CASE)
    found: MassProperties | torsion_rig.RigProperties
    modes: list[list[float]] = []
    if torsion_rig.states_rig(content):
        found = torsion_rig.evaluate(content)
    else:
        found, modes = _of_signals(job["signals"], content, report)
    result = result_table(found)
    report.send(
        head=list(result.heads), rows=list(map(list, result.rows)), warnings=list(found.cautions),
        notes=list(found.notes), modes=modes,
    )  # fmt: skip
    with progress.shown_by(report.stage):
        progress.report("drawing the certificate")
        found.report(place / CERTIFICATE)
    report.send(status="success", message="")


def _of_signals(files: list[str], content: Any, report: Any) -> tuple[MassProperties, list[list[float]]]:
    """Mass properties by recordings, and frequency and decay rate of the modes of the first one."""
    with progress.shown_by(report.stage):
        found = mass_properties(files, description.load(content))
    modes = found.evaluations[0].modal.modes
    return found, [[float(modes.frequency[k]), float(modes.decay_rate[k])] for k in range(modes.order)]
