"""Directions from which a motion is seen: oblique, along the axes, and the one that suits its geometry."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from evolvent.results.motion import Array, Motion
from evolvent.results.rotations import turned, turns_between

#: Direction of the oblique view: azimuth and elevation, rad.
OBLIQUE = (-1.1, 0.6)
#: Extent along an axis, of the largest, below which a motion is planar.
_PLANAR = 0.06
#: Rotation that makes a spin, rad, and the share of it about one axis.
_SPIN, _ABOUT_ONE = 2.0 * np.pi, 0.98
#: Share of the extent of the whole motion below which the first moment has a view of its own.
_STOWED = 0.4
#: Largest number of samples that bound a view.
_SAMPLES = 200
#: Inertial axes in the order right, away, up, by the axis that points up; the sign of "away".
_ORDER = {"z": ("x", "y", 1.0), "y": ("x", "z", -1.0), "x": ("y", "z", 1.0)}


class View(NamedTuple):
    """A direction of view.

    Attributes
    ----------
    name : str, what it shows, in a word or two
    about : str, the same in a sentence
    azimuth, elevation : float, rad, about the axis that points up
    what : str, what fills the picture: "" the whole motion, which so has one scale; "bodies"; "start" the first moment;
        "opening" the first moment at first, and soon the whole motion
    """

    name: str
    about: str
    azimuth: float
    elevation: float
    what: str = ""


def views(motion: Motion) -> list[View]:
    """The views of a motion, the one that suits it first: along the normal of a planar motion, else oblique.

    Parameters
    ----------
    motion : Motion, in inertial axes
    """
    plane, spin = _normal(motion), _spin_axis(motion)
    right, away, _ = _ORDER[motion.up]
    found = [View("oblique", "from the side and above", *OBLIQUE)]
    for axis, azimuth, elevation in (
        (motion.up, 0.0, 0.5 * np.pi), (away, 0.0, 0.0), (right, 0.5 * np.pi, 0.0),
    ):  # fmt: skip
        about = {motion.up: "from above", away: "from the side", right: "from the end"}[axis] + f", along {axis}"
        about += ", the axis of the spin" if axis == spin else ""
        about += "; the motion is in this plane" if axis == plane else ""
        found.append(View(f"spin axis {axis}" if axis == spin else f"along {axis}", about, azimuth, elevation))
    first = next((view for view in found if plane and view.name.endswith(f" {plane}")), found[0])
    found.sort(key=lambda view: view is not first)
    if motion.frames:
        found.append(View("bodies", "the bodies alone, near", *OBLIQUE, what="bodies"))
    if motion.time.size > 1 and _half(motion, np.zeros(1, dtype=int)) < _STOWED * _half(motion, _kept(motion)):
        found[0] = found[0]._replace(
            what="opening", about=f"{found[0].about}; near at the start, then the whole motion on one scale"
        )
        about = "the first moment, near"
        found.append(View("start", about, found[0].azimuth, found[0].elevation, what="start"))
    return found


def _kept(motion: Motion) -> Array:
    """Samples whose positions bound the views."""
    return np.unique(np.linspace(0, motion.time.size - 1, min(motion.time.size, _SAMPLES)).round().astype(int))


def _half(motion: Motion, kept: Array) -> float:
    """Half the largest extent along an axis of lines, surfaces, marks and bodies at some samples, inertial axes, m."""
    origin = 0.0 if motion.body is None else motion.body.origin[kept][:, None]
    clouds = [points + origin for points in (*_clouds(motion, kept), *_corners(motion, kept))]
    low = np.fmin.reduce([np.nanmin(points, axis=(0, 1)) for points in clouds if np.isfinite(points).any()])
    high = np.fmax.reduce([np.nanmax(points, axis=(0, 1)) for points in clouds if np.isfinite(points).any()])
    return 0.5 * float(np.nanmax(high - low, initial=0.0))


def _normal(motion: Motion) -> str:
    """The inertial axis that a motion is normal to; '' where it is not planar, or all on one line."""
    kept = _kept(motion)
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for points in _points(motion, kept):
        if np.any(np.isfinite(points)):
            low, high = np.fmin(low, np.nanmin(points, axis=(0, 1))), np.fmax(high, np.nanmax(points, axis=(0, 1)))
    extent = high - low
    if not np.all(np.isfinite(extent)) or np.count_nonzero(extent <= _PLANAR * extent.max()) != 1:
        return ""
    return "xyz"[int(extent.argmin())]


def _points(motion: Motion, kept: Array) -> Iterator[Array]:
    """Points (nk, n, 3) of lines, surfaces and marks from the main body; where there are none, of the bodies."""
    if any(line.kind != "spring" for line in motion.lines) or motion.surfaces or motion.marks:
        yield from _clouds(motion, kept)
    else:
        yield from _corners(motion, kept)


def _clouds(motion: Motion, kept: Array) -> Iterator[Array]:
    """Points (nk, n, 3) of lines, surfaces and marks relative to the main body."""
    origin = 0.0 if motion.body is None else motion.body.origin[kept][:, None]
    for points in motion.strands:
        yield points[kept] - origin
    for surface in motion.surfaces:
        yield surface.points[kept] - origin
    for mark in motion.marks:
        yield mark.points[kept] - origin


def _corners(motion: Motion, kept: Array) -> Iterator[Array]:
    """Corners (nk, n, 3) of bodies relative to the main one."""
    origin = 0.0 if motion.body is None else motion.body.origin[kept][:, None]
    for frame in motion.frames:
        solids = (solid.mesh(sectors=8).vertices @ solid.basis.T + solid.centre for solid in frame.solids)
        points = np.vstack([np.zeros((1, 3)), *frame.outline, *solids])
        yield turned(frame.attitude[kept], np.broadcast_to(points, (kept.size, *points.shape))) + (
            frame.origin[kept][:, None] - origin
        )


def _spin_axis(motion: Motion) -> str:
    """The inertial axis about which the main body turns more than once; '' where there is none."""
    body = motion.body
    if body is None or motion.time.size < 2:
        return ""
    turns = turns_between(body.attitude, np.arange(motion.time.size))
    total = turned(body.attitude, turns[:, None]).sum(axis=(0, 1))
    size = float(np.linalg.norm(total))
    k = int(np.abs(total).argmax())
    return "xyz"[k] if size > _SPIN and abs(total[k]) > _ABOUT_ONE * size else ""
