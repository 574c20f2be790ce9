"""What can be read off the states of a finished run."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from evolvent.assembly import needs
from evolvent.equations.implicit import momenta
from evolvent.equations.sampling import fill_observations, inventories
from evolvent.kernels import rigid
from evolvent.model import N_INVENTORY, Model


class Observations(NamedTuple):
    """Quantities at every sample, inertial frame, SI.

    Attributes
    ----------
    position, velocity : (nt, nn, 3) float, of all threads' nodes, wound ones on their spools
    tension : (nt, nn) float, N, of the segment inwards of each node (0 while it is wound)
    spool : (nt, np, 2) float, angle and rate of each thread's spool, rad and rad/s
    body_rotation : (nt, nb, 3, 3) float, body to inertial axes
    body_position, body_velocity, body_rate : (nt, nb, 3) float
    inventory : (nt, N_INVENTORY) float, energies and momenta (see `evolvent.equations.inventory`)
    thread_inventory : (nt, np, N_INVENTORY) float, the part of each thread, with its copies
    """

    position: np.ndarray
    velocity: np.ndarray
    tension: np.ndarray
    spool: np.ndarray
    body_rotation: np.ndarray
    body_position: np.ndarray
    body_velocity: np.ndarray
    body_rate: np.ndarray
    inventory: np.ndarray
    thread_inventory: np.ndarray


def empty_observations(model: Model, n_t: int) -> Observations:
    """Room for `n_t` samples."""
    n_n, n_p, n_b = model.nodes.size, model.threads.size, model.bodies.size
    return Observations(
        np.zeros((n_t, n_n, 3)),
        np.zeros((n_t, n_n, 3)),
        np.zeros((n_t, n_n)),
        np.zeros((n_t, n_p, 2)),
        np.zeros((n_t, n_b, 3, 3)),
        np.zeros((n_t, n_b, 3)),
        np.zeros((n_t, n_b, 3)),
        np.zeros((n_t, n_b, 3)),
        np.zeros((n_t, N_INVENTORY)),
        np.zeros((n_t, n_p, N_INVENTORY)),
    )


def observe(model: Model, t: np.ndarray, y: np.ndarray, s: np.ndarray, la: np.ndarray | None = None) -> Observations:
    """Evaluate all quantities at the samples of a run.

    Parameters
    ----------
    model : Model
    t, y, s, la : (nt,), (nt, ny), (nt, ns), (nt, nj), as in `evolvent.solvers.Solution`; la of implicit methods
    """
    out = empty_observations(model, t.size)
    needs.load(model, fill_observations)
    la = np.zeros((t.size, model.constraints.size)) if la is None else np.ascontiguousarray(la)
    fill_observations(t, np.ascontiguousarray(y), np.ascontiguousarray(s), la, model, *out)
    return out


def sums_of(model: Model, t: np.ndarray, y: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Energies and momenta of states: (nt, N_INVENTORY) float, see `evolvent.equations.inventory`.

    Parameters
    ----------
    t, y, s : (nt,), (nt, ny), (nt, ns), as in `evolvent.solvers.Solution`
    """
    out = np.empty((t.size, N_INVENTORY))
    needs.load(model, inventories)
    inventories(np.ascontiguousarray(t), np.ascontiguousarray(y), np.ascontiguousarray(s), model, out)
    return out


def momenta_of(model: Model, t: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Linear momentum and angular momentum about the inertial origin of states without threads: (nt, 3) each.

    Parameters
    ----------
    t, y : (nt,), (nt, ny), as in `evolvent.solvers.Solution`
    """
    out = np.empty((t.size, 6))
    y = np.ascontiguousarray(y)
    for k in range(t.size):
        rigid.kinematics(t[k], y[k], model)
        momenta(y[k], model, out[k])
    return out[:, :3], out[:, 3:]
