"""A mechanism at a position: the direction in which it moves there, and the virtual power of each part along it.

Every force is the engine's: the residual of the equations of motion (`evolvent.flow.implicit.residual`) of the model
with one part's force alone. So gradients of constraints, levers of weights and neighbours' springs are those of a run.

Notes
-----
With the gradients G of the constraints, J of the coordinates and the mass matrix M, the direction v of coordinate c is
the one of least kinetic energy v.M v/2 among those with G v = 0, J_c v = 1, and J_j v = 0 of the coordinates j that are
held. What is neither held nor driven, such as a free satellite, so follows by its inertia. A part with the generalised
force Q has the share Q.v, and the reflected inertia is v.M v.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import scipy.linalg

from evolvent import model as mdl
from evolvent.analysis.margins.shares import GRAVITY, OWN, SPIN, Share, coordinate_names
from evolvent.assembly.assembled import Assembly
from evolvent.base.errors import InputError
from evolvent.flow.implicit import residual
from evolvent.flow.powers import N_POWERS
from evolvent.kernels import axial, coordinate_laws
from evolvent.kernels.axial import QUARTER
from evolvent.kernels.blocks import displace
from evolvent.solvers import equilibrium

Array = np.ndarray

#: Rank of constraints beside the largest singular value, and what an equation of the direction may be off.
_RANK, _OFF = 1e-10, 1e-7
#: Part of what a force does in single velocities below which their sum is round-off.
_ROUND_OFF = 1e-12
#: Largest move between two positions, rad and m; iterations to a position, and what it may be off.
_MOVE, _ITERATIONS, _REACHED = 0.2, 30, 1e-13
#: Deflections of a bristle, beside that at which friction slips, from which it is pulled along.
_SLIPPING = 2.0


@dataclasses.dataclass(frozen=True)
class Direction:
    """How a mechanism moves with a coordinate.

    Attributes
    ----------
    v : (nv,) float, velocities by that of the coordinate, which is 1 or -1
    rates : (nc,) float, of all coordinates
    inertia : float, kg m2 or kg, v.M v
    """

    v: Array
    rates: Array
    inertia: float


class Mechanism:
    """Forces, constraints and positions of an assembled system, at a time t (s).

    Parameters
    ----------
    assembly : Assembly
    spin : (6,) float, rad/s and m, rate and centre of a steady turn of everything
    """

    def __init__(self, assembly: Assembly, spin: Array) -> None:
        model = assembly.model.copy()
        self.assembly, self.spin = assembly, spin
        self.n_v, self.n_j, self.n_q = int(model.info.nv), int(model.joints.size), int(model.info.nq)
        model.info.exact = 1
        model.switches[:] = assembly.s
        self.names = coordinate_names(assembly)
        forces = ("springs", "loads", "fields", "motors", "synchronizations", "custom_forces")
        self.whole, self.synchronizations = model, model.synchronizations
        still = model.coordinates.copy()
        for field in OWN:
            still[field] = 0.0
        still["applied"] = 0.0
        #: The model without any force but those of constraints.
        self.bare = model._replace(coordinates=still, **{name: mdl.zeros(name, 0) for name in forces})
        self._models: dict[tuple[str, Any], Any] = {}
        self.powers = np.zeros(N_POWERS)
        self.none = np.zeros(self.n_v), np.zeros(self.n_j)

    # ------------------------------------------------------------------------------------------------ the engine

    def _with(self, family: str, key: Any, records: Array) -> Any:
        """The bare model with records of one family: made once for each key, later its records are overwritten."""
        model = self._models.get((family, key))
        if model is None:
            model = self._models[family, key] = self.bare._replace(**{family: records})
        else:
            getattr(model, family)[:] = records
        return model

    def left(self, t: float, y: Array, model: Any, *, a: Any = None, la: Any = None, factor: float = 0.0) -> Array:
        """Residual of a model: generalised forces on the left of the equations, then gaps."""
        r = np.empty(self.n_v + self.n_j)
        a, la = self.none[0] if a is None else a, self.none[1] if la is None else la
        residual(t, y, a, la, 0.0, factor, model, r, self.powers)
        return r

    def mass(self, t: float, y: Array) -> Array:
        """Mass matrix, (nv, nv)."""
        zero = self.left(t, y, self.bare)[: self.n_v]
        columns = [self.left(t, y, self.bare, a=e)[: self.n_v] - zero for e in np.eye(self.n_v)]
        M = np.array(columns)
        return 0.5 * (M + M.T)

    def constraints(self, t: float, y: Array) -> tuple[Array, Array]:
        """Gradients (nj, nv) and gaps (nj,) of the joints; penalties hold as constraints do."""
        r = self.left(t, y, self.bare)
        zero, gaps = r[: self.n_v].copy(), r[self.n_v :].copy()
        G = np.array([self.left(t, y, self.bare, la=e)[: self.n_v] - zero for e in np.eye(self.n_j)])
        return G.reshape(self.n_j, self.n_v), gaps

    def coordinates(self, t: float, y: Array) -> tuple[Array, Array]:
        """Gradients (nc, nv) and values (nc,) of the coordinates: the force of a spring with a torque of 1."""
        zero = self.left(t, y, self.bare)[: self.n_v]
        rows = self.bare.coordinates
        x, J = rows["angle"].copy(), np.zeros((rows.size, self.n_v))
        for k in range(rows.size):
            one = rows[k : k + 1].copy()
            one["stiffness"], one["rest"] = 1.0, x[k] - 1.0
            J[k] = self.left(t, y, self._with("coordinates", k, one))[: self.n_v] - zero
        return J, x

    def power(self, share: Share, t: float, y: Array, direction: Direction, *, still: bool = False) -> float:
        """Virtual power of a share along a direction: N m or N, above 0 where it drives.

        Parameters
        ----------
        still : bool, whether the mechanism is at rest: a motor that follows a motion then has its limit, since where
            its reference would be is not known

        Raises
        ------
        InputError
            For such a motor without a limit.
        """
        if still and share.family == "motors":
            (row,) = (self.whole.motors[k] for k in share.rows)
            if row["kind"] == coordinate_laws.BY_MOTION:
                if not math.isfinite(row["limit"]):
                    raise InputError(
                        f"{share.part!r} follows a motion, and its torque at rest is its limit; give "
                        f"{share.part}.limit, the torque or force that it has at the worst"
                    )
                return float(row["limit"]) * abs(float(direction.rates[int(row["coordinate"])]))
        zero = self.left(t, y, self.bare)[: self.n_v]
        parts = (zero - self._force(share, t, y, direction)) * direction.v
        found = float(parts.sum())
        return found if abs(found) > _ROUND_OFF * float(np.abs(parts).sum()) else 0.0

    def _force(self, share: Share, t: float, y: Array, direction: Direction) -> Array:
        """Generalised forces of a share, on the left of the equations, with those of the bare model."""
        if share.label == GRAVITY:
            return self.left(t, y, self.bare, factor=1.0)[: self.n_v]
        if share.label == SPIN:
            a = np.zeros(self.n_v)
            equilibrium.turning(1.0, self.spin, y, self.whole, a)
            return self.left(t, y, self.bare, a=a)[: self.n_v]
        own = getattr(self.whole, share.family)[list(share.rows)].copy()
        if share.family == "coordinates":
            own = self._coordinate(share, direction)
        if share.family == "fields":
            own["scale"] = 1.0
        return self.left(t, y, self._with(share.family, share.label, own))[: self.n_v]

    def _coordinate(self, share: Share, direction: Direction) -> Array:
        """A coordinate's record with the fields of a share alone; friction slips against the direction."""
        (k,) = share.rows
        own = self.whole.coordinates[k : k + 1].copy()
        for field in OWN:
            if field not in share.fields:
                own[field] = 0.0
        if "friction" in share.fields:
            x, rate = float(self.bare.coordinates["angle"][k]), float(direction.rates[k])
            own["relax"] = own["slips"] = own["bristle0"] = 0.0
            if abs(rate) <= _OFF:  # it does not move
                own["friction"] = 0.0
            else:
                own["anchor"] = x - math.copysign(_SLIPPING * float(own["friction"][0] / own["stick"][0]), rate)
        return own

    # ------------------------------------------------------------------------------------------------ directions

    def tied(self, J: Array) -> Array:
        """Gradients of the loops between synchronised coordinates: (n, nv)."""
        rows = self.synchronizations
        if not rows.size:
            return np.zeros((0, self.n_v))
        return np.array([row["ratio_b"] * J[row["b"]] - row["ratio_a"] * J[row["a"]] for row in rows])

    def direction(self, k: int, held: list[int], sense: float, t: float, y: Array) -> Direction:
        """How the mechanism moves with coordinate k at the rate `sense`, 1 or -1.

        Raises
        ------
        InputError
            If it cannot.
        """
        found = self._solved(k, held, sense, t, y)
        if found is None:
            raise InputError(
                f"{self.names[k]!r} cannot move at {self.value_text(k)}: the constraints and the coordinates that are "
                f"held do not let it"
            )
        return found

    def _solved(self, k: int, held: list[int], sense: float, t: float, y: Array) -> Direction | None:
        G, _ = self.constraints(t, y)
        J, _ = self.coordinates(t, y)
        M = self.mass(t, y)
        A = np.vstack([G, self.tied(J), J[held], J[[k]]])
        b = np.zeros(A.shape[0])
        b[-1] = sense
        v = _least(M, A, b)
        if float(np.abs(A @ v - b).max()) > _OFF:
            return None
        return Direction(v, J @ v, float(v @ M @ v))

    def held_with(self, k: int, t: float, y: Array) -> tuple[list[int], list[int]]:
        """Coordinates that can be held while k moves, and those that follow it, by the constraints."""
        held: list[int] = []
        follow: list[int] = []
        for j in range(len(self.names)):
            if j == k:
                continue
            free = self._solved(k, [*held, j], 1.0, t, y) is not None
            (held if free else follow).append(j)
        return held, follow

    # ------------------------------------------------------------------------------------------------ positions

    def count_turns(self) -> None:
        """Keep the last angles as those from which whole turns are counted."""
        rows = self.bare.coordinates
        angles = rows["kind"] == axial.ANGLE
        quarters = np.floor(rows["angle"] / QUARTER + 0.5).astype(np.int64)
        self.bare.switches[rows["switch"][angles]] = quarters[angles]

    def move(self, targets: dict[int, float], t: float, y: Array) -> Array:
        """The position in which coordinates have the values `targets`, from the position y: a state at rest.

        Raises
        ------
        InputError
            If the mechanism does not reach it.
        """
        y = y.copy()
        y[self.n_q : self.n_q + self.n_v] = 0.0
        _, x = self.coordinates(t, y)
        rows = list(targets)
        end = np.array([targets[k] for k in rows])
        steps = max(1, math.ceil(float(np.abs(end - x[rows]).max(initial=0.0)) / _MOVE))
        start = x[rows]
        for i in range(1, steps + 1):
            y = self._newton(rows, start + (end - start) * i / steps, t, y)
            self.count_turns()
        return y

    def _newton(self, rows: list[int], values: Array, t: float, y: Array) -> Array:
        M = self.mass(t, y)
        for _ in range(_ITERATIONS):
            G, gaps = self.constraints(t, y)
            J, x = self.coordinates(t, y)
            ties = self.synchronizations
            stretch = ties["ratio_b"] * x[ties["b"]] - ties["ratio_a"] * x[ties["a"]] - ties["offset"]
            A, b = np.vstack([G, self.tied(J), J[rows]]), -np.concatenate([gaps, stretch, x[rows] - values])
            off = float(np.abs(b).max(initial=0.0))
            if off <= _REACHED:
                return y
            moved = y.copy()
            displace(y, _least(M, A, b), False, self.bare, moved)
            y = moved
        if off <= 1e3 * _REACHED:
            return y
        k = rows[int(np.argmax(np.abs(x[rows] - values)))]
        raise InputError(
            f"{self.names[k]!r} does not reach {values[rows.index(k)]:.6g} {self.unit(k)}: the constraints and the "
            f"coordinates that are held stop it at {x[k]:.6g} {self.unit(k)}"
        )

    def unit(self, k: int) -> str:
        """Unit of coordinate k."""
        return "rad" if self.whole.coordinates["kind"][k] == axial.ANGLE else "m"

    def value_text(self, k: int) -> str:
        """Value of coordinate k at the last evaluation, with its unit."""
        return f"{float(self.bare.coordinates['angle'][k]):.6g} {self.unit(k)}"


def _least(M: Array, A: Array, b: Array) -> Array:
    """The x of least x.M x with A x = b, in the sense of least squares where that has no solution."""
    L = np.linalg.cholesky(M)
    B = scipy.linalg.solve_triangular(L, A.T, lower=True).T
    size = np.linalg.norm(B, axis=1)
    size[size == 0.0] = 1.0
    w = np.linalg.lstsq(B / size[:, None], b / size, rcond=_RANK)[0]
    return scipy.linalg.solve_triangular(L.T, w)
