"""How a system moves, as data: lines, surfaces, bodies, forces and marks at every sample, inertial axes, SI units.

The animation, the studio, films and files for other programs are all drawn from one `Motion`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Literal, NamedTuple

import numpy as np

from evolvent.results.rotations import conjugate, from_rotation_vectors, product, rotation_vectors, turned
from evolvent.results.solids import Solid
from evolvent.results.surfaces import Surface
from evolvent_base.units import unit_text

Array = np.ndarray

#: Length of the arrow of the largest force, of the reach of a motion.
_LONGEST_ARROW = 0.2
#: Shares of all values that lie below the ends of a colour scale; single extreme values are beyond it.
_ENDS = (0.2, 99.8)
#: Share of the other end below which an end of a colour scale is zero.
_ZERO = 1e-3
#: Force, N, and moment, N m, below which all of them are round-off and have no arrows.
_ROUND_OFF = 1e-15
#: Share of the samples whose largest force is no longer than the longest arrow.
_USUAL = 0.98


@dataclasses.dataclass(frozen=True, kw_only=True)
class Frame:
    """The axes of a body, and what is fixed in them.

    Attributes
    ----------
    name : str
    origin : (nt, 3) float, m, inertial axes
    attitude : (nt, 4) float, quaternion from the frame to inertial axes, scalar part first
    outline : sequence of (k, 3) float, m, polylines in the axes of the frame
    solids : sequence of Solid, in the axes of the frame
    lift : float, m, by which it is drawn nearer than it is, so that it is seen inside a body
    marked : (nt,) bool, samples at which its solids have the colour of a warning; None for none
    shown : (nt,) bool, samples at which it is drawn; None for all
    """

    name: str
    origin: Array
    attitude: Array
    outline: Sequence[Array] = ()
    solids: Sequence[Solid] = ()
    lift: float = 0.0
    marked: Array | None = None
    shown: Array | None = None

    def is_shown(self, k: int) -> bool:
        """Whether it is drawn at sample k."""
        return self.shown is None or bool(self.shown[k] > 0.5)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Line:
    """A line through points that move.

    Attributes
    ----------
    name : str
    points : (nt, n, 3) float, m, inertial axes; NaN hides
    values : mapping, label with its unit in brackets -> (nt, n) float, of each point; NaN for none
    kind : "line", "rod" (round, `width` is its diameter), or "spring" (a coil from the first point to the last)
    width : float, m, or None for one that is too thin to matter
    across : (nt, n, 3) float, inertial axes, directions along which a strip has its width; None if it is no strip
    tip : int, the point whose trail is shown first, None for none
    """

    name: str
    points: Array
    values: Mapping[str, Array] = dataclasses.field(default_factory=dict)
    kind: Literal["line", "rod", "spring"] = "line"
    width: float | None = None
    across: Array | None = None
    tip: int | None = -1

    def __post_init__(self) -> None:
        if self.points.ndim != 3 or self.points.shape[2] != 3 or self.points.shape[1] < 2:
            raise ValueError(f"line {self.name!r}: points have shape {self.points.shape}, not (samples, 2 or more, 3)")
        for label, values in self.values.items():
            if values.shape != self.points.shape[:2]:
                raise ValueError(f"line {self.name!r}: {label!r} has shape {values.shape}, not {self.points.shape[:2]}")
        if self.across is not None and (self.across.shape != self.points.shape or self.width is None):
            raise ValueError(f"line {self.name!r}: a strip needs a width, and a direction across at every point")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Forces:
    """Forces or moments, and the points at which they act.

    Attributes
    ----------
    name : str, what acts on what
    points : (nt, k, 3) float, m, inertial axes
    vectors : (nt, k, 3) float, inertial axes; NaN or zero for none
    unit : "N" or "N m"
    """

    name: str
    points: Array
    vectors: Array
    unit: str = "N"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Marks:
    """Points that are shown as dots: joints, hinges, point masses.

    Attributes
    ----------
    name : str
    points : (nt, k, 3) float, m, inertial axes; NaN hides
    size : float, m, diameter; None for dots that are small in every view
    """

    name: str
    points: Array
    size: float | None = None


class ValueRange(NamedTuple):
    """Ends of the colour scale of a value."""

    low: float
    high: float


@dataclasses.dataclass(frozen=True, kw_only=True)
class Motion:
    """The motion of a system.

    Attributes
    ----------
    title : str
    time : (nt,) float, s
    frames : sequence of Frame
    lines : sequence of Line
    surfaces : sequence of Surface
    forces : sequence of Forces
    marks : sequence of Marks
    symbols : sequence of Frame, of parts without an extent of their own: joints, motors, thrusters
    numbers : mapping, label with its unit in brackets -> (nt,) float, shown beside the picture
    main : str, name of the frame whose axes are the "body axes"; None for the first frame
    up : the inertial axis that points up in pictures
    magnification : float, factor by which pictures enlarge displacements from their mean; positions here are true
    repeats : bool, whether it is one period of a motion that goes on
    """

    title: str
    time: Array
    frames: Sequence[Frame] = ()
    lines: Sequence[Line] = ()
    surfaces: Sequence[Surface] = ()
    forces: Sequence[Forces] = ()
    marks: Sequence[Marks] = ()
    symbols: Sequence[Frame] = ()
    numbers: Mapping[str, Array] = dataclasses.field(default_factory=dict)
    main: str | None = None
    up: Literal["x", "y", "z"] = "z"
    magnification: float = 1.0
    repeats: bool = False

    def __post_init__(self) -> None:
        if self.main is not None and self.main not in [f.name for f in self.frames]:
            raise ValueError(f"main is {self.main!r}, and no frame has that name")
        count = self.time.size
        parts: list[Line | Surface | Forces | Marks] = [*self.lines, *self.surfaces, *self.forces, *self.marks]
        for part in parts:
            if len(part.points) != count:
                raise ValueError(f"{part.name!r} has {len(part.points)} samples, and the motion has {count}")
        for frame in (*self.frames, *self.symbols):
            if frame.origin.shape != (count, 3) or frame.attitude.shape != (count, 4):
                raise ValueError(f"frame {frame.name!r}: origin or attitude do not fit {count} samples")

    # ---------------------------------------------------------------------------------------- what it holds

    @property
    def body(self) -> Frame | None:
        """The main frame; None of a motion without frames."""
        if self.main is None:
            return self.frames[0] if self.frames else None
        return next(f for f in self.frames if f.name == self.main)

    @property
    def valued(self) -> list[Mapping[str, Array]]:
        """Values of all lines, then of all surfaces."""
        return [*(line.values for line in self.lines), *(surface.values for surface in self.surfaces)]

    @property
    def labels(self) -> list[str]:
        """Labels of all values of lines and surfaces, each once, in their order."""
        return list(dict.fromkeys(label for values in self.valued for label in values))

    @property
    def strands(self) -> list[Array]:
        """Points (nt, n, 3) of all lines but those of springs, m, inertial axes."""
        return [line.points for line in self.lines if line.kind != "spring"]

    @property
    def clouds(self) -> list[Array]:
        """Points (nt, n, 3) of all lines, surfaces and marks, m, inertial axes."""
        surfaces = [surface.points for surface in self.surfaces]
        return [*(line.points for line in self.lines), *surfaces, *(mark.points for mark in self.marks)]

    @property
    def reach(self) -> float:
        """Largest distance of any point from the origin of the main frame, or from the mean of all points, m."""
        clouds = self.clouds
        radii = []
        for frame in self.frames:
            for solid in frame.solids:
                radii.append(np.linalg.norm(solid.centre) + solid.size)
            radii += [np.linalg.norm(polyline, axis=-1).max(initial=0.0) for polyline in frame.outline]
            clouds.append(frame.origin[:, None])
        if self.body is not None:
            centre = self.body.origin[:, None]
        else:
            centre = np.nanmean(np.concatenate([c.reshape(-1, 3) for c in clouds]), axis=0) if clouds else np.zeros(3)
        far = [float(np.nanmax(np.linalg.norm(c - centre, axis=-1), initial=0.0)) for c in clouds]
        return max(*far, *(float(r) for r in radii), 0.0, 0.0) or 1.0

    def value_range(self, label: str) -> ValueRange:
        """Ends of the colour scale of a value, over all parts and samples; zero is one unless all lies far from it."""
        values = self._values(label)
        if not values.size:
            return ValueRange(0.0, 1.0)
        low, high = (float(x) for x in np.percentile(values, _ENDS))
        size = max(abs(low), abs(high))
        low = min(low, 0.0) if low < 0.5 * high else low
        high = max(high, 0.0) if high > 0.5 * low else high
        low, high = (x if abs(x) > _ZERO * size else 0.0 for x in (low, high))
        if low == high:
            low, high = min(low, 0.0), max(high, 0.0)
        return ValueRange(low, high if high > low else low + 1.0)

    def clipped(self, label: str) -> tuple[bool, bool]:
        """Whether values lie below the first colour's, and above the last one's, by a step of 256 colours or more."""
        low, high = self.value_range(label)
        values, step = self._values(label), (high - low) / 256.0
        return bool(np.any(values < low - step)), bool(np.any(values > high + step))

    def _values(self, label: str) -> Array:
        """All values of a label that are finite, of all lines, surfaces and samples."""
        every = [values[label].ravel() for values in self.valued if label in values]
        values = np.concatenate(every) if every else np.empty(0)
        return np.asarray(values[np.isfinite(values)])

    def arrow_scale(self, unit: str) -> float:
        """Length of the arrow of a unit force, m per `unit`: the largest usual force has a fifth of the reach."""
        sizes = [np.linalg.norm(f.vectors, axis=-1) for f in self.forces if f.unit == unit and f.vectors.size]
        if not sizes:
            return 0.0
        largest = np.nan_to_num(np.concatenate(sizes, axis=1)).max(axis=1)
        largest = largest[largest > max(1e-6 * largest.max(), _ROUND_OFF)]
        return float(_LONGEST_ARROW * self.reach / np.quantile(largest, _USUAL)) if largest.size else 0.0

    # ---------------------------------------------------------------------------------------- other motions

    def labelled(self, label: str) -> Motion:
        """The motion with `label` in its title; itself where that is empty."""
        return dataclasses.replace(self, title=f"{self.title} - {label}") if label else self

    def at(self, samples: Array) -> Motion:
        """The motion at some samples alone."""
        return self._of(
            self.time[samples],
            lambda x: x[samples],
            lambda x: x[samples],
            lambda f: (f.origin[samples], f.attitude[samples]),
            lambda x: x[samples],
        )

    def in_body(self) -> Motion:
        """The motion in the axes of the main frame, from its origin; itself of a motion without frames."""
        body = self.body
        if body is None:
            return self
        back = conjugate(body.attitude)
        return self._of(
            self.time,
            lambda x: turned(back, x - body.origin[:, None]),
            lambda x: turned(back, x),
            lambda f: (turned(back, (f.origin - body.origin)[:, None])[:, 0], product(back, f.attitude)),
            lambda x: x,
        )

    def refined(self) -> Motion:
        """The motion with surfaces of few quadrilaterals made smooth, for pictures."""
        return dataclasses.replace(self, surfaces=[surface.refined() for surface in self.surfaces])

    def carried(self, origin: Array, attitude: Array) -> Motion:
        """The motion with all of it turned by attitudes (nt, 4), then moved by origins (nt, 3): undoes `in_body`."""
        return self._of(
            self.time,
            lambda x: origin[:, None] + turned(attitude, x),
            lambda x: turned(attitude, x),
            lambda f: (origin + turned(attitude, f.origin[:, None])[:, 0], product(attitude, f.attitude)),
            lambda x: x,
        )

    def resampled(self, time: Array) -> Motion:
        """The motion at other times (k,), s: linear in the axes of the main frame, whose attitude turns evenly."""
        if self.time.size == 1:
            return dataclasses.replace(self.at(np.zeros(len(time), dtype=int)), time=time)
        high = np.clip(np.searchsorted(self.time, time, side="right"), 1, self.time.size - 1)
        low = high - 1
        share = np.clip((time - self.time[low]) / (self.time[high] - self.time[low]), 0.0, 1.0)

        def mixed(x: Array) -> Array:
            f = share.reshape(-1, *[1] * (x.ndim - 1))
            both = (1.0 - f) * x[low] + f * x[high]
            # one that is missing hides the other only between the two
            return np.where(f == 0.0, x[low], np.where(f == 1.0, x[high], both))

        def pose(frame: Frame) -> tuple[Array, Array]:
            q = frame.attitude
            step = rotation_vectors(product(conjugate(q[low]), q[high]))
            return mixed(frame.origin), product(q[low], from_rotation_vectors(share[:, None] * step))

        seen = self.in_body()._of(time, mixed, mixed, pose, mixed)
        return seen if self.body is None else seen.carried(*pose(self.body))

    def magnified(self) -> Motion:
        """The motion as pictures show it: displacements and rotations from their means enlarged by `magnification`."""
        factor = self.magnification
        if factor == 1.0:
            return self

        def enlarged(x: Array) -> Array:
            known = np.isfinite(x)
            mean = np.where(known, x, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
            return np.asarray(mean + factor * (x - mean))

        def pose(frame: Frame) -> tuple[Array, Array]:
            q = frame.attitude * np.where(frame.attitude @ frame.attitude[0] < 0.0, -1.0, 1.0)[:, None]
            mean = q.mean(axis=0, keepdims=True)
            mean = mean / np.linalg.norm(mean)
            step = rotation_vectors(product(conjugate(mean), q))
            return enlarged(frame.origin), product(mean, from_rotation_vectors(factor * step))

        found = self._of(self.time, enlarged, lambda x: x, pose, lambda x: x)
        title = f"{self.title} (displacements enlarged {factor:g} times)"
        return dataclasses.replace(found, title=title, magnification=1.0)

    def _of(
        self,
        time: Array,
        points: Callable[[Array], Array],
        vectors: Callable[[Array], Array],
        pose: Callable[[Frame], tuple[Array, Array]],
        values: Callable[[Array], Array],
    ) -> Motion:
        """A motion whose points, directions, poses of frames, and values are functions of those of this one."""

        def line(x: Line) -> Line:
            kept = {label: values(v) for label, v in x.values.items()}
            across = None if x.across is None else vectors(x.across)
            return dataclasses.replace(x, points=points(x.points), values=kept, across=across)

        def surface(x: Surface) -> Surface:
            kept, data = ({label: values(v) for label, v in of.items()} for of in (x.values, x.data))
            along = {label: vectors(v) for label, v in x.vectors.items()}
            return dataclasses.replace(
                x, points=points(x.points), normals=vectors(x.normals), values=kept, data=data, vectors=along
            )

        def frame(x: Frame) -> Frame:
            origin, attitude = pose(x)
            solids = []
            for s in x.solids:
                turned, scale = (None if v is None else values(v) for v in (s.turned, s.scale))
                solids.append(dataclasses.replace(s, turned=turned, scale=scale))
            marked, shown = (None if v is None else values(v) for v in (x.marked, x.shown))
            return dataclasses.replace(
                x, origin=origin, attitude=attitude, solids=solids, marked=marked, shown=shown
            )  # fmt: skip

        return dataclasses.replace(
            self,
            time=time,
            frames=[frame(x) for x in self.frames],
            lines=[line(x) for x in self.lines],
            surfaces=[surface(x) for x in self.surfaces],
            forces=[dataclasses.replace(x, points=points(x.points), vectors=vectors(x.vectors)) for x in self.forces],
            marks=[dataclasses.replace(x, points=points(x.points)) for x in self.marks],
            symbols=[frame(x) for x in self.symbols],
            numbers={label: values(v) for label, v in self.numbers.items()},
        )


# ------------------------------------------------------------------------------------------------ units


def name_and_unit(label: str) -> tuple[str, str]:
    """The parts of a label such as "tension [N]", the unit as it is shown, "1/m" for "m-1"; '' where there is none."""
    name, _, rest = label.partition(" [")
    unit = rest.removesuffix("]")
    return name, unit_text(unit) if unit else ""


def quantity(x: float, unit: str, digits: int = 3) -> str:
    """A value with its unit, with a prefix where that is shorter: 0.0021, "N" -> "2.1 mN"."""
    factor, prefixed = prefixed_unit(x, unit)
    return f"{float(f'{x / factor:.{digits}g}'):g} {prefixed}".strip()  # 880 of two digits, and not 8.8e+02


def prefixed_unit(x: float, unit: str) -> tuple[float, str]:
    """The unit with the prefix that suits a value, and how large it is: 0.0021, "N" -> (0.001, "mN")."""
    if unit not in ("m", "N", "N m", "J", "W", "Pa") or x == 0.0:
        return 1.0, unit
    steps = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
    factor, prefix = next((step for step in steps if abs(x) >= 0.9999 * step[0]), (1.0, ""))
    return factor, f"{prefix}{unit}"
