"""Systems for the implicit engine's tests, its equations as functions, and what can be read off its runs."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from evolvent import elements
from evolvent.algebra import sparse
from evolvent.assembly.assembled import Assembly
from evolvent.equations import energy_momentum as flow, implicit
from evolvent.kernels import blocks, contact
from evolvent.model import powers
from evolvent.solvers import Solution
from evolvent.solvers.common.matrices import matrix_of
from evolvent.solvers.static.work import sparse_of
from evolvent.solvers.time.implicit.plan import solve_implicit

Array = np.ndarray

RUBBER = elements.Material(young_modulus=2e6, poisson_ratio=0.0, density=1000.0)
SQUARE = elements.Rectangle(thickness=0.02, width=0.02)


class Equations(NamedTuple):
    """Residual and tangent of an assembly as functions of increments dq and multipliers la.

    Velocities and accelerations follow the increments as in a step: v = v0 + c_rate dq, a = a0 + c_mass dq.
    """

    assembly: Assembly
    t: float
    y: Array
    a: Array
    c_mass: float
    c_rate: float
    step: float = 0.0

    def residual(self, dq: Array, la: Array) -> Array:
        """(nv + nj,) in the order of the velocities, then of the joints."""
        model = self.assembly.model
        n_q, n_v, n_j = int(model.info.nq), dq.size, la.size
        r, power = np.zeros(n_v + n_j), np.zeros(powers.N_POWERS)
        y = self.y.copy()
        y[n_q : n_q + n_v] += self.c_rate * dq
        blocks.displace(self.y, dq, False, model, y)
        implicit.residual(self.t, y, self.a + self.c_mass * dq, la, self.step, 1.0, model, r, power)
        return r

    def tangent(self, la: Array) -> Array:
        """(nv + nj, nv + nj), of the same order."""
        model = self.assembly.model
        matrix = matrix_of(model)
        self.residual(np.zeros(int(model.info.nv)), la)
        implicit.tangent(self.t, self.y, la, self.c_mass, self.c_rate, 1.0, model, matrix)
        assert matrix.counts[sparse.OUTSIDE] == 0
        return sparse_of(matrix).toarray()

    def differences(self, la: Array, sizes: Array, h: float = 1e-4) -> Array:
        """Central differences of sixth order of the residual by dq (steps h times `sizes`) and la."""
        n_v = int(self.assembly.model.info.nv)
        x0, columns = np.concatenate([np.zeros(n_v), la]), []
        for k in range(x0.size):
            d = np.zeros(x0.size)
            d[k] = h * sizes[k] if k < n_v else 1.0
            column = 0.0
            for i, w in ((1, 45.0), (2, -9.0), (3, 1.0)):
                for s in (i, -i):
                    x = x0 + s * d
                    column = column + np.sign(s) * w * self.residual(x[:n_v], x[n_v:])
            columns.append(column / (60.0 * d[k]))
        return np.array(columns).T


def start_step(assembly: Assembly, y: Array) -> None:
    """Take the state y as the start of a step: gaps, anchors and bristles of contacts are those of y."""
    model = assembly.model
    n_v = int(model.info.nv)
    model.contact_points["gap"] = np.inf
    model.contact_points["stick"] = 0.0
    model.contact_points["drag"] = 0.0
    Equations(assembly, 0.0, y, np.zeros(n_v), 0.0, 0.0).residual(np.zeros(n_v), np.zeros(model.joints.size))
    contact.end_points(y, model)


def run(assembly: Assembly, samples: Any, **options: Any) -> Solution:
    """Solve; the run must end well."""
    solution = solve_implicit(assembly, samples=samples, **options)
    assert solution.success, solution.message
    return solution


def coordinates(assembly: Assembly, y: Array, name: str) -> Array:
    """Coordinates of a part at all samples: (nt, nodes, vectors, 3) of a beam, (nt, 3) of a point, or a body's."""
    family, index = assembly.names[name]
    model = assembly.model
    if family == "beams":
        row = model.beams[index]
        k = 2 if row["kind"] == 0 else 4
        return y[..., row["iq"] :][..., : 3 * k * row["nodes"]].reshape(*y.shape[:-1], row["nodes"], k, 3)
    row = getattr(model, family)[index]
    size = 3 if family == "points" else 7 if row["motion"] == 2 else 1
    return y[..., row["iq"] :][..., :size]


def momenta(assembly: Assembly, solution: Solution) -> Array:
    """(nt, 6) linear momentum and angular momentum about the origin."""
    from evolvent.kernels import rigid

    out = np.zeros((solution.t.size, 6))
    for k, (t, y) in enumerate(zip(solution.t, solution.y, strict=True)):
        rigid.kinematics(t, y, assembly.model)
        implicit.momenta(y, assembly.model, out[k])
    return out


def moved(assembly: Assembly, y: Array, d: Array) -> Array:
    """A state that differs by increments d (nv,)."""
    found = y.copy()
    blocks.displace(y, d, False, assembly.model, found)
    return found


def forces(assembly: Assembly, y: Array) -> Array:
    """Forces (nv,) in a state, with the sign of a residual."""
    n_v = int(assembly.model.info.nv)
    r = np.zeros(n_v)
    implicit.residual(0.0, y, np.zeros(n_v), np.zeros(0), 0.0, 1.0, assembly.model, r, np.zeros(powers.N_POWERS))
    return r


def step_tangents(plan: Any, step: Any, start: Array, h: float = 1e-6) -> tuple[Array, Array]:
    """Tangent (nv, nv) of a step of energy-momentum at its increments `start`, and the same by central differences."""
    model = plan.assembly.model

    def residual(dq: Array) -> Array:
        step.dq[:] = dq
        flow.residual(model, step)
        return np.array(step.r)

    wanted = np.array([(residual(start + h * e) - residual(start - h * e)) / h for e in np.eye(start.size)]).T
    residual(start)
    flow.tangent(1.0, model, step, plan.matrix)
    return sparse_of(plan.matrix).toarray(), wanted
