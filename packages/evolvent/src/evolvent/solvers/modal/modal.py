"""What `modes` returns: frequencies, shapes by part name, effective masses, states to animate."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import lazy_loader as lazy
import numpy as np
import scipy

from evolvent.algebra.poles import WITHOUT_POTENTIAL
from evolvent.algebra.subspaces import constrained
from evolvent.assembly import families
from evolvent.assembly.assembled import Assembly
from evolvent.assembly.blocks import owner_of
from evolvent.assembly.families import MOST_NAMED
from evolvent.assembly.references import split_reference
from evolvent.kernels.blocks import block_at, displace
from evolvent.model.questions import LinearizedPoint
from evolvent.parts.checks import positive, vector
from evolvent.solvers.common.limits import limitation_of
from evolvent.solvers.common.sizes import sizes
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.modal.positions import find_moving, linearized_points, moving, nodal, rigid_motions
from evolvent_base.errors import InputError, counted

if TYPE_CHECKING:
    import xarray as xr
else:
    xr = lazy.load("xarray")

Array = np.ndarray

#: Real part of a pole that grows, beside the largest pole; below it is round-off of poles that are nearly equal.
GROWS = 1e-7
#: Largest displacement, in parts of the structure's size, and rotation (rad) of states that are not given an amplitude.
VISIBLE, VISIBLE_TURN = 0.1, 0.3
#: Period (s) over which `states` shows a mode that does not oscillate.
NOMINAL_PERIOD = 1.0
#: Directions of participation factors: displacement along, then rotation about, inertial axes.
DIRECTIONS = ("x", "y", "z", "rotation x", "rotation y", "rotation z")
#: Effective masses below this part of the rigid-body mass are round-off.
NOTHING = 1e-12


@dataclasses.dataclass(frozen=True)
class PartModes:
    """How one part moves in the modes, per square root of kg as `VibrationModes.shape`.

    Attributes
    ----------
    name : str, of a part, or of a point ("boom.tip", "boom[5]")
    shape : (k, ...) float or complex
        Coordinates: (k, nodes, vectors, 3) of a beam, m of positions and 1 of slopes; (k, vectors, 3) of one of its
        nodes; (k, nodes, 6) of a rod, and (k, 6) of one of its nodes, as of free bodies;
        (k, nodes, 3) of a thread, m, from its tip, 0 of nodes on the spool and of one that is fixed to another part;
        (k, 3) of a point, m; (k, 6) of a free body, m in inertial axes and rad in body axes; (k, 1), rad, of a body on
        a fixed axis.
    displacement : (k, 3) or of a beam or thread (k, nodes, 3), m
        Inertial axes (those that turn, of a structure that spins).
    """

    name: str
    shape: Array
    displacement: Array
    _rotation: Array | None = dataclasses.field(repr=False)

    @property
    def rotation(self) -> Array:
        """Small rotations about inertial axes, rad: (k, 3), or of a beam (k, nodes, 3).

        Of a beam's section; of a cable's axis, without twist. A point and a thread have none.
        """
        if self._rotation is None:
            what = "a thread" if self.displacement.ndim == 3 else "a point"
            raise InputError(f"{self.name!r} is {what}, which has no rotation")
        return self._rotation


@dataclasses.dataclass(frozen=True)
class VibrationModes:
    """Natural modes about an equilibrium, slowest first. ``modes["boom"]`` holds the shapes of one part.

    Attributes
    ----------
    pole : (k,) complex, s of u = shape exp(s t), real part in 1/s, imaginary part in rad/s
        One of each conjugate pair; real above 0, a motion that grows without oscillating.
    shape : (k, nv) float or complex, displacements of the velocities' coordinates
        In m, rad of a body's rotation, 1 of a beam's slopes, each per square root of kg: u^H M u = 1, M in kg and kg
        m2; the largest one is real. Complex where dampers count, the structure spins or loads follow its shape.
    equilibrium : Solution, whose last state the modes are about
    assembly : Assembly
    M, G : (nv, nv) and (nc, nv) sparse, mass matrix and gradients of the constraints at the equilibrium
    causes : tuple of str, of complex shapes: what makes them so, such as "damping"
    point : (3,) float, m, through which the axes of rotation of `participation` and `effective_mass` go (see `about`)
    note : str, what was assumed; '' for nothing
    """

    pole: Array
    shape: Array
    equilibrium: Solution
    assembly: Assembly = dataclasses.field(repr=False)
    M: scipy.sparse.csr_matrix = dataclasses.field(repr=False)
    G: scipy.sparse.csr_matrix = dataclasses.field(repr=False)
    causes: tuple[str, ...] = ()
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    note: str = ""

    @functools.cached_property
    def warnings(self) -> tuple[str, ...]:
        """What the equilibrium is beyond (`evolvent.solvers.common.limits`), and which modes grow: a sentence each."""
        beyond = limitation_of(self.equilibrium)
        return tuple(([beyond] if beyond else []) + self._growing())

    @property
    def warning(self) -> str:
        """`warnings` as one text; '' for none."""
        return "; ".join(self.warnings)

    def _growing(self) -> list[str]:
        """A sentence on the modes that grow, what each moves most, and what feeds them; none where none grows."""
        which = np.flatnonzero(self.unstable)
        if not which.size:
            return []
        weight, _ = sizes(self.assembly)
        each = []
        for k in which[:MOST_NAMED]:
            block = block_at(self.assembly.model, int(np.argmax(np.abs(self.shape[k]) / weight)))
            name, how = (
                families.owner(self.assembly, *owner_of(block)),
                "" if self.frequency[k] else " without oscillation",
            )
            each.append(f"mode {k} by {self.pole[k].real:.4g} 1/s{how}, which moves {name!r} most")
        more = [f"{which.size - MOST_NAMED} more"] if which.size > MOST_NAMED else []
        causes = f"; the structure has {self._causes()}" if WITHOUT_POTENTIAL in self.causes else ""
        return [f"{counted(which.size, 'mode')} grow{'s' * (which.size == 1)} (real part of the pole above 0): "
                f"{'; '.join([*each, *more])}{causes}"]  # fmt: skip

    def _causes(self) -> str:
        """What makes the shapes complex; forces without a potential with the parts that may have them."""
        names = families.without_potential(self.assembly) if WITHOUT_POTENTIAL in self.causes else []
        of = ", ".join(map(repr, names[:MOST_NAMED])) + (
            f" and {len(names) - MOST_NAMED} more" * (len(names) > MOST_NAMED)
        )
        return " and ".join(f"{cause} ({of})" if cause == WITHOUT_POTENTIAL and of else cause for cause in self.causes)

    @property
    def without_masses(self) -> str:
        """Why there are no effective masses, a sentence; '' where there are."""
        if not np.iscomplexobj(self.shape):
            return ""
        causes = self._causes()
        return f"effective masses are defined for real modes, and these are complex, since the structure has {causes}"

    # -------------------------------------------------------------------------------------------- frequencies

    @property
    def frequency(self) -> Array:
        """Damped angular frequencies, rad/s, in the frame that turns: (k,)."""
        return self.pole.imag

    @property
    def frequency_hz(self) -> Array:
        """Damped frequencies, Hz: (k,)."""
        return self.frequency / (2.0 * math.pi)

    @property
    def decay_rate(self) -> Array:
        """Decay rates of the amplitude, 1/s; below zero of a motion that grows: (k,)."""
        return -self.pole.real + 0.0

    @property
    def damping_ratio(self) -> Array:
        """Decay rate over the modulus of the pole, without unit: (k,)."""
        size = np.abs(self.pole)
        return np.divide(self.decay_rate, size, out=np.zeros_like(size), where=size > 0.0)

    @property
    def unstable(self) -> Array:
        """Whether a mode grows, Re s > 0: (k,) bool. Real parts below 1e-7 of the largest pole are round-off."""
        return np.asarray(self.pole.real > GROWS * np.abs(self.pole).max(initial=0.0))

    @property
    def square(self) -> Array:
        """-Re s^2, rad2/s2 : (k,); below zero where the equilibrium is unstable."""
        return -(self.pole**2).real

    # -------------------------------------------------------------------------------------------- shapes

    @property
    def parts(self) -> tuple[str, ...]:
        """Names of the parts that move."""
        return tuple(moving(self.assembly))

    def __contains__(self, name: object) -> bool:
        return name in self.parts or name in self._points

    def __getitem__(self, name: str) -> PartModes:
        """Shapes of one part, or of a node of a beam ("boom.tip", "boom[5]").

        Raises
        ------
        InputError
            Where no part has this name, or the part does not move.
        """
        known = self._points
        if name in known:
            displacement, rotation = (self._mapped([known[name]], which)[:, 0] for which in (0, 1))
            shape = self.shape[:, known[name].where]
            own = nodal(self.assembly, split_reference(name)[0])
            if own is not None:  # one of its nodes
                shape = shape.reshape(len(shape), *own[1:])
            return PartModes(name, shape, displacement, None if known[name].rotation is None else rotation)
        *_, where = find_moving(self.assembly, name)
        own = nodal(self.assembly, name)
        if own is None:
            raise InputError(f"{name!r} has no points")
        shape = self.shape[:, where].reshape(len(self.shape), *own)
        nodes = [known.get(f"{name}[{i}]") for i in range(own[0])]  # None of those that do not move yet
        turns = any(node is not None and node.rotation is not None for node in nodes)
        return PartModes(name, shape, self._mapped(nodes, 0), self._mapped(nodes, 1) if turns else None)

    @functools.cached_property
    def _points(self) -> dict[str, LinearizedPoint]:
        return linearized_points(self.assembly, self.equilibrium.y[-1])

    def _mapped(self, found: Sequence[LinearizedPoint | None], which: int) -> Array:
        """Displacements (0) or rotations (1) of points: (k, n, 3)."""
        out = np.zeros((len(self.shape), len(found), 3), dtype=self.shape.dtype)
        for i, place in enumerate(found):
            T = None if place is None else place.rotation if which else place.displacement
            if place is not None and T is not None:
                out[:, i] = self.shape[:, place.where] @ T.T
        return out

    # -------------------------------------------------------------------------------------------- effective masses

    def about(self, point: Sequence[float]) -> VibrationModes:
        """The same modes, with axes of rotation through `point`, (3,) float, m."""
        x = vector("point", point)
        return dataclasses.replace(self, point=(float(x[0]), float(x[1]), float(x[2])))

    @functools.cached_property
    def _rigid(self) -> Array:
        """Rigid-body vectors r of the coordinates: (nv, 6)."""
        return rigid_motions(self.assembly, self.equilibrium.y[-1], np.array(self.point))

    @property
    def participation(self) -> Array:
        """Participation factors shape^T M r: (k, 6), kg^(1/2) for translations, kg^(1/2) m for rotations.

        Columns: base motion along inertial x, y, z, and about these axes through `point`.
        """
        if self.without_masses:
            raise InputError(f"{self.without_masses}; take modes without them, such as damped=False and at rest")
        return np.asarray(self.shape @ (self.M @ self._rigid))

    @property
    def effective_mass(self) -> Array:
        """Effective masses, squares of the participation factors: (k, 6), kg for translations, kg m2 for rotations.

        Notes
        -----
        ``(u^T M r)^2`` of modes with ``u^T M u = 1`` (Girard and Roy 2008, Structural Dynamics in Industry), r being
        the displacement of the coordinates as ground and structure move together like a rigid body. The sum over all
        modes is `movable_mass`. A structure that nothing holds has all of it in its rigid-body modes, since the
        others are orthogonal to them.
        """
        return self.participation**2

    @property
    def total_mass(self) -> Array:
        """Mass (three times, kg) and moments of inertia (kg m2) of all that has coordinates, r^T M r: (6,).

        Driven bodies are part of the ground; of a body on a fixed axis only the inertia about that axis counts.
        """
        return np.asarray(np.einsum("ij,ij->j", self._rigid, self.M @ self._rigid))

    @functools.cached_property
    def movable_mass(self) -> Array:
        """What the effective masses of all modes sum to: (6,), kg and kg m2.

        Notes
        -----
        ``w^T M w`` with w the part of r that the constraints leave, ``M w + G^T mu = M r``, ``G w = 0``. It falls short
        of `total_mass` by `held_mass`.
        """
        w = constrained(self.M, self.G, self.M @ self._rigid, np.zeros((self.G.shape[0], 6)))
        found = np.einsum("ij,ij->j", w, self.M @ w)
        found[found <= NOTHING * self.total_mass] = 0.0
        return np.asarray(found)

    @property
    def held_mass(self) -> Array:
        """What the supports carry directly and no mode moves, `total_mass` less `movable_mass`: (6,), kg and kg m2.

        It is the share of the elements next to a support, which goes to zero with their length (of a clamped rod the
        lump of the node that is held), and mass in directions in which a joint to the ground leaves it no freedom.
        """
        found = self.total_mass - self.movable_mass
        found[np.abs(found) <= NOTHING * self.total_mass] = 0.0
        return found

    @property
    def cumulative_fraction(self) -> Array:
        """Sums of effective masses from the slowest mode on over `movable_mass`: (k, 6); NaN where that is 0."""
        summed, whole = np.cumsum(self.effective_mass, axis=0), np.broadcast_to(self.movable_mass, (len(self.pole), 6))
        return np.divide(summed, whole, out=np.full_like(summed, np.nan), where=whole > 0.0)

    # -------------------------------------------------------------------------------------------- to see

    def states(self, k: int, amplitude: float | None = None, frames: int = 60) -> tuple[Array, Array]:
        """States of one mode over one period about the equilibrium, for an animation.

        Parameters
        ----------
        k : int, number of the mode, from 0
        amplitude : float, m, largest displacement of a body, point or node (rad, its rotation, where none is displaced)
            If left out, a tenth of the structure's size, or a rotation of 0.3 rad where that comes first.
        frames : int, from 2

        Returns
        -------
        t : (frames,) float, s, from 0 to one period
        y : (frames, ny) float, states; coordinates displaced by Re(c shape exp(i w t)), velocities by the derivative

        Notes
        -----
        The amplitude is constant, whatever the damping. A mode that does not oscillate is shown to and fro over 1 s. Of
        a structure that spins, the states are in the frame that turns.
        """
        if isinstance(k, bool) or not isinstance(k, int | np.integer) or not 0 <= k < len(self.pole):
            raise InputError(f"k is {k!r}; it must be the number of a mode, from 0 to {len(self.pole) - 1}")
        if isinstance(frames, bool) or not isinstance(frames, int) or frames < 2:
            raise InputError(f"frames is {frames!r}; it must be a whole number from 2")
        if amplitude is not None:
            amplitude = positive("amplitude", amplitude)
        w = float(self.frequency[k]) or 2.0 * math.pi / NOMINAL_PERIOD
        t = np.linspace(0.0, 2.0 * math.pi / w, frames)
        phase = np.exp(1j * w * t) if self.frequency[k] else -1j * np.exp(1j * w * t)
        u = np.outer(phase, self.shape[k])
        d, rate = u.real, (1j * w * u).real
        scale = self._scale(d, amplitude)
        model = self.assembly.model
        n_q, n_v = int(model.info.nq), int(model.info.nv)
        rest = np.ascontiguousarray(self.equilibrium.y[-1])
        y = np.tile(rest, (frames, 1))
        for j in range(frames):
            displace(rest, np.ascontiguousarray(scale * d[j]), False, model, y[j])
        y[:, n_q : n_q + n_v] += scale * rate
        return t, y

    def _scale(self, d: Array, amplitude: float | None) -> float:
        """What displacements d (frames, nv) are multiplied by for an amplitude."""
        largest = np.zeros(2)
        for place in self._points.values():
            for i, T in enumerate((place.displacement, place.rotation)):
                if T is not None:
                    largest[i] = max(largest[i], float(np.linalg.norm(d[:, place.where] @ T.T, axis=1).max()))
        weight, _ = sizes(self.assembly)
        length = float(weight.max())
        still = largest[0] <= 1e-9 * length * largest[1]
        if amplitude is not None:
            return amplitude / float(largest[1] if still else largest[0])
        by_turn = VISIBLE_TURN / largest[1] if largest[1] > 0.0 else math.inf
        return float(min(math.inf if still else VISIBLE * length / largest[0], by_turn))

    def to_dataset(self) -> xr.Dataset:
        """Frequencies, damping, effective masses and the shapes of all parts as an `xarray.Dataset` with units.

        Shapes are scaled to a modal mass of 1 kg: displacements are plain numbers, rotations rad/m, and participation
        factors kg and kg m (UDUNITS has no root of a kilogram).

        Dimension `mode`; shapes are "boom.displacement" and "boom.rotation", of complex modes with a dimension
        `component` (real, imaginary). Effective masses are left out of complex modes.
        """
        data: dict[str, Any] = {
            "frequency_hz": ("mode", self.frequency_hz, {"units": "Hz", "long_name": "frequency"}),
            "frequency": ("mode", self.frequency, {"units": "rad/s", "long_name": "angular frequency"}),
            "damping_ratio": ("mode", self.damping_ratio, {"units": "1", "long_name": "damping ratio"}),
            "decay_rate": ("mode", self.decay_rate, {"units": "1/s", "long_name": "decay rate"}),
        }
        coords: dict[str, Any] = {"mode": np.arange(len(self.pole)), "axis": list("xyz")}
        is_complex = np.iscomplexobj(self.shape)
        if is_complex:
            coords["component"] = ["real", "imaginary"]
        else:
            for name, part, unit in (
                ("effective_mass", slice(0, 3), "kg"),
                ("effective_inertia", slice(3, 6), "kg m2"),
            ):
                name_of = name.replace("_", " ")
                data[name] = (("mode", "axis"), self.effective_mass[:, part], {"units": unit, "long_name": name_of})
                factor, root = name.replace("effective", "participation"), "kg" if unit == "kg" else "kg m"
                what = f"participation factor for a modal mass of 1 kg, over which its square is the {name_of}"
                data[factor] = (("mode", "axis"), self.participation[:, part], {"units": root, "long_name": what})
                kinds = {"movable": self.movable_mass, "held": self.held_mass, "total": self.total_mass}
                for of, values in kinds.items():
                    about = {"units": unit, "long_name": f"{of} {name_of.removeprefix('effective ')}"}
                    data[name.replace("effective", of)] = ("axis", values[part], about)
        for name in self.parts:
            found = self[name]
            dims: tuple[str, ...] = ("mode", "axis")
            if found.displacement.ndim == 3:
                dims = ("mode", f"{name}.node", "axis")
            shapes = [("displacement", found.displacement, "1")]
            if found._rotation is not None:
                shapes.append(("rotation", found._rotation, "rad/m"))
            for what, values, unit in shapes:
                attributes = {"units": unit, "long_name": f"{what} of {name}, scaled to a modal mass of 1 kg"}
                if is_complex:
                    pair = np.stack([values.real, values.imag])
                    data[f"{name}.{what}"] = (("component", *dims), pair, attributes)
                else:
                    data[f"{name}.{what}"] = (dims, values, attributes)
        texts = {"warning": self.warning, "comment": self.without_masses, "note": self.note}
        return xr.Dataset(data, coords=coords, attrs={key: text for key, text in texts.items() if text})
