"""What a net is as a reflector: lengths to cut, tensions, errors of the surface, tolerances, heat and adjustment."""

from __future__ import annotations

import csv
import dataclasses
import io
from collections.abc import Iterator
from typing import Any

import numpy as np
import scipy

from evolvent.analysis import reflector_figures
from evolvent.analysis.reflector import NetInSystem, State
from evolvent.analysis.reflector_after import AfterRun, surface_after
from evolvent.analysis.reflector_keys import ReflectorKeys
from evolvent.assembly.assembled import Assembly
from evolvent.families.nets.cords import names
from evolvent.families.nets.part_ties import Behind
from evolvent.nets.error import POINTS, SurfaceError, quadrature, ruze, signed_areas, slant
from evolvent.results import made_with
from evolvent.results.motion import quantity
from evolvent_base import answer as an, safe_open
from evolvent_base.errors import InputError, nearest
from evolvent_base.figures import Figure
from evolvent_base.showing import Shown

Array = np.ndarray
#: Surfaces that are drawn for tolerances, and the rank of the one that bounds 95 % of all with 95 % of confidence:
#: of n draws the smallest k with P(Binomial(n, 0.95) < k) >= 0.95.
DRAWS, _SEED = 1000, 20031
#: Factor of heights from which on the best fit is another reflector than the wanted one.
_OTHER = 1.25
#: Area of a facet in the plane x, y, beside that in the topology, that is none.
_TURNED = 1e-6
#: How far a measured node may be from its place, beside the diameter of the aperture.
_FAR = 0.1
#: Cords in the table of sensitivities.
_MOST = 8


@dataclasses.dataclass(frozen=True)
class Tolerance:
    """What errors of the cut lengths do to the best fit.

    Attributes
    ----------
    length_error : float, m, standard deviation of every length
    bound : float, m, rms of the half path error about the best fit that 95 % of all reflectors keep, with 95 % of
        confidence, by the order statistics of `DRAWS` surfaces
    allowed : float, m, standard deviation whose bound is the limit; None without a limit, 0 where no error is allowed
    """

    length_error: float
    bound: float
    allowed: float | None


@dataclasses.dataclass(frozen=True)
class Adjusted:
    """Lengths that cancel a measured surface.

    Attributes
    ----------
    cords : (k,) int; change : (k,) float, m, by which each is made longer
    before, after : float, m, rms of the axial error of the measured nodes, and what the linear response leaves
    """

    cords: Array
    change: Array
    before: float
    after: float


class ReflectorResults(Shown):
    """A net as a reflector.

    Attributes
    ----------
    net : evolvent.parts.Net; topology : its nodes in the plane, cords and facets
    x : (n, 3) float, m, nodes in equilibrium, axes of the net
    cut_lengths, length, tension : (m,) float, m and N, of the cords: of the net, of its rear net, ties
    error : evolvent.nets.error.SurfaceError
    sensitivity : (m,) float, of the rms of the half path error by the lengths of the cords
    tolerance : Tolerance
    warm : SurfaceError at the change of temperature; None without
    adjusted : Adjusted; None without a measured surface
    after : AfterRun; None without a run
    """

    named, endings = "results of a reflector", (".json", ".csv")

    def __init__(self, assembly: Assembly, keys: ReflectorKeys, *, title: str = "", case: str = "") -> None:
        self.keys, self.title, self.case = keys, title, case
        self.name = _net_of(assembly, keys.net)
        self._of = NetInSystem(assembly, self.name)
        self.state: State = self._of.formed()
        self.net, self.topology = self._of.net, self._of.topology
        self.x, self.cut_lengths = self.state.x, self.state.natural
        self.length, self.tension = self.state.length, self.state.tension
        self.error: SurfaceError = self._of.error(self.state)
        self._response = response = self._of.response(self.state)
        square, slope = self._of.mean_square_slope(self.state)
        self.sensitivity = response.gradient(slope) / (2.0 * np.sqrt(square))
        self.tolerance = self._tolerance()
        self.warm_state = None if keys.temperature is None else self._warm(keys.temperature)
        self.warm = None if self.warm_state is None else self._of.error(self.warm_state)
        self.adjusted = None if keys.measured is None else self._adjusted(keys.measured)
        self.after: AfterRun | None = None if keys.after is None else surface_after(keys.after, self._of, self.x)

    # ---------------------------------------------------------------------------------------------- what follows

    def _tolerance(self) -> Tolerance:
        """Bound of the best fit by errors of lengths, and the errors that a limit allows."""
        surface, facets = self.net.surface, self.topology.facets
        points, weights = quadrature(self.x, facets)
        share = np.sqrt(weights / weights.sum())
        cosine = slant(surface, points[:, 0], points[:, 1])
        one, two = surface.slopes(points[:, 0], points[:, 1])
        off = (points[:, 2] - surface.height(points[:, 0], points[:, 1])) * cosine
        draws = np.random.default_rng(_SEED).standard_normal((len(self.tension), DRAWS))
        on_facets = _interpolation(facets, len(self.topology.plan))
        # what the error at the points changes with the places of the nodes, all x first, then y, z
        by_place = scipy.sparse.hstack([
            scipy.sparse.diags(share * cosine * slope) @ on_facets for slope in (-one, -two, np.ones_like(one))
        ]).tocsr()  # fmt: skip
        # less what the best fit follows: shifts, tilts and the scale of heights
        x, y = points[:, 0], points[:, 1]
        height = surface.height(x, y)
        fits = np.stack([one, two, np.ones_like(one), y + height * two, x + height * one, height], axis=1)
        A = (share * cosine)[:, None] * fits
        sizes = np.linalg.norm(A, axis=0)
        Q = np.linalg.qr(A[:, sizes > 0.0] / sizes[sizes > 0.0])[0]
        base = share * off
        base = base - Q @ (Q.T @ base)
        # squares of base + sigma T, T = (1 - Q Q^T) by_place u of the displacements u of a draw
        u = self._response.moves(draws).transpose(1, 0, 2).reshape(-1, DRAWS)
        followed = (by_place.T @ Q).T @ u
        square = np.einsum("ij,ij->j", u, (by_place.T @ by_place) @ u) - np.einsum("ij,ij->j", followed, followed)
        c0, linear, square = float(base @ base), 2.0 * (by_place.T @ base) @ u, np.maximum(square, 0.0)
        rank = _rank(DRAWS)

        def bound(sigma: float) -> float:
            squares = c0 + sigma * linear + sigma * sigma * square
            return float(np.sqrt(np.sort(np.maximum(squares, 0.0))[rank]))

        limit, allowed = self.keys.limit, None
        if limit is not None:
            low, high = 0.0, limit / max(float(np.sqrt(np.median(square))), 1e-300)
            while bound(high) < limit:
                high *= 2.0
            for _ in range(60):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if bound(middle) <= limit else (low, middle)
            allowed = low if bound(0.0) <= limit else 0.0
        return Tolerance(self.keys.length_error, bound(self.keys.length_error), allowed)

    def _warm(self, change: float) -> State:
        """The net at a change of temperature."""
        if self.net.thermal_expansion is None:
            raise InputError(f"reflector.temperature is given, but {self.name}.thermal_expansion is missing; give it")
        together = f"the sum of {self.name}.temperature and reflector.temperature"
        strain = self.net.heat(self.name, together, self.net.temperature + change)
        self._of.cut(self.cut_lengths, strain)
        try:
            return self._of.equilibrium(self.state.y)
        finally:
            self._of.cut(self.cut_lengths)

    def _adjusted(self, path: str) -> Adjusted:
        """Lengths that bring a measured surface to the wanted one, by least squares."""
        nodes, places = _measured(path, len(self.topology.plan))
        off = np.linalg.norm(places - self.x[nodes], axis=1)
        if off.max() > _FAR * self.net.surface.diameter:
            k = int(off.argmax())
            raise InputError(
                f"reflector.measured is {path!r}, whose node {nodes[k]} is {off[k]:.4g} m from its place in the net; "
                f"it must be within {_FAR * self.net.surface.diameter:.3g} m: give places in m, in the axes of the net"
            )
        off = places[:, 2] - self.net.surface.height(places[:, 0], places[:, 1])
        cords = self.choice(self.keys.adjust)
        one, two = self.net.surface.slopes(places[:, 0], places[:, 1])
        moved = self._response.moves(np.eye(len(self.tension))[:, cords])[nodes]
        S = moved[:, 2] - one[:, None] * moved[:, 0] - two[:, None] * moved[:, 1]
        change = np.linalg.lstsq(S, -off, rcond=1e-9)[0]
        left = off + S @ change
        return Adjusted(cords, change, float(np.sqrt(np.mean(off**2))), float(np.sqrt(np.mean(left**2))))

    def choice(self, which: str) -> Array:
        """Numbers of the ties, of the cords of the nets, or of all."""
        count, m = len(self.topology.cords), len(self.tension)
        nets = count * (2 if isinstance(self.net.ties, Behind) else 1)
        if which == "ties" and nets == m:
            raise InputError(f"reflector.adjust is 'ties', but {self.name!r} has none; give 'cords'")
        return {"ties": np.arange(nets, m), "cords": np.arange(nets), "all": np.arange(m)}[which]

    def error_of(self, position: Any) -> SurfaceError:
        """Error of the surface of the net in another state, such as after a deployment.

        Parameters
        ----------
        position : (n, 3) float, m, of the nodes, inertial axes: ``run["net"].position[-1]``

        Raises
        ------
        InputError
            For positions of another shape, and for a net without facets.
        """
        x, count = np.asarray(position, dtype=float), len(self._of.iq)
        if x.shape != (count, 3):
            raise InputError(f"position has the shape {x.shape}; it must be {(count, 3)}, the nodes of {self.name!r}")
        return self._of.error_of(self.net.seen(x))

    @property
    def node_count(self) -> int:
        """Number of nodes of the net and of its rear net, without anchors."""
        return len(self.topology.plan) * (2 if isinstance(self.net.ties, Behind) else 1)

    @property
    def fails(self) -> list[str]:
        """What a reflector must not have, one sentence each."""
        slack, limit = int((self.tension <= 0.0).sum()), self.keys.limit
        found = [f"{slack} of {len(self.tension)} cords are slack"] if slack else []
        if self.warm_state is not None and (slack := int((self.warm_state.tension <= 0.0).sum())):
            found.append(
                f"at {self.keys.temperature:+g} K {slack} of {len(self.tension)} cords are slack, and the surface is "
                f"one of several"
            )
        plan = signed_areas(self.topology.plan, self.topology.facets)
        if over := int((signed_areas(self.x, self.topology.facets) * plan <= _TURNED * plan**2).sum()):
            found.append(f"{over} of {len(plan)} facets are turned over, or have no area, beside those of the topology")
        found += [
            f"the surface{when} that fits best has {error.fit.scale:.3g} times the heights of the wanted one: neither "
            f"its rms nor the loss of gain is that of a feed at the wanted focus"
            for when, error in self._errors()
            if not 1.0 / _OTHER < error.fit.scale < _OTHER
        ]
        if limit is not None and self.tolerance.bound > limit:
            found.append(
                f"with lengths that are {quantity(self.keys.length_error, 'm')} wrong 95 % of all reflectors keep "
                f"{quantity(self.tolerance.bound, 'm')} rms about the best fit; the limit is {quantity(limit, 'm')}"
            )
        return found

    @property
    def unknown(self) -> list[str]:
        """What best fits do not tell, one sentence each."""
        return [
            f"the surface{when} does not determine {', '.join(error.fit.undetermined)} of its best fit: other values "
            f"fit as well"
            for when, error in self._errors()
            if error.fit.undetermined
        ]

    def _errors(self) -> Iterator[tuple[str, SurfaceError]]:
        """Errors of all surfaces, each with words for when it is such."""
        yield "", self.error
        if self.warm is not None:
            yield f" at {self.keys.temperature:+g} K", self.warm
        if self.after is not None:
            yield " after the run", self.after.error

    def called(self, k: int) -> str:
        """Name of a cord in tables: what it is, and the nodes that it joins."""
        count, n = len(self.topology.cords), len(self.topology.plan)
        rear = isinstance(self.net.ties, Behind)
        a, b = self._of.cords[k].tolist()
        if k < count:
            return f"cord {a}-{b}"
        return f"rear cord {a - n}-{b - n}" if rear and k < 2 * count else f"tie {a}"

    # ---------------------------------------------------------------------------------------------------- answer

    def answer(self) -> an.Answer:
        """Facts, tables, figures, files."""
        least = int(self.tension.argmin())
        facts = [
            ("nodes, cords, facets", f"{self.node_count}, {len(self.tension)}, {len(self.topology.facets)}"),
            ("least tension", f"{quantity(float(self.tension[least]), 'N')} ({self.called(least)})"),
            ("rms of the best fit", quantity(self.error.fit.rms, "m")),
        ]
        sections = [
            an.Section(title="Surface", blocks=[an.Table.of(self.surface_rows())]),
            an.Section(title="Cords", blocks=[an.Table.of(self.cord_rows())]),
            an.Section(title="Errors of lengths", blocks=[an.Table.of(self.tolerance_rows())]),
            an.Section(title="Most sensitive cords", blocks=[an.Table.of(self.sensitivity_rows())], level=an.DETAIL),
        ]
        if self.after is not None:
            sections.insert(1, an.Section(title="Surface after the run", blocks=[an.Table.of(self.after_rows())]))
        if self.adjusted is not None:
            sections.append(an.Section(title="Adjustment", blocks=[an.Table.of(self.adjustment_rows(), most=12)]))
        sections += [an.Section(title=one.title, blocks=[one], level=an.PAGE) for one in self.figures()]
        if self.case:
            sections.append(an.Section(title="Case", blocks=[an.Listing(self.case)], level=an.PAGE))
        return an.Answer(
            title=f"Reflector {self.name!r}" + (f" of {self.title}" if self.title else ""), facts=facts,
            warnings=[*self.fails, *self.unknown], sections=sections,
            notes=list(self.notes()), made=made_with(),
            files={"reflector.json": lambda: an.as_json(self.to_dict()), "reflector.csv": self._csv},
        )  # fmt: skip

    def surface_rows(self) -> list[list[str]]:
        """Errors of the surface: a head, then a row each."""
        fit = self.error.fit
        rows = [["error", "value"], *([name, quantity(value, "m")] for name, value in _named(self.error).items())]
        rows.append(["shift of the best fit x, y, z", ", ".join(quantity(float(one), "m") for one in fit.shift)])
        rows.append(["tilt of the best fit about x, y", ", ".join(f"{1e3 * one:.3g} mrad" for one in fit.turn)])
        focal = getattr(self.net.surface, "focal_length", None)
        if focal is not None:
            rows.append(["focal length of the best fit", f"{focal / fit.scale:.6g} m (wanted {focal:g} m)"])
        if self.keys.frequency is not None:
            loss = ruze(fit.rms, self.keys.frequency)
            rows.append([f"loss of gain at {self.keys.frequency / 1e9:g} GHz (Ruze)", f"{loss:.3g} dB"])
        if self.warm is not None and self.keys.temperature is not None:
            warm, by = self.warm, f"{self.keys.temperature:+g} K"
            rows.append([f"rms of half the path about the best fit at {by}", quantity(warm.fit.rms, "m")])
            shift = (warm.fit.shift - fit.shift)[2]
            rows.append([f"shift of the vertex at {by}", quantity(float(shift), "m")])
            if focal is not None:
                changed = focal / warm.fit.scale - focal / fit.scale
                rows.append([f"change of the focal length at {by}", quantity(changed, "m")])
        return rows

    def after_rows(self) -> list[list[str]]:
        """The same errors after the run, beside those in equilibrium."""
        found = self.after
        assert found is not None
        rows = [["error", "in equilibrium", "after the run"]]
        now = _named(found.error)
        rows += [[name, quantity(value, "m"), quantity(now[name], "m")] for name, value in _named(self.error).items()]
        focal = getattr(self.net.surface, "focal_length", None)
        if focal is not None:
            fits = [f"{focal / one.fit.scale:.6g} m" for one in (self.error, found.error)]
            rows.append(["focal length of the best fit", *fits])
        if self.keys.frequency is not None:
            losses = [f"{ruze(one.fit.rms, self.keys.frequency):.3g} dB" for one in (self.error, found.error)]
            rows.append([f"loss of gain at {self.keys.frequency / 1e9:g} GHz (Ruze)", *losses])
        rows.append(["largest distance of a node from equilibrium", "", quantity(found.moved, "m")])
        rows.append(["slack cords in the last sample", "", str(found.slack)])
        return rows

    def cord_rows(self) -> list[list[str]]:
        """Tensions and lengths of each kind of cords."""
        count, rear = len(self.topology.cords), isinstance(self.net.ties, Behind)
        kinds = [("cords", slice(0, count))] + ([("rear cords", slice(count, 2 * count))] if rear else [])
        if (last := (2 if rear else 1) * count) < len(self.tension):
            kinds.append(("ties", slice(last, None)))
        rows = [["kind", "number", "least tension", "mean", "largest", "length cut, all"]]
        for kind, own in kinds:
            t = self.tension[own]
            texts = [quantity(float(value), "N") for value in (t.min(), t.mean(), t.max())]
            rows.append([kind, str(t.size), *texts, quantity(float(self.cut_lengths[own].sum()), "m", 5)])
        return rows

    def tolerance_rows(self) -> list[list[str]]:
        """What errors of lengths do."""
        found = self.tolerance
        rows = [["standard deviation of the lengths", "rms about the best fit, 95 % of all, 95 % confidence"]]
        rows.append([quantity(found.length_error, "m"), quantity(found.bound, "m")])
        if found.allowed is not None and self.keys.limit is not None:
            allowed = quantity(found.allowed, "m") if found.allowed else "none"
            rows.append([f"{allowed} (allowed)", f"{quantity(self.keys.limit, 'm')} (limit)"])
        return rows

    def sensitivity_rows(self) -> list[list[str]]:
        """Cords by which the rms changes most."""
        order = np.argsort(-np.abs(self.sensitivity), kind="stable")[:_MOST]
        rows = [["cord", "change of the rms of half the path by its length, m/m"]]
        return rows + [[self.called(int(k)), f"{self.sensitivity[k]:.4g}"] for k in order]

    def adjustment_rows(self) -> list[list[str]]:
        """Lengths to change."""
        found = self.adjusted
        assert found is not None
        rows = [["cord", "make longer by"]]
        order = np.argsort(-np.abs(found.change), kind="stable")
        return rows + [[self.called(int(found.cords[k])), quantity(float(found.change[k]), "m")] for k in order]

    def notes(self) -> Iterator[str]:
        """Sentences on what was assumed."""
        yield (
            "facets are plane; the half path error is that along the axis times the square of the cosine of the slope; "
            "areas are those in the aperture"
        )
        yield (
            f"bounds of errors of lengths follow from {DRAWS} surfaces of the linear response, with independent normal "
            f"errors of all lengths"
        )
        if self.after is not None:
            when = (
                f"the means over the last swing, from {self.after.since:g} to {self.after.until:g} s"
                if self.after.since < self.after.until
                else f"those at {self.after.until:g} s"
            )
            yield f"places of the nodes after the run are {when}"
        if self.adjusted is not None:
            found = self.adjusted
            yield (
                f"the measured nodes are {quantity(found.before, 'm')} rms from the wanted surface; the changes of "
                f"lengths leave {quantity(found.after, 'm')} by the linear response"
            )

    def figures(self) -> list[Figure]:
        """Views with tensions, and the map of the error."""
        own = self.topology.cords
        return [
            reflector_figures.views(self.x, self._of.cords, len(own), self.tension),
            reflector_figures.error_map(self.net.surface, self.x, own, self.topology.facets, self.error),
        ]

    # ----------------------------------------------------------------------------------------------------- files

    def to_dict(self) -> dict[str, Any]:
        """All numbers, as the JSON file has them; the key `lengths` is what `cut` of the net reads."""
        error = self.error
        found: dict[str, Any] = {
            "net": self.name, "units": {"lengths": "m", "tensions": "N"}, "positions": self.x, "cords": self._of.cords,
            "lengths": self.cut_lengths, "tensions": self.tension, "sensitivities": self.sensitivity,
            "error": {key: getattr(error, key) for key in ("area", "axial", "normal", "half_path", "mean", "at_nodes")},
            "best_fit": error.fit._asdict(), "tolerance": dataclasses.asdict(self.tolerance),
        }  # fmt: skip
        if self.warm is not None:
            found["warm"] = {"half_path": self.warm.half_path, "best_fit": self.warm.fit._asdict()}
        if self.after is not None:
            found["after"] = {
                "since": self.after.since, "until": self.after.until, "positions": self.after.x,
                "moved": self.after.moved, "slack": self.after.slack, "half_path": self.after.error.half_path,
                "best_fit": self.after.error.fit._asdict(),
            }  # fmt: skip
        if self.adjusted is not None:
            found["adjustment"] = dataclasses.asdict(self.adjusted)
        return found

    def _csv(self) -> str:
        """A row a cord."""
        heads = ["cord", "kind", "a", "b", "cut_length_m", "length_m", "tension_N", "rms_by_length"]
        rows = [
            [k, self.called(k).split(" ")[0], *self._of.cords[k].tolist(), f"{self.cut_lengths[k]:.9g}",
             f"{self.length[k]:.9g}", f"{self.tension[k]:.6g}", f"{self.sensitivity[k]:.6g}"]
            for k in range(len(self.tension))
        ]  # fmt: skip
        return an.as_csv([heads, *rows])


def _named(error: SurfaceError) -> dict[str, float]:
    """Errors of a surface, m, by what they are called in tables."""
    return {
        "rms of the nodes, along the axis": error.at_nodes, "rms of the facets, along the axis": error.axial,
        "rms of the facets, normal": error.normal, "rms of half the path": error.half_path,
        "mean along the axis": error.mean, "rms of half the path about the best fit": error.fit.rms,
    }  # fmt: skip


def _net_of(assembly: Assembly, name: str | None) -> str:
    """Name of the net that is meant."""
    nets = names(assembly)
    if not nets:
        raise InputError("the system has no net; add a part of the kind net")
    if name is None and len(nets) > 1:
        raise InputError(f"reflector.net is missing; the system has several nets: {', '.join(nets)}")
    if name is not None and name not in nets:
        raise InputError(f"reflector.net is {name!r}; {nearest(name, nets)}")
    return nets[0] if name is None else name


def _interpolation(facets: Array, count: int) -> scipy.sparse.csr_matrix:
    """Values at the points of `quadrature` by those of the nodes."""
    k, p = len(facets), len(POINTS)
    columns = np.repeat(facets[:, None], p, axis=1).ravel()
    rows = np.repeat(np.arange(k * p), 3)
    return scipy.sparse.csr_matrix((np.tile(POINTS.ravel(), k), (rows, columns)), shape=(k * p, count))


def _rank(count: int) -> int:
    """Index in ascending order of the draw that bounds 95 % of all with 95 % of confidence."""
    return min(int(np.searchsorted(scipy.stats.binom.cdf(np.arange(count), count, 0.95), 0.95)), count - 1)


def _measured(path: str, count: int) -> tuple[Array, Array]:
    """Nodes and their places (k, 3), m, of a CSV file."""
    text = safe_open.content(path, most=safe_open.LARGEST_TEXT).decode("utf-8-sig", "replace")
    rows = [{str(k).strip(): v for k, v in row.items()} for row in csv.DictReader(io.StringIO(text))]
    if not rows:
        raise InputError(f"reflector.measured is {path!r}, which has no rows below a head node,x,y,z")
    try:
        nodes = np.array([int(row["node"]) for row in rows])
        places = np.array([[float(row[key]) for key in "xyz"] for row in rows])
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"reflector.measured is {path!r}, which needs columns node, x, y and z of numbers ({error})"
        ) from None
    if not np.isfinite(places).all():
        k = int((~np.isfinite(places)).any(axis=1).argmax())
        raise InputError(f"reflector.measured is {path!r}, whose place of node {nodes[k]} is not finite")
    if len(np.unique(nodes)) < len(nodes):
        raise InputError(f"reflector.measured is {path!r}, which has a node twice")
    if nodes.min() < 0 or nodes.max() >= count:
        raise InputError(f"reflector.measured is {path!r}, whose nodes must be of 0 to {count - 1}")
    return nodes, places
