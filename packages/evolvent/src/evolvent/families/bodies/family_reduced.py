"""Reduced bodies."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from evolvent.families.bodies.family import node_point
from evolvent.kernels import calls, reduced
from evolvent.kernels.blocks import SCALAR
from evolvent.model.family import Family, Kind, Records, record
from evolvent.model.powers import SPRINGS
from evolvent.model.questions import (
    AdjointSupport,
    Block,
    Bound,
    Coordinates,
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
    never,
)
from evolvent.model.shares import ELASTIC, Elastic, Rule, Shares
from evolvent_base.errors import InputError, nearest

Array = np.ndarray
#: Share by which a rate or a rotation may change what the linear model has, before it is reported.
_LINEAR = 0.01
_3 = (3,)


@calls.force
def force(interval, model):
    """Forces and inertia of all modal coordinates."""
    step = interval.step
    _, lost = reduced.add_modes(interval.ym, step.h, step.chi, step.ratio, model, model.F)
    interval.powers[SPRINGS] += lost
    reduced.add_mode_inertia(interval.dv, step.inertia, model.info.nq, model.reduced_bodies, model.F)


@calls.tangent
def tangent(interval, model, matrix):
    """Derivatives of `force`."""
    reduced.add_mode_tangents(interval.step.c_mass, interval.step.c_rate, interval.step.chi, model, matrix)


@calls.energy
def energy(interval, model, out):
    """Energies of all modal coordinates."""
    reduced.add_mode_energies(interval.ym, model, out, 0, 1)


@calls.force
def explicit_rate(interval, model):
    """Rates of all modal coordinates, by their forces."""
    interval.powers[SPRINGS] += reduced.mode_rates(interval.ym, model, interval.rates)


def _nodes(row: Any) -> range:
    """Its bodies."""
    return range(int(row["first_body"]), int(row["first_body"] + row["nodes"]) + 1)


@calls.force
def evaluate(interval, model):
    """Energies and momenta of all reduced bodies."""
    reduced.evaluate_reduced(interval.ym, model)


def _unforced(model: Any) -> dict[str, Array]:
    found = model.modes.copy()
    found["stiffness"] = found["damping"] = 0.0
    return {"modes": found}


def _modal(records: Records, _: Mapping[str, Any]) -> Iterator[Block]:
    for k, row in enumerate(records("reduced_bodies")):
        for i in range(int(row["modes"])):
            yield Block(SCALAR, row["iq"] + i, row["iv"] + i, k, row["mass"])


def _bound(model: Any, _: Array, felt: Mapping[str, Array]) -> Iterator[Bound]:
    return ((k, *reduced.mode_bounds(model, k)) for k in range(model.reduced_bodies.size))


def _sizes(model: Any, length: float) -> Iterator[tuple[Any, Any]]:
    for row in model.reduced_bodies:
        yield np.arange(row["iv"], row["iv"] + row["modes"]), length


def _points(assembly: Any, name: str, index: int, where: slice, y: Array) -> Iterator[tuple[str, LinearizedPoint]]:
    """Frame and interface nodes."""
    names = assembly.parts[name].model.names
    for k, b in enumerate(_nodes(assembly.model.reduced_bodies[index])):
        point = node_point(assembly.model, b, y)
        for place in (f"{name}.{names[k - 1]}", f"{name}[{k - 1}]") if k > 0 else (name,):
            yield place, point


def _place(builder: Any, at: Any) -> Any:
    """An interface node of a reduced body."""
    names = [*builder.body_points[at.name]]
    number = names.index(at.on) if at.on in names else at.on
    if not isinstance(number, int) or number >= len(names):
        found = "names no interface node of it" if at.on is None else f"has no node {at.on!r}"
        raise InputError(f"{at.key} is {at.where!r}, which {found}; {nearest(str(at.on), names)}")
    return builder.on_body(builder.rows["reduced_bodies"][at.row]["first_body"] + 1 + number, (0.0, 0.0, 0.0))


def _beyond_small(solution: Any) -> Iterator[str]:
    """What reduced bodies have been made of, and those that turn too fast, or deform too much, for their linear models.

    Notes
    -----
    What is left out of the stiffness is of the order of (rate/lowest frequency with a node held)^2, and displacements
    are off by half the square of the rotations.
    """
    model = solution.assembly.model
    for name, (family, index) in solution.assembly.names.items():
        if family != "reduced_bodies":
            continue
        part = solution.assembly.parts[name]
        if part.model.warning:
            yield f"the model of {name!r} was made where {part.model.warning}"
        row, axes = model.reduced_bodies[index], part.axes
        iv = int(model.bodies["iv"][row["first_body"]])
        rate = np.linalg.norm(solution.y[:, iv + 3 : iv + 6], axis=1)
        share = (rate / axes.held) ** 2
        if share.max() > _LINEAR:
            k = int(share.argmax())
            yield (
                f"{name!r} turns at {rate[k]:.3g} rad/s at t = {solution.t[k]:.6g} s, {rate[k] / axes.held:.2g} of its "
                f"lowest frequency with a node held: stiffening and loads by spin, which its linear model does not "
                f"have, change it by about {100.0 * share[k]:.2g} %; use a Rod or a Beam"
            )
        q = solution.y[:, int(row["iq"]) :][:, : int(row["modes"])]
        turns = (q @ axes.shapes[: 6 * int(row["nodes"])].T).reshape(len(q), -1, 6)[..., 3:]
        largest = float(np.abs(turns).max(initial=0.0))
        if 0.5 * largest**2 > _LINEAR:
            yield (
                f"{name!r} turns its nodes by {np.degrees(largest):.3g} deg against its frame: its displacements are "
                f"off by about {50.0 * largest**2:.2g} %, since its model is linear; use a Rod or a Beam"
            )


@calls.kick
def kick(y, s, model, dy):
    """Rates of modal coordinates jump by dy."""
    reduced.kick_modes(y, model, dy)


# reduced flexible bodies: the bodies from first_body on are the frame and the interface nodes; modes, first_mode:
# of the modal coordinates at iq, iv; mass: of each of them
REDUCED_BODIES = Family(
    "reduced_bodies",
    record(
        "first_body nodes first_mode modes iq iv", "mass", "kinetic elastic linear angular", linear=_3, angular=_3
    ),
    order=130,
    results={
        "kinetic": ("energy_kinetic", "J", "kinetic energy"),
        "elastic": ("energy_elastic", "J", "strain energy"),
        "linear": ("momentum", "kg m s-1", "linear momentum, inertial axes"),
        "angular": ("angular_momentum", "kg m2 s-1", "angular momentum about the inertial origin"),
    },
    kinds=(
        Kind("a reduced body", symmetric=True),
    ),
    isolated=True,
    force=force,
    tangent=tangent,
    energy=energy,
    shares=Shares(
        (Rule(ELASTIC),), place=13, unforced=_unforced, elastic=Elastic(lambda whole, bare, _: {"modes": whole.modes})
    ),
    smooth=True,
    stiff=lambda found: found["modes"] > 0,
    of_step=False,
    adjoint=AdjointSupport(
        "its stiffness is constant in its modes", filtered="strains of reduced bodies", timed=False,
        smooth=True,
    ),
    parts=Parts(consists=lambda row, _: _nodes(row), place=_place),
    state=State(unknowns=(Coordinates(_modal, 70, lambda found: 0),), sizes=_sizes, points=_points),
    inertia=Inertia(kick=kick),
    explicit=Explicit(force=False, rate=explicit_rate),
    stability=Stability(by_rates=False, bound=_bound),
    statics=Statics(uneven=never),
    samples=Samples(evaluate=evaluate),
    notes=Notes(limits=_beyond_small),
)  # fmt: skip


@calls.note
def note_step(model):
    """Changes of all modal coordinates."""
    reduced.note_changes(model.modes)


# of a step: change of the coordinate, and that over the step before
MODAL = Family(
    "modes",
    record("", "stiffness damping", "change before"),
    order=140,
    of="reduced_bodies",
    step=Step(note=note_step),
)  # fmt: skip
