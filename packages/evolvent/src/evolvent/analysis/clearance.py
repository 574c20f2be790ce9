"""Clearances between the bodies of a run: signed distances over time, interference, and what lies between samples."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from evolvent import cases
from evolvent.analysis.clearance_results import Clearances
from evolvent.assembly.references import split_reference
from evolvent.families.beams.part import Beam
from evolvent.families.bodies.part import RigidBody
from evolvent.families.bodies.part_point import Point
from evolvent.families.joints.part import TOUCHING, Joint
from evolvent.families.rods.part import Rod
from evolvent.families.threads.part import Thread
from evolvent.families.threads.part_reel import Reel
from evolvent.parts.shapes import Box, Capsule, Cylinder, Sphere
from evolvent.results import variables
from evolvent.results.motion import quantity, rotation_matrices
from evolvent.results.solids import Solid
from evolvent.results.tree import solution_of
from evolvent_base import __version__
from evolvent_base.errors import InputError, counted, nearest

Array = np.ndarray
#: Depth that counts as touching, of the radius about the smaller body.
_TOUCHING = 1e-6
#: Steps of the penetration depth of round bodies: leaves at most 3e-4 of their radius.
_ITERATIONS = 256
#: Parts with an extent that are not checked.
_THIN = {"beam": Beam, "rod": Rod, "thread": Thread, "reel": Reel, "point mass": Point}
#: Intervals between samples that are written as one.
_NAMED = 3


class Body(NamedTuple):
    """A body with a shape along a run.

    Attributes
    ----------
    name : str
    shape : Box, Cylinder, Sphere or Capsule
    x, v : (nt, 3) float, m and m/s, centre and its velocity, inertial axes
    R : (nt, 3, 3) float, rotation matrices from the axes of its geometry to inertial axes
    w : (nt, 3) float, rad/s, angular velocity, inertial axes
    radius : float, m, of the sphere about the centre that holds the body
    """

    name: str
    shape: Any
    x: Array
    v: Array
    R: Array
    w: Array
    radius: float


def clearances(run: xr.DataTree, pairs: Iterable[Sequence[str]] | None = None) -> Clearances:
    """Signed distances between the rigid bodies of a run that have a shape.

    Parameters
    ----------
    run : xarray.DataTree
    pairs : sequence of (name, name), optional
        Pairs of bodies; left out, all pairs but those that a joint, which is not released, holds together.

    Returns
    -------
    Clearances, whose ``dataset`` holds them

    Raises
    ------
    InputError
        If the package coal is missing, the shapes are not known, a pair is none, or there is none to check.

    Notes
    -----
    From one sample to the next, dt apart, a distance changes by no more than u dt, where u is the largest velocity of
    a point of one body in the axes of the other: ``|v_b - v_a - w_a x (x_b - x_a)| + |w_b - w_a| r_b``, the smaller
    one of both ways and the larger one of both samples. So it stays above ``(d_0 + d_1 - u dt)/2``, unless bodies move
    faster between samples than at both of them. Times at which an interference starts and ends are linear between
    samples. Depths below 1e-6 of the radius about the smaller body are contact.
    """
    parts = _parts(run)
    bodies = {name: part for name, part in parts.items() if isinstance(part, RigidBody) and part.shape is not None}
    joined = _joined(parts, bodies)
    chosen = _pairs(bodies, joined) if pairs is None else [_pair(pair, bodies) for pair in pairs]
    if not chosen:
        why = "every pair of them is held by a joint" if joined else f"{counted(len(bodies), 'body', 'bodies')} has one"
        raise InputError(f"no clearance can be found: it is that of two rigid bodies with a shape, and {why}")
    measure = _measure()
    seen = {name: _body(run, name, bodies[name].shape) for name in dict.fromkeys(itertools.chain(*chosen))}
    time = run.to_dataset()["time"].values
    found = [_Pair(seen[a], seen[b], time, measure) for a, b in chosen]
    left_out = [] if pairs is not None else [f"{a!r} and {b!r}, held by {by!r}" for (a, b), by in joined.items()]
    return Clearances(_dataset(time, found, {
        "title": str(run.attrs.get("title", "")), "source": f"evolvent {__version__}",
        "left_out": json.dumps(left_out), "not_checked": json.dumps(_not_checked(parts, bodies)),
    }))  # fmt: skip


def check_package() -> None:
    """Refuse where the package coal is missing."""
    _measure()


def _measure() -> Any:
    """The package that finds distances."""
    try:
        import coal  # an extra
    except ImportError:
        raise InputError("clearances need the package coal; pip install 'evolvent[clearance]' brings it") from None
    return coal


# ------------------------------------------------------------------------------------------------ bodies and pairs


def _parts(run: xr.DataTree) -> Mapping[str, Any]:
    """Parts of a run by name, of its states in memory or of its case."""
    solution = solution_of(run)
    if solution is not None:
        return dict(solution.assembly.parts)
    text = str(run.attrs.get("case", ""))
    if not text or json.loads(run.attrs.get("laws", "{}")):
        raise InputError("the run does not hold its whole case, as it has a law in Python, and so no shapes of bodies")
    cases.check_files_of_run(run)
    case = cases.of_run(text)
    return dict(cases.system(case.system).system(case).parts)


def _joined(parts: Mapping[str, Any], bodies: Mapping[str, Any]) -> dict[tuple[str, str], str]:
    """Pairs of bodies that a joint holds together to the end of the run, and the joint's name."""
    order, found = list(bodies), {}
    for name, part in parts.items():
        if not isinstance(part, Joint) or part.type not in TOUCHING:
            continue
        if part.until is not None or part.released_by is not None:
            continue
        a, b = _owner(part.a), _owner(part.b)
        if a in bodies and b in bodies and a != b:
            found[min((a, b), (b, a), key=lambda pair: order.index(pair[0]))] = name
    return found


def _owner(reference: Any) -> str:
    """Name of the part that a point is of, '' of the ground."""
    if isinstance(reference, str):
        return split_reference(reference)[0]
    return reference[0] if isinstance(reference[0], str) else ""


def _pairs(bodies: Mapping[str, Any], joined: Mapping[tuple[str, str], str]) -> list[tuple[str, str]]:
    """All pairs that no joint holds together."""
    return [pair for pair in itertools.combinations(bodies, 2) if pair not in joined]


def _pair(given: Sequence[str], bodies: Mapping[str, Any]) -> tuple[str, str]:
    """A pair that was asked for."""
    if isinstance(given, str) or len(given) != 2:
        raise InputError(f"a pair is {given!r}; it must be two names of bodies, such as ('panel 1', 'bus')")
    for name in given:
        if name not in bodies:
            raise InputError(f"{name!r} is no rigid body with a shape; {nearest(str(name), bodies)}")
    a, b = given
    if a == b:
        raise InputError(f"a pair is {a!r} twice; it must be two bodies")
    return a, b


def _not_checked(parts: Mapping[str, Any], bodies: Mapping[str, Any]) -> list[str]:
    """Parts with an extent, or masses, that are not checked, kind by kind."""
    kinds = {
        "rigid body without a shape": [n for n, p in parts.items() if isinstance(p, RigidBody) and n not in bodies]
    }
    kinds |= {kind: [n for n, p in parts.items() if isinstance(p, of)] for kind, of in _THIN.items()}
    return [
        f"{kind} {', '.join(map(repr, names[:_NAMED]))}"
        + (f" and {len(names) - _NAMED} more" if names[_NAMED:] else "")
        for kind, names in kinds.items()
        if names
    ]


def _body(run: xr.DataTree, name: str, shape: Any) -> Body:
    """Poses and rates of a body at the samples."""
    x, q, v, own = (variables.get(run, f"{name}.{key}").values for key in ("position", "attitude", "velocity", "rate"))
    R = rotation_matrices(q)
    w = np.einsum("tij,tj->ti", R, own)
    solid = _solid(shape)
    return Body(name, shape, x, v, R if isinstance(shape, Box) else R @ solid.basis[:, [1, 2, 0]], w, solid.size)


def _solid(shape: Any) -> Solid:
    """The solid of a shape, which has its axes and its radius."""
    match shape:
        case Box():
            return Solid.box(shape.size)
        case Cylinder():
            return Solid.cylinder(shape.radius, shape.span, axis=shape.axis)
        case Capsule():
            half = 0.5 * shape.length + shape.radius
            return Solid.revolution([(-half, 0.0), (half, 0.0)], axis=shape.axis)
        case Sphere():
            return Solid.sphere(shape.radius)
    raise InputError(f"a shape is {type(shape).__name__}; clearances take boxes, cylinders, spheres and capsules")


def _geometry(coal: Any, shape: Any) -> Any:
    """A shape as coal has it, its axis along z.

    A sphere is a capsule without length: the closed form of coal 3.0.3 for the depth of a sphere in a cylinder takes
    the wrong way out where the centre of the sphere is inside.
    """
    match shape:
        case Box():
            return coal.Box(*shape.size)
        case Cylinder():
            return coal.Cylinder(shape.radius, shape.span)
    return coal.Capsule(shape.radius, getattr(shape, "length", 0.0))


# ------------------------------------------------------------------------------------------------ one pair


class _Pair:
    """Distances of two bodies at the samples: bounds by spheres, exact where it matters."""

    def __init__(self, a: Body, b: Body, time: Array, coal: Any) -> None:
        self.a, self.b, self._time, self._coal = a, b, time, coal
        self._shapes = _geometry(coal, a.shape), _geometry(coal, b.shape)
        self._request = coal.DistanceRequest()
        self._request.enable_signed_distance = True
        self._request.epa_max_iterations = _ITERATIONS
        reach = a.radius + b.radius
        self.d = np.linalg.norm(b.x - a.x, axis=1) - reach
        self.exact = ~np.isfinite(self.d)  # what is not finite stays as it is
        self._find(np.flatnonzero(self.d < reach))
        self._find_smallest()
        self._touching = _TOUCHING * min(a.radius, b.radius)
        self._inside = self.d < -self._touching
        self._find(np.flatnonzero(np.convolve(self._inside, [1, 1, 1])[1:-1]))
        self.least_between, self.gaps = self._between()

    def _find(self, samples: Array) -> None:
        """Make the distances of samples exact."""
        coal, (A, B), (a, b) = self._coal, self._shapes, (self.a, self.b)
        for k in samples:
            if not self.exact[k]:
                places = coal.Transform3s(a.R[k], a.x[k]), coal.Transform3s(b.R[k], b.x[k])
                self.d[k] = coal.distance(A, places[0], B, places[1], self._request, coal.DistanceResult())
                self.exact[k] = True

    def _find_smallest(self) -> None:
        """Make distances exact until the smallest one is."""
        while np.isfinite(self.d).any() and not self.exact[k := int(np.nanargmin(self.d))]:
            self._find(np.array([k]))

    def _speed(self) -> Array:
        """Bound (nt,) of the velocity of points of one body in the axes of the other, m/s."""
        a, b = self.a, self.b
        found = []
        for p, q in ((a, b), (b, a)):
            centre = q.v - p.v - np.cross(p.w, q.x - p.x)
            found.append(np.linalg.norm(centre, axis=1) + np.linalg.norm(q.w - p.w, axis=1) * q.radius)
        return np.minimum(*found)

    def _between(self) -> tuple[float, Array]:
        """Bound of the distance over all time, m, and intervals whose bodies may touch unseen between two samples."""
        u, dt = self._speed(), np.diff(self._time)
        change = np.maximum(u[1:], u[:-1]) * dt
        for _ in range(2):  # by bounds of the distances, then by the distances where these matter
            low = 0.5 * (self.d[1:] + self.d[:-1] - change)
            k = np.flatnonzero(low < max(self.smallest[0], 0.0))
            self._find(np.concatenate([k, k + 1]))
        low = 0.5 * (self.d[1:] + self.d[:-1] - change)
        least = min(float(np.nanmin(low, initial=np.inf)), self.smallest[0])
        apart = ~self._inside[1:] & ~self._inside[:-1] & (np.maximum(self.d[1:], self.d[:-1]) > self._touching)
        return least, np.flatnonzero(apart & (low < -self._touching))

    @property
    def smallest(self) -> tuple[float, float]:
        """Smallest distance, m, and the first time of it, s."""
        if not np.isfinite(self.d).any():
            return np.nan, np.nan
        k = int(np.nanargmin(self.d))
        return float(self.d[k]), float(self._time[k])

    def interferences(self) -> list[tuple[float, float, float]]:
        """Start and end, s, and depth, m."""
        edges = np.flatnonzero(np.diff(np.concatenate([[False], self._inside, [False]]).astype(int)))
        found = []
        for first, last in zip(edges[::2], edges[1::2] - 1, strict=True):
            start = self._crossing(first, first - 1) if first > 0 else self._time[first]
            end = self._crossing(last, last + 1) if last + 1 < self._time.size else self._time[last]
            found.append((float(start), float(end), float(-self.d[first : last + 1].min())))
        return found

    def _crossing(self, inside: int, outside: int) -> float:
        """Time at which the distance is zero between two samples, linear."""
        d, t = self.d, self._time
        share = d[inside] / (d[inside] - max(d[outside], 0.0))
        return float(t[inside] + share * (t[outside] - t[inside]))

    def warning(self) -> str:
        """Sentence on intervals in which the bodies may have touched unseen, '' for none."""
        if not self.gaps.size:
            return ""
        k, ways = self.gaps, f"{self.a.name!r} and {self.b.name!r}"
        many = "one interval" if k.size == 1 else f"{k.size} intervals"
        return (
            f"{ways} may touch unseen between samples, by their rates, in {many}, the first from t = "
            f"{self._time[k[0]]:.5g} s to {self._time[k[0] + 1]:.5g} s; take samples that are closer together"
        )


# ------------------------------------------------------------------------------------------------ results


def _dataset(time: Array, found: list[_Pair], attrs: dict[str, Any]) -> xr.Dataset:
    """All pairs as a data set."""
    struck, sentences = [], []
    for k, pair in enumerate(found):
        if times := pair.interferences():
            struck += [(k, *one) for one in times]
            start, end, depth = max(times, key=lambda one: one[2])
            until = "to the end" if end == time[-1] else f"to {end:.5g} s"
            more = f", and less deep in {counted(len(times) - 1, 'more interval')}" if times[1:] else ""
            sentences.append(f"{pair.a.name!r} is up to {quantity(depth, 'm')} inside {pair.b.name!r} from t = "
                             f"{start:.5g} s {until}{more}")  # fmt: skip

    def of(dims: Any, values: Any, unit: str, text: str) -> tuple[Any, Array, dict[str, str]]:
        return dims, np.asarray(values), {"units": unit, "long_name": text}

    index, begin, finish, depths = (np.array(struck) if struck else np.zeros((0, 4))).T
    both = ("time", "pair")
    pair_names = [f"{pair.a.name} - {pair.b.name}" for pair in found]
    return xr.Dataset(
        {
            "clearance": of(both, np.stack([p.d for p in found], 1), "m", "distance, negative: depth of interference"),
            "exact": of(both, np.stack([p.exact for p in found], 1).astype("i1"), "1", "1, or 0 of a lower bound"),
            "smallest": of("pair", [p.smallest[0] for p in found], "m", "smallest clearance at the samples"),
            "time_of_smallest": of("pair", [p.smallest[1] for p in found], "s", "time of the smallest clearance"),
            "least_between": of("pair", [p.least_between for p in found], "m", "lower bound, between samples too"),
            "between": of("interference", index.astype(int), "1", "index of the pair"),
            "start": of("interference", begin, "s", "start of the interference"),
            "end": of("interference", finish, "s", "end of the interference"),
            "depth": of("interference", depths, "m", "largest depth"),
        },
        {
            "time": of("time", time, "s", "time"), "pair": ("pair", pair_names),
            "a": ("pair", [p.a.name for p in found]), "b": ("pair", [p.b.name for p in found]),
        },
        attrs | {
            "sentences": json.dumps(sentences), "warnings": json.dumps([w for p in found if (w := p.warning())]),
        },
    )  # fmt: skip
