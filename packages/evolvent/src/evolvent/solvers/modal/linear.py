"""linearize(): a structure about an equilibrium as a linear state-space model, whole or reduced."""

from __future__ import annotations

import dataclasses
import functools
import math
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import scipy

from evolvent.assembly.assembled import Assembly
from evolvent.assembly.references import split_reference
from evolvent.model.questions import LinearizedPoint
from evolvent.solvers.common.limits import limitation_of
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.modal import reduction
from evolvent.solvers.modal.channels import INPUTS, OUTPUTS, Channel, Quantity, channels
from evolvent.solvers.modal.modes import Where, at_equilibrium
from evolvent.solvers.modal.positions import linearized_points
from evolvent.solvers.modal.reduction import Basis, Structure
from evolvent.solvers.modal.resolution import Naming
from evolvent_base.errors import InputError, nearest

if TYPE_CHECKING:
    import control

Array = np.ndarray

#: Samples of a frequency response whose frequencies are not given, over all, and about each resonance.
SAMPLES, NEAR = 400, 12
#: Frequencies (rad/s) of a model without resonances.
PLAIN = (1e-2, 1e2)


class FrequencyResponse(NamedTuple):
    """Response of the outputs to harmonic inputs.

    Attributes
    ----------
    omega : (n,) float, rad/s
    response : (n, outputs, inputs) complex, units of the output per unit of the input; inf at an undamped pole
    inputs, outputs : tuple of str
    units : tuple of tuple of str, (outputs, inputs), such as "rad/s/(N m)"
    """

    omega: Array
    response: Array
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    units: tuple[tuple[str, ...], ...]

    @property
    def frequency_hz(self) -> Array:
        """(n,) Hz."""
        return self.omega / (2.0 * math.pi)

    @property
    def magnitude(self) -> Array:
        """(n, outputs, inputs), in `units`."""
        return np.abs(self.response)

    @property
    def magnitude_db(self) -> Array:
        """20 log10 of the magnitude in `units`: (n, outputs, inputs)."""
        with np.errstate(divide="ignore"):
            return np.asarray(20.0 * np.log10(self.magnitude))

    @property
    def phase_deg(self) -> Array:
        """Phase without jumps by 360 degrees: (n, outputs, inputs), degrees."""
        return np.asarray(
            np.degrees(np.unwrap(np.angle(np.where(np.isfinite(self.response), self.response, 0.0)), axis=0))
        )


@dataclasses.dataclass(frozen=True)
class StateSpace:
    """x' = A x + B u, y = C x + D u about an equilibrium; all are deviations from it.

    `to_scipy` and `to_control` give it to other packages.

    Attributes
    ----------
    A, B, C, D : (2 m, 2 m), (2 m, nu), (ny, 2 m), (ny, nu) float
    inputs, outputs, states : tuple of str
    input_units, output_units, state_units : tuple of str
    at_rest : (ny,) float, what a position is at the equilibrium, m, to add to the output; 0 of all others
    square : (m,) float, rad2/s2, squares of the undamped frequencies of the states, without a spin's gyroscopic terms
    basis : (nv, m) float, displacements of the velocities' coordinates by the first m states
    method : {"full", "modal", "craig-bampton"}
    boundary : tuple of str, points whose coordinates a Craig-Bampton model keeps
    equilibrium : Solution

    Notes
    -----
    The states are modal coordinates eta (kg^(1/2) m) of the full or reduced model and their rates: u = V eta,
    V^T M V = 1, so that A = [[0, 1], [-V^T K V, -V^T C V]].
    """

    A: Array
    B: Array
    C: Array
    D: Array
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    states: tuple[str, ...]
    input_units: tuple[str, ...]
    output_units: tuple[str, ...]
    state_units: tuple[str, ...]
    at_rest: Array
    square: Array
    basis: Array = dataclasses.field(repr=False)
    method: str
    boundary: tuple[str, ...]
    equilibrium: Solution = dataclasses.field(repr=False)
    _source: _Source = dataclasses.field(repr=False)

    @functools.cached_property
    def warning(self) -> str:
        """What the equilibrium is beyond (`evolvent.solvers.common.limits`), one text; '' for nothing."""
        return limitation_of(self.equilibrium)

    @property
    def rigid(self) -> int:
        """How many modes neither oscillate nor grow: rigid-body modes."""
        return int(np.sum(self.square == 0.0))

    @property
    def summary(self) -> str:
        """What the model consists of, one sentence, and its warning."""
        negative = int(np.sum(self.square < 0.0))
        parts = [f"{self.rigid} rigid-body", f"{len(self.square) - self.rigid - negative} elastic"]
        whole = f"{' and '.join(parts)} modes"
        if negative:  # a spin's gyroscopic terms may keep them from growing
            whole += f", {negative} of negative stiffness"
        text = f"{len(self.A)} states: {whole} ({self.method}), {len(self.inputs)} inputs, {len(self.outputs)} outputs"
        return f"{text}; warning: {self.warning}" if self.warning else text

    @property
    def poles(self) -> Array:
        """Eigenvalues of A, ascending by modulus: (2 m,) complex, 1/s."""
        w = np.sqrt(np.abs(self.square))
        w[w == 0.0] = w.min(initial=math.inf, where=w > 0.0) if np.any(w) else 1.0
        # equally large entries in a pair of states, fast pairs first: the slow ones keep their digits
        order = np.add.outer(np.argsort(-w), [0, len(w)]).ravel()
        T = np.concatenate([w, np.ones(len(w))])[order]
        found = np.linalg.eigvals(T[:, None] * self.A[np.ix_(order, order)] / T)
        return np.asarray(found[np.argsort(np.abs(found), kind="stable")])

    def to_scipy(self) -> scipy.signal.StateSpace:
        """The model as a `scipy.signal.StateSpace`."""
        return scipy.signal.StateSpace(self.A, self.B, self.C, self.D)

    def to_control(self) -> control.StateSpace:
        """The model as a `control.StateSpace` of the package python-control, with names of states, inputs and outputs.

        Returns
        -------
        control.StateSpace
            Signals of python-control cannot have dots and brackets: "hub.torque.z" is "hub_torque_z", "boom[5].force.y"
            is "boom_5_force_y". It has no place for units: they are in its attributes `input_units`, `output_units` and
            `state_units`, which models made from it do not have.

        Raises
        ------
        InputError
            If the package is missing, or holds no model without states, inputs or outputs.
        """
        try:
            import control  # an extra
        except ImportError:
            text = "to_control needs the package control (python-control): pip install 'evolvent[control]'"
            raise InputError(text) from None
        for name in ("states", "inputs", "outputs"):
            if not getattr(self, name):
                raise InputError(f"the model has no {name}; a model of python-control has at least one of each")
        signals = {"inputs": _signals(self.inputs), "outputs": _signals(self.outputs), "states": list(self.states)}
        found = control.StateSpace(self.A, self.B, self.C, self.D, **signals)
        found.input_units, found.output_units, found.state_units = (
            self.input_units, self.output_units, self.state_units,
        )  # fmt: skip
        return found

    def frequency_response(self, omega: Any = None) -> FrequencyResponse:
        """Response C (i w - A)^-1 B + D.

        Parameters
        ----------
        omega : (n,) float, rad/s; if left out, from a tenth of the lowest to ten times the highest resonance (that of a
            full model's tenth mode), closer together about resonances
        """
        if omega is None:
            omega = self._frequencies()
        try:
            w = np.atleast_1d(np.array(omega, dtype=float))
        except (TypeError, ValueError):
            w = np.full(1, np.nan)
        if w.ndim != 1 or not np.all(np.isfinite(w)):
            raise InputError(f"omega is {omega!r}; it must be finite numbers, rad/s")
        m = len(self.square)
        K, C = -self.A[m:, :m], -self.A[m:, m:]
        found = np.empty((w.size, len(self.outputs), len(self.inputs)), dtype=complex)
        for j, x in enumerate(w):
            try:
                eta = np.linalg.solve(K + 1j * x * C - x * x * np.eye(m), self.B[m:])
            except np.linalg.LinAlgError:
                found[j] = np.inf
                continue
            found[j] = (self.C[:, :m] + 1j * x * self.C[:, m:]) @ eta + self.D
        units = tuple(
            tuple(f"{y}/({u})" if " " in u else f"{y}/{u}" for u in self.input_units) for y in self.output_units
        )
        return FrequencyResponse(w, found, self.inputs, self.outputs, units)

    def _frequencies(self) -> Array:
        """Frequencies for a figure: (n,) rad/s."""
        w = np.sqrt(self.square[self.square > 0.0])
        if not w.size:
            return np.geomspace(*PLAIN, SAMPLES)
        if self.method == reduction.FULL:
            w = w[:10]
        near = np.geomspace(1e-4, 0.1, NEAR)
        near = np.concatenate([1.0 - near, 1.0 + near])
        return np.unique(np.concatenate([np.geomspace(0.1 * w[0], 10.0 * w[-1], SAMPLES), np.outer(w, near).ravel()]))

    def reduce(
        self, n: int, method: str = reduction.MODAL, *, boundary: Sequence[str] = (), static_correction: bool = False
    ) -> StateSpace:
        """A smaller model of the same structure, inputs and outputs: see `linearize`, whose `modes` is n.

        Parameters
        ----------
        n : int, elastic modes (modal), or elastic modes with the boundary held (craig-bampton)
        method : {"modal", "craig-bampton"}
        boundary : sequence of str, points, as of `linearize`
        static_correction : bool, as of `linearize`
        """
        return self._source.model(n, method, boundary, static_correction=static_correction)


def _signals(names: Sequence[str]) -> list[str]:
    """Names of letters, digits and underscores, each once."""
    found: list[str] = []
    for name in names:
        plain = re.sub(r"\W+", "_", name).strip("_")
        same = sum(one == plain or one.startswith(f"{plain}__") for one in found)
        found.append(f"{plain}__{same + 1}" if same else plain)
    return found


def linearize(
    assembly: Assembly,
    inputs: Sequence[str],
    outputs: Sequence[str],
    *,
    equilibrium: Solution | None = None,
    y: Any = None,
    time: float = 0.0,
    rotating: str | Sequence[float] | None = None,
    centre: Sequence[float] | None = None,
    damped: bool = True,
    modes: int | None = None,
    method: str = reduction.MODAL,
    boundary: Sequence[str] = (),
    static_correction: bool = False,
) -> StateSpace:
    """Make a linear model of a structure about an equilibrium, with constraints eliminated.

    Parameters
    ----------
    assembly : Assembly
    inputs, outputs : sequence of str, "point.quantity.axis", or "point.quantity" for all three axes
        A point is a body ("hub"), a point mass, or a node of a beam ("boom.root", "boom.tip", "boom[5]"). Inputs:
        `force` (N), `torque` (N m, not on point masses). Outputs: `position` or `displacement` (m), `velocity` (m/s),
        `acceleration` (m/s2), `rotation` (rad, small), `rate` (rad/s), `angular_acceleration` (rad/s2). Axes are
        inertial, or those that turn with a structure that spins, and motions relative to them. A beam's rotation is
        that of its section, a cable's that of its axis.
    equilibrium, y, time, rotating, centre : as of `evolvent.solvers.modal.modes.modes`
    damped : bool, whether dampers count
    modes : int, optional, size of a reduced model; all modes if left out
        Modal: the slowest elastic modes, and all rigid-body modes besides. Craig-Bampton: elastic modes with the
        boundary held, and the boundary's coordinates besides.
    method : {"modal", "craig-bampton"}, of the reduction
    boundary : sequence of str, points whose displacements and rotations a Craig-Bampton model keeps, besides the
        coordinates that inputs and outputs touch; an edge of a surface, "panel.x0", is all of its nodes
    static_correction : bool
        Whether D of a modal model holds what the modes left out would give to positions and rotations statically; the
        gain at zero frequency is then that of the full model.

    Returns
    -------
    StateSpace

    Raises
    ------
    InputError
        For names that are not known, arguments out of range, and what `solve_static` refuses.
    RunFailed
        If there is no equilibrium; `run` holds the `Solution`.

    Notes
    -----
    M u'' + C u' + K u + G^T la = B f, G u = 0, with the matrices of `evolvent.solvers.modal.modes.modes`, gyroscopic
    terms of a spin included. u = V eta with V^T M V = 1 and G V = 0: the modes of M and the symmetric part of K, all,
    the slowest, or those of a basis of Craig and Bampton (1968), see `craig_bampton_basis`. Poles are those of `modes`
    with the same `damped`. A modal model of an odd number of modes may hold one of a pair of equal frequency.

    Examples
    --------
    >>> model = linearize(assembly, ["hub.torque.z"], ["hub.rate.z", "boom.tip.displacement.y"])  # doctest: +SKIP
    >>> small = model.reduce(4, "craig-bampton")  # doctest: +SKIP
    """
    if assembly.relaxations:
        raise InputError(
            f"{next(iter(assembly.relaxations.values()))[0]!r} is viscoelastic, which linear state-space models do not "
            f"support: they have no states of relaxation; leave its `viscoelastic` out, or find its modes with `damped`"
        )
    where = Where(equilibrium, y, time, rotating, centre)
    assembly, equilibrium, work, (M, C, K, G) = at_equilibrium(assembly, where, damped=damped)
    known = linearized_points(assembly, equilibrium.y[-1])
    source = _Source(
        structure=Structure(M, C, K, G, work.balance.weight, Naming(work, M)),
        inputs=channels("inputs", inputs, known, assembly, INPUTS),
        outputs=channels("outputs", outputs, known, assembly, OUTPUTS),
        points=known,
        assembly=assembly,
        equilibrium=equilibrium,
    )
    return source.model(modes, method, boundary, static_correction=static_correction)


@dataclasses.dataclass(frozen=True)
class _Source:
    """What models of one structure are made from."""

    structure: Structure
    inputs: list[Channel]
    outputs: list[Channel]
    points: dict[str, LinearizedPoint]
    assembly: Assembly
    equilibrium: Solution

    def model(self, n: int | None, method: str, boundary: Sequence[str], *, static_correction: bool) -> StateSpace:
        """The model with all modes (n is None), or a reduced one."""
        if method not in reduction.METHODS:
            raise InputError(f"method is {method!r}; {nearest(str(method), reduction.METHODS)}")
        least = 0 if method == reduction.CRAIG_BAMPTON else 1
        if n is not None and (isinstance(n, bool) or not isinstance(n, int | np.integer) or n < least):
            raise InputError(f"the number of modes is {n!r}; it must be a whole number from {least}")
        if n is None and method != reduction.MODAL:
            raise InputError(f"method is {method!r}, but the number of modes is not given; give `modes`")
        if static_correction and (n is None or method != reduction.MODAL):
            raise InputError("static_correction is for modal reduction; no other model leaves static response out")
        if len(boundary) and (n is None or method != reduction.CRAIG_BAMPTON):
            raise InputError(f"boundary is {boundary!r}; it belongs to a reduction with method='craig-bampton'")
        touched: tuple[str, ...] = ()
        if n is None:
            basis, method = reduction.modal_basis(self.structure, None), reduction.FULL
        elif method == reduction.MODAL:
            basis = reduction.modal_basis(self.structure, int(n))
        else:
            touched, rows = self._boundary(boundary)
            basis = reduction.craig_bampton_basis(self.structure, rows, int(n))
        return self._matrices(basis, method, touched, static_correction=static_correction)

    def _boundary(self, names: Sequence[str]) -> tuple[tuple[str, ...], Array]:
        """Names and rows of the boundary's coordinates."""
        if isinstance(names, str):
            raise InputError(f"boundary is {names!r}; it must be a list of points")
        names = [place for name in names for place in self.places(name)]
        ends = [*self.inputs, *self.outputs]
        if not ends and not len(names):
            raise InputError("a Craig-Bampton model needs inputs, outputs or a boundary")
        touched = dict.fromkeys([*names, *(channel.place for channel in ends)])
        return tuple(touched), np.array([*self.boundary_rows(names), *(channel.row for channel in ends)])

    def places(self, name: str) -> list[str]:
        """The point of a name, or the nodes that move of an edge of a surface, "panel.x0", in their order."""
        part, known = name.partition(".")[0] if isinstance(name, str) else "", self.points
        if name in known or part == name or part not in self.assembly.parts:
            return [name]
        try:
            found = self.assembly.parts[part].spread(*split_reference(name))
        except InputError as error:
            raise InputError(f"boundary holds {name!r}; {error}") from None
        numbers, *_ = ((),) if found is None else found
        nodes = [f"{part}[{node}]" for node in numbers]
        if nodes and not any(node in known for node in nodes):
            raise InputError(f"boundary holds {name!r}, whose nodes all stand still; leave it out")
        return [node for node in nodes if node in known] or [name]

    def boundary_rows(self, names: Sequence[str]) -> Array:
        """Displacements, and rotations where there are any, of points by the velocities' coordinates: (n, nv)."""
        rows, known = [], self.points
        for name in names:
            wanted = {"displacement": Quantity(False, 0, "m"), "rotation": Quantity(True, 0, "rad")}
            having = [k for k, q in wanted.items() if name not in known or known[name][2 + q.turns] is not None]
            for what in having:
                rows += channels("boundary", [f"{name}.{what}"], known, self.assembly, wanted)
        return np.array([channel.row for channel in rows]).reshape(len(rows), self.structure.M.shape[0])

    def _matrices(self, basis: Basis, method: str, boundary: tuple[str, ...], *, static_correction: bool) -> StateSpace:
        s, (V, square) = self.structure, basis
        m, n_u, n_y = len(square), len(self.inputs), len(self.outputs)
        n_v = s.M.shape[0]
        K = np.diag(square) + V.T @ ((0.5 * (s.K - s.K.T)) @ V)
        damping = V.T @ (s.C @ V)
        forces = np.array([channel.row for channel in self.inputs]).reshape(n_u, n_v).T
        seen = np.array([channel.row for channel in self.outputs]).reshape(n_y, n_v)
        b, c = V.T @ forces, seen @ V
        A = np.block([[np.zeros((m, m)), np.eye(m)], [-K, -damping]])
        order = np.array([channel.quantity.order for channel in self.outputs], dtype=int)
        rows = {0: np.hstack([c, np.zeros((n_y, m))]), 1: np.hstack([np.zeros((n_y, m)), c]), 2: c @ A[m:]}
        C, D = np.zeros((n_y, 2 * m)), np.zeros((n_y, n_u))
        for k, row in rows.items():
            C[order == k] = row[order == k]
        D[order == 2] = (c @ b)[order == 2]
        if static_correction:
            D[order == 0] += (seen @ reduction.residual_flexibility(s, basis, forces))[order == 0]
        numbers = range(1, m + 1)
        return StateSpace(
            A=A, B=np.vstack([np.zeros((m, n_u)), b]), C=C, D=D,
            inputs=tuple(channel.name for channel in self.inputs),
            outputs=tuple(channel.name for channel in self.outputs),
            states=(*(f"eta{i}" for i in numbers), *(f"eta{i}'" for i in numbers)),
            input_units=tuple(channel.quantity.unit for channel in self.inputs),
            output_units=tuple(channel.quantity.unit for channel in self.outputs),
            state_units=("kg^(1/2) m",) * m + ("kg^(1/2) m/s",) * m,
            at_rest=np.array([channel.at_rest for channel in self.outputs]),
            square=square, basis=V, method=method, boundary=boundary, equilibrium=self.equilibrium, _source=self,
        )  # fmt: skip
