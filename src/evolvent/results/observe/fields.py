"""Observations of fields: their resultant, power and work."""

from __future__ import annotations

import numpy as np

from evolvent.assembly import needs
from evolvent.flow.inventory import inventory
from evolvent.kernels import fields, rigid, thread
from evolvent.kernels.blocks import POSITION, indices
from evolvent.model import N_INVENTORY, Model, zeros
from evolvent.results.observe.variables import Observed
from evolvent.results.observe.view import View

Array = np.ndarray


def observe_field(view: View, name: str) -> Observed:
    """Resultant of a field on all masses, its power, and its work by the trapezoidal rule."""
    found, model = Observed(), view.model.copy()._replace(loads=zeros("loads", 0))
    scale = np.zeros(model.fields.size)
    scale[view.index(name)] = 1.0
    model.fields["scale"], model.info.gravity[:] = scale, 0.0
    needs.load(model, rigid.kinematics, fields.add_field_forces, fields.add_beam_fields)
    force, power = np.zeros((view.t.size, 3)), np.zeros(view.t.size)
    for k, (t, y, s) in enumerate(zip(view.t.tolist(), view.y, view.s, strict=True)):
        power[k] = _sums(t, y, s, model, force[k])
    work = np.zeros(view.t.size)
    np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(view.t), out=work[1:])
    found.vector("force", force, "N", "resultant on all masses, inertial axes")
    found.scalar("power", power, "W", "power of the field")
    found.scalar("work", work, "J", "work since the first sample, by the trapezoidal rule over the samples")
    found.plots = ["force"]
    return found


def _sums(t: float, y: Array, s: Array, model: Model, force: Array) -> float:
    """Add the resultant of all fields of a state to `force`; returns their power, W."""
    f, n_q = model.flexible, int(model.info.nq)
    if model.threads.size:
        inventory(t, y, s, model, np.empty(N_INVENTORY))  # it places the nodes
    rigid.kinematics(t, y, model)
    model.points["f"], model.bodies["F"], f.P[:] = 0.0, 0.0, 0.0
    power = float(fields.add_field_forces(t, y, model))
    fields.add_beam_fields(t, y, model, f.P)
    power += float(f.P @ y[n_q : n_q + f.P.size])
    positions = model.blocks[model.blocks["kind"] == POSITION]
    force += f.P[indices(positions, "iv") - n_q].sum(axis=0)
    if model.threads.size:
        power += float(thread.wound_fields(t, s, model))
    for p, row in enumerate(model.threads):
        power += float(thread.node_loads(t, s, model, p))
        nodes = model.nodes[int(row["node"]) : int(row["node"]) + int(s[p])]
        force += row["copies"] * (nodes["mass"] @ nodes["af"])
    force += model.points["f"].sum(axis=0) + model.bodies["F"][:, :3].sum(axis=0)
    return power
