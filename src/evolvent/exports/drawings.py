"""All that is drawn of a run, in a folder."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

from evolvent import animation, plots
from evolvent.results import unfinished

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.figures import Figure, Scene


def write(run: xr.Dataset, figures: Sequence[Figure], scene: Scene | None, folder: str | os.PathLike[str]) -> list[str]:
    """Write figures and animation of a run, labelled if it did not end as it should; returns the files' paths.

    Raises
    ------
    InputError
        If the folder cannot be written into.
    """
    label = unfinished(run)
    paths = plots.draw(figures, folder, label=label)
    if scene is not None:
        paths.append(animation.write(scene.labelled(label), os.path.join(folder, f"{scene.name}.html")))
    return paths
