"""What follows from the states of a run at its samples: energy balance, momenta, forces."""

from __future__ import annotations

import math
import weakref
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from evolvent import model as mdl
from evolvent.assembly import needs
from evolvent.assembly.assembled import Assembly
from evolvent.equations.kept_fields import write_forces
from evolvent.equations.rhs import rhs
from evolvent.kernels import constraints
from evolvent.model.questions import CONSTRAINT
from evolvent.model.registry import asked, families
from evolvent.solvers.common import balance as eb

Array = np.ndarray


class Sampled(NamedTuple):
    """What follows from the states at the samples: kept by implicit and static solvers, evaluated of explicit runs.

    Attributes
    ----------
    acceleration : (nt, nv) float
    la : (nt, nj) float, multipliers of the joints, in the order of `names`
    balance : (nt,) records of the energy balance, J (see `evolvent.solvers.common.balance`)
    forces : (nt, n) float, the fields of `Samples.kept`, which `by_field` finds in it; `F` of a body is all that
        acts on it at its origin (N and N m, inertial axes), of a free one less the gyroscopic w x J w
    points : (nt, n) float, N, normal forces of the contact points, means over the step; None where they follow from the
        states alone
    momenta : (nt, 6) float, kg m/s and kg m2/s about the inertial origin, between those of the steps' ends on straight
        lines; None where they follow from the states alone
    """

    acceleration: Array
    la: Array
    balance: Any
    forces: Array
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
        np.zeros((size, model.constraints.size)),
        eb.records(size),
        np.zeros((size, int(model.kept[:, 2] @ model.kept[:, 4]))),
    )


def by_field(model: mdl.Model, forces: Array) -> dict[str, dict[str, Array]]:
    """Views of forces (nt, n) of `Sampled`: family -> field -> (nt, records) or (nt, records, numbers)."""
    if model not in _FIELDS:
        _FIELDS[model] = [*_fields(model)]
    at, found = 0, dict[str, dict[str, Array]]()
    for name, field, count, shape in _FIELDS[model]:
        own = found.setdefault(name, {})
        if field:
            end = at + count * math.prod(shape)
            own[field] = forces[:, at:end].reshape(len(forces), count, *shape)
            at = end
    return found


#: Fields of `Samples.kept` of models, in their order: family, field, records and shape; before them families alone.
_FIELDS: weakref.WeakKeyDictionary[mdl.Model, list[tuple[str, str, int, tuple[int, ...]]]]
_FIELDS = weakref.WeakKeyDictionary()


def _fields(model: mdl.Model) -> Iterator[tuple[str, str, int, tuple[int, ...]]]:
    """See `_FIELDS`."""
    names = []
    for name, family in families().items():
        own = family.samples
        if own.kept:
            yield name, "", 0, ()
        kept = own.keeps is None or own.keeps(lambda other: getattr(model, other))
        names += [(how, name, field, kept) for field, how in own.kept.items()]
    for _, name, field, kept in sorted(names, key=lambda row: row[0]):
        yield name, field, getattr(model, name).size if kept else 0, mdl.RECORDS[name][field].shape


def forces_of(model: mdl.Model) -> Array:
    """The last forces, as those of a sample."""
    found: Array = empty(model, 1).forces[0]
    write_forces(model, found)
    return found


def balances(model: mdl.Model, y: Array, sums: Array) -> Any:
    """Energy balances of an explicit method's states, from their accounts; energies of joints count as elastic.

    Parameters
    ----------
    y, sums : (nt, ny) and (nt, N_INVENTORY), states and their energies and momenta (`evolvent.equations.inventory`)

    Returns
    -------
    (nt,) records of `evolvent.solvers.common.balance`
    """
    found = np.zeros(y.shape[0], dtype=eb.BALANCE)
    accounts = y[:, int(model.info.nq + model.info.nv) :]
    found["kinetic"], found["elastic"] = sums[:, mdl.KINETIC], sums[:, mdl.ELASTIC]
    found["loads"], found["drives"] = accounts[:, mdl.LOAD], accounts[:, mdl.DRIVE]
    found["spools"], found["released"] = accounts[:, mdl.SPOOL], accounts[:, mdl.RELEASE]
    found["by_springs"] = accounts[:, mdl.DISSIPATED]
    if any(family.energies.by_causes and family.records(model).size for family in families().values()):
        causes = accounts[:, mdl.N_ACCOUNTS :]
        found["by_mass"], found["by_stiffness"] = causes[:, mdl.BY_MASS], causes[:, mdl.BY_STIFFNESS]
        found["by_contact"], found["by_joints"] = causes[:, mdl.BY_CONTACT], causes[:, mdl.BY_JOINTS]
        found["by_springs"] -= causes[:, : mdl.IMPULSE].sum(axis=1)
    for name, rubbed in asked("friction.rubbed").items():
        if getattr(model, name).size:
            for accounts_of in rubbed(getattr(model, name)):
                found["by_friction"] += y[:, accounts_of].sum(axis=1)
    if model.info.rubbed >= 0:
        found["by_friction"] += y[:, int(model.info.rubbed)]
    found["by_springs"] -= found["by_friction"]
    return found.view(np.recarray)


def evaluate(assembly: Assembly, t: Array, y: Array, s: Array, sums: Array) -> Sampled:
    """Evaluate the states of an explicit run.

    Notes
    -----
    Energies of penalties and coordinates stand in `coupled`. Normal impulses are those that the method integrates.
    """
    model = assembly.model
    y, s = np.ascontiguousarray(y), np.ascontiguousarray(s)
    n_q, n_v = int(model.info.nq), int(model.info.nv)
    found = empty(model, t.size)
    found.balance[:] = balances(model, y, sums)
    needs.load(model, rhs, write_forces)
    contacts = [getattr(model, name) for name in asked("contacts.presses")]
    for records in contacts:
        records["impulse"] = np.nan
    dy, scratch = np.zeros_like(assembly.y), np.zeros(n_v)
    rows = np.flatnonzero(model.rows["kind"] == CONSTRAINT)
    for k in range(t.size):
        rhs(t[k], y[k], s[k], model, dy)
        found.acceleration[k] = dy[n_q : n_q + n_v]
        write_forces(model, found.forces[k])
        found.balance.contact[k] = sum(records["energy"].sum() for records in contacts)
        found.la[k], coupled = constraints.penalty_values(t[k], s[k], model)
        found.la[k, model.rows["index"][rows]] = model.la[rows]
        for name, bending in asked("energies.bending").items():
            if getattr(model, name).size:
                found.balance.bending[k] += bending(model, y[k])
        for name, own in asked("energies.coupled").items():
            if getattr(model, name).size:
                coupled += own(t[k], y[k], s[k], model, scratch)
        found.balance.coupled[k] = coupled
        found.balance.elastic[k] -= coupled
    if model.contact_surfaces.size:
        first = n_q + n_v + mdl.N_ACCOUNTS + mdl.IMPULSE
        by_field(model, found.forces)["contact_surfaces"]["impulse"][:] = y[
            :, first : first + model.contact_surfaces.size
        ]
    return found


def bristles(model: mdl.Model) -> Array:
    """Indices of the accounts that are states (`layout.Accounts.states`), and those of deflections of contacts."""
    last = int(model.info.ny)
    first = int(model.info.rubbed) + 1 if model.info.rubbed >= 0 else last
    every = ((f.records(model), accounts) for f in families().values() for accounts in f.accounts if accounts.states)
    own = [found[accounts.field] + offset for found, accounts in every for offset in accounts.states]
    return np.concatenate([*own, np.arange(first, last)]).astype(int)


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
