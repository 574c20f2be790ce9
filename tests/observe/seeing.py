"""Runs with their trees, and what tests of observations read off the raw state by themselves."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy.spatial.transform import Rotation

from evolvent import System
from evolvent.analysis import runs, trees
from evolvent.assembly.assembled import Assembly
from evolvent.solvers import Solution
from evolvent.solvers.static.static import solve_static

Array = np.ndarray
IMPLICIT, EXPLICIT = "generalized-alpha", "dopri5"


class Seen(NamedTuple):
    """A run: assembly, solution, and the tree of its parts."""

    assembly: Assembly
    solution: Solution
    tree: xr.DataTree

    @property
    def t(self) -> Array:
        return self.solution.t

    def of(self, name: str, variable: str) -> Array:
        """Values of a part's variable."""
        return np.asarray(self.tree[name][variable].values)

    def state(self, name: str, size: int, *, at: int = 0, rate: bool = False) -> Array:
        """Columns of the raw state from a part's first coordinate (or velocity) on: (nt, size)."""
        family, index = self.assembly.names[name]
        first = int(getattr(self.assembly.model, family)["iv" if rate else "iq"][index]) + at
        return self.solution.y[:, first : first + size]

    def nodes(self, name: str, *, rate: bool = False) -> Array:
        """Coordinates (or rates) of a beam, from the raw state: (nt, n + 1, vectors, 3)."""
        part = self.assembly.parts[name]
        size = 3 * part.vectors * (part.elements + 1)
        return self.state(name, size, rate=rate).reshape(-1, part.elements + 1, part.vectors, 3)

    def rotation(self, name: str) -> Array:
        """Rotation matrices of a free body, from the raw quaternion: (nt, 3, 3)."""
        return matrices(self.state(name, 4, at=3))


def run(system: System, samples: Any, method: str = "auto", **options: Any) -> Seen:
    """Simulate; the run must end well."""
    assembly = system.assemble()
    prepared, why = runs.plan(assembly, np.asarray(samples, dtype=float), method=method, **options)
    solution = prepared.run()
    assert solution.success, solution.message
    return Seen(solution.assembly, solution, trees.tree(solution, case="", why=why))


def at_rest(system: System, **options: Any) -> Seen:
    """The equilibrium."""
    solution = solve_static(system.assemble(), **options).chosen(slice(-1, None))
    assert solution.success, solution.message
    return Seen(solution.assembly, solution, trees.tree(solution, case="", why=""))


def matrices(quaternion: Array) -> Array:
    """Rotation matrices of quaternions, scalar part first."""
    return np.asarray(Rotation.from_quat(np.roll(quaternion, -1, axis=-1)).as_matrix())


def derivative(t: Array, values: Array) -> Array:
    """Central differences of fourth order, at all samples but the first and the last two."""
    h = t[1] - t[0]
    found = (values[:-4] - 8.0 * values[1:-3] + 8.0 * values[3:-1] - values[4:]) / (12.0 * h)
    return np.asarray(found)


#: Samples at which `derivative` has values.
INNER = slice(2, -2)


def turned(R: Array, v: Array) -> Array:
    """Vectors of body axes in inertial ones."""
    return np.einsum("tij,...j->ti", R, v) if np.ndim(v) == 1 else np.einsum("tij,tj->ti", R, v)


def close(found: Any, wanted: Any, *, part: float = 1e-9) -> None:
    """Whether arrays agree to a part of the largest wanted value."""
    found, wanted = np.asarray(found), np.asarray(wanted)
    scale = max(float(np.nanmax(np.abs(wanted), initial=0.0)), 1e-12)
    np.testing.assert_allclose(found, np.broadcast_to(wanted, found.shape), rtol=0.0, atol=part * scale)
