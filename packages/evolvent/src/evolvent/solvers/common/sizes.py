"""Sizes of a system: of its unknowns, of a typical mass, and of the energies beside which others are round-off."""

from __future__ import annotations

import functools

import numpy as np

from evolvent import model as mdl
from evolvent.assembly.assembled import Assembly
from evolvent.assembly.blocks import owners
from evolvent.kernels.blocks import ANGLE, MOVES, POSITION, SCALAR, indices
from evolvent.model.registry import asked, families
from evolvent.solvers.common.balance import LEAST_ENERGY, RESOLVED
from evolvent.solvers.common.laws import largest_works

#: Share of energies of the system's size that is round-off.
ROUND_OFF = 1e-9
#: Part of the elements' `form_energy` that is round-off of their strain energy.
STRAIN_ROUND_OFF = 1e-14
#: Part of the energies and works that a run handles which is round-off.
WORK_ROUND_OFF = 1e-14
#: Sizes of a system from which the origin of the ground says nothing of it.
GROUND_IS_FAR = 100.0
#: Share of the distance from the origin below which steps cannot be measured, for the round-off of positions.
KNOWN_TO = 1e-4


def sizes(assembly: Assembly) -> tuple[np.ndarray, float]:
    """What counts as 1 of each velocity's coordinate (m, or 1 for slopes and turns), and a typical mass (kg).

    Of a wheel that is the angle which turns its body by 1 rad.
    """
    model, blocks, n_q = assembly.model, assembly.model.blocks, int(assembly.model.info.nq)
    weight = np.ones(int(model.info.nv))
    positions, inertia = blocks["kind"] == POSITION, blocks["inertia"][:, 0]
    placed = assembly.y[indices(blocks[positions & (blocks["switch"] == MOVES)], "iq")]
    own = asked("state.extents").items()
    lengths = [(one, 0.0, 0.0) for name, extents in own for one in extents(getattr(model, name))]
    length = _extent(np.concatenate([model.bodies["x"], placed, np.reshape(lengths, (-1, 3))]))
    weight[indices(blocks[positions], "iv") - n_q] = length
    for sizes_of in asked("state.sizes").values():
        for velocities, size in sizes_of(model, length):
            weight[velocities - n_q] = size
    # the first node of a beam has the mass of half an element; a point mass has that of a thread's end on it
    first = _first_masses()[blocks["family"]]
    typical = (positions & ((first == 0.0) | (blocks["node"] == 0)) | (blocks["kind"] == ANGLE)) & (inertia > 0.0)
    masses = np.where(first > 0.0, first, 1.0)[typical] * inertia[typical]
    return weight, float(np.exp(np.mean(np.log(masses)))) if masses.size else 1.0


@functools.cache
def _first_masses() -> np.ndarray:
    """What the first coordinate of an owner has of the typical mass, by the codes of owners: (n,)."""
    return np.array([max(one.first for one in families()[name].state.unknowns) for name in owners()])


def _extent(places: np.ndarray) -> float:
    """Size of a system by the places of its bodies, of which the first is the ground: without it where it is far, m."""
    together, own = (float(np.linalg.norm(np.ptp(found, axis=0))) for found in (places, places[1:]))
    own = own or 1.0
    return (together or 1.0) if together <= GROUND_IS_FAR * own else max(own, KNOWN_TO * together)


def length_of(model: mdl.Model, weight: np.ndarray) -> float:
    """Largest size of the unknowns (m, or 1 for slopes and turns) but for wheels and free spools."""
    kept = np.ones(weight.size, dtype=bool)
    kept[model.blocks["iv"][model.blocks["kind"] == SCALAR] - int(model.info.nq)] = False
    return float(weight[kept].max(initial=0.0))


def form_energy(model: mdl.Model) -> float:
    """Energies of which the strain energies of elements are differences, J (`Energies.strained`)."""
    return sum(strained(model) for strained in asked("energies.strained").values())


def strain_round_off(model: mdl.Model) -> float:
    """Energy of which the part `balance.RESOLVED` is the round-off of the elements' strain energies, J."""
    return STRAIN_ROUND_OFF / RESOLVED * form_energy(model)


def round_off_energy(assembly: Assembly, time: float, known: tuple[np.ndarray, float] | None = None) -> float:
    """Round-off of the energies and works that a run from `time` handles, J: of weights lifted and of laws' forces.

    `known` are the `sizes` of the assembly, where they have been found.
    """
    weight, mass = sizes(assembly) if known is None else known
    return WORK_ROUND_OFF * (_lifted(assembly.model, mass, weight) + largest_works(assembly, time))


def _lifted(model: mdl.Model, mass: float, weight: np.ndarray) -> float:
    """Work of weights that are lifted by the system's size, J."""
    return mass * weight.size * float(np.linalg.norm(model.info["gravity"])) * length_of(model, weight)


def energy_floor(assembly: Assembly, mass: float, weight: np.ndarray) -> float:
    """Energy beside which a gain is round-off, J.

    That of weights lifted by the system's size, of forms of elements, and what families state (`Energies.round_off`).
    """
    model = assembly.model
    own = sum(round_off(model) for round_off in asked("energies.round_off").values())
    return ROUND_OFF * (_lifted(model, mass, weight) + form_energy(model)) + own + LEAST_ENERGY
