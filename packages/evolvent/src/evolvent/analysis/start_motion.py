"""Motion of a whole structure at the start: the keys `spin` and `velocity` of a system."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import Discriminator, Tag, ValidationError

from evolvent import model as mdl
from evolvent.analysis.start_state import KEY, RATES, started_from
from evolvent.assembly.assembled import Assembly
from evolvent.assembly.checks import WRITTEN, check_constraints
from evolvent.solvers.common.observations import sums_of
from evolvent.solvers.common.sampled import angular_momentum
from evolvent.solvers.modal.positions import moving, rigid_motions
from evolvent_base import units
from evolvent_base.errors import InputError, nearest
from evolvent_base.schema import Section, members, sentence

Array = np.ndarray
#: Keys of a system that say how it moves at the start.
KEYS = ("spin", "velocity")


class Spin(Section):
    """Rigid rotation of a structure, or of some of its parts, at the start, beside their own velocities.

    Parameters
    ----------
    axis : (3,) float
        Direction, inertial axes.
    rate : float, rad/s
    about : (3,) float, m, optional
        A point on the axis, inertial axes; the centre of mass of what turns if left out.
    parts : list of str, optional
        Parts that turn; all that move if left out. "rib" stands for "rib 1", "rib 2" and so on.
    """

    axis: units.Direction = (0.0, 0.0, 1.0)
    rate: units.AngularRate
    about: units.Position | None = None
    parts: tuple[str, ...] | None = None


#: One rotation, or a list of them; the brackets of the tags keep these out of the keys of messages.
Spins = Annotated[
    Annotated[Spin, Tag("spin[one]")] | Annotated[tuple[Spin, ...], Tag("spin[several]")],
    Discriminator(lambda given: "spin[several]" if isinstance(given, (list, tuple)) else "spin[one]"),
]


class StartMotion(Section):
    """What `spin` and `velocity` of a system hold."""

    spin: Spins = ()
    velocity: units.Velocity = (0.0, 0.0, 0.0)

    @classmethod
    def of(cls, sections: Mapping[str, Any]) -> StartMotion:
        """Those of a system's sections; InputError where they cannot be used."""
        try:
            return cls.model_validate({key: sections[key] for key in KEYS if key in sections})
        except ValidationError as error:
            raise InputError(sentence(error.errors(include_url=False), cls)) from None

    def written(self) -> dict[str, Any]:
        """As a case file holds them, without what is zero."""
        return self.model_dump(mode="json", exclude_defaults=True)


def follows_masses(sections: Mapping[str, Any]) -> bool:
    """Whether velocities at the start may follow from masses: a turn about the centre of mass, or a run before it."""
    if KEY in sections:
        return True
    spin = StartMotion.of(sections).spin
    return any(one.about is None for one in ((spin,) if isinstance(spin, Spin) else spin))


def started(assembly: Assembly, sections: Mapping[str, Any]) -> Assembly:
    """An assembly that starts as `start`, `spin` and `velocity` of its system say.

    Raises
    ------
    InputError
        For names of no part that moves, for parts without mass that turn about their centre of mass, and where joints
        do not allow the motion.
    """
    assembly = started_from(assembly, sections)
    if not any(key in sections for key in KEYS):
        return assembly
    own = StartMotion.of(sections)
    at = int(assembly.model.info.nq)
    y = assembly.y.copy()
    v = y[at : at + int(assembly.model.info.nv)]
    v += rigid_motions(assembly, y, np.zeros(3))[:, :3] @ own.velocity
    spins = {"spin": own.spin} if isinstance(own.spin, Spin) else {f"spin.{k}": one for k, one in enumerate(own.spin)}
    for key, spin in spins.items():
        turns = _chosen(assembly, spin, key)
        about = np.array(spin.about) if spin.about is not None else _centre_of_mass(assembly, turns, key)
        rate = spin.rate * np.array(spin.axis) / np.linalg.norm(spin.axis)
        v += np.where(turns, rigid_motions(assembly, y, about)[:, 3:] @ rate, 0.0)
    found = dataclasses.replace(assembly, y=y)
    check_constraints(found, RATES if sections.get(KEY) else WRITTEN)
    return found


def _chosen(assembly: Assembly, spin: Spin, key: str) -> Array:
    """Which velocities turn: (nv,) bool."""
    if spin.parts is None:
        return np.ones(int(assembly.model.info.nv), dtype=bool)
    known, found = moving(assembly), np.zeros(int(assembly.model.info.nv), dtype=bool)
    for name in spin.parts:
        own = members(known, name)
        if not own:
            raise InputError(f"{key}.parts holds {name!r}, which is no part that moves; {nearest(name, known)}")
        for one in own:
            found[known[one][2]] = True
    return found


def _centre_of_mass(assembly: Assembly, chosen: Array, key: str) -> Array:
    """Centre of mass (3,), m, of what moves with the chosen velocities, by its momenta in two translations."""
    at, n = int(assembly.model.info.nq), int(assembly.model.info.nv)
    y = np.repeat(assembly.y[None], 2, axis=0)
    y[:, at : at + n] = np.where(chosen, rigid_motions(assembly, assembly.y, np.zeros(3))[:, :2].T, 0.0)
    sums = sums_of(assembly.model, np.zeros(2), y, np.repeat(assembly.s[None], 2, axis=0))
    mass = float(sums[0, mdl.P_ALL])
    if not mass > 0.0:
        raise InputError(f"{key}.about is missing: what turns has no mass of its own, and so no centre of mass")
    H = angular_momentum(sums)
    return np.array([H[1, 2], -H[0, 2], H[0, 1]]) / mass
