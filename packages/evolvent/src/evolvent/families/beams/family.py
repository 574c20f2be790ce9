"""Beams, their nodes and elements."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from evolvent.algebra.sparse import add_entry
from evolvent.compiled.jit import inlined
from evolvent.elements.forms import STRAIGHT
from evolvent.elements.thermal import HEATED, refuse_unheated, thermal_form
from evolvent.families.beams import beam_strains
from evolvent.families.beams.beam_strains import POINTS
from evolvent.families.beams.family_bends import COUNT, STRAINS
from evolvent.families.beams.family_relaxation import kept
from evolvent.families.relaxation.family import LineSet, set_of
from evolvent.kernels import ancf, ancf_beams, calls, free_strains
from evolvent.kernels.ancf_beams import BEAM, NODE_VECTORS, beam_energies
from evolvent.kernels.between import keep_lengths
from evolvent.kernels.blocks import POSITION, SLOPE
from evolvent.model.family import ENERGY, EVERY, EXPLICIT, Family, Kind, Records, record, where
from evolvent.model.powers import MARKER_LOADS, MASS_DAMPING, STIFFNESS_DAMPING
from evolvent.model.questions import (
    AdjointSupport,
    Advice,
    Block,
    Coordinates,
    Energies,
    Explicit,
    Inertia,
    LinearizedPoint,
    Notes,
    Parts,
    Samples,
    Stability,
    State,
    Statics,
    Step,
    along,
    never,
    skew,
)
from evolvent.model.shares import ELASTIC, Elastic, Rule, Shares
from evolvent_base.errors import InputError

Array = np.ndarray
#: Stretch of a beam's axis beyond which Green's strain with a constant modulus is reported.
GREEN = 0.05
#: Part of its size by which the bending of a viscoelastic cable may leave a plane before it is reported.
PLANE = 1e-3
_3, _33 = (3,), (3, 3)


@calls.force
def evaluate(interval, model):
    """Strains, forces, energies, momenta and nodes of all beams, with their free strains."""
    step = interval.step
    if model.thermal_loads.size > 0:
        free_strains.heat_beams(step.t, step.factor, model)
    beam_strains.evaluate_beams(interval.ym, model)
    beam_strains.evaluate_sums(interval.ym, model)
    beam_strains.evaluate_nodes(int(step.sample), interval.ym, model)


def _unforced(model: Any) -> dict[str, Array]:
    H, h = np.zeros_like(model.H), np.zeros_like(model.h)
    forms = model.elements["form"][model.elements["stretch"] != 0]  # whose first rows are no stiffness
    H[forms, :3], h[forms] = model.H[forms, :3], model.h[forms]
    return {"H": H, "h": h}


def _stiff(whole: Any, bare: Any, index: int) -> dict[str, Array]:
    return {name: getattr(whole, name) for name in ("H", "h", "thermal_loads")}


def _nodal_masses(beam: np.record, elements: Array, masses: Any) -> Array:
    """Diagonal of a beam's mass matrix, a number for each nodal vector, kg and so on."""
    vectors = NODE_VECTORS[beam["kind"]]
    found = np.zeros(vectors * int(beam["nodes"]))
    for i, element in enumerate(elements[beam["first_element"] :][: beam["elements"]]):
        found[vectors * i :][: 2 * vectors] += np.diag(masses[element["mass"]])
    return found


def _vectors(records: Records, pools: Mapping[str, Any]) -> Iterator[Block]:
    for b, beam in enumerate(records("beams")):
        vectors = NODE_VECTORS[beam["kind"]]
        for i, mass in enumerate(_nodal_masses(beam, records("elements"), pools["M"])):
            kind = SLOPE if i % vectors else POSITION
            yield Block(kind, beam["iq"] + 3 * i, beam["iv"] + 3 * i, b, mass, i // vectors)


def _bending(model: Any, y: Array) -> float:
    found = np.zeros(3)
    beam_energies(y, 0, model.elements.size, model, found)
    return float(found[2])


def _points(assembly: Any, name: str, index: int, where: slice, y: Array) -> Iterator[tuple[str, LinearizedPoint]]:
    """Nodes; rotations of a section, of a cable those of its axis, which has no twist."""
    row = assembly.model.beams[index]
    vectors = NODE_VECTORS[row["kind"]]
    size, found = 3 * vectors, []
    for i in range(int(row["nodes"])):
        node = y[row["iq"] + size * i : row["iq"] + size * (i + 1)].reshape(vectors, 3)
        at = where.start + size * i
        displacement = np.zeros((3, size))
        displacement[:, :3] = np.eye(3)
        rotation = np.zeros((3, size))
        if row["kind"] != BEAM:
            rotation[:, 3:] = skew(node[1]) / (node[1] @ node[1])
        else:
            # least squares of theta x r = dr for both directions across
            across = node[2:]
            A = sum((r @ r) * np.eye(3) - np.outer(r, r) for r in across)
            rotation[:, 6:] = np.linalg.solve(A, np.hstack([skew(r) for r in across]))
        found.append(LinearizedPoint(node[0].copy(), slice(at, at + size), displacement, rotation))
    yield from along(name, found)


def _place(builder: Any, at: Any) -> Any:
    """A node of a beam."""
    row = builder.rows["beams"][at.row]
    first = 3 * NODE_VECTORS[row["kind"]] * at.number(row["nodes"] - 1, "beam")
    return builder.on_coordinates("beams", at.row, row["iq"] + first, row["iv"] + first, row["kind"])


def _factor_within(load: Any, first: float, last: float, xi: float) -> float:
    """Factor of a thermal load at a position from 0 to 1 between two others."""
    return float(load.factor(first + xi * (last - first)))


def _heat(builder: Any, name: str, load: Any, called: str) -> dict[str, int]:
    """Forms of the elements that are linear and quadratic in temperature, and free strains at a temperature of 1 K."""
    beam = builder.specs[name]
    gradients = [key for key in ("gradient_y", "gradient_z") if getattr(load, key) is not None]
    if gradients and beam.vectors == 2:
        raise InputError(
            f"{called}.{gradients[0]} is given, but {name!r} is a {beam.formulation}, whose section has no axes; leave "
            f"it out, or use the formulation 'assumed_strain'"
        )
    if beam.formulation not in HEATED:
        raise InputError(
            f"{called}.part is {name!r}, whose formulation is {beam.formulation!r}; a thermal load needs "
            f"{', '.join(map(repr, HEATED[:-1]))} or {HEATED[-1]!r}"
        )
    refuse_unheated(load, beam, name, called)
    unloaded, ends = beam.rest_nodes(name), beam.arc / beam.length
    for i, length in enumerate(beam.lengths):
        first, last = ends[i], ends[i + 1]
        form = thermal_form(
            beam.formulation, float(length), beam.section.between(first, last), beam.material,
            functools.partial(_factor_within, load, first, last),
            rest=None if unloaded is None else unloaded[i : i + 2].ravel(),
        )  # fmt: skip
        builder.parameters([*form.C.ravel(), *form.Q.ravel(), *form.rest])
    at = (beam.arc[:-1, None] + beam.lengths[:, None] * np.asarray(POINTS)) / beam.length
    grown = float(beam.material.thermal_expansion) * np.ravel(load.factor(at))
    return {"beam": builder.names[name][1], "expansions": builder.parameters(grown.tolist())[0]}


def _factored_masses(records: Records, masses: Sequence[Array]) -> Array:
    """L D L^T of the beams' masses, which couple nodal vectors of neighbouring nodes: see `Model.masses`."""
    found = [np.zeros((0, 8))]
    for beam in records("beams"):
        k = NODE_VECTORS[beam["kind"]]
        n, w = k * int(beam["nodes"]), 2 * k - 1
        band = np.zeros((w + 1, n))  # band[i - j, j] = M[i, j], i >= j
        for c in range(beam["elements"]):
            M = masses[records("elements")["mass"][beam["first_element"] + c]]
            for j in range(2 * k):
                band[: 2 * k - j, k * c + j] += M[j:, j]
        rows = np.zeros((n, 8))
        for c in range(n):
            rows[c, 0], below = 1.0 / band[0, c], min(w, n - 1 - c)
            for i in range(1, below + 1):
                rows[c + i, i] = band[i, c] / band[0, c]
            for j in range(1, below + 1):
                band[: below + 1 - j, c + j] -= rows[c + j, j] * band[j : below + 1, c]
        found.append(rows)
    return np.concatenate(found)


def _beyond_green(solution: Any) -> Iterator[str]:
    """Sentences on beams whose axis is stretched by more than `GREEN` under Green's strain (`Notes.limits`).

    Notes
    -----
    A stretch x has Green's strain x + x^2/2 and the force E A (1 + x)(x + x^2/2), 3 x/2 above E A x.
    """
    model = solution.assembly.model
    for name, (family, index) in solution.assembly.names.items():
        if family != "beams":
            continue
        row = model.beams[index]
        first, last = int(row["first_element"]), int(row["first_element"]) + int(row["elements"])
        if np.all(model.elements["stretch"][first:last] != 0):
            continue
        vectors, nodes = NODE_VECTORS[row["kind"]], int(row["nodes"])
        q = solution.y[:, int(row["iq"]) : int(row["iq"]) + 3 * vectors * nodes].reshape(-1, nodes, vectors, 3)
        if vectors == 2:
            stretch = np.linalg.norm(q[:, :, 1], axis=2) - 1.0
        else:
            chord = np.linalg.norm(np.diff(q[:, :, 0], axis=1), axis=2)
            stretch = chord / model.elements["length"][first:last] - 1.0
        size = np.abs(stretch) if vectors == 2 else np.maximum(stretch, 0.0)
        if size.max() > GREEN:
            n, k = np.unravel_index(int(size.argmax()), size.shape)
            yield (
                f"the axis of {name!r} is strained by {100.0 * stretch[n, k]:.3g} % at t = {solution.t[n]:.6g} s: by "
                f"Green's strain its axial force is off by about {150.0 * abs(stretch[n, k]):.2g} %; use the "
                f"formulation 'cable_stretch' or a Rod"
            )


def _out_of_plane(solution: Any) -> Iterator[str]:
    """Sentences on viscoelastic cables whose bending leaves a plane by more than `PLANE` (`Notes.limits`)."""
    model = solution.assembly.model
    for name, (family, index) in solution.assembly.names.items():
        row = model.beams[index] if family == "beams" else None
        if row is None or not row["relaxes"] or row["kind"] == BEAM:
            continue
        first, nodes = int(row["iq"]), int(row["nodes"])
        slopes = solution.y[:, first : first + 6 * nodes].reshape(-1, nodes, 2, 3)[:, :, 1]
        turns = np.cross(slopes[:, :-1], slopes[:, 1:])
        across, along = np.sqrt(np.maximum(np.linalg.eigvalsh(turns.mT @ turns)[:, 1:].T, 0.0))
        part = float(across.max() / max(along.max(), STRAIGHT))
        if part > PLANE:
            yield (
                f"the bending of {name!r} leaves its plane, by {100.0 * part:.2g} % of its size: what a viscoelastic "
                f"cable keeps turns with its plane, as it has no torsional stiffness; use a Rod where torsion counts"
            )


def _limits(solution: Any) -> Iterator[str]:
    yield from _beyond_green(solution)
    yield from _out_of_plane(solution)


@calls.kick
def kick(y, s, model, dy):
    """Velocities of all beams jump by dy."""
    ancf_beams.kick_beams(y, model, dy)


@calls.interpolate
def interpolate(theta, y0, y1, model, y):
    """Lengths between nodes lie on straight lines."""
    beams = model.beams
    for k in range(beams.size):
        keep_lengths(theta, y0, y1, beams[k].iq, 3 * NODE_VECTORS[beams[k].kind], beams[k].nodes, 0.0, y)


def _kept(model: Any, index: int) -> LineSet:
    """What a beam keeps, or the curvature of a cable, the mean of its points in each element."""
    row, bends = model.beams[index], model.bend_relaxations
    if row["kind"] == BEAM:
        return kept(model, index)
    of = bends["element"] - int(row["first_element"])
    own = bends[(of >= 0) & (of < row["elements"])]
    found = np.array([(set_of(model, bend, STRAINS)[:COUNT] / bend["radii"]).mean() for bend in own])
    return LineSet(model.elements["length"][own["element"]], {"curvature": found})


# beams; a node's coordinates stand together, node after node; first_node: number of the first among
# the nodes of all beams and rods; relaxes: 1 of a viscoelastic one; paper: 1 where the damping is the paper's, which a
# turn of the whole feels; held: 1 where rows of constraint act on its nodes; axes: rows x along, y and z of the root
BEAMS = Family(
    "beams",
    record(
        "kind iq iv nodes first_element elements first_node paper held relaxes", "length",
        "kinetic elastic bending linear angular axes", linear=_3, angular=_3, axes=_33,
    ),
    order=10,
    results={
        "kinetic": ("energy_kinetic", "J", "kinetic energy"),
        "elastic": ("energy_elastic", "J", "strain energy"),
        "bending": ("energy_bending", "J", "strain energy of bending"),
        "linear": ("momentum", "kg m s-1", "linear momentum, inertial axes"),
        "angular": ("angular_momentum", "kg m2 s-1", "angular momentum about the inertial origin"),
        "axes": ("root_axes", "1", "axes of the root, rows x along, y and z across, inertial axes"),
    },
    kinds=(
        Kind("a beam", which=lambda found: (found["paper"] == 0) & (found["relaxes"] == 0), symmetric=True),
        Kind(
            "a viscoelastic beam", EVERY - {EXPLICIT},
            "use generalized-alpha or energy-momentum: beams have far shorter periods than relaxation times",
            which=lambda found: (found["relaxes"] != 0) & (found["kind"] == BEAM),
            symmetric=True,
        ),
        Kind(
            "a viscoelastic cable", EVERY - {EXPLICIT},
            "use generalized-alpha or energy-momentum: cables have far shorter periods than relaxation times",
            which=lambda found: (found["relaxes"] != 0) & (found["kind"] != BEAM),
            symmetric=True,
        ),
        Kind(
            "a beam with the paper's damping", EVERY - {ENERGY}, "use `damping` 'objective', or generalized-alpha",
            which=where("paper", 1),
            symmetric=True,
        ),
    ),
    isolated=lambda found, records: not np.any(found["paper"] != 0) and not np.any(records("elements")["alpha"] != 0.0),
    shares=Shares((Rule(ELASTIC),), place=10, unforced=_unforced, elastic=Elastic(_stiff)),
    smooth=True,
    of_step=False,
    adjoint=AdjointSupport(
        "its strains follow from the state, with all derivatives", filtered="strains of beams", timed=False, cubic=True,
        mirrored=True, smooth=True,
    ),
    parts=Parts(
        reads_inertia=False, place=_place, heat=_heat,
        scratch=lambda records, builder: {"masses": _factored_masses(records, builder.pools["M"])},
    ),
    state=State(
        unknowns=(Coordinates(_vectors, 10, lambda found: 6 * found.size, first=2.0),), points=_points,
        nodal=lambda row: (int(row["nodes"]), NODE_VECTORS[row["kind"]], 3),
    ),
    inertia=Inertia(kick=kick),
    statics=Statics(
        uneven=never,
        sets=lambda model, k: _kept(model, k).largest(),
        sets_along=lambda model, k: _kept(model, k).along(),
    ),
    energies=Energies(bending=_bending, by_causes=True),
    samples=Samples(local=True, evaluate=evaluate, interpolate=interpolate),
    advice=Advice(conserved="beams", short_steps=lambda _: "beams are stiff"),
    notes=Notes(limits=_limits),
)  # fmt: skip

# nodes of beams and rods; undeformed: position without stress, from the root, in its axes; share: part of the rod
BEAM_NODES = Family(
    "beam_nodes",
    record(
        "", "undeformed share", "x v slope deflection curvature", undeformed=_3, x=_3, v=_3, slope=_3, deflection=_3
    ),
    order=20,
    results={
        "x": ("position", "m", "positions of the nodes, inertial axes"),
        "v": ("velocity", "m s-1", "velocities of the nodes, inertial axes"),
        "slope": ("slope", "1", "{slopes}, inertial axes"),
        "deflection": (
            "deflection",
            "m",
            "deflections of the nodes from the shape without stress, in the axes of the root (x along, y and z across)",
        ),
        "curvature": ("curvature", "m-1", "{curvature} at the nodes"),
    },
    of="beams",
    parts=Parts(scratch=lambda records, _: {"angles": np.zeros(records("beam_nodes").size)}, changes=""),
)  # fmt: skip


@calls.force
def force(interval, model):
    """Forces and inertia of all elements."""
    _add_elements(interval.step.inertia, interval, model)


@inlined
def _add_elements(inertia, interval, model):
    """Forces of all elements, inertia forces for accelerations times `inertia`, and powers of damping."""
    step, powers = interval.step, interval.powers
    lost, viscous = ancf_beams.add_elements(
        interval.ym, interval.dv, inertia, (step.h, step.chi, step.chi_v, step.ratio), model, model.F
    )
    powers[MASS_DAMPING] += lost
    powers[STIFFNESS_DAMPING] += viscous


@calls.tangent
def tangent(interval, model, matrix):
    """Derivatives of `force`."""
    step = interval.step
    filtered = (step.h, step.chi, step.chi_v, step.ratio)
    ancf_beams.add_element_tangents(interval.ym, step.c_mass, step.c_rate, filtered, model, matrix)


@calls.energy
def energy(interval, model, out):
    """Energies of all beams."""
    ancf_beams.beam_energies(interval.ym, 0, model.elements.size, model, out)


@calls.momentum
def momentum(y, model, out):
    """Momenta of all beams."""
    ancf_beams.beam_momenta(y, 0, model.elements.size, model, out[:3], out[3:])


@calls.force
def explicit_force(interval, model):
    """Forces and weight of all elements."""
    _add_elements(0.0, interval, model)
    ancf_beams.copy_weight(model, model.P)


@calls.force
def explicit_rate(interval, model):
    """Rates of all beams' coordinates; the power of their loads."""
    n_q, given = model.info.nq, 0.0
    for k in range(model.beams.size):
        first = model.beams[k].iv - n_q
        for i in range(first, first + 3 * ancf_beams.NODE_VECTORS[model.beams[k].kind] * model.beams[k].nodes):
            given += model.P[i] * interval.ym[n_q + i]
    interval.powers[MARKER_LOADS] += given
    ancf_beams.beam_rates(interval.ym, model, interval.rates)


@calls.note
def note_step(model):
    """What elements have changed by."""
    ancf.note_changes(model.elements)


@calls.turning_tangent
def turning_tangent(factor, spin, y, model, matrix):
    """Derivatives of the forces by a steady turn."""
    n_q, elements, beams = model.info.nq, model.elements, model.beams
    square = spin[0] * spin[0] + spin[1] * spin[1] + spin[2] * spin[2]
    for k in range(elements.size):
        n = 2 * ancf_beams.NODE_VECTORS[beams[elements[k].beam].kind]
        M = model.M[elements[k].mass]
        at = elements[k].iv - n_q
        for i in range(n):
            for j in range(n):
                if M[i, j] == 0.0:
                    continue
                for c in range(3):
                    for e in range(3):
                        value = spin[c] * spin[e] - (square if c == e else 0.0)
                        add_entry(matrix, at + 3 * i + c, at + 3 * j + e, factor * M[i, j] * value)


# form, bending, mass: indices in the pools of the model, bending of the form of that alone; force, tangent,
# energy: indices (`jit.slot`) of `element_calls`; group_forces, group_energies: the same for groups of consecutive
# elements, 0 for none; stretch: 1 of a cable with engineering strain; section: index among the parameters of what
# `beam_strains` needs; changes: of products, stretches and curvatures over the step before, then over this one
# (`ancf.force_of`); free: strains by heat at `beam_strains.POINTS`; the others are in `RESULTS`
ELEMENTS = Family(
    "elements",
    record(
        "beam iq iv form bending mass force tangent energy group_forces group_energies stretch section",
        "length alpha beta thickness",
        "changes free strain axial_force energy_density shear_force_y shear_force_z bending_moment torsional_moment "
        "bending_moment_y bending_moment_z free_strain free_curvature_y free_curvature_z",
        changes=(56,), free=(5, 3),
        **dict.fromkeys(
            ("strain", "axial_force", "energy_density", "shear_force_y", "shear_force_z", "bending_moment",
             "free_strain", "free_curvature_y", "free_curvature_z"), (2,)
        ),
    ),
    order=30,
    results={
        "strain": ("strain", "1", "strain of the axis"),
        "axial_force": ("axial_force", "N", "force along the axis, positive where it pulls,"),
        "energy_density": ("energy_density", "J m-1", "strain energy per length"),
        "shear_force_y": ("shear_force_y", "N", "shear force along y {section},"),
        "shear_force_z": ("shear_force_z", "N", "shear force along z {section},"),
        "torsional_moment": ("torsional_moment", "N m", "moment about x {section},"),
        "bending_moment_y": ("bending_moment_y", "N m", "moment about y {section},"),
        "bending_moment_z": ("bending_moment_z", "N m", "moment about z {section},"),
        "bending_moment": ("bending_moment", "N m", "size of the bending moment"),
        "free_strain": ("free_strain", "1", "strain of the axis without stress"),
        "free_curvature_y": ("free_curvature_y", "m-1", "curvature towards z without stress"),
        "free_curvature_z": ("free_curvature_z", "m-1", "curvature towards y without stress"),
    },
    of="beams",
    force=force,
    tangent=tangent,
    energy=energy,
    momentum=momentum,
    parts=Parts(
        totals={"slender": lambda found: found.size},
        calls={
            ancf_beams.add_elements: "force",
            ancf_beams.add_element_tangents: "tangent",
            ancf_beams.beam_energies: "energy",
            ancf_beams.add_group: "group_forces",
            ancf_beams.add_group_energies: "group_energies",
        },
    ),
    inertia=Inertia(turning_tangent=turning_tangent),
    explicit=Explicit(force=explicit_force, rate=explicit_rate),
    stability=Stability(waves=lambda _: 1.0),
    step=Step(note=note_step),
    energies=Energies(strained=lambda model: float(np.abs(model.U0[model.elements["form"]]).sum())),
    samples=Samples(evaluate=False),
)  # fmt: skip
