"""The process that estimates the duration of a study, as `evolvent_studio.child` starts it.

It reads a study as YAML from stdin, computes a case in the middle of it and, where that is fast, cases at its ends, and
writes one JSON object: the time of a case in s, the cases computed, and the reason where one failed.
"""

from __future__ import annotations

import sys
import tempfile
import time
from typing import Any

from evolvent import cases
from evolvent.design import studies
from evolvent.design.evaluator.evaluator import Evaluator
from evolvent.design.studies.runner import Points, runs_of
from evolvent.design.studies.study import corners
from evolvent_base.errors import EvolventError
from evolvent_studio import child

#: Longest first case, s, after which no other one is computed.
_LONG = 5.0


def main() -> int:
    """Estimate the study on stdin."""
    send = child.channel()
    try:
        send(**estimated(sys.stdin.read()))
    except EvolventError as error:
        send(error=str(error))
    return 0


def estimated(text: str) -> dict[str, Any]:
    """Time of a case of a study, from a few of them.

    Parameters
    ----------
    text : str, the study as YAML that holds its whole case

    Raises
    ------
    EvolventError
        If the study cannot be read or its cases cannot be computed.
    """
    study = studies.read(cases.parse_yaml(text, "the study"))
    reasons = []

    with tempfile.TemporaryDirectory(prefix="evolvent-estimate-") as folder:
        runs, points = runs_of(study, folder), Points(study)

        def timed(index: int) -> float:
            began = time.perf_counter()
            (found,) = Evaluator(runs, one_thread=True).of([points[index]])
            if found.reason:
                reasons.append(found.reason)
            return time.perf_counter() - began

        middle = study.count // 2
        taken = [timed(middle)]
        if taken[0] < _LONG and not study.stages:  # its time has the loading and compilation of functions in it
            reasons.clear()
            others = [index for index in corners(study) if index != middle][:3]
            taken = [timed(index) for index in (middle, *others)]
    return {"seconds": sum(taken) / len(taken), "computed": len(taken), "reasons": reasons}
