"""The motion of a run, from what its groups say of how they are drawn.

Each group's attribute ``drawn`` is a list of mappings with one key:

``frame``
    Axes of a body: `origin` and `attitude` (variables), `solids` (list of ``{box: {edges, centre}}`` or
    ``{revolution: {profile, centre, axis}}``).
``line``
    `points` (a variable), `kind` ("line", "rod" or "spring"), `values` (variables of the colour, or a mapping of labels
    to them), `width` (m), `across` (a variable), `tip` (the point whose trail is shown), and of beams `slope` (a
    variable) and `length` (m), by which the line is made smooth. Values at other points than those of the line have a
    coordinate `arc` (m), the length at which they are. With `pieces` (a coordinate: two points of each) the line has
    gaps between these, and `values` are those of each piece.
``quads``
    `points`, `normals` (variables over nodes), `faces` (a coordinate: four nodes of each), `thickness` (m), `values`
    (variables of the colour, over faces), `data` and `vectors` (variables over faces and nodes that files hold).
``pushes``
    Forces on beams away from the axis of a body (a part): `size`, `arc` and `beam` (variables over contact points),
    `centre` and `axis` (body axes).
``marks``
    `points` (list of variables).
``forces``
    `points`, `vectors` (variables), `unit` ("N" or "N m"), `name`.
``surface``
    `body` (a part, or 'ground'), `solids` as of a frame, in the axes of the body.
``spool``
    `body` (a part), `centre`, `axis` (body axes), `radius`, `width` (m), and `angle` (a variable).
``symbol``
    Of a part without its own extent: `body` (a part, or 'ground') and `centre` (body axes), or `origin` and
    `along` (variables; z of the symbol is along the second). `solids` as of a frame about the point, in units of the
    symbols' size, each with `turned` (a variable, rad) or `scaled` and `most` (a variable and its largest value);
    `outline` (polylines, m); `lift` (true to draw it over its body); `near` (bodies that it joins, beside which it is
    small).

Symbols and marks are drawn `while` a variable, by its full name, is not 0: none of a joint that is released.

Lines, forces and spools of a part that stands for several have `copies` {count, body, axis}: they are evenly spaced
about an axis through the origin of the body, body axes.
"""

from __future__ import annotations

import dataclasses
import json
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from evolvent.elements.shape_functions import axis_shape
from evolvent.results import display, unfinished, variables
from evolvent.results.motion import Forces, Frame, Line, Marks, Motion
from evolvent.results.observe.view import about
from evolvent.results.rotations import quaternions, turned
from evolvent.results.solids import Solid
from evolvent.results.surfaces import Surface

Array = np.ndarray
#: Points that are drawn between two nodes of a beam, and most of them in all.
_BETWEEN, _MOST_POINTS = 6, 400
#: Most arrows of a contact; of more contact points, neighbours share one.
_MOST_ARROWS = 100
#: Most numbers beside the picture.
_NUMBERS = 4
#: Largest size of a symbol: share of the size of the structure, and of the body on which it is.
_OF_STRUCTURE, _OF_BODY = 0.02, 0.06


def motion_of(run: xr.DataTree, *, title: str = "") -> Motion | None:
    """Lines, surfaces, bodies, forces and marks of a run; None where it has nothing to draw.

    Parameters
    ----------
    run : xarray.DataTree
    title : str, of the picture
    """
    frames: dict[str, Frame] = {}
    lines: list[Line] = []
    surfaces: list[Surface] = []
    forces: list[Forces] = []
    marks: list[Marks] = []
    later: dict[str, list[tuple[str, Any]]] = {"spool": [], "surface": [], "symbol": []}  # they need all frames
    for part in variables.parts(run):
        group = variables.group_of(run, part)
        for entry in json.loads(group.attrs.get("drawn", "[]")):
            for kind, own in entry.items():
                if kind == "frame":
                    frames[part] = _frame(part, group, own)
                elif kind == "line":
                    line = _line(part, group, own)
                    copies = _copies(run, own, line.points)
                    across: list[Any] = [None] * len(copies)
                    if line.across is not None:
                        across = _copies(run, own, line.across, places=False)
                    for k, (x, y) in enumerate(zip(copies, across, strict=True)):
                        name = f"{part} copy {k + 1}" if k else part
                        lines.append(dataclasses.replace(line, name=name, points=x, across=y))
                elif kind == "quads":
                    surfaces.append(_quads(part, group, own))
                elif kind == "marks":
                    points = np.stack([group[name].values for name in own["points"]], axis=1)
                    if (shown := _shown(run, own)) is not None:
                        points = np.where(shown[:, None, None], points, np.nan)
                    marks.append(Marks(name=part, points=points))
                elif kind == "forces":
                    at, vectors = _thinned_arrows(*(group[own[key]].values for key in ("points", "vectors")))
                    points = np.concatenate(_copies(run, own, at), axis=1)
                    vectors = np.concatenate(_copies(run, own, vectors, places=False), axis=1)
                    name = own.get("name", part)
                    forces.append(Forces(name=name, points=points, vectors=vectors, unit=own.get("unit", "N")))
                elif kind == "pushes":
                    forces += _contact_arrows(run, part, group, own)
                elif kind in later:
                    later[kind].append((part, own))
    if not (frames or lines or surfaces or marks):
        return None
    for part, own in later["spool"]:
        _add_spool(frames, run, part, own)
    main = next(iter(frames), None)
    for part, own in later["surface"]:
        _add_surface(frames, run, part, own)
    motion = Motion(
        title=title or unfinished(run),
        time=run.to_dataset()["time"].values,
        frames=list(frames.values()),
        lines=lines,
        surfaces=surfaces,
        forces=forces,
        marks=marks,
        numbers=_numbers(run),
        main=main,
    )
    size = _structure_size(motion)
    return dataclasses.replace(motion, symbols=[_symbol(run, part, own, frames, size) for part, own in later["symbol"]])


def _structure_size(motion: Motion) -> float:
    """Size of what is drawn without symbols, m: the median over the samples of the diagonal of a box around it."""
    lows, highs = [], []
    for points in motion.clouds:
        if np.isfinite(points).any():
            lows.append(np.nanmin(np.where(np.isfinite(points), points, np.inf), axis=1))
            highs.append(np.nanmax(np.where(np.isfinite(points), points, -np.inf), axis=1))
    for frame in motion.frames:
        radius = _body_size(frame)
        lows.append(frame.origin - radius / np.sqrt(3.0))
        highs.append(frame.origin + radius / np.sqrt(3.0))
    if not lows:
        return 1.0
    found = np.linalg.norm(np.max(highs, axis=0) - np.min(lows, axis=0), axis=-1)
    found = found[np.isfinite(found)]
    return (float(np.median(found)) if found.size else 0.0) or 1.0


def _body_size(frame: Frame) -> float:
    """Radius about the origin of a frame that holds its solids, m; 0 without any."""
    return max((float(np.linalg.norm(solid.centre)) + solid.size for solid in frame.solids), default=0.0)


def _symbol(run: xr.DataTree, part: str, own: dict[str, Any], frames: dict[str, Frame], structure: float) -> Frame:
    """The frame of a symbol, with its solids in m."""
    group, count = variables.group_of(run, part), run.to_dataset()["time"].size
    frame = frames.get(own.get("body", ""))
    body = 0.0 if frame is None else _body_size(frame)
    near = [_body_size(frames[name]) for name in own.get("near", ()) if name in frames]
    size = min([_OF_STRUCTURE * structure, *(_OF_BODY * one for one in (body, *near) if one > 0.0)])
    if "origin" in own:
        origin, attitude = group[own["origin"]].values, _along(group[own["along"]].values)
    else:
        origin, attitude = np.zeros((count, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
        if own["body"] != "ground":
            held = variables.group_of(run, own["body"])
            origin, attitude = held["position"].values, held["attitude"].values
        origin = origin + turned(attitude, np.broadcast_to(own["centre"], (count, 1, 3)))[:, 0]
    solids = []
    for solid, keys in zip(_solids(own), own.get("solids", []), strict=True):
        solids.append(
            dataclasses.replace(
                solid.enlarged(size),
                turned=group[keys["turned"]].values if "turned" in keys else None,
                scale=np.nan_to_num(group[keys["scaled"]].values) / keys["most"] if "scaled" in keys else None,
            )
        )
    lift = 2.0 * max(body, size) if own.get("lift") else 0.0
    outline = [np.array(polyline) for polyline in own.get("outline", [])]
    return Frame(
        name=part, origin=origin, attitude=attitude, solids=solids, outline=outline, lift=lift, shown=_shown(run, own)
    )  # fmt: skip


def _shown(run: xr.DataTree, own: dict[str, Any]) -> Array | None:
    """Samples (nt,) at which something is drawn; None for all."""
    part, _, name = str(own.get("while", "")).rpartition(".")
    if not name or part not in variables.parts(run):
        return None
    group = variables.group_of(run, part)
    return np.asarray(group[name].values > 0.5) if name in group.data_vars else None


def _along(axes: Array) -> Array:
    """Quaternions (nt, 4) of frames whose z is along the given directions (nt, 3)."""
    z = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    least = np.eye(3)[int(np.argmin(np.abs(z).max(axis=0)))]
    x = np.cross(least, z)
    across = np.linalg.norm(x, axis=1, keepdims=True)
    x = np.where(across > 1e-9, x / np.maximum(across, 1e-300), [1.0, 0.0, 0.0])
    return quaternions(np.stack([x, np.cross(z, x), z], axis=2))


def _thinned_arrows(points: Array, vectors: Array) -> tuple[Array, Array]:
    """Positions and forces (nt, 3) or (nt, n, 3) as (nt, m, 3): of more than can be seen, neighbours share an arrow."""
    if points.ndim == 2:
        return points[:, None], vectors[:, None]
    count = points.shape[1]
    first = np.arange(0, count, -(-count // _MOST_ARROWS))
    shared = np.diff(np.append(first, count))[:, None]
    return np.add.reduceat(points, first, axis=1) / shared, np.add.reduceat(vectors, first, axis=1)


def _add_surface(frames: dict[str, Frame], run: xr.DataTree, part: str, own: dict[str, Any]) -> None:
    """Solids of a part on a body; on the ground, which is not drawn, a frame of the part's own."""
    frame = frames.get(own["body"])
    if frame is None:
        count = run.to_dataset()["time"].size
        attitude = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
        frame = Frame(name=part, origin=np.zeros((count, 3)), attitude=attitude, solids=[])
    solids = [*frame.solids, *_solids(own)]
    frames[frame.name] = dataclasses.replace(frame, solids=solids)


def _frame(part: str, group: xr.Dataset, own: dict[str, Any]) -> Frame:
    origin, attitude = group[own["origin"]].values, group[own["attitude"]].values
    return Frame(name=part, origin=origin, attitude=attitude, solids=_solids(own))


def _solids(own: dict[str, Any]) -> list[Solid]:
    solids = []
    for solid in own.get("solids", []):
        if "box" in solid:
            solids.append(Solid.box(solid["box"]["edges"], centre=solid["box"].get("centre", (0.0, 0.0, 0.0))))
        else:
            found = solid["revolution"]
            solids.append(Solid.revolution(found["profile"], centre=found["centre"], axis=found["axis"]))
    return solids


def _add_spool(frames: dict[str, Frame], run: xr.DataTree, part: str, own: dict[str, Any]) -> None:
    """A spool as a solid of its body that turns."""
    frame = frames.get(own["body"])
    if frame is None:
        return
    radius, angle = own["radius"], variables.group_of(run, part)[own["angle"]].values
    copies = own.get("copies", {"count": 1, "axis": [0.0, 0.0, 1.0]})
    solids = []
    for k in range(copies["count"]):
        R = about(np.array(copies["axis"]), np.array([2.0 * np.pi * k / copies["count"]]))[0]
        centre, axis = R @ own["centre"], R @ own["axis"]
        solids.append(Solid.cylinder(radius, own.get("width", radius), centre=centre, axis=axis, turned=angle))
    frames[own["body"]] = dataclasses.replace(frame, solids=[*frame.solids, *solids])


def _copies(run: xr.DataTree, own: dict[str, Any], x: Array, *, places: bool = True) -> list[Array]:
    """Positions, or vectors, (nt, n, 3) of a part, and those of its copies about an axis of their body."""
    copies = own.get("copies")
    if copies is None:
        return [x]
    group = variables.group_of(run, copies["body"])
    attitude = group["attitude"].values
    axes = turned(attitude, np.broadcast_to(np.array(copies["axis"]), (len(attitude), 1, 3)))[:, 0]
    origin = group["position"].values[:, None] if places else np.zeros(3)
    found = [x]
    for k in range(1, copies["count"]):
        half = np.pi * k / copies["count"]
        turn = np.concatenate([np.full((len(axes), 1), np.cos(half)), np.sin(half) * axes], axis=1)
        found.append(origin + turned(turn, x - origin))
    return found


def _line(part: str, group: xr.Dataset, own: dict[str, Any]) -> Line:
    if "pieces" in own:
        return _pieces(part, group, own)
    points = group[own["points"]].values
    values, named = {}, own.get("values", [])
    for label, name in named.items() if isinstance(named, dict) else [(n.replace("_", " "), n) for n in named]:
        found = group[name]
        label = f"{label} [{found.attrs.get('units', '1')}]"
        values[label] = _at_points(found, own, points.shape[1])
    across = own.get("across")
    if isinstance(across, str):
        across = group[across].values
        across = across if across.ndim == 3 else np.broadcast_to(across[:, None], points.shape)
    if "slope" in own:
        count = points.shape[1] - 1
        between = max(1, min(_BETWEEN, _MOST_POINTS // count))
        points = smooth(points, group[own["slope"]].values, np.diff(_arc_of(group, own, count + 1)), between)
        values = {label: _linear(v, between) for label, v in values.items()}
        across = None if across is None else _linear(across, between)
    return Line(
        name=part,
        points=points,
        values=values,
        kind=own.get("kind", "line"),
        width=own.get("width"),
        across=None if across is None else np.ascontiguousarray(across),
        tip=None if own.get("kind") == "spring" else own.get("tip", -1),
    )


def _pieces(part: str, group: xr.Dataset, own: dict[str, Any]) -> Line:
    """Straight pieces between points as one line with gaps."""
    ends = group[own["points"]].values[:, group[own["pieces"]].values]
    points = np.concatenate([ends, np.full_like(ends[:, :, :1], np.nan)], axis=2).reshape(len(ends), -1, 3)[:, :-1]
    values = {
        label: np.repeat(value, 3, axis=1)[:, :-1] for label, value in _labelled(group, own.get("values", [])).items()
    }  # fmt: skip
    return Line(name=part, points=np.ascontiguousarray(points), values=values, tip=None)


def _quads(part: str, group: xr.Dataset, own: dict[str, Any]) -> Surface:
    values, data, vectors = (_labelled(group, own.get(key, [])) for key in ("values", "data", "vectors"))
    return Surface(
        name=part, points=group[own["points"]].values, normals=group[own["normals"]].values,
        faces=group[own["faces"]].values, thickness=own["thickness"], values=values, data=data, vectors=vectors,
    )  # fmt: skip


def _labelled(group: xr.Dataset, names: list[str]) -> dict[str, Array]:
    """Values of variables by their labels."""
    found = ((name, group[name]) for name in names)
    return {f"{name.replace('_', ' ')} [{own.attrs.get('units', '1')}]": np.asarray(own.values) for name, own in found}


def _at_points(found: xr.DataArray, own: dict[str, Any], count: int) -> Array:
    """Values (nt, count) at the points of a line: of one value for all of it, or of other points, between those."""
    if found.ndim == 1:
        return np.repeat(found.values[:, None], count, axis=1)
    if found.shape[1] == count:
        return np.asarray(found.values)
    values, arc = found.values, found["arc"].values
    if arc.size == 2 * (count - 1):  # of beams the means of elements: what varies within one is mostly its cubic's
        values, arc = (0.5 * (x[..., ::2] + x[..., 1::2]) for x in (values, arc))
    at = np.clip(_arc_of(found, own, count), arc[0], arc[-1])
    return interpolated_along(values, arc, at)


def _arc_of(found: Any, own: dict[str, Any], count: int) -> Array:
    """Lengths (count,) from the root to the points of a line: its nodes', else evenly spaced."""
    if "arc_node" in found.coords and found["arc_node"].size == count:
        return np.asarray(found["arc_node"].values)
    return np.linspace(0.0, own["length"], count)


def interpolated_along(values: Array, arc: Array, at: Array) -> Array:
    """Values (nt, k, ...) at the lengths `at` (k,) along a line, linear between those (nt, n, ...) at `arc` (n,)."""
    if arc.size == 1:
        return np.repeat(values, at.size, axis=1)
    left = np.clip(np.searchsorted(arc, at) - 1, 0, arc.size - 2)
    share = ((at - arc[left]) / (arc[left + 1] - arc[left])).reshape(-1, *[1] * (values.ndim - 2))
    found: Array = (1.0 - share) * values[:, left] + share * values[:, left + 1]
    return found


def _contact_arrows(run: xr.DataTree, part: str, group: xr.Dataset, own: dict[str, Any]) -> list[Forces]:
    """Contact forces on beams, away from the axis of a cylinder; neighbours share an arrow where there are many."""
    body = variables.group_of(run, own["body"]) if own["body"] in variables.parts(run) else None
    found = []
    for beam in dict.fromkeys(group[own["beam"]].values.tolist()):
        mine = np.flatnonzero(group[own["beam"]].values == beam)
        first = np.arange(0, mine.size, -(-mine.size // _MOST_ARROWS))
        size = np.add.reduceat(group[own["size"]].values[:, mine], first, axis=1)
        arc = np.add.reduceat(group[own["arc"]].values[mine], first) / np.diff(np.append(first, mine.size))
        line = variables.group_of(run, beam)
        arcs = line["arc_node"].values
        points = _on_beam(line["position"].values, line["slope"].values, arcs, arc)
        axis, centre = np.array(own["axis"]) / np.linalg.norm(own["axis"]), np.array(own["centre"])
        if body is not None:
            attitude = body["attitude"].values
            axis, centre = (turned(attitude, np.tile(x, (len(attitude), 1, 1))) for x in (axis, centre))
            centre = centre + body["position"].values[:, None]
        away = points - centre
        away = away - np.sum(away * axis, axis=-1, keepdims=True) * axis
        away /= np.maximum(np.linalg.norm(away, axis=-1, keepdims=True), 1e-300)
        found.append(Forces(name=f"{part} on {beam}", points=points, vectors=size[..., None] * away))
    return found


def _on_beam(points: Array, slopes: Array, nodes: Array, arc: Array) -> Array:
    """Points (nt, k, 3) at the lengths `arc` (k,), on Hermite's cubics through points (nt, n, 3) at `nodes` (n,)."""
    cell = np.clip(np.searchsorted(nodes, arc, side="right") - 1, 0, nodes.size - 2)
    length = np.diff(nodes)[cell]
    a, b, c, d = (np.asarray(f)[:, None] for f in axis_shape(length, (arc - nodes[cell]) / length))
    found: Array = a * points[:, cell] + b * slopes[:, cell] + c * points[:, cell + 1] + d * slopes[:, cell + 1]
    return found


def smooth(points: Array, slopes: Array, length: ArrayLike, between: int) -> Array:
    """Points of Hermite's cubics through nodes (nt, n, 3) with slopes, `between` a piece of the given length(s)."""
    lengths = np.broadcast_to(length, points.shape[1] - 1)
    nodes = np.append(0.0, np.cumsum(lengths))
    inner = nodes[:-1, None] + lengths[:, None] * np.arange(between) / between
    return _on_beam(points, slopes, nodes, np.append(inner.ravel(), nodes[-1]))


def _linear(values: Array, between: int) -> Array:
    """Values at nodes (nt, n, ...), with those between them by straight lines."""
    s = (np.arange(between) / between).reshape(-1, *[1] * (values.ndim - 2))
    inner = (1.0 - s) * values[:, :-1, None] + s * values[:, 1:, None]
    return np.concatenate([inner.reshape(len(values), -1, *values.shape[2:]), values[:, -1:]], axis=1)


def _numbers(run: xr.DataTree) -> dict[str, Array]:
    """Some numbers over time that stand beside the picture: one of each part before another one of any.

    Joints come last: where a spring turns a joint, its angle is the one that was asked for.
    """
    listed: list[tuple[int, bool, str, str]] = []
    for part in variables.parts(run):
        held = (name for name in json.loads(run[part].attrs.get("plots", "[]")) if name in run[part].data_vars)
        single = [name for name in held if run[part][name].dims == ("time",)]
        listed += [(k, run[part].attrs.get("kind") == "joint", part, name) for k, name in enumerate(single)]
    shown = sorted(listed, key=lambda entry: (entry[1], entry[0]))[:_NUMBERS]
    order = variables.parts(run)
    found: dict[str, Array] = {}
    for _, _, part, name in sorted(shown, key=lambda entry: (order.index(entry[2]), entry[0])):
        variable = display.shown(variables.group_of(run, part)[name])
        found[f"{part}.{name} [{variable.attrs.get('units', '1')}]"] = variable.values
    return found
