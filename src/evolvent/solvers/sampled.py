"""What follows from the states of a run at its samples: energy balance, momenta, forces."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import void

from evolvent import model as mdl
from evolvent.assembly import needs
from evolvent.assembly.assembled import Assembly
from evolvent.compiled.jit import MATRIX, indirect
from evolvent.flow.rhs import rhs
from evolvent.kernels import constraint_rows, coordinate, joint
from evolvent.kernels.ancf_beams import beam_energies
from evolvent.kernels.rod import evaluate_rods
from evolvent.solvers import balance as eb

Array = np.ndarray
#: Numbers of a contact surface at a sample (see `Sampled`), and the indices of two of them.
N_SURFACE, IMPULSE, TOUCHING = 10, 7, 8
#: Numbers of a contact between bodies at a sample, and the index of its impulse.
N_TOUCH, TOUCHED = 19, 18


class Sampled(NamedTuple):
    """What follows from the states at the samples: kept by implicit and static solvers, evaluated of explicit runs.

    Attributes
    ----------
    acceleration : (nt, nv) float
    la : (nt, nj) float, multipliers of the joints, in the order of `names`
    balance : (nt,) records of the energy balance, J (see `evolvent.solvers.balance`)
    contact_surfaces : (nt, nc, 10) float, of each: force (N) and torque (N m) on its body at the body's origin,
        inertial axes; sum of normal forces (N), its impulse (N s), points that touch, energy (J)
    wrenches : (nt, nb, 6) float, N and N m, all that acts on each body at its origin, inertial axes; torques of free
        bodies less the gyroscopic w x J w
    touches : (nt, n, 19) float, of each contact between bodies: force on a (N), moments on a and b about their origins
        (N m), friction on a (N), point of contact (m), inertial axes; normal force (N), gap (m), energy (J), and the
        impulse of the normal force (N s, NaN of explicit methods)
    friction : (nt, n, 3) float, N, inertial axes, friction on the contact points of beams; n = 0 where nothing rubs
    points : (nt, n) float, N, normal forces of the contact points, means over the step; None where they follow from the
        states alone
    momenta : (nt, 6) float, kg m/s and kg m2/s about the inertial origin, between those of the steps' ends on straight
        lines; None where they follow from the states alone
    """

    acceleration: Array
    la: Array
    balance: Any
    contact_surfaces: Array
    wrenches: Array
    touches: Array
    friction: Array
    points: Array | None = None
    momenta: Array | None = None

    def chosen(self, samples: Any) -> Sampled:
        """At some of the samples: (nt,) bool, or indices."""
        found: list[Any] = [None if values is None else values[samples] for values in self]
        return Sampled(*found)


class Momentum(NamedTuple):
    """Momentum balance.

    Attributes
    ----------
    linear, angular : (nt, 3) float, kg m/s and kg m2/s about the inertial origin, of all that the model moves
    jumps_linear, jumps_angular : (nt, 3) float, what events brought in since the start (nodes that leave a spool)
    """

    linear: Array
    angular: Array
    jumps_linear: Array
    jumps_angular: Array

    @property
    def drift_linear(self) -> Array:
        """(nt, 3) linear momentum less that at the start and less the jumps: zero where nothing acts from outside."""
        return (self.linear - self.linear[:1]) - (self.jumps_linear - self.jumps_linear[:1])

    @property
    def drift_angular(self) -> Array:
        """(nt, 3) angular momentum less that at the start and less the jumps: zero where nothing acts from outside."""
        return (self.angular - self.angular[:1]) - (self.jumps_angular - self.jumps_angular[:1])


def empty(model: mdl.Model, size: int) -> Sampled:
    """Room for `size` samples."""
    return Sampled(
        np.zeros((size, int(model.info.nv))),
        np.zeros((size, model.joints.size)),
        eb.records(size),
        np.zeros((size, model.contact_surfaces.size, N_SURFACE)),
        np.zeros((size, model.bodies.size, 6)),
        np.zeros((size, model.body_contacts.size, N_TOUCH)),
        np.zeros((size, rubbing_points(model), 3)),
    )


def rubbing_points(model: mdl.Model) -> int:
    """Number of the contact points of beams, 0 where none of them has friction."""
    return model.contact_points.size if np.any(model.contact_surfaces["friction"] > 0.0) else 0


@indirect(void(mdl.MODEL, MATRIX, MATRIX, MATRIX))
def write_contacts(model: mdl.Model, contact_surfaces: Array, friction: Array, touches: Array) -> None:
    """Write what the last contacts' forces left in their records as a sample's `Sampled`, but for impulses."""
    rows, points, pairs = model.contact_surfaces, model.contact_points, model.body_contacts
    for k in range(contact_surfaces.shape[0]):
        for i in range(6):
            contact_surfaces[k, i] = rows[k].F[i]
        contact_surfaces[k, 6], contact_surfaces[k, 8], contact_surfaces[k, 9] = (
            rows[k].normal,
            rows[k].touching,
            rows[k].energy,
        )
    for i in range(friction.shape[0]):
        f, n, lam = points[i].f, points[i].n, points[i].force
        for j in range(3):
            friction[i, j] = f[j] - lam * n[j] if lam > 0.0 else 0.0
    for k in range(touches.shape[0]):
        row = pairs[k]
        p, q, f, c = row.on_a, row.on_b, row.rubbing, row.c
        for i in range(3):
            touches[k, i], touches[k, 3 + i], touches[k, 6 + i] = p[i], p[3 + i], q[3 + i]
            touches[k, 9 + i], touches[k, 12 + i] = f[i], c[i]
        touches[k, 15], touches[k, 16], touches[k, 17] = row.force, row.gap1, row.energy


def forces_of(model: mdl.Model) -> tuple[Array, Array, Array, Array]:
    """Of the last forces: `contact_surfaces`, `wrenches`, `touches` and `friction` of a sample, without impulses."""
    contact_surfaces, touches = (
        np.zeros((model.contact_surfaces.size, N_SURFACE)),
        np.zeros((model.body_contacts.size, N_TOUCH)),
    )
    friction = np.zeros((rubbing_points(model), 3))
    if model.contact_surfaces.size or model.body_contacts.size:
        write_contacts(model, contact_surfaces, friction, touches)
    touches[:, TOUCHED] = np.nan
    return contact_surfaces, model.bodies["F"].copy(), touches, friction


def balances(model: mdl.Model, y: Array, sums: Array) -> Any:
    """Energy balances of an explicit method's states, from their accounts; energies of joints count as elastic.

    Parameters
    ----------
    y, sums : (nt, ny) and (nt, N_INVENTORY), states and their energies and momenta (`evolvent.flow.inventory`)

    Returns
    -------
    (nt,) records of `evolvent.solvers.balance`
    """
    found = np.zeros(y.shape[0], dtype=eb.BALANCE)
    accounts = y[:, int(model.info.nq + model.info.nv) :]
    found["kinetic"], found["elastic"] = sums[:, mdl.KINETIC], sums[:, mdl.ELASTIC]
    found["loads"], found["drives"] = accounts[:, mdl.LOAD], accounts[:, mdl.DRIVE]
    found["spools"], found["released"] = accounts[:, mdl.SPOOL], accounts[:, mdl.RELEASE]
    found["by_springs"] = accounts[:, mdl.DISSIPATED]
    if model.beams.size or model.rods.size:
        causes = accounts[:, mdl.N_ACCOUNTS :]
        found["by_mass"], found["by_stiffness"] = causes[:, mdl.BY_MASS], causes[:, mdl.BY_STIFFNESS]
        found["by_contact"], found["by_joints"] = causes[:, mdl.BY_CONTACT], causes[:, mdl.BY_JOINTS]
        found["by_springs"] -= causes[:, : mdl.IMPULSE].sum(axis=1)
    found["by_friction"] = y[:, model.coordinates["account"] + mdl.BY_FRICTION].sum(axis=1)
    if model.info.rubbed >= 0:
        found["by_friction"] += y[:, int(model.info.rubbed)]
    found["by_springs"] -= found["by_friction"]
    return found.view(np.recarray)


def evaluate(assembly: Assembly, t: Array, y: Array, s: Array, sums: Array) -> Sampled:
    """Evaluate the states of an explicit run.

    Notes
    -----
    Energies of penalties and hinges stand in `coupled`. Normal impulses are those that the method integrates.
    """
    model = assembly.model
    y, s = np.ascontiguousarray(y), np.ascontiguousarray(s)
    n_q, n_v = int(model.info.nq), int(model.info.nv)
    found = empty(model, t.size)
    found.balance[:] = balances(model, y, sums)
    needs.load(model, rhs, write_contacts)
    dy, own, scratch = np.zeros_like(assembly.y), np.zeros(3), np.zeros(n_v)
    rows = np.flatnonzero(model.rows["kind"] == constraint_rows.JOINT)
    for k in range(t.size):
        rhs(t[k], y[k], s[k], model, dy)
        found.acceleration[k] = dy[n_q : n_q + n_v]
        found.contact_surfaces[k], found.wrenches[k], found.touches[k], found.friction[k] = forces_of(model)
        found.balance.contact[k] = found.contact_surfaces[k, :, 9].sum() + found.touches[k, :, 17].sum()
        found.la[k], coupled = joint.penalty_values(t[k], s[k], model.joints)
        found.la[k, model.rows["index"][rows]] = model.la[rows]
        if model.beams.size:
            own[:] = 0.0
            beam_energies(y[k], 0, model.elements.size, model, own)
            found.balance.bending[k] = own[2]
        if model.rods.size:
            own[:] = 0.0
            evaluate_rods(model, own)
            found.balance.bending[k] += own[2]
        if model.coordinates.size:
            coupled += coordinate.add_coordinates(t[k], y[k], mdl.KEPT, s[k], model, scratch)[0]
        found.balance.coupled[k] = coupled
        found.balance.elastic[k] -= coupled
    if model.contact_surfaces.size:
        first = n_q + n_v + mdl.N_ACCOUNTS + mdl.IMPULSE
        found.contact_surfaces[:, :, 7] = y[:, first : first + model.contact_surfaces.size]
    return found


def bristles(model: mdl.Model) -> Array:
    """Indices of the accounts that are states: forces of frictions of coordinates, and deflections of contacts'."""
    last = int(model.info.ny)
    first = int(model.info.rubbed) + 1 if model.info.rubbed >= 0 else last
    return np.concatenate([model.coordinates["account"] + mdl.FRICTION_FORCE, np.arange(first, last)]).astype(int)


def angular_momentum(sums: Array) -> Array:
    """(..., 3) angular momentum about the inertial origin of sums (..., N_INVENTORY), with wound thread if carried."""
    found: Array = np.sum([sums[..., k : k + 3] for k in (mdl.H_BODY, mdl.H_RELEASED, mdl.H_CARRIED)], axis=0)
    return found


def momentum_of(model: mdl.Model, y: Array, linear: Array, angular: Array) -> Momentum:
    """Momenta (nt, 3) of the states of any run, with what its events brought in."""
    accounts = y[:, int(model.info.nq + model.info.nv) :]
    return Momentum(
        linear=linear,
        angular=angular,
        jumps_linear=accounts[:, mdl.JUMP_LINEAR : mdl.JUMP_LINEAR + 3],
        jumps_angular=accounts[:, mdl.JUMP_ANGULAR : mdl.JUMP_ANGULAR + 3],
    )
