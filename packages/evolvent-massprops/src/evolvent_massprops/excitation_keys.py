"""Keys of what sets a body on springs in motion: pulls that are released, impulses, an initial state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from evolvent_base import units
from evolvent_base.errors import InputError
from evolvent_base.schema import Section
from evolvent_massprops.inertia import Load, NormalModes, best_point, coordinates, displaced, least_energy

SpringNumber = Annotated[int, units.Whole(least=1, most=10_000)]
_STATE = ("displacement", "rotation", "velocity", "rate")


class LoadKeys(Section):
    """One of several loads that act together."""

    force: units.ForceVector | None = Field(None, description="pulls the body at equilibrium, and is released suddenly")
    impulse: units.ImpulseVector | None = Field(None, description="strikes the body")
    at: SpringNumber | units.Position = Field(1, description="where it acts: a spring by number, or a point")

    @model_validator(mode="after")
    def _check(self) -> LoadKeys:
        if (self.force is None) == (self.impulse is None):
            raise InputError("a load gives neither or both of force and impulse; give one of them")
        return self


class Excitation(Section):
    """What sets the body in motion at t = 0: a `force` that is released, an `impulse`, or an initial state.

    `loads` are several forces and impulses at once: the forces are released together, at the moment of the impulses.
    """

    force: units.ForceVector | None = Field(None, description="pulls the body at equilibrium, and is released suddenly")
    impulse: units.ImpulseVector | None = Field(None, description="strikes the body at equilibrium")
    at: SpringNumber | Literal["best", "best point"] | units.Position = Field(
        1,
        description="where it acts: a spring by number, a point, best: the spring that gives the weakest mode most, or "
        "best point: the point between the springs that does",
    )
    loads: Annotated[tuple[LoadKeys, ...], Field(min_length=1, max_length=100)] | None = Field(
        None, description="forces and impulses that act together, each with its own place"
    )
    displacement: units.Position | None = Field(
        None, description="of the centre of mass from equilibrium, of an initial state"
    )
    rotation: units.RotationVector | None = Field(None, description="rotation vector from equilibrium")
    velocity: units.Velocity | None = None
    rate: units.AngularVelocity | None = Field(None, description="angular velocity, level axes")

    @model_validator(mode="after")
    def _check(self) -> Excitation:
        state = [k for k in _STATE if getattr(self, k) is not None]
        kinds = [k for k in ("force", "impulse", "loads") if getattr(self, k) is not None] + state[:1]
        if len(kinds) != 1:
            given = " and ".join(f"excitation.{k}" for k in kinds) or "nothing"
            raise InputError(
                f"excitation gives {given}; give one of force, impulse, loads, or an initial state (displacement, "
                f"rotation, velocity, rate)"
            )
        if (state or self.loads) and "at" in self.model_fields_set and self.at != 1:
            where = "an initial state acts nowhere" if state else "each of excitation.loads has its own"
            raise InputError(f"excitation.at is given, but {where}; leave it out")
        vectors = {k: getattr(self, k) for k in (*kinds[:1], *state) if k != "loads"}
        vectors |= {f"loads.{k}": one.force or one.impulse for k, one in enumerate(self.loads or ())}
        for key, vector in vectors.items():
            if not any(vector) and len(state) < 2:
                raise InputError(f"excitation.{key} is zero, so there is no motion")
        return self

    @property
    def acts(self) -> bool:
        """Whether forces or impulses act, and no initial state is given."""
        return not any(getattr(self, k) is not None for k in _STATE)

    def check_springs(self, number: int, key: str = "excitation") -> None:
        """Refuse places at springs that are not there."""
        places = {f"{key}.at": self.at}
        places |= {f"{key}.loads.{k}.at": one.at for k, one in enumerate(self.loads or ())}
        for where, place in places.items():
            if isinstance(place, int) and place > number:
                raise InputError(f"{where} is {place}, but there are {number} springs")


class Excited(NamedTuple):
    """What an excitation is on a given stand.

    Attributes
    ----------
    loads : tuple of Load; none of an initial state
    spring : int, the spring at which the one load acts, from 1; 0 for none
    z : (m,) complex, modal coordinates
    """

    loads: tuple[Load, ...]
    spring: int
    z: np.ndarray


def excitation_on(given: Excitation, springs: np.ndarray, modes: NormalModes) -> Excited:
    """What an excitation is on a stand with springs at points (n, 3), m, of the body.

    Raises
    ------
    InputError
        An initial state that guides hold.
    """
    if not given.acts:
        state = given.model_dump(include=set(_STATE), exclude_none=True)
        return Excited((), 0, displaced(modes, **state).z)
    if given.loads is not None:
        loads = tuple(_load(one.force, one.impulse, one.at, springs) for one in given.loads)
        spring = given.loads[0].at if len(loads) == 1 and isinstance(given.loads[0].at, int) else 0
        return Excited(loads, spring, coordinates(modes, loads))
    place: Any = given.at
    if place == "best":
        place = 1 + int(np.argmax(least_energies(given, springs, modes)))
    elif place == "best point":
        vector, impulse = _acting(given)
        place = tuple(map(float, best_point(modes, springs, vector, impulse=impulse)))
    load = _load(given.force, given.impulse, place, springs)
    return Excited((load,), place if isinstance(place, int) else 0, coordinates(modes, [load]))


def least_energies(given: Excitation, points: np.ndarray, modes: NormalModes) -> np.ndarray:
    """(n,) J, energy of the weakest of heave, roll and pitch, were the one load to act at each of points (n, 3)."""
    vector, impulse = _acting(given)
    return np.array([least_energy(modes, [Load(vector, point, impulse)]) for point in points])


def _acting(given: Excitation) -> tuple[np.ndarray, bool]:
    """Vector of the one load, and whether it is an impulse."""
    return np.array(given.impulse if given.force is None else given.force), given.force is None


def _load(force: Sequence[float] | None, impulse: Sequence[float] | None, at: object, springs: np.ndarray) -> Load:
    point = springs[at - 1] if isinstance(at, int) else np.array(at)
    return Load(np.array(impulse if force is None else force), point, impulse=force is None)
