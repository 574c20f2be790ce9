"""The parts of a case, its timeline, and its closed form."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent import parts
from evolvent.analysis.system import System
from evolvent.elements.materials import Material
from evolvent.elements.sections import General
from evolvent_papers.wire_booms.case import PAIRS, Case

if TYPE_CHECKING:
    from evolvent.analysis.system import System

Array = np.ndarray
#: Directions of the booms, body axes; a pair is opposite.
DIRECTIONS = {"1": (1.0, 0.0), "2": (-1.0, 0.0), "3": (0.0, 1.0), "4": (0.0, -1.0)}
#: Speed of a pay-out that the log does not hold, and of one whose times there cannot be used, m/s.
SPEED = 6e-3


@dataclasses.dataclass(frozen=True, kw_only=True)
class Timeline:
    """When spools turn and thrusters fire, in the time of a run.

    Attributes
    ----------
    moves : (pair, start s, end s, length before m, length after m), in order of time
    spin_ups : (start s, end s, group)
    before, after : (n,) float, s, at which the rate before and after every logged step is read
    groups : (n,) int, group of every logged step
    end : float, s
    """

    moves: tuple[tuple[str, float, float, float, float], ...]
    spin_ups: tuple[tuple[float, float, int], ...]
    before: Array
    after: Array
    groups: Array
    end: float


def timeline(case: Case) -> Timeline:
    """Logged steps one after another, without the hours between them.

    What is out at the start of a group, and was not after the group before, is paid out before the spin-up.
    """
    timing, time = case.timing, case.timing.pause
    moves, spin_ups, before, after, groups = [], [], [], [], []
    out = case.starts[0]
    for k, (start, steps) in enumerate(zip(case.starts, case.steps, strict=True)):
        if k > 0:
            missing = {pair: start[pair] - out[pair] for pair in PAIRS if start[pair] != out[pair]}
            if missing:
                duration = max(map(abs, missing.values())) / SPEED + 3.0 * timing.ramp
                moves += [(pair, time, time + duration, out[pair], start[pair]) for pair in missing]
                time += duration + timing.pause
            spin_ups.append((time, time + timing.spin_up, k))
            time += timing.spin_up + timing.pause
        out = dict(start)
        for step in steps:
            before.append(time - 0.5 * timing.pause)
            moves.append((step.pair, time, time + step.duration, step.before, step.after))
            out[step.pair] = step.after
            time += step.duration + timing.pause
            after.append(time - 0.5 * timing.pause)
            groups.append(k)
    return Timeline(
        moves=tuple(moves), spin_ups=tuple(spin_ups), before=np.array(before), after=np.array(after),
        groups=np.array(groups), end=time,
    )  # fmt: skip


def inertia(case: Case, lengths: Array, *, root: float | None = None) -> Array:
    """Moment of inertia about the spin axis, kg m2: rigid body, straight radial wires, wound wire at the roots.

    Parameters
    ----------
    lengths : (..., 2) float, m, of the booms of both pairs
    root : float, m, distance of the roots in place of the case's (0: as eq. 18 of Tenenbaum, 2014)
    """
    wire, R = case.wire, case.body.root if root is None else root
    own = case.body.inertia[2] if isinstance(case.body.inertia, tuple) else case.body.inertia
    straight = wire.line_density * ((R + lengths) ** 3 - R**3) / 3.0 + wire.tip_mass * (R + lengths) ** 2
    wound = wire.line_density * (wire.length - lengths) * R**2
    return np.asarray(own + 2.0 * (straight + wound).sum(axis=-1))


def angular_momenta(case: Case) -> Array:
    """Angular momentum of every group, kg m2/s: that of straight wires at its start."""
    lengths = np.array([[start[pair] for pair in PAIRS] for start in case.starts])
    return inertia(case, lengths) * np.array(case.rates)


def lengths_at(case: Case, time: Array) -> Array:
    """Length of the booms of both pairs, (nt, 2), m."""
    found = np.empty((time.size, 2))
    for p, pair in enumerate(PAIRS):
        own = [move for move in timeline(case).moves if move[0] == pair]
        found[:, p] = case.starts[0][pair]
        for _, start, end, before, after in own:
            found[:, p] += (after - before) * share(time, start, end, ramp_of(case, end - start))
    return found


def ramp_of(case: Case, duration: float) -> float:
    """Duration of the smooth start and end of a step, s."""
    return min(case.timing.ramp, duration / 3.0)


def share(time: Array, start: float, end: float, ramp: float) -> Array:
    """Share of a step that is paid out: its rate rises and falls by quintic steps of the duration `ramp`."""
    rise, top = np.clip((time - start) / ramp, 0.0, 1.0), end - start - ramp
    fall = np.clip((time - end + ramp) / ramp, 0.0, 1.0)
    going = np.clip(time - start - ramp, 0.0, None)
    return np.asarray((ramp * _area(rise) + going - np.clip(time - end, 0.0, None) - ramp * _area(fall)) / top)


def straight_rate(case: Case, time: Array) -> Array:
    """Spin rate with straight radial wires, rad/s: the angular momentum of the group over the inertia."""
    line, momenta = timeline(case), angular_momenta(case)
    momentum = np.full(time.shape, momenta[0])
    for start, end, k in line.spin_ups:
        s = np.clip(2.0 * (time - start) / (end - start), 0.0, 2.0)
        done = np.where(s < 1.0, _area(np.minimum(s, 1.0)), 1.0 - _area(np.minimum(2.0 - s, 1.0)))
        momentum += (momenta[k] - momenta[k - 1]) * done
    return np.asarray(momentum / inertia(case, lengths_at(case, time)))


def _area(s: Array) -> Array:
    """Integral of the quintic step s^3 (10 - 15 s + 6 s^2) from 0 to s."""
    return np.asarray(s**4 * (2.5 - 3.0 * s + s**2))


def build(case: Case, *, laws: Mapping[str, Any] | None = None) -> System:
    """The parts "spacecraft", "reel-1" to "reel-4", "wire-1" to "wire-4" "thrusters-1" and so on."""
    system, body, wire, radius = System(title=case.title), case.body, case.wire, case.reel_radius
    line, momenta = timeline(case), angular_momenta(case)
    shape = parts.Cylinder(radius=body.root, length=body.root)
    spacecraft = parts.RigidBody(
        mass=body.mass, inertia=body.inertia, angular_velocity=(0.0, 0.0, case.rates[0]), shape=shape
    )
    system.add(spacecraft, "spacecraft")
    for boom, (x, y) in DIRECTIONS.items():
        pair = next(pair for pair in PAIRS if boom in pair.split("-"))
        own = [move for move in line.moves if move[0] == pair]
        steps = []
        for _, start, end, before, after in own:
            ramp = ramp_of(case, end - start)
            rate = (after - before) / (end - start - ramp) / radius
            steps += [(start, ramp, rate), (end - ramp, ramp, 0.0)]
        drive = parts.RampDrive(angle=case.starts[0][pair] / radius, steps=tuple(steps))
        axes = {
            "payout_axis": (x, y, 0.0),
            "spool_axis": (-y, x, 0.0),
            "centre": (body.root * x, body.root * y, -radius),
        }
        system.add(parts.Reel(body="spacecraft", radius=radius, drive=drive, **axes), f"reel-{boom}")
        thread = parts.Thread(
            reel=f"reel-{boom}", length=wire.length, line_density=wire.line_density, tip_mass=wire.tip_mass,
            nodes=wire.nodes, stiffness=wire.stiffness, damping=wire.damping, wound_mass="carried",
        )  # fmt: skip
        system.add(thread, f"wire-{boom}")
    for start, end, k in line.spin_ups:
        half = 0.5 * (end - start)
        pulse = {"value": (momenta[k] - momenta[k - 1]) / half, "start": start, "duration": 2.0 * half, "rise": half}
        thrusters = parts.Load(at="spacecraft", axis=(0.0, 0.0, 1.0), profile={"pulse": pulse})
        system.add(thrusters, f"thrusters-{k}")
    return system


def pendulum_rates(case: Case, lengths: Array, rate: Array) -> tuple[Array, Array]:
    r"""Angular frequencies of booms that swing as rigid pendulums, the hub fixed: in the plane of spin, and out.

    w^2 = W^2 R S/I and W^2 (1 + R S/I), with S and I the first and second moments of mass of a boom about its root
    (W. Johnson, Helicopter Theory, 1980, lag and flap frequencies of a hinged blade). Without the wire's mass R S/I is
    the distance of the root over the length, R/l.

    Parameters
    ----------
    lengths : (..., 2) float, m; rate : (...) float, rad/s, spin rate

    Returns
    -------
    in_plane, out_of_plane : (..., 2) float, rad/s; not a number where a boom is not out
    """
    wire = case.wire
    first = wire.line_density * lengths**2 / 2.0 + wire.tip_mass * lengths
    second = wire.line_density * lengths**3 / 3.0 + wire.tip_mass * lengths**2
    ratio = case.body.root * np.divide(first, second, out=np.full(lengths.shape, np.nan), where=second > 0.0)
    spin = np.asarray(rate)[..., None]
    return np.asarray(spin * np.sqrt(ratio)), np.asarray(spin * np.sqrt(1.0 + ratio))


#: Elements of a wire, cross-section (m2) and its second moment (m4) in `deployed`: it hardly bends.
ELEMENTS, AREA, SECOND_MOMENT = 12, 1e-6, 1e-16


def deployed(case: Case) -> tuple[System, float]:
    """The spacecraft with the booms at their final lengths, as cables on hinges, and its spin rate, rad/s."""
    end = np.array([timeline(case).end])
    lengths, spin = lengths_at(case, end)[0], float(straight_rate(case, end)[0])
    wire, root = case.wire, case.body.root
    of_boom = dict(zip(PAIRS, lengths, strict=True))
    roots = {f"root {boom}": (root * x, root * y, 0.0) for boom, (x, y) in DIRECTIONS.items()}
    body, turn = case.body, (0.0, 0.0, spin)
    system = System(title=case.title)
    spacecraft = parts.RigidBody(mass=body.mass, inertia=body.inertia, angular_velocity=turn, points=roots)
    system.add(spacecraft, "spacecraft")
    section = General(area=AREA, Iy=SECOND_MOMENT, Iz=SECOND_MOMENT, J=2.0 * SECOND_MOMENT)
    modulus = wire.stiffness * wire.length / wire.nodes / AREA
    material = Material(young_modulus=modulus, poisson_ratio=0.0, density=wire.line_density / AREA)
    for boom, (x, y) in DIRECTIONS.items():
        length = next(of_boom[pair] for pair in PAIRS if boom in pair.split("-"))
        cable = parts.Beam(
            length=length, section=section, material=material, elements=ELEMENTS, formulation="cable_stretch",
            position=(root * x, root * y, 0.0), direction=(x, y, 0.0),
            velocity=(-spin * root * y, spin * root * x, 0.0), angular_velocity=turn,
        )  # fmt: skip
        system.add(cable, f"wire-{boom}")
        system.add(parts.Joint(a=f"spacecraft.root {boom}", b=f"wire-{boom}.root"), f"hinge-{boom}")
        system.add(parts.Point(mass=wire.tip_mass, at=f"wire-{boom}.tip"), f"sphere-{boom}")
    return system, spin
