"""Reduced finite-element models: their matrices, checks of these, and their form in mean axes.

The coordinates u (n,) of a model are displacements and rotations of its interface nodes, six each in the order of the
nodes, then any others, such as amplitudes of modes with the interface held (Craig and Bampton 1968). A rigid motion
moves the nodes and no other coordinate.
"""

from __future__ import annotations

import dataclasses
import math
from typing import NamedTuple

import numpy as np
import scipy

from evolvent_base.errors import InputError, counted

Array = np.ndarray

#: What matrices may be off, beside their own entries: symmetry, strain energy of rigid motions, mass of these.
SYMMETRY, RIGID, MASS = 1e-6, 1e-5, 1e-6
#: Share of the energy of the lowest mode with the interface held, below which that of a rigid motion is round-off.
FLOOR = 1e-8
#: Least inertia of a motion beside the mean of the body; below, it gets so much: interfaces of finite-element models
#: often have rotations without inertia.
LEAST = 1e-6
#: Share of the largest mass that the interface nodes could take, which they get.
SHARE = 0.5
#: Words for the rigid motions.
_MOTIONS = ("translation along x", "translation along y", "translation along z",
            "rotation about x", "rotation about y", "rotation about z")  # fmt: skip


@dataclasses.dataclass(frozen=True, eq=False)
class ReducedModel:
    """Matrices of a reduced model, SI units, and where its interface nodes are.

    Attributes
    ----------
    stiffness, mass : (n, n) float, N/m, kg, and so on with rotations in rad; other coordinates have any unit
    positions : (p, 3) float, m, of the interface nodes, axes of the model
    names : tuple of str, of the nodes
    recovery : (r, n) float, results as combinations of the coordinates
    recovery_names, recovery_units : tuple of str, of the results
    warning : str, what the structure that the model was made of was beyond; '' for nothing
    """

    stiffness: Array
    mass: Array
    positions: Array
    names: tuple[str, ...]
    recovery: Array
    recovery_names: tuple[str, ...] = ()
    recovery_units: tuple[str, ...] = ()
    warning: str = ""

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.stiffness)

    @property
    def rigid_motions(self) -> Array:
        """Coordinates (n, 6) of translations and rotations by 1 about the origin of the model's axes."""
        found = np.zeros((self.size, 6))
        for k, s in enumerate(self.positions):
            own = found[6 * k : 6 * k + 6]
            own[:3, :3], own[:3, 3:], own[3:, 3:] = np.eye(3), np.cross(np.eye(3), s).T, np.eye(3)
        return found

    def scaled(self, length: float, mass: float) -> ReducedModel:
        """The model in SI units, where it has been written with other units of length (m) and mass (kg)."""
        translations = np.zeros(self.size, dtype=bool)
        for k in range(len(self.positions)):
            translations[6 * k : 6 * k + 3] = True
        by = np.where(translations, length, 1.0)
        energy = mass * length**2 / np.outer(by, by)
        return dataclasses.replace(
            self, stiffness=energy * self.stiffness, mass=energy * self.mass, positions=length * self.positions,
            recovery=self.recovery / by,
        )  # fmt: skip


class MeanAxes(NamedTuple):
    """A reduced model as a rigid body with nodes on it and modal coordinates q beside.

    Attributes
    ----------
    mass, inertia, centre : of the body, kg, (3, 3) kg m2 about its centre of mass, and (3,) m
    node_mass, node_inertia : float, kg and kg m2, of each node about every axis
    shapes : (n, m) float, coordinates by q; q is the root mean square displacement by mass, m
    square : (m,) float, rad2/s2, squares of the frequencies of the modes
    held : float, rad/s, lowest frequency of the model with one of its nodes held; infinite of a single node alone
    """

    mass: float
    inertia: Array
    centre: Array
    node_mass: float
    node_inertia: float
    shapes: Array
    square: Array
    held: float


def check_model(model: ReducedModel, key: str) -> None:
    """Refuse matrices that are no model of a body that floats freely.

    Parameters
    ----------
    key : str, what messages call the model

    Raises
    ------
    InputError
        One sentence: what is wrong, by how much, and what is allowed.
    """
    n, nodes = len(np.atleast_1d(model.stiffness)), len(np.atleast_1d(model.positions))
    for what, matrix in (("stiffness", model.stiffness), ("mass", model.mass)):
        if matrix.ndim != 2 or matrix.shape != (n, n):
            raise InputError(f"{key}: the {what} has the shape {matrix.shape}; it must be square, of one size with the "
                             f"other matrix")  # fmt: skip
        if not np.all(np.isfinite(matrix)):
            raise InputError(f"{key}: the {what} has entries that are not finite numbers")
        size = float(np.abs(matrix).max(initial=0.0))
        scale = np.sqrt(np.abs(np.outer(np.diagonal(matrix), np.diagonal(matrix))))
        off = np.abs(matrix - matrix.T) / np.where(scale > 0.0, scale, size or 1.0)
        if off.max(initial=0.0) > SYMMETRY:
            i, j = np.unravel_index(int(off.argmax()), off.shape)
            raise InputError(
                f"{key}: the {what} is not symmetric: entries {i}, {j} and {j}, {i} are {matrix[i, j]:.6g} and "
                f"{matrix[j, i]:.6g}; they may differ by {SYMMETRY:g} of the diagonal"
            )
    if model.positions.shape != (nodes, 3) or nodes == 0 or not np.all(np.isfinite(model.positions)):
        raise InputError(f"{key}: positions have the shape {model.positions.shape}; they must be (nodes, 3), at least "
                         f"one node")  # fmt: skip
    if n < 6 * nodes:
        raise InputError(
            f"{key}: the matrices have {counted(n, 'coordinate')}, but {counted(nodes, 'interface node')} need "
            f"{6 * nodes}: three displacements and three rotations each"
        )
    if model.recovery.ndim != 2 or model.recovery.shape[1] != n or not np.all(np.isfinite(model.recovery)):
        raise InputError(f"{key}: the recovery matrix has the shape {model.recovery.shape}; it must be (results, {n}), "
                         f"finite numbers")  # fmt: skip
    _check_rigid(model, key)


def _check_rigid(model: ReducedModel, key: str) -> None:
    """Refuse a model that strains in a rigid motion, or whose mass is that of no body."""
    Z = model.rigid_motions
    strained = np.einsum("ik,ij,jk->k", Z, model.stiffness, Z)
    terms = np.einsum("ik,ij,jk->k", np.abs(Z), np.abs(model.stiffness), np.abs(Z))
    floor = _round_off(model, Z) if np.any(np.abs(strained) > RIGID * terms) else np.zeros(6)
    share = np.where(np.abs(strained) > floor, np.abs(strained) / np.where(terms > 0.0, terms, 1.0), 0.0)
    if share.max() > RIGID:
        k = int(share.argmax())
        raise InputError(
            f"{key}: a {_MOTIONS[k]} strains the model: its energy is {share[k]:.2g} of that of the parts, at most "
            f"{RIGID:g} is allowed; the model must not be held, and positions must be those of its nodes"
        )
    whole = Z.T @ model.mass @ Z
    mass = float(np.trace(whole[:3, :3])) / 3.0
    if not mass > 0.0:
        raise InputError(f"{key}: its mass is {mass:.6g} kg; it must be above 0")
    off = float(np.abs(whole[:3, :3] - mass * np.eye(3)).max())
    if off > MASS * mass:
        raise InputError(
            f"{key}: its mass differs by {off:.3g} kg with the direction, beside {mass:.6g} kg; {MASS:g} of it is "
            f"allowed: rotations must be in rad and displacements in the unit of the positions"
        )
    first = whole[:3, 3:]
    if np.abs(first + first.T).max() > MASS * mass * max(1.0, float(np.abs(model.positions).max())):
        raise InputError(f"{key}: its mass matrix is that of no body: no centre of mass gives its first moments")


def _round_off(model: ReducedModel, Z: Array) -> Array:
    """Strain energy (6,) of rigid motions Z that is round-off, for models whose interface has no stiffness beside it.

    With one interface node all stiffness is that of the other coordinates, and what is left at the node is round-off of
    their size, or of that of the finite-element model: `FLOOR` of the energy that the lowest frequency with the
    interface held would give the motion.
    """
    inner = np.arange(6 * len(model.positions), model.size)
    floor: Array = np.finfo(float).eps * model.size * np.abs(model.stiffness).max() * (Z**2).sum(axis=0)
    if inner.size:
        K, M = (0.5 * (one + one.T)[np.ix_(inner, inner)] for one in (model.stiffness, model.mass))
        try:
            lowest = float(scipy.linalg.eigh(K, M, eigvals_only=True)[0])
        except (np.linalg.LinAlgError, ValueError):
            return floor
        floor = np.maximum(floor, FLOOR * max(lowest, 0.0) * np.einsum("ik,ij,jk->k", Z, model.mass, Z))
    return floor


def mean_axes(model: ReducedModel, key: str) -> MeanAxes:
    """A checked model as a rigid body, nodes and modes.

    Notes
    -----
    A share of the mass matrix stands at the nodes, s D with D = diag(m/p, m/p r^2/p): half of the most that leaves
    M - s D positive definite. Of the rest, Z are the rigid motions; with Z^T (M - s D) u = 0 (mean axes) the remaining
    motions have the eigenvalues K u = w^2 (M - s D) u. Nothing is left out: the linear model is that of the matrices.
    Frequencies of rigid motions by round-off do not enter. Motions without inertia get the share `LEAST` of the mean of
    the body; rigid motions keep theirs.
    """
    K, M = 0.5 * (model.stiffness + model.stiffness.T), 0.5 * (model.mass + model.mass.T)
    Z, nodes = model.rigid_motions, len(model.positions)
    whole = Z.T @ M @ Z
    mass, centre = _centre(whole)
    about = whole[3:, 3:] + mass * _square(centre)
    radius = math.sqrt(max(float(np.linalg.eigvalsh(about)[0]), 1e-6 * float(np.trace(about))) / mass)
    own = np.array([1.0, 1.0, 1.0, radius**2, radius**2, radius**2]) * mass / nodes
    D = np.zeros(model.size)
    D[: 6 * nodes] = np.tile(own, nodes)
    M = _definite(M, D, Z, key)
    share = SHARE / float(scipy.linalg.eigh(np.diag(D), M, eigvals_only=True)[-1])
    rest = M - share * np.diag(D)
    body = Z.T @ rest @ Z
    rest_mass, rest_centre = _centre(body)
    inertia = body[3:, 3:] + rest_mass * _square(rest_centre)
    basis = scipy.linalg.null_space((rest @ Z).T / np.sqrt(np.diagonal(body))[:, None])
    square, shapes = scipy.linalg.eigh(basis.T @ K @ basis, basis.T @ rest @ basis)
    if square.size and square[0] < -1e-9 * square[-1]:
        raise InputError(f"{key}: its stiffness is negative along a motion, by {square[0]:.3g} 1/s2 beside its mass")
    shapes = math.sqrt(mass) * (basis @ shapes)
    shapes *= np.where(shapes[np.abs(shapes).argmax(axis=0), np.arange(square.size)] < 0.0, -1.0, 1.0)
    return MeanAxes(
        rest_mass, 0.5 * (inertia + inertia.T), rest_centre, share * mass / nodes, share * own[3], shapes,
        np.maximum(square, 0.0), _held_frequency(K, M, nodes),
    )  # fmt: skip


def _definite(M: Array, D: Array, Z: Array, key: str) -> Array:
    """M (n, n), with inertia `LEAST` beside the mean D (n,) in elastic motions that have less; Z : rigid motions.

    The added matrix is D N a N^T D with motions N that are normal to Z by D, so that it vanishes for rigid motions.
    """
    own = np.where(D > 0.0, D, np.diagonal(M))
    if not np.all(own > 0.0):
        k = int(np.argmin(own))
        raise InputError(f"{key}: coordinate {k} of the modes has the mass {M[k, k]:.3g}; it must be above 0")
    root = np.sqrt(own)
    values, vectors = np.linalg.eigh(M / np.outer(root, root))
    if values[0] < -LEAST:
        raise InputError(f"{key}: its mass matrix is negative along a motion, by {values[0]:.3g} of the mean mass")
    low = values < LEAST
    if not low.any():
        return M
    N = vectors[:, low] / root[:, None]
    N -= Z @ np.linalg.solve(Z.T @ (own[:, None] * Z), Z.T @ (own[:, None] * N))
    W = own[:, None] * N
    return M + (W * (LEAST - values[low])) @ W.T


def _held_frequency(K: Array, M: Array, nodes: int) -> float:
    """Lowest frequency (rad/s) with one node held, whichever is the softest."""
    found = math.inf
    for k in range(nodes):
        rest = np.delete(np.arange(len(K)), np.s_[6 * k : 6 * k + 6])
        if rest.size:
            square = scipy.linalg.eigh(K[np.ix_(rest, rest)], M[np.ix_(rest, rest)], eigvals_only=True)[0]
            found = min(found, math.sqrt(max(float(square), 0.0)))
    return found


def _centre(whole: Array) -> tuple[float, Array]:
    """Mass and centre of mass of a mass matrix (6, 6) of rigid motions about the origin."""
    mass = float(np.trace(whole[:3, :3])) / 3.0
    first = whole[:3, 3:]  # m times the matrix of w -> w x c
    turned = np.array([first[1, 2] - first[2, 1], first[2, 0] - first[0, 2], first[0, 1] - first[1, 0]])
    return mass, turned / (2.0 * mass)


def _square(a: Array) -> Array:
    """[a]x [a]x: of a mass at a, its inertia about the origin is -m of this."""
    return np.outer(a, a) - (a @ a) * np.eye(3)
