"""Clearances between the bodies of a run: signed distances over time, interference, and what lies between samples."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from evolvent import cases
from evolvent.analysis.clearance_bodies import Body, Surface, body, surface
from evolvent.analysis.clearance_results import Clearances
from evolvent.assembly.references import split_reference
from evolvent.families.beams.part import Beam
from evolvent.families.bodies.part import RigidBody
from evolvent.families.bodies.part_point import Point
from evolvent.families.coordinates.part_seam import Seam
from evolvent.families.joints.part import TOUCHING, Joint
from evolvent.families.rods.part import Rod
from evolvent.families.shells.part import Shell
from evolvent.families.threads.part import Thread
from evolvent.families.threads.part_reel import Reel
from evolvent.results.motion import quantity
from evolvent.results.tree import solution_of
from evolvent_base import __version__
from evolvent_base.errors import InputError, counted, nearest

Array = np.ndarray
#: Depth that counts as touching, of the radius about the smaller body.
_TOUCHING = 1e-6
#: Share of the smallest distance within which another one is the same.
_SAME = 1e-6
#: Steps of the penetration depth of round bodies: leaves at most 3e-4 of their radius.
_ITERATIONS = 256
#: Parts with an extent that are not checked.
_THIN = {"beam": Beam, "rod": Rod, "thread": Thread, "reel": Reel, "point mass": Point}
#: Intervals between samples that are written as one.
_NAMED = 3


def clearances(run: xr.DataTree, pairs: Iterable[Sequence[str]] | None = None) -> Clearances:
    """Signed distances between the rigid bodies of a run that have a shape, and its shells.

    Parameters
    ----------
    run : xarray.DataTree
    pairs : sequence of (name, name), optional
        Pairs of bodies and shells; left out, all pairs but those that a joint, which is not released, or a seam holds
        together.

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
    faster between samples than at both of them. A shell is its triangles with half of its thickness on both sides; of
    one, u is that of its fastest node, and between two shells the sum of those of both. Times at which an interference
    starts and ends are linear between samples. Depths below 1e-6 of the radius about the smaller body are contact.
    """
    parts = _parts(run)
    bodies = _bodies(parts)
    joined = _joined(parts, bodies)
    chosen = checked_pairs(parts, pairs)
    measure = _measure()
    seen = {name: _seen(run, name, bodies[name]) for name in dict.fromkeys(itertools.chain(*chosen))}
    time = run.to_dataset()["time"].values
    found = [_Pair(seen[a], seen[b], time, measure) for a, b in chosen]
    left_out = [] if pairs is not None else [f"{a!r} and {b!r}, held by {by!r}" for (a, b), by in joined.items()]
    return Clearances(_dataset(time, found, {
        "title": str(run.attrs.get("title", "")), "source": f"evolvent {__version__}",
        "left_out": json.dumps(left_out), "not_checked": json.dumps(_not_checked(parts, bodies)),
    }))  # fmt: skip


def checked_pairs(parts: Mapping[str, Any], pairs: Iterable[Sequence[str]] | None = None) -> list[tuple[str, str]]:
    """Pairs of bodies whose clearances are found: those that are asked for, or all that nothing holds together.

    Raises
    ------
    InputError
        If a pair is none, or there is none.
    """
    bodies = _bodies(parts)
    if pairs is not None:
        return [_pair(pair, bodies) for pair in pairs]
    joined = _joined(parts, bodies)
    chosen = _pairs(bodies, joined)
    if not chosen:
        why = "every pair of them is held by a joint" if joined else f"{counted(len(bodies), 'body', 'bodies')} has one"
        raise InputError(f"no clearance can be found: it is that of two rigid bodies with a shape or shells, and {why}")
    return chosen


def _bodies(parts: Mapping[str, Any]) -> dict[str, Any]:
    """Parts that are checked, by name."""
    return {name: part for name, part in parts.items() if _has_surface(part)}


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


def _has_surface(part: Any) -> bool:
    """Whether a part is checked."""
    return isinstance(part, Shell) or (isinstance(part, RigidBody) and part.shape is not None)


def _joined(parts: Mapping[str, Any], bodies: Mapping[str, Any]) -> dict[tuple[str, str], str]:
    """Pairs of bodies that a joint holds together to the end of the run, and the joint's name."""
    order, found = list(bodies), {}
    for name, part in parts.items():
        if isinstance(part, Joint):
            if part.type not in TOUCHING or part.until is not None or part.released_by is not None:
                continue
        elif not isinstance(part, Seam):
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
            raise InputError(f"{name!r} is no rigid body with a shape and no shell; {nearest(str(name), bodies)}")
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


def _seen(run: xr.DataTree, name: str, part: Any) -> Body | Surface:
    """Motion of a body or a surface at the samples."""
    return surface(run, name, part) if isinstance(part, Shell) else body(run, name, part.shape)


# ------------------------------------------------------------------------------------------------ one pair


class _Pair:
    """Distances of two bodies at the samples: bounds by spheres, exact where it matters."""

    def __init__(self, a: Body | Surface, b: Body | Surface, time: Array, coal: Any) -> None:
        self.a, self.b, self._time, self._coal = a, b, time, coal
        self._request = coal.DistanceRequest()
        self._request.enable_signed_distance = True
        self._request.epa_max_iterations = _ITERATIONS
        reach = a.radius + b.radius
        self.d = np.linalg.norm(b.x - a.x, axis=1) - reach
        self.exact = ~np.isfinite(self.d)  # what is not finite stays as it is
        self._find(np.flatnonzero(self.d < reach))
        self._find_smallest()
        self._touching = _TOUCHING * min(float(np.max(a.radius)), float(np.max(b.radius)))
        self._inside = self.d < -self._touching
        self._find(np.flatnonzero(np.convolve(self._inside, [1, 1, 1])[1:-1]))
        self.least_between, self.gaps = self._between()

    def _find(self, samples: Array) -> None:
        """Make the distances of samples exact."""
        for k in samples:
            if not self.exact[k]:
                whole = self._distance(self.a.placed(self._coal, k), self.b.placed(self._coal, k))
                if whole < 0.0 and self.a.half + self.b.half > 0.0:  # of one facet: the deepest one is wanted
                    whole = self._deepest(k)
                self.d[k] = whole - self.a.half - self.b.half
                self.exact[k] = True

    def _deepest(self, k: int) -> float:
        """Least distance of facets at sample k, of which one is inside.

        coal finds no depth where the centre of a round body lies in the plane of a facet; it is moved a little then.
        """
        reach = float(np.max(self.a.radius) + np.max(self.b.radius))
        others = [*self.b.facets(self._coal, k)]
        least = 0.0
        for one in self.a.facets(self._coal, k):
            for other, place in others:
                found, way = self._distance(one, (other, place)), np.array([0.36, 0.48, 0.8])
                for size in (1e-9, 1e-7, 1e-5):
                    if found >= -reach:
                        break
                    moved = self._coal.Transform3s(place.getRotation(), place.getTranslation() + size * reach * way)
                    found = self._distance(one, (other, moved))
                least = min(least, found) if found >= -reach else least
        return least

    def _distance(self, one: tuple[Any, Any], other: tuple[Any, Any]) -> float:
        """Distance of two placed geometries."""
        return float(self._coal.distance(*one, *other, self._request, self._coal.DistanceResult()))

    def _find_smallest(self) -> None:
        """Make distances exact until the smallest one is."""
        while np.isfinite(self.d).any() and not self.exact[k := int(np.nanargmin(self.d))]:
            self._find(np.array([k]))

    def _speed(self) -> Array:
        """Bound (nt,) of the velocity of points of one body in the axes of the other, m/s."""
        found = [p.speed_of(q) for p, q in ((self.a, self.b), (self.b, self.a))]
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
        least = float(np.nanmin(self.d))
        k = int(np.argmax(self.exact & (self.d <= least + _SAME * abs(least))))
        return least, float(self._time[k])

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
