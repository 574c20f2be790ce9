"""The start of a case as a motion of one sample, before anything is run.

`main` is the process that draws it; see `evolvent_studio.reading`.
"""

from __future__ import annotations

import base64
import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

from evolvent import cases
from evolvent.analysis.trees import at_start
from evolvent.results.tree import tree_of
from evolvent.view import animation
from evolvent.view.drawing import motion_of
from evolvent_base import progress
from evolvent_base.errors import EvolventError, InputError
from evolvent_studio import reading


def start_of(content: Mapping[str, Any], note: Callable[[str], None] = lambda text: None) -> bytes:
    """The start of a case for the viewer, packed.

    Parameters
    ----------
    content : mapping, a case whose system is built of parts
    note : called with what is done meanwhile, where it takes long

    Raises
    ------
    InputError
        If the case cannot be used, its parts cannot be assembled, or there is nothing to draw.
    """
    case = cases.load(content)

    def compiling(state: progress.Compilation) -> None:
        note(f"compiling for this machine, once: {state.done} of {state.needed} functions")

    try:
        with progress.compilation_shown_by(compiling):
            assembly = cases.system(case.system).build(case).assemble()
            # the method says nothing about the start, and is not chosen: that may fail while a case is being written
            solution = at_start(assembly, "auto")
            motion = motion_of(tree_of(solution, lambda: {"status": "success", "message": ""}, balances=False))
    except EvolventError:
        raise
    except Exception as error:  # a part of another package may raise anything
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise InputError(f"the start cannot be drawn: {reason}") from error
    if motion is None:
        raise InputError("the case has no part that can be drawn; add a body, a beam or a point")
    lines = [dataclasses.replace(line, values={}) for line in motion.lines]  # nothing has a stress or a force yet
    surfaces = [dataclasses.replace(surface, values={}) for surface in motion.surfaces]
    return animation.pack(dataclasses.replace(motion, lines=lines, surfaces=surfaces, forces=[], numbers={}))


def _packed(note: Callable[[str], None], *, content: Any) -> str:
    return base64.b64encode(start_of(content, note)).decode()


def main() -> int:
    """Answer with starts of cases."""
    return reading.answer({"start": _packed})
