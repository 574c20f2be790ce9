"""Shells."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.elements.thermal import refuse_relaxing
from evolvent.families.bodies.family import node_point
from evolvent.families.relaxation.family import set_of
from evolvent.families.shells import shell, shell_limits, shell_strains, shell_tangent
from evolvent.kernels import calls, free_strains, rigid
from evolvent.model.family import EVERY, EXPLICIT, End, Family, Kind, Records, record
from evolvent.model.powers import MARKER_LOADS, MASS_DAMPING, STIFFNESS_DAMPING
from evolvent.model.questions import (
    AdjointSupport,
    Advice,
    Energies,
    Implicit,
    LinearizedPoint,
    Notes,
    Parts,
    Samples,
    Stability,
    State,
    Statics,
    Step,
    TouchFace,
    TouchPoint,
    never,
)
from evolvent.model.shares import ELASTIC, Elastic, Rule, Shares
from evolvent_base.errors import InputError

Array = np.ndarray
#: Strain of a shell that is round-off: it is the difference of positions beside the size of an element.
_ROUND_OFF = 1e-10
_STRAINS = (shell_strains.STRAINS,)
#: What of the strains that are kept is shown: index, factor, words, unit.
_KEPT = (
    (3, 1.0, "curvature along axis 1", "1/m"),
    (4, 1.0, "curvature along axis 2", "1/m"),
    (5, 0.5, "twist", "1/m"),
    (0, 1.0, "membrane strain along axis 1", "1"),
    (1, 1.0, "membrane strain along axis 2", "1"),
    (2, 0.5, "membrane shear strain", "1"),
)


def _nodes(row: Any) -> range:
    """Its bodies."""
    return range(int(row["first_body"]), int(row["first_body"] + row["nodes"]))


def _of_element(row: Any, records: Records) -> Iterator[End]:
    yield from (("bodies", int(node)) for node in row["nodes"])


@calls.force
def force(interval, model):
    """Forces of all shells."""
    step, powers = interval.step, interval.powers
    lost, viscous, heat = shell.add_shells(step.h, step.chi, step.ratio, model)
    powers[MASS_DAMPING] += lost
    powers[STIFFNESS_DAMPING] += viscous
    powers[MARKER_LOADS] += heat


@calls.tangent
def tangent(interval, model, matrix):
    """Derivatives of `force`."""
    step = interval.step
    shell_tangent.add_shell_tangents(step.h, step.c_rate, step.chi, step.ratio, model, matrix)


@calls.measure
def measure(end, t, y, model):
    """Strains of all shells."""
    shell_strains.measure_shells(end, model)


@calls.energy
def energy(interval, model, out):
    """Energies of all shells but that of motion, which is the bodies'."""
    shell.evaluate_shells(model, out)


@calls.force
def evaluate(interval, model):
    """Strains, forces, energies and momenta of all shells, with their free strains."""
    step = interval.step
    if model.thermal_loads.size > 0:
        free_strains.heat_shells(step.t, step.t, step.factor, model)
    shell.evaluate_shells(model, model.sums[1])
    shell.evaluate_sums(interval.ym, model)


@calls.force
def end_step(interval, model):
    """What relaxation of all shells takes over a step."""
    interval.powers[STIFFNESS_DAMPING] += shell.relaxed_shells(interval.step.h, model)


@calls.note
def note_step(model):
    """Changes of the strains of all elements."""
    shell_strains.note_strains(model.shell_elements)


def _stiff(whole: Any, bare: Any, index: int) -> dict[str, Array]:
    return {name: getattr(whole, name) for name in ("shells", "shell_elements", "shell_relaxations", "thermal_loads")}


def _bending(model: Any, _: Array) -> float:
    found = np.zeros(3)
    shell.evaluate_shells(model, found)
    return float(found[2])


def kept_strains(model: Any, index: int) -> Array:
    """Strains that a shell keeps just after all stress is released at once, in the middle of each element.

    Returns
    -------
    (n, 8) float, in the order of the wall's stiffness matrix: membrane strains, changes of curvature (1/m), shear
    """
    row = model.shells[index]
    own = model.shell_elements[int(row["first_element"]) :][: int(row["elements"])]
    forces = np.zeros((own.size, 8))
    for total, element in zip(forces, own, strict=True):
        for part in model.shell_relaxations[int(element["relaxation"]) : int(element["relaxation_end"])]:
            total += part["resultants"] @ set_of(model, part, shell_strains.STRAINS)
    return np.asarray(forces @ row["compliance"])


def _sets(model: Any, index: int) -> Iterator[tuple[str, float, str]]:
    found = kept_strains(model, index)
    for column, factor, words, unit in _KEPT:
        values = factor * found[:, column]
        yield f"largest {words}", float(values[np.abs(values).argmax()]), unit


def _stretched(model: Any) -> float:
    own = model.shell_elements
    return 0.5 * _ROUND_OFF**2 * float(np.sum(own["area"] * own["membrane"]))


def _points(assembly: Any, name: str, index: int, where: slice, y: Array) -> Iterator[tuple[str, LinearizedPoint]]:
    """Nodes that move."""
    model, nodes = assembly.model, _nodes(assembly.model.shells[index])
    free = model.bodies["motion"] == rigid.FREE
    yield from ((f"{name}[{k}]", node_point(model, b, y)) for k, b in enumerate(nodes) if free[b])


def _touches(builder: Any, name: str) -> Iterator[TouchPoint]:
    """All nodes, each with its share of the area."""
    row = builder.rows["shells"][builder.names[name][1]]
    first, elements = row["first_body"], builder.rows["shell_elements"][row["first_element"] :][: row["elements"]]
    quads, areas = np.array([one["nodes"] for one in elements]) - first, np.zeros(row["nodes"])
    np.add.at(areas, quads, 0.25 * np.array([[one["area"]] for one in elements]))
    corners = np.array([builder.poses[first + k].x for k in range(row["nodes"])])[quads]
    spacing = float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).min(axis=1).max())
    radius = 0.5 * builder.specs[name].wall(name).thickness
    for k, weight in enumerate(areas / areas.sum()):
        yield TouchPoint(first + k, np.zeros(3), radius, float(weight), spacing)


def _heat(builder: Any, name: str, load: Any, called: str) -> dict[str, int]:
    """Factors of the elements: means of `along` over them, from the begin of side 1 to its end."""
    part, index = builder.specs[name], builder.names[name][1]
    if load.gradient_y is not None:
        raise InputError(
            f"{called}.gradient_y is given, but {name!r} is a shell, whose temperature changes along its normal; give "
            f"gradient_z"
        )
    if part.wall(name).expansion is None:
        where = "its plies' materials" if part.section is not None else f"{name}.material"
        raise InputError(
            f"{called}.part is {name!r}, a shell whose thermal expansion is not known; its section must be of plies, "
            f"and {where} must have thermal_expansion"
        )
    if part.wall(name).relaxing:
        refuse_relaxing(name)
    row = builder.rows["shells"][index]
    for element in builder.rows["shell_elements"][row["first_element"] :][: row["elements"]]:
        element["heated"] = 1
    if load.balance is not None:
        elements, wall = range(row["first_element"], row["first_element"] + row["elements"]), part.wall(name)
        return {"shell": index, **load.write_walls(builder, called, elements, wall.mass, wall.thickness)}
    factors = np.ones(row["elements"])
    if load.along is not None:
        if part.elements is None:
            raise InputError(f"{called}.along is given, but {name!r} is a mesh from a file, which has no side 1")
        one, two = part.elements
        factors = np.repeat(load.means(np.linspace(0.0, 1.0, one + 1)), two)
    builder.parameters(factors)
    return {"shell": index}


def _faces(builder: Any, name: str) -> Iterator[TouchFace]:
    """Its elements: vectors along their sides, as long as arcs, across the normals."""
    mesh, radius = builder.specs[name].mesh(name), 0.5 * builder.specs[name].wall(name).thickness
    first = builder.rows["shells"][builder.names[name][1]]["first_body"]
    for quad in mesh.quads:
        x, R, along = mesh.x[quad], mesh.R[quad], np.zeros((8, 3))
        for i, (a, b) in enumerate(((0, 1), (0, 3), (0, 1), (1, 2), (3, 2), (1, 2), (3, 2), (0, 3))):
            chord, normal = x[b] - x[a], R[i // 2, :, 2]
            bend = 0.5 * np.arccos(np.clip(R[a, :, 2] @ R[b, :, 2], -1.0, 1.0))
            across = chord - (chord @ normal) * normal
            length = np.linalg.norm(chord) * (bend / np.sin(bend) if bend > 1e-6 else 1.0)
            along[i] = R[i // 2].T @ (across * length / np.linalg.norm(across))
        yield TouchFace(first + quad, along, radius, x)


def _place(builder: Any, at: Any) -> Any:
    """A node of a shell, which is a body."""
    row = builder.rows["shells"][at.row]
    if isinstance(at.on, str):
        raise InputError(
            f"{at.key} is {at.where!r}, which is no point of the shell {at.name!r}; loads act along edges, and seams "
            f"join them: give a node from '{at.name}[0]' to '{at.name}[{row['nodes'] - 1}]' here"
        )
    if not isinstance(at.on, int) or at.on >= row["nodes"]:
        raise InputError(
            f"{at.key} is {at.where!r}; {at.name!r} is a shell; give a node from '{at.name}[0]' to "
            f"'{at.name}[{row['nodes'] - 1}]'"
        )
    return builder.on_body(row["first_body"] + at.on, (0.0, 0.0, 0.0))


def _near(builder: Any, at: Any, position: Any) -> Any:
    """The node of a shell at a position, within half of the shortest side of an element."""
    row, wanted = builder.rows["shells"][at.row], np.array(position, dtype=float)
    first = row["first_body"]
    x = np.array([builder.poses[b].x for b in range(first, first + row["nodes"])])
    quads = np.array(
        [one["nodes"] for one in builder.rows["shell_elements"][row["first_element"] :][: row["elements"]]]
    )
    corners = x[quads - first]
    within = 0.5 * float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).min())
    off = np.linalg.norm(x - wanted, axis=1)
    k = int(off.argmin())
    if off[k] > within:
        raise InputError(
            f"{at.key} is {at.where!r}; the nearest node of the shell {at.name!r} is {off[k]:.3g} m from there, "
            f"'{at.name}[{k}]' at {tuple(x[k].tolist())}; a position must be within {within:.3g} m of a node"
        )
    return builder.on_body(first + k, (0.0, 0.0, 0.0))


# geometrically exact shells: their nodes are the bodies from first_body on; relaxes: 1 of a viscoelastic one; alpha:
# damping by mass; compliance: of the wall, of an instant; work: scratch
SHELLS = Family(
    "shells",
    record(
        "first_element elements first_body nodes relaxes",
        "alpha compliance",
        "kinetic linear angular work",
        compliance=(8, 8), linear=(3,), angular=(3,), work=(shell_strains.WORK,),
    ),
    order=101,
    results={
        "kinetic": ("energy_kinetic", "J", "kinetic energy"),
        "linear": ("momentum", "kg m s-1", "linear momentum, inertial axes"),
        "angular": ("angular_momentum", "kg m2 s-1", "angular momentum about the inertial origin"),
    },
    kinds=(
        Kind("a shell", which=lambda found: found["relaxes"] == 0, symmetric=True),
        Kind(
            "a viscoelastic shell", EVERY - {EXPLICIT},
            "use generalized-alpha or energy-momentum: shells have far shorter periods than relaxation times",
            which=lambda found: found["relaxes"] != 0,
            symmetric=True,
        ),
    ),
    isolated=lambda found, _: not np.any(found["alpha"] != 0.0),
    force=force,
    tangent=tangent,
    energy=energy,
    shares=Shares((Rule(ELASTIC),), place=11.5, elastic=Elastic(_stiff)),
    smooth=True,
    of_step=False,
    adjoint=AdjointSupport(
        "its strains follow from the state, with all derivatives", filtered="strains of shells", timed=False,
        rates=lambda model: bool(np.any(model.shells["alpha"]) or np.any(model.shell_elements["beta"])),
        smooth=True,
    ),
    parts=Parts(
        consists=lambda row, _: _nodes(row), place=_place, near=_near, touches=_touches, faces=_faces, heat=_heat,
        totals={"slender": lambda found: found.size}, changes="compliance", reads_inertia=False,
    ),
    state=State(points=_points),
    stability=Stability(waves=lambda _: 1.0),
    step=Step(measure=measure),
    statics=Statics(uneven=never, sets=_sets),
    energies=Energies(bending=_bending, by_causes=True, round_off=_stretched),
    samples=Samples(evaluate=evaluate),
    advice=Advice(conserved="shells"),
    notes=Notes(limits=shell_limits.beyond_elements),
)  # fmt: skip

# an element between four bodies, whose third axes are the directors; stiffness, resultants, rest, slopes, untwisted:
# see `stiffness.Constants`; beta: damping by stiffness, s; drilling: N m, stiffness of a node's drilling strain;
# membrane: N/m, largest stiffness; heated: 1 with a thermal load, which makes the change of temperature `warmth`,
# its gradient `slope` and the free measures `free`, by the rows of `expansion`; held: stresses less those of `free` at
# the last sample, at which the free measures were `freed`; relaxation, relaxation_end: range of `shell_relaxations`.
# m0, m1: measures at the start and the end of an interval; before: changes of the strains over the step before
SHELL_ELEMENTS = Family(
    "shell_elements",
    record(
        "nodes heated relaxation relaxation_end",
        "area beta membrane drilling stiffness resultants rest slopes untwisted expansion",
        "warmth slope free held freed m0 m1 before stress stored bent drilled membrane_force_1 membrane_force_2 "
        "membrane_shear moment_1 moment_2 twisting_moment shear_force_1 shear_force_2",
        nodes=(4,), stiffness=(15, 15), resultants=(8, 15), rest=_STRAINS, slopes=(8, 4), untwisted=(4,),
        expansion=(free_strains.SHELL_AMPLITUDES, *_STRAINS), free=_STRAINS, held=_STRAINS, freed=_STRAINS,
        m0=(shell_strains.MEASURES,), m1=(shell_strains.MEASURES,), before=(19,), stress=(8,),
    ),
    order=102,
    results={
        "membrane_force_1": ("membrane_force_1", "N m-1", "membrane force along axis 1, positive in tension"),
        "membrane_force_2": ("membrane_force_2", "N m-1", "membrane force along axis 2, positive in tension"),
        "membrane_shear": ("membrane_shear", "N m-1", "shear force in the plane"),
        "moment_1": ("moment_1", "N", "bending moment per length, of curvature along axis 1"),
        "moment_2": ("moment_2", "N", "bending moment per length, of curvature along axis 2"),
        "twisting_moment": ("twisting_moment", "N", "twisting moment per length"),
        "shear_force_1": ("shear_force_1", "N m-1", "transverse shear force per length, on sections across axis 1"),
        "shear_force_2": ("shear_force_2", "N m-1", "transverse shear force per length, on sections across axis 2"),
        "warmth": ("temperature_change", "K", "change of temperature, mean through the wall"),
        "slope": ("temperature_gradient", "K m-1", "gradient of temperature along the normal"),
        "stored": ("energy_elastic", "J", "strain energy"),
        "bent": ("energy_bending", "J", "strain energy of bending and transverse shear"),
        "drilled": ("energy_drilling", "J", "energy of the springs that hold the nodes about the normal"),
    },
    of="shells",
    ends=_of_element,
    parts=Parts(changes="membrane drilling stiffness resultants expansion"),
    step=Step(note=note_step),
)  # fmt: skip

# a part of the stiffness of an element that relaxes by the Prony terms of one law, with its resultants; branch: first
# branch of the element's strains
SHELL_RELAXATIONS = Family(
    "shell_relaxations",
    record("prony prony_end branch", "stiffness resultants", stiffness=(15, 15), resultants=(8, 15)),
    order=103,
    of="shells",
    stability=Stability(by_rates=False),
    implicit=Implicit(end_step=end_step),
)  # fmt: skip
