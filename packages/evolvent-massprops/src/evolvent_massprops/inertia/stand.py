"""A rigid body and the springs that hold it: what the user states, and the same as numbers."""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple

import numpy as np

from evolvent_base.errors import InputError, nearest

G0 = 9.80665  # m/s2, standard gravity
SUPPORTS = ("hanging", "standing", "guided")
#: Moments by name, with their place in the tensor; offsets of the centre of mass, with their axis and sign.
MOMENTS = {"Ixx": (0, 0), "Iyy": (1, 1), "Izz": (2, 2), "Ixy": (0, 1), "Ixz": (0, 2), "Iyz": (1, 2)}
CENTRE = {"ex": (0, 1.0), "h": (1, -1.0), "ez": (2, 1.0)}


def array(name: str, value: Any, shape: tuple[int, ...] = (), *, least: float = -np.inf) -> np.ndarray:
    """`value` as a read-only float array of the trailing `shape`; refused unless finite and at least `least`."""
    try:
        result = np.array(value, dtype=float)
    except (TypeError, ValueError):
        result = np.full(0, np.nan)
    trailing = result.shape[max(result.ndim - len(shape), 0) :] if shape else ()
    fits = len(trailing) == len(shape) and all(w in (-1, n) for n, w in zip(trailing, shape, strict=True))
    if not fits or result.size == 0 or not np.all(np.isfinite(result)):
        wanted = " x ".join("n" if n < 0 else str(n) for n in shape) + " finite numbers" if shape else "a finite number"
        raise InputError(f"{name} is {' '.join(str(value).split())[:200]}; it must be {wanted}")
    if np.any(result < least):
        limit = "above 0" if 0.0 < least < 1e-300 else f"{least:g} or above"
        raise InputError(f"{name} is {' '.join(str(value).split())[:200]}; it must be {limit}")
    result.flags.writeable = False
    return result


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Stand:
    """Springs, between points of a body and points of the ground, that hold the body up.

    Parameters
    ----------
    points : (n, 3) float, m
        Where the springs are attached, body axes (y up), from the stiffness centre of the attachment plane.
    stiffness : float or (n,) float, N/m, axial
    length : float or (n,) float, m, natural length
    damping : float or (n,) float, N s/m, axial
    lateral_stiffness, lateral_damping : float or (n,) float, N/m and N s/m
        Against horizontal displacement of the attachment from its position above (or below) the ground point.
    ground : (n, 3) float, m, optional
        Ground points in the frame of the level, unloaded stand, where the attachments stand at `points`. Left out,
        they lie vertically above (hanging, guided) or below (standing) the attachments at the natural length.
    support : {"hanging", "standing", "guided"}
        Hanging and standing bodies are free in six degrees of freedom. A guided one is held sideways: x and z of its
        centre of mass stay, and its x axis keeps no z component in the level frame, (R e_x) . Z = 0.
    gravity : float, m/s2, downwards

    Notes
    -----
    With d from ground point to attachment, ``l = |d|`` and w the horizontal part of d less its value on the level,
    unloaded stand, a spring has the energy k (l - l0)^2 / 2 + k_l w^2 / 2 and acts on the body with
    -(k (l - l0) + c l') d / l - (k_l w + c_l w'). Frames: y up, x and z horizontal.

    Every field may carry leading axes, broadcast against those of the body: a map or a sample is then one call.
    """

    points: Any
    stiffness: Any
    length: Any
    damping: Any = 0.0
    lateral_stiffness: Any = 0.0
    lateral_damping: Any = 0.0
    ground: Any = None
    support: str = "hanging"
    gravity: Any = G0

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "points", array("stand.points", self.points, (-1, 3)))
        n = self.points.shape[-2]
        for field in ("stiffness", "length", "damping", "lateral_stiffness", "lateral_damping"):
            value = np.asarray(getattr(self, field))
            value = array(f"stand.{field}", getattr(self, field), (n,) if value.ndim else (), least=0.0)
            put(self, field, np.broadcast_to(value, np.broadcast_shapes(value.shape, (n,))))
        if np.any(self.stiffness <= 0.0) or np.any(self.length <= 0.0):
            field = "length" if np.all(self.stiffness > 0.0) else "stiffness"
            raise InputError(f"stand.{field} is {getattr(self, field)}; every spring's must be above 0")
        put(self, "gravity", array("stand.gravity", self.gravity, least=0.0))
        if self.support not in SUPPORTS:
            raise InputError(f"stand.support is {self.support!r}; {nearest(str(self.support), SUPPORTS)}")
        if self.ground is not None:
            put(self, "ground", array("stand.ground", self.ground, (n, 3)))
            if np.any(np.all(self.ground == self.points, axis=-1)):
                raise InputError("stand.ground meets an attachment point; a spring needs a direction")

    @classmethod
    def rectangle(cls, a: float, b: float, **fields: Any) -> Stand:
        """Four springs at (a, b), (a, -b), (-a, -b), (-a, b) in (x, z), in this order; `fields` as of `Stand`."""
        array("stand.a", a, least=0.0)
        array("stand.b", b, least=0.0)
        return cls(points=[[a, 0, b], [a, 0, -b], [-a, 0, -b], [-a, 0, b]], **fields)

    @property
    def ground_points(self) -> np.ndarray:
        """(n, 3) float, m, level frame."""
        if self.ground is not None:
            return self.ground
        side = -1.0 if self.support == "standing" else 1.0
        return self.points + side * self.length[..., None] * np.array([0.0, 1.0, 0.0])


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Body:
    """A rigid body.

    Parameters
    ----------
    mass : float, kg
    centre : (3,) float, m
        Centre of mass, body axes, from the stiffness centre of the attachment plane: (ex, -h, ez) with h the height of
        the attachment plane above it.
    inertia : (3, 3) or (3,) float, kg m2
        Tensor about the centre of mass in body axes (I_xz = -int x z dm), or its principal moments along them.

    Notes
    -----
    Every field may carry leading axes (the tensor then in full).
    """

    mass: Any
    centre: Any
    inertia: Any

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "mass", array("body.mass", self.mass, least=np.nextafter(0.0, 1.0)))
        put(self, "centre", array("body.centre", self.centre, (3,)))
        tensor = np.asarray(self.inertia)
        tensor = np.diag(array("body.inertia", tensor, (3,))) if tensor.shape == (3,) else tensor
        put(self, "inertia", array("body.inertia", tensor, (3, 3)))
        reason = inertia_defect(self.inertia)
        if reason:
            raise InputError(f"body.inertia is {' '.join(str(self.inertia).split())[:200]}; {reason}")


def inertia_defect(inertia: np.ndarray) -> str:
    """Why no body can have this inertia tensor; empty where one can.

    Parameters
    ----------
    inertia : (..., 3, 3) float, kg m2
    """
    rtol = 1e-9  # of the largest principal moment
    if not np.allclose(inertia, np.swapaxes(inertia, -1, -2), rtol=rtol, atol=rtol * np.max(np.abs(inertia))):
        return "an inertia tensor is symmetric"
    moments = np.linalg.eigvalsh(inertia)
    if np.any(moments[..., 0] <= 0.0):
        return f"its least principal moment is {np.min(moments[..., 0]):.6g} kg m2 and must be above 0"
    excess = moments[..., 2] - moments[..., 0] - moments[..., 1]
    if np.any(excess > rtol * moments[..., 2]):
        return f"its largest principal moment exceeds the sum of the others by {np.max(excess):.6g} kg m2"
    return ""


class Mounting(NamedTuple):
    """How a body is fixed to a stand, with what else and which air moves along; any leading axes.

    Attributes
    ----------
    rotation : (..., 3, 3), body axes to the stand's
    position : (..., 3) m, of the body's reference point from the stiffness centre, stand's axes
    turn : (..., 3) rad, rotation vector that follows `rotation`, stand's axes: an error of the attitude
    occupied : bool, whether the body is on the stand
    tare_mass, tare_centre, tare_inertia : (..., t) kg, (..., t, 3) m, (..., t, 3, 3) kg m2
        Of all else on the stand: centres of mass from the stiffness centre, tensors about them, stand's axes.
    air_mass, air_inertia : (n, 3, 3) m3 and m5, added mass and moments of shapes for the density 1
    air_centre : (n, 3) m, of the shapes
    air_on_body : tuple of bool, whether a shape's axes and reference point are the body's, or the stand's
    air_factor : (..., n), on the formula of each shape
    air_density : (...) kg/m3
    """

    rotation: np.ndarray = np.eye(3)
    position: np.ndarray = np.zeros(3)
    turn: np.ndarray = np.zeros(3)
    occupied: bool = True
    tare_mass: np.ndarray = np.zeros(0)
    tare_centre: np.ndarray = np.zeros((0, 3))
    tare_inertia: np.ndarray = np.zeros((0, 3, 3))
    air_mass: np.ndarray = np.zeros((0, 3, 3))
    air_inertia: np.ndarray = np.zeros((0, 3, 3))
    air_centre: np.ndarray = np.zeros((0, 3))
    air_on_body: tuple[bool, ...] = ()
    air_factor: np.ndarray = np.zeros(0)
    air_density: np.ndarray | float = 0.0


class Setup(NamedTuple):
    """Numbers of a stand and a body, with any leading axes, unchecked.

    `added` (..., 6, 6), in translation of the centre of mass and rotation, body axes, is inertia without weight: that
    of air. With a `mounting` mass, centre and inertia are those of the body alone, in its own axes.
    """

    points: np.ndarray
    ground: np.ndarray
    stiffness: np.ndarray
    length: np.ndarray
    damping: np.ndarray
    lateral_stiffness: np.ndarray
    lateral_damping: np.ndarray
    gravity: np.ndarray
    guided: bool
    mass: np.ndarray
    centre: np.ndarray
    inertia: np.ndarray
    added: np.ndarray | None = None
    mounting: Mounting | None = None

    @property
    def batch(self) -> tuple[int, ...]:
        """Leading axes of all fields together; those of a mounting are not counted."""
        trailing = [2, 2, 1, 1, 1, 1, 1, 0, 0, 0, 1, 2, *([] if self.added is None else [2])]
        fields = [np.asarray(f) for f in (*self[:12], *(() if self.added is None else (self.added,)))]
        return np.broadcast_shapes(*(f.shape[: f.ndim - n] for f, n in zip(fields, trailing, strict=True)))


def setup(stand: Stand, body: Body) -> Setup:
    """Numbers of a stand and a body."""
    return Setup(
        stand.points,
        stand.ground_points,
        stand.stiffness,
        stand.length,
        stand.damping,
        stand.lateral_stiffness,
        stand.lateral_damping,
        stand.gravity,
        stand.support == "guided",
        body.mass,
        body.centre,
        body.inertia,
    )
