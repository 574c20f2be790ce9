"""Nets in equilibrium with what holds them: lengths of the cords, errors of the surface, sensitivities, adjustment."""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np
import scipy

from evolvent.analysis import trees
from evolvent.assembly.assembled import Assembly
from evolvent.families.nets.cords import NetCords
from evolvent.families.nets.part_ties import Anchors, Behind
from evolvent.families.nets.part_unfold import unfolded_start
from evolvent.nets.error import SurfaceError, mean_square_slope, surface_error
from evolvent.nets.topology import Topology
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.static.static import solve_static
from evolvent.solvers.static.work import Work
from evolvent_base.errors import InputError, RunFailed

Array = np.ndarray
#: Most forms that are found on a rim that yields, and its change, beside the aperture, by which they end.
_FORMS, _MOVED = 40, 1e-11


class State(NamedTuple):
    """A net in equilibrium.

    Attributes
    ----------
    y : (ny,) float, state of the assembly
    x : (n, 3) float, m, nodes of the whole net, in its axes
    natural, length : (m,) float, m, lengths of the cords without tension, at the temperature of the form, and with it
    tension : (m,) float, N
    turns, arms : (n, 3, 3) and (n, 3) float, m, attitudes of the bodies that have nodes, and the places of these from
        their origins, inertial axes
    """

    y: Array
    x: Array
    natural: Array
    length: Array
    tension: Array
    turns: Array
    arms: Array


class NetInSystem:
    """A net of an assembled system.

    Parameters
    ----------
    assembly : Assembly; it is left as it is
    name : str, of the net
    """

    def __init__(self, assembly: Assembly, name: str) -> None:
        self.assembly = unfolded_start(dataclasses.replace(assembly, model=assembly.model.copy()), name)
        self.name, self.net = name, assembly.parts[name]
        self.topology: Topology = self.net.layout(name)
        self.own = NetCords(self.assembly, name)
        self.cords, self.iq, self.iv = self.own.ends, self.own.iq, self.own.iv
        springs = self.own.records
        self.axial = springs["stiffness"] * springs["length"]
        self.strain = self.net.heat(name, "temperature", self.net.temperature)
        self.natural = springs["length"] / (1.0 + self.strain)

    def cut(self, natural: Array, strain: float | None = None) -> None:
        """Let the cords have other lengths without tension, m, and a strain by heat beside them."""
        springs = self.own.records
        self.natural = natural
        length = natural * (1.0 + (self.strain if strain is None else strain))
        springs["length"], springs["stiffness"] = length, self.axial / length
        springs["damping"] = self.net.damping * springs["stiffness"]

    def equilibrium(self, y: Array | None = None, tolerance: float = 1e-12) -> State:
        """The net in equilibrium with what holds it.

        Raises
        ------
        RunFailed
            If there is none.
        """
        found = solve_static(self.assembly, y=y, tolerance=tolerance)
        if found.status == "failed":
            raise RunFailed(f"{self.name!r} has no equilibrium: {found.message}", found)
        return self.state(found.chosen(slice(-1, None)))

    def state(self, solution: Solution) -> State:
        """The net in a solution with one sample."""
        held = self.own.held(solution)
        x = self.net.seen(held.x)
        length = np.linalg.norm(x[self.cords[:, 1]] - x[self.cords[:, 0]], axis=1)
        springs = self.own.records
        tension = np.maximum(springs["stiffness"] * (length - springs["length"]), 0.0)
        return State(solution.y[-1], x, self.natural.copy(), length, tension, held.turns, held.arms)

    def formed(self, *, tolerance: float = 1e-12) -> State:
        """The net whose cords are cut for its form on the rim as it is in equilibrium.

        Raises
        ------
        RunFailed
            If no equilibrium is found, or the rim yields so much that no form fits it.

        Notes
        -----
        While the form is found, cords have their force densities as stiffness and no natural length, so that one
        equilibrium has the form on the rim that bends under it; what ties need to keep the heights is iterated.
        """
        net, n = self.net, len(self.topology.plan)
        size, y, before = net.surface.diameter, self.assembly.y.copy(), np.zeros((0, 3))
        places = self.state(trees.at_start(self.assembly, "static")).x
        for _ in range(_FORMS):
            below, rim = places[n:], places[self.topology.rim]
            whole = net.form(
                self.name, self.topology, rim, base=below if isinstance(net.ties, Anchors) else None,
                rear=below[self.topology.rim] if isinstance(net.ties, Behind) else None,
            )  # fmt: skip
            own = self.iq >= 0
            y[self.iq[own, None] + np.arange(3)] = net.in_place(whole.x)[own]
            moved = np.inf if before.shape != whole.x.shape else float(np.abs(whole.x - before).max())
            if net.cut is not None:
                return self.equilibrium(y, tolerance)
            if moved <= _MOVED * size:
                self.cut(net.natural_lengths(whole))
                return self.equilibrium(y, tolerance)
            before = whole.x
            springs = self.own.records
            springs["stiffness"], springs["length"], springs["damping"] = whole.tension / whole.length, 0.0, 0.0
            state = self.equilibrium(y, tolerance)
            places, y = state.x, state.y.copy()
        raise RunFailed(
            f"the rim of {self.name!r} yields so much that after {_FORMS} forms it still moves by {moved:.3g} m; "
            f"stiffen the rim, or reduce the force densities", state,
        )  # fmt: skip

    def error(self, state: State) -> SurfaceError:
        """Error of the surface of the facets."""
        return self.error_of(state.x)

    def error_of(self, x: Array) -> SurfaceError:
        """Error of the surface with its nodes at places (n, 3), m, in the axes of the net."""
        if not len(self.topology.facets):
            raise InputError(
                f"{self.name}.topology has no facets; a file needs the key `facets` for errors of the surface"
            )
        return surface_error(x, self.topology.facets, self.net.surface)

    # ------------------------------------------------------------------------------------------- sensitivities

    def mean_square_slope(self, state: State) -> tuple[float, Array]:
        """Mean square of the half path error, m2, and its derivatives (n, 3) by the places of the nodes of the net."""
        return mean_square_slope(state.x[: len(self.topology.plan)], self.topology.facets, self.net.surface)

    def response(self, state: State) -> Response:
        """How the nodes move when cords are cut longer, about an equilibrium."""
        return Response(self, state)


class Response:
    """Derivatives of the places of a net's nodes by the lengths to which its cords are cut.

    Notes
    -----
    Of a cord with the natural length l0 (1 + e), the tension EA (l/(l0 (1 + e)) - 1) changes by -EA l/(l0^2 (1 + e)) a
    length of l0. With the tangent K of the equilibrium the unknowns change by K^-1 P^T B, B (3 n, m) the forces on
    the nodes by the lengths, P (3 n, nu) the velocities of the nodes by those of the unknowns.
    """

    def __init__(self, of: NetInSystem, state: State) -> None:
        self.of = of
        work = Work(of.assembly, state.y, 0.0, np.zeros(3))
        work.probe(1.0)
        K = work.tangent(0.0, 0.0).tocsc()
        try:
            self._solve = scipy.sparse.linalg.splu(
                K, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.01, options={"SymmetricMode": True}
            ).solve
        except RuntimeError:
            slack = int((state.tension <= 0.0).sum())
            why = f"with {slack} of {len(state.tension)} cords slack " if slack else ""
            remedy = "cut the cords shorter" if slack else "hold them"
            raise RunFailed(
                f"{why}the equilibrium of {of.name!r} has free motions, about which no sensitivities are known; "
                f"{remedy}",
                state,
            ) from None
        n, m = len(of.iq), len(of.cords)
        springs = of.own.records
        slope = np.where(state.tension > 0.0, -of.axial * state.length / (of.natural * springs["length"]), 0.0)
        along = (state.x[of.cords[:, 1]] - state.x[of.cords[:, 0]]) @ of.net.axes.T / state.length[:, None]
        rows = 3 * of.cords[:, :, None] + np.arange(3)
        values = np.stack([slope[:, None] * along, -slope[:, None] * along], axis=1)
        columns = np.broadcast_to(np.arange(m)[:, None, None], rows.shape)
        self._B = scipy.sparse.csr_matrix((values.ravel(), (rows.ravel(), columns.ravel())), shape=(3 * n, m))
        self._P = self._velocities(work.n_q, K.shape[0], state)

    def _velocities(self, n_q: int, size: int, state: State) -> scipy.sparse.csr_matrix:
        """Velocities (3 n) of the nodes by those of the unknowns."""
        found = scipy.sparse.lil_matrix((3 * len(self.of.iq), size))
        for k, (iv, R, arm) in enumerate(zip(self.of.iv, state.turns, state.arms, strict=True)):
            if iv < 0:
                continue
            at = int(iv) - n_q
            found[3 * k : 3 * k + 3, at : at + 3] = np.eye(3)
            if self.of.iq[k] < 0:
                x, y, z = arm
                found[3 * k : 3 * k + 3, at + 3 : at + 6] = -np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) @ R
        return found.tocsr()

    def moves(self, changes: Array) -> Array:
        """Displacements (n, 3, k) of the nodes of the net, m, in its axes, by changes (m, k) of the lengths, m."""
        forces = self._P.T @ (self._B @ changes)
        # one right side at a time: SuperLU takes 2.4 ms a side with 100 at once, of 780 unknowns, and 0.06 ms alone
        moved = self._P @ np.stack([self._solve(one) for one in np.ascontiguousarray(forces.T)], axis=1)
        shaped = moved.reshape(len(self.of.iq), 3, -1)[: len(self.of.topology.plan)]
        return np.asarray(np.einsum("ij,njk->nik", self.of.net.axes.T, shaped))

    def gradient(self, slope: Array) -> Array:
        """Derivatives (m,) by all lengths of a value with derivatives (n, 3) by the nodes' places; one solution."""
        whole = np.zeros((len(self.of.iq), 3))
        whole[: len(slope)] = slope @ self.of.net.axes.T
        return np.asarray(self._B.T @ (self._P @ self._solve(self._P.T @ whole.ravel(), trans="T")))
