"""All that is drawn of a run, in a folder."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from evolvent.results import unfinished
from evolvent.view import animation
from evolvent_base import plots

if TYPE_CHECKING:
    from evolvent.results.motion import Motion
    from evolvent_base.figures import Figure

#: File of the animation in the folder.
ANIMATION = "animation.html"


def write(
    run: Any, figures: Sequence[Figure], motion: Motion | None, folder: str | os.PathLike[str], *, kind: str = "png"
) -> list[str]:
    """Write figures and animation (`animation.of_run`) of a run into a folder; returns the files' paths.

    Parameters
    ----------
    run : xarray.DataTree
    figures : sequence of Figure
    motion : Motion, None for no animation
    folder : str
    kind : str, format of the figures, one of `evolvent_base.plots.FORMATS`

    Raises
    ------
    InputError
        If the folder cannot be written into.
    """
    paths = plots.draw(figures, folder, kind=kind, label=unfinished(run))
    if motion is not None:
        paths.append(animation.write(motion, os.path.join(folder, ANIMATION)))
    return paths
