"""What a user writes about a wrapped rib."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from typing import Annotated, Literal

from evolvent import closed_forms
from evolvent_base.errors import InputError, nearest
from evolvent_base.file_keys import FileKey
from evolvent_base.schema import Section
from evolvent_papers.wrapped_rib.keys import (
    ALPHA,
    ENERGY,
    KINDS,
    LATCHES,
    MOST_ELEMENTS,
    MOTIONS,
    SINKS,
    STRAIN_REFUSED,
    TIP_FALL,
    Contact,
    Damping,
    Drive,
    Hold,
    Hub,
    Output,
    Rib,
    Solver,
    key,
)

#: The string is asked for several times a run: for its duration, its figures, and by every case of a study.
_string_winding = functools.lru_cache(maxsize=16)(closed_forms.string_winding)


class Case(Section):
    """A case of the system `wrapped-rib`."""

    system: Literal["wrapped-rib"] = "wrapped-rib"
    phase: Literal["wind", "hold", "deploy"] = key(
        ..., "wind: the drive winds the rib; hold: it holds the wound rib; deploy: the rib springs open"
    )
    start: Annotated[str, FileKey(endings=(".nc",))] = key(
        "auto", "straight, or wound on the hub without stretch; auto: by the phase; or a saved run, run.nc, at its end"
    )
    rib: Rib = Rib()
    hub: Hub = Hub()
    drive: Drive | None = key(None, "needed in phases wind and hold")
    hold: Hold | None = key(None, "needed in phase hold")
    damping: Damping = Damping()
    contact: Contact = Contact()
    solver: Solver = Solver()
    output: Output = Output()

    def refusals(self) -> Iterator[str]:
        """Rules between the sections."""
        for rules in (self._refused_phase, self._refused_drive, self._refused_geometry, self._refused_helix):
            yield from rules()

    def _refused_phase(self) -> Iterator[str]:
        phase, hold, duration = self.phase, self.hold, self.solver.duration
        starts = ("auto", "straight" if phase == "wind" else "wound")
        if self.start not in starts and not self.start.endswith(".nc"):
            allowed = f"phase {phase!r} starts from {' or '.join(starts)}, or from a saved run *.nc"
            yield f"start is {self.start!r}; {allowed}; {nearest(self.start, starts)}"
        if self.begins != "straight" and self.rib.start_angle != 0.0:
            yield "rib.start_angle is given, but the rib does not start straight; leave it out"
        if phase != "deploy" and self.rib.root_latch is not None:
            yield f"rib.root_latch is given, but phase is {phase!r}; a hinge locks in phase deploy, leave it out"
        if phase == "hold" and hold is None:
            yield "hold is missing; phase 'hold' needs it, such as {time: 60 s}"
        if phase != "hold" and hold is not None:
            yield f"hold is given, but phase is {phase!r}; leave it out, or use phase hold"
        if hold is not None and duration not in ("auto", hold.time):
            yield f"solver.duration is {duration:g} s, but hold.time is {hold.time:g} s; leave solver.duration out"

    def _refused_drive(self) -> Iterator[str]:
        drive, motion, phase = self.drive, self.hub.motion, self.phase
        kind = "none" if drive is None else drive.kind
        if drive is None and phase != "deploy":
            yield f"drive is missing; phase {phase!r} needs it, such as {{kind: torque, torque: 0.2 N m}}"
        if kind not in KINDS[phase]:
            yield f"drive.kind is {kind!r}; in phase {phase!r} it must be {' or '.join(KINDS[phase])}"
        if motion not in MOTIONS[kind]:
            yield f"hub.motion is {motion!r}; with drive.kind {kind!r} it must be {' or '.join(MOTIONS[kind])}"
        if drive is None:
            return
        if phase != "deploy" and drive.rate is not None and drive.rate < 0.0:
            yield f"drive.rate is {drive.rate:g} rad/s; phase {phase!r} needs one above 0 rad/s"
        strain = 0.0 if drive.torque is None else closed_forms.root_strain(self.strip, drive.torque)
        if drive.torque is not None and strain >= STRAIN_REFUSED:
            yield (
                f"drive.torque is {drive.torque:g} N m, which strains the wound rib's root by {100.0 * strain:.3g} %; "
                f"it must be below {STRAIN_REFUSED * drive.torque / strain:.3g} N m"
            )

    def _refused_geometry(self) -> Iterator[str]:
        rib, R, contact, numbers = self.rib, self.hub.radius, self.contact, self.damping.elements
        if rib.width > self.hub.height:
            yield f"rib.width is {rib.width:g} m, more than hub.height {self.hub.height:g} m"
        angle, least = rib.element_length / R, math.ceil(rib.length / (math.pi * R) - 1e-9)
        if angle > math.pi:
            most = f"even with {MOST_ELEMENTS} of them rib.length is {MOST_ELEMENTS * math.pi * R:.4g} m at most"
            yield (
                f"rib.elements is {rib.elements}, of which each would span {math.degrees(angle):.4g} deg of the hub; "
                + (f"it must be {least} or more" if least <= MOST_ELEMENTS else most)
            )
        if self.contact_spacing >= 2.0 * R:
            yield (
                f"contact.points is {contact.points}, contact points {self.contact_spacing:.4g} m apart, between which "
                f"the rib would pass through the hub, {2.0 * R:.4g} m across; it must be "
                f"{int(rib.length / (rib.elements * 2.0 * R)) + 1} or more"
            )
        if rib.curvatures[1] * R >= 1.0:
            yield (
                f"rib.shape has a curvature of {rib.curvatures[1]:.4g} 1/m, not below 1/hub.radius = {1.0 / R:.4g} "
                f"1/m: the rib would press on the hub with its ends alone; use a greater focal_length"
            )
        if rib.shape is not None and self.drive is not None and self.drive.kind == "tip":
            yield "rib.shape is given, but a carried tip starts from a straight, taut rib; use another drive.kind"
        if contact.self and contact.law == "conservative":
            yield "contact.law is 'conservative', which contact.self does not support; use hunt-crossley"
        if isinstance(numbers, tuple) and max(numbers) > rib.elements:
            yield f"damping.elements names element {max(numbers)}, but rib.elements is {rib.elements}"

    def _refused_helix(self) -> Iterator[str]:
        rib, hub, drive, rise = self.rib, self.hub, self.drive, self.rise
        half = 0.5 * rib.width * math.cos(self.helix_angle)
        low, high = self.root_height - half, self.root_height + rise + half
        if rise + 2.0 * half > hub.height:
            yield (
                f"rib.pitch is {rib.pitch:g} m, with which the wound rib takes {rise + 2.0 * half:.4g} m of the hub's "
                f"axis, but hub.height is {hub.height:g} m; it must be {self._largest_pitch:.4g} m at most"
            )
        elif low < -0.5 * hub.height * (1.0 + 1e-9) or high > 0.5 * hub.height * (1.0 + 1e-9):
            least, most = -0.5 * hub.height + half, 0.5 * hub.height - rise - half
            yield (
                f"rib.root_height is {self.root_height:g} m, with which the wound rib lies from {low:.4g} to "
                f"{high:.4g} m, beyond the hub's ends at {0.5 * hub.height:g} m; it must be from {least:.4g} to "
                f"{most:.4g} m"
            )
        if rib.pitch == 0.0:
            return
        if self.contact.self and self.turns_overlap:
            yield (
                f"rib.pitch is {rib.pitch:g} m, with which turns overlap in part, which contact.self does not support; "
                f"it must be 0, or {self.clear_pitch:.4g} m or more"
            )
        if drive is None or drive.kind != "hub" or self.phase == "deploy":
            return
        if drive.torque is None:
            yield (
                "drive.torque is missing; with rib.pitch a drive of kind 'hub' needs it, such as '0.2 N m': a hub that "
                "turns against drag alone does not push the rib along its axis"
            )
        if self.damping.elements != "all" and self.damping.alpha > 0.0:
            yield "damping.elements is given, but with rib.pitch a drive of kind 'hub' needs drag on all; leave it out"

    @property
    def method(self) -> str:
        """The time integration; `auto` is generalized-alpha for the paper's law of damping only."""
        if self.solver.method != "auto":
            return self.solver.method
        return ALPHA if self.damping.kind == "paper" and self.damping.beta > 0.0 else ENERGY

    @property
    def contact_spacing(self) -> float:
        """Length of rib between contact points of the contact, m."""
        return self.rib.element_length / self.contact.points

    @property
    def helix_angle(self) -> float:
        """Angle between the wound rib and the plane across the hub's axis, rad."""
        return math.atan(self.rib.pitch / (2.0 * math.pi * self.hub.radius))

    @property
    def rise(self) -> float:
        """Height of the wound rib's tip above its root, m."""
        return self.rib.length * math.sin(self.helix_angle)

    @property
    def root_height(self) -> float:
        """Height of the root above the hub's middle, m."""
        return -0.5 * self.rise if self.rib.root_height == "auto" else float(self.rib.root_height)

    @property
    def turn_distance(self) -> float:
        """Distance of the middles of turns of a helix that lie beside one another, across the rib, m."""
        return self.rib.pitch / self.rib.count * math.cos(self.helix_angle)

    @property
    def turns_overlap(self) -> bool:
        """Whether turns of a helix overlap in part."""
        return 0.0 < self.turn_distance < self.rib.width * (1.0 - 1e-3)

    @property
    def clear_pitch(self) -> float:
        """Pitch with which turns lie beside one another without a gap, m; infinite where ribs are too many."""
        around = self.rib.width * self.rib.count / (2.0 * math.pi * self.hub.radius)
        return math.inf if around >= 1.0 else self.rib.width * self.rib.count / math.sqrt(1.0 - around**2)

    @property
    def _largest_pitch(self) -> float:
        """Pitch of a rib that, wound, takes all of the hub's height, m."""
        # L sin(a) + w cos(a) = H
        L, w, H = self.rib.length, self.rib.width, self.hub.height
        return 2.0 * math.pi * self.hub.radius * math.tan(math.asin(min(H / math.hypot(L, w), 1.0)) - math.atan2(w, L))

    @property
    def begins(self) -> str:
        """Where the run starts: "straight", "wound", or the name of a saved run."""
        if self.start == "auto":
            return "straight" if self.phase == "wind" else "wound"
        return self.start

    @property
    def first_direction(self) -> float:
        """Of a rib that starts straight, rad from outwards: a carried tip begins its involute on the tangent."""
        return 0.5 * math.pi if self.drive is not None and self.drive.kind == "tip" else self.rib.start_angle

    @property
    def strip(self) -> closed_forms.Strip:
        """What the closed forms take; of a tapered rib, the means over its length.

        Of a helix it is the rib as seen along the hub's axis: the same mass, energy of bending and tension about it.
        """
        rib = self.rib
        ends = (rib.thickness, rib.thickness if rib.tip_thickness is None else rib.tip_thickness)
        area = rib.width * 0.5 * sum(ends)
        # the mean of t^3 over a linear taper is (a + b)(a^2 + b^2)/4
        moment = rib.width * sum(ends) * (ends[0] ** 2 + ends[1] ** 2) / 48.0
        cosine = math.cos(self.helix_angle)
        return closed_forms.Strip(
            radius=self.hub.radius,
            length=rib.length * cosine,
            line_density=rib.density * area / cosine,
            bending_stiffness=rib.young_modulus * moment * cosine**3,
            axial_stiffness=rib.young_modulus * area * cosine,
            taper=ends[1] / ends[0],
        )

    @property
    def damped(self) -> tuple[int, ...]:
        """Elements that are damped, from 0."""
        chosen = self.damping.elements
        if chosen == "all":
            return tuple(range(self.rib.elements))
        return (0,) if chosen == "first" else tuple(sorted(int(k) - 1 for k in chosen))

    @property
    def damped_arcs(self) -> tuple[tuple[float, float], ...] | None:
        """Arc lengths from the root, from and to, of what is damped, m; None for all of it."""
        length = self.rib.element_length
        return None if self.damping.elements == "all" else tuple((k * length, (k + 1) * length) for k in self.damped)

    @property
    def contact_stiffness(self) -> float:
        """Stiffness of the contact, N/m^n; see `Contact.stiffness`."""
        contact, strip, drive = self.contact, self.strip, self.drive
        if contact.stiffness != "auto":
            return float(contact.stiffness)
        R, n, spacing = strip.radius, contact.exponent, self.contact_spacing
        pull = strip.bending_stiffness / R**2
        if drive is not None and drive.torque is not None:
            pull += drive.torque / R
        elif drive is not None and drive.kind == "tip":
            pull += strip.axial_stiffness * drive.stretch
        elif drive is not None and drive.rate is not None:  # drag of a straight rib
            arcs = self.damped_arcs or ((0.0, strip.length),)
            third = sum(b**3 - a**3 for a, b in arcs) / 3.0
            pull += self.damping.alpha * strip.line_density * abs(drive.rate) * third / R
        held = pull / R * spacing / (SINKS * R) ** n
        speed = closed_forms.deployment_speed(strip)
        falls = 0.5 * (n + 1.0) * strip.line_density * spacing * speed**2 / (TIP_FALL * R) ** (n + 1.0)
        return max(held, falls)

    @property
    def penalty(self) -> tuple[float, float]:
        """Stiffness of the penalties of a root under explicit methods: position (N/m) and direction (N m).

        That of a quarter of an element, and a tenth of that of its slopes: about as fast as the element itself.
        """
        EA, length = self.strip.axial_stiffness, self.rib.element_length
        return 4.0 * EA / length, 0.1 * EA * length

    @property
    def contact_frequency(self) -> float:
        """Frequency of a contact point with its share of the mass on the hub, rad/s, at a depth of the thickness."""
        n, mass = self.contact.exponent, self.strip.line_density * self.contact_spacing
        return math.sqrt(n * self.contact_stiffness * self.rib.thickness ** (n - 1.0) / mass)

    @property
    def string(self) -> closed_forms.Winding:
        """A string without bending stiffness under the drive's torque."""
        assert self.drive is not None
        assert self.drive.torque is not None
        return _string_winding(
            self.strip, self.drive.torque, self.damping.alpha, damped=self.damped_arcs, start_angle=self.rib.start_angle
        )

    @property
    def duration(self) -> float:
        """Time that the run covers, s."""
        if self.solver.duration != "auto":
            return float(self.solver.duration)
        if self.hold is not None:
            return self.hold.time
        drive = self.drive
        turns = self.rib.length / self.hub.radius
        if drive is not None and drive.kind == "torque" and drive.torque is not None:
            motion = self.string
            if not math.isfinite(motion.end_time):
                raise InputError(
                    f"solver.duration is auto, but drive.torque {drive.torque:g} N m does not wind a string without "
                    f"bending stiffness within {motion.time[-1]:.3g} s; give it, such as '60 s', or a greater torque"
                )
            return 1.2 * motion.end_time + drive.ramp
        if drive is not None and drive.rate is not None:
            return 1.2 * turns / abs(drive.rate) + drive.ramp
        return closed_forms.deployment_time(self.strip) if self.rib.root_latch is None else self._latched

    @property
    def _latched(self) -> float:
        """Time until a hinge without a spring has locked and the rib has turned on by half a turn, s."""
        rib, alpha = self.rib, self.damping.alpha
        assert rib.root_latch is not None
        turn = LATCHES - rib.root_latch
        found = closed_forms.opening(self.strip, alpha=alpha, damping=rib.root_damping, turn=turn)
        if not math.isfinite(found.latched):
            raise InputError(
                f"solver.duration is auto, but rib.root_damping {rib.root_damping:g} N m s and damping.alpha {alpha:g} "
                f"1/s stop the rib before its latch, as far as a rigid rib tells; give it, such as '200 s'"
            )
        return found.latched + math.pi / found.rate
