"""What an export is asked for, and what all exporters share."""

from __future__ import annotations

import dataclasses
import os
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from evolvent import cases
from evolvent.results import regular_samples
from evolvent.view import animation
from evolvent_base.errors import InputError, counted

if TYPE_CHECKING:
    from evolvent.analysis.clearance_results import Clearances
    from evolvent.results.motion import Motion

#: Size above which a file is written only if that is asked for, bytes.
LARGE = 200_000_000
#: Decimal signs of tables, and what separates their columns.
DECIMALS = {".": ",", ",": ";"}


@dataclasses.dataclass(frozen=True, kw_only=True)
class Request:
    """What an export is asked for.

    Attributes
    ----------
    frames : int, optional
        Number of moments, evenly spread; left out, what suits the format.
    speed : float, optional
        Time of the run over time of the clock, of an animation; left out, one that shows the run in 15 s.
    axes : "inertial" or "body", optional
        What positions refer to; left out, what suits the format.
    large : bool
        Whether more than `LARGE` bytes may be written.
    decimal : "." or ",", optional
        The decimal sign of tables; columns are separated by ';' where it is a comma.
    clearance : Clearances, optional
        Of `evolvent.analysis.clearance`: bodies that interfere are red in an animation.
    """

    frames: int | None = None
    speed: float | None = None
    axes: Literal["inertial", "body"] | None = None
    large: bool = False
    decimal: Literal[".", ","] = "."
    clearance: Clearances | None = None

    def __post_init__(self) -> None:
        if self.decimal not in DECIMALS:
            raise InputError(f"decimal is {self.decimal!r}; it must be '.' or ','")

    def samples(self, run: Any, *, most: int | None = None) -> np.ndarray:
        """Samples of a run that are kept: as many as asked for, else at most `most`, evenly spread in time.

        All of them, or some of the regular ones.
        """
        count = run.sizes["time"]
        wanted = self.frames or min(count, most or count)
        if wanted == 1:
            return np.array([count - 1])
        if wanted >= count:
            return np.arange(count)
        even = regular_samples(run)
        found: np.ndarray = even[np.unique(np.linspace(0, even.size - 1, min(wanted, even.size)).round().astype(int))]
        return found

    def allow(self, size: float, what: str) -> None:
        """Refuse to write far more than anybody wants by mistake.

        Parameters
        ----------
        size : float, bytes, an estimate
        what : str, what would take that much
        """
        if size > LARGE and not self.large:
            raise InputError(
                f"{what} may take up to {shown_size(size)}; write fewer (--frames), or everything (--large)"
            )


def shown_size(size: float) -> str:
    """Bytes as a text with a unit."""
    for unit, scale in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if size >= scale:
            return f"{size / scale:.3g} {unit}"
    return f"{size:.0f} bytes"


def size_of(path: str) -> int:
    """Size of a file or of all files in a folder, bytes."""
    if not os.path.isdir(path):
        return os.path.getsize(path)
    return sum(os.path.getsize(os.path.join(folder, name)) for folder, _, names in os.walk(path) for name in names)


def samples_text(samples: np.ndarray, count: int) -> str:
    """How many samples a file holds, as words."""
    if samples.size == count:
        return counted(count, "sample")
    return f"{samples.size} of {count} samples (--frames takes more)"


def animation_of(run: Any, clearance: Clearances | None = None) -> Motion:
    """The motion of a run, labelled if the run did not end as it should; bodies that interfere are marked.

    Raises
    ------
    InputError
        If the run holds too little to move.
    """
    motion = animation.of_run(run)
    if motion is None:
        raise InputError("the run holds a single sample, which makes no animation; --to vtk, csv and mat accept it")
    return motion if clearance is None else clearance.marked(motion)


def motion_of(run: Any) -> Motion:
    """The motion of a run, if only at one sample.

    Raises
    ------
    InputError
        If the run holds too little for that.
    """
    motion: Motion | None = cases.presenter(run).motion(run)
    if motion is None:
        raise InputError("the run holds too little: there is no motion to export")
    return motion


def about(run: Any) -> list[tuple[str, str]]:
    """Where a run comes from and how it ended, as (what, text)."""
    attrs = run.attrs
    rows = [("title", attrs["title"]), ("status", attrs["status"]), ("message", attrs["message"])]
    rows += [("warning", attrs["warning"])] if attrs.get("warning") else []
    rows += [("date", attrs.get("date", "not recorded"))]
    rows += [("made with", attrs.get("made_with", f"evolvent {attrs['version']}")), ("method", attrs["method"])]
    return rows
