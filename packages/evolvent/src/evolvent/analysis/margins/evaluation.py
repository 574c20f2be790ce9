"""The margins of an assembled system, coordinate by coordinate."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent.analysis.margins import coordinates as lines, factors, latches, reels, shares, tables
from evolvent.analysis.margins.factors import Standard
from evolvent.analysis.margins.keys import Margin, MarginLine
from evolvent.analysis.margins.mechanism import Mechanism
from evolvent.analysis.margins.results import MarginResults
from evolvent.analysis.margins.shares import Share
from evolvent.analysis.margins.tables import MarginTable
from evolvent.model.shares import ACCELERATION
from evolvent.solvers.common.laws import refusing_laws
from evolvent.solvers.common.limits import limitations
from evolvent.solvers.static.storage import check_relaxes
from evolvent_base.errors import InputError, nearest

if TYPE_CHECKING:
    from evolvent.assembly.assembled import Assembly
    from evolvent.solvers.common.solution import Solution


#: What viscoelastic parts act with at a station, by the key `pace`.
_PACES = {
    "fast": "pace fast: at each station viscoelastic parts act with what they have at the start of the deployment, and "
    "with their whole stiffness from there on; nothing relaxes on the way",
    "slow": "pace slow: at each station viscoelastic parts have relaxed whole; near its rest a part that drives has "
    "less in a faster deployment",
}


@dataclasses.dataclass(frozen=True, eq=False)
class AtRest:
    """Margins along the travel at rest, with what those along a run need.

    Attributes
    ----------
    assembly : Assembly
    keys : Margin
    label : str, name of the table of factors; standard : Standard; evidence : str, of what has no own
    mechanism : Mechanism, as in the run, or None where reels alone have margins
    shares : list of Share
    tables : list of Table, one a coordinate
    reels : mapping, reels with a margin -> rows of their threads
    opened : names of hold-downs that the tables at rest leave out, '' for none
    """

    assembly: Assembly
    keys: Margin
    label: str
    standard: Standard
    evidence: str
    mechanism: Mechanism | None
    shares: list[Share]
    tables: list[MarginTable]
    reels: dict[str, Any]
    opened: str = ""

    def results(self, solution: Solution | None = None, *, title: str = "", case: str = "") -> MarginResults:
        """All margins: these, and those along a run of the same assembly.

        Raises
        ------
        InputError
            For a resistance that is neither given nor declared to be zero.
        """
        known = self.standard, self.evidence
        moving: list[MarginTable | None] = [None] * len(self.tables)
        if solution is not None and self.mechanism is not None:
            with refusing_laws(self.assembly):
                asked = [table.coordinate for table in self.tables]
                moving = tables.along_motion(self.mechanism, asked, self.shares, solution, known)
        for table, motion in zip(self.tables, moving, strict=True):
            given = _given(table) | (_given(motion) if motion is not None else set())
            lines.refuse_unstated(table.coordinate, given, self.standard)
        ends, remarks = [], self._remarks()
        if solution is not None and self.mechanism is not None:
            both = list(zip(self.tables, moving, strict=True))
            stay = [table.coordinate for table, motion in both if motion is None and self._starts(table, solution)]
            ends = [
                latches.of_solution(self.mechanism, table, motion, solution, held=table.coordinate in stay)
                for table, motion in both
            ]
            remarks += [f"{one.name!r} is held throughout the run, which has no margin along it" for one in stay]
        remarks += self._of_pace(solution)
        still: list[MarginTable | None] = [*self.tables, *([None] * len(self.reels))]
        for name, thread in self.reels.items():
            found = (
                None if solution is None else reels.along_run(self.assembly, name, thread, self.keys, solution, known)
            )
            if found is not None:
                lines.refuse_unstated(found.coordinate, _given(found), self.standard)
            moving.append(found)
        names = [*(table.coordinate.name for table in self.tables), *self.reels]
        remarks += limitations(solution) if solution is not None else []
        return MarginResults(
            self.label, self.standard, self.keys, names, still, moving, ends, remarks,
            warnings=self._warnings(solution, moving), title=title, case=case,
        )  # fmt: skip

    def _starts(self, table: MarginTable, solution: Solution) -> bool:
        """Whether a run begins before the end of a coordinate's travel."""
        assert self.mechanism is not None
        one = table.coordinate
        return one.sense * (float(self.mechanism.of_run(solution, 0).x[one.k]) - one.end) < 0.0

    def _relaxes_in(self, solution: Solution | None) -> str:
        """What relaxes in a run that the tables at rest do not count, a clause; '' where nothing does."""
        own = self.assembly.relaxations.values()
        if solution is None or not own or self.keys.pace != "fast":
            return ""
        shortest, name = min(((time, name) for name, law in own for _, time in law.terms), key=lambda one: one[0])
        end = float(solution.t[-1])
        if shortest >= end:
            return ""
        return f"{name!r} has a relaxation time of {shortest:.3g} s, and the run takes {end:.4g} s"

    def _warnings(self, solution: Solution | None, moving: Sequence[MarginTable | None]) -> list[str]:
        """What relaxes during a deployment of which no margin along the run tells."""
        alone = [table.coordinate.name for table, motion in zip(self.tables, moving, strict=False) if motion is None]
        why = self._relaxes_in(solution)
        if not why or not alone:
            return []
        return [
            f"what relaxes while the system deploys is in no margin of {', '.join(map(repr, alone))}: {why}; where "
            f"such a part drives, margins may be lower"
        ]

    def _of_pace(self, solution: Solution | None) -> list[str]:
        """Sentences on what viscoelastic parts act with, in the tables at rest and along a run."""
        if not self.assembly.relaxations or not self.tables:
            return []
        found = [_PACES[self.keys.pace]]
        if solution is not None:
            why = self._relaxes_in(solution)
            found.append(
                "along the run viscoelastic parts act with what they have at each sample"
                + (f", which the tables at rest do not count: {why}" if why else "")
            )
        return found

    def _remarks(self) -> list[str]:
        """Sentences on parts that have no share."""
        if self.mechanism is None:
            return []
        touched = {name for table in self.tables for name in table.touches}
        own = [share.part for share in self.shares if share.evaluated.contact is not None]
        found = [f"{name!r} does not touch on any travel" for name in dict.fromkeys(own) if name not in touched]
        remarks: dict[str, list[str]] = {}
        for name, (family, _) in self.assembly.names.items():
            remarks.setdefault(shares.of_family(family).remark, []).append(repr(name))
        found += [remark.format(names=", ".join(names)) for remark, names in remarks.items() if remark]
        if self.opened:
            found.append(f"the tables at rest leave out what is to be released: {self.opened}")
        if any(share.evaluated.elastic is not None for share in self.shares):
            found.append(
                "elastic parts stand in equilibrium at each station; their damping is in no share, and they count by "
                "the factor of springs where the table has none of their own"
            )
        return found


def at_rest(assembly: Assembly, keys: Margin) -> AtRest:
    """Margins along the travel at rest of every coordinate of an assembled system.

    Parameters
    ----------
    assembly : Assembly
    keys : Margin, as of the key `margin` of a case

    Raises
    ------
    InputError
        For parts that are not supported, a coordinate without an end of its travel, and keys that do not fit.
    """
    spools = reels.asked_of(assembly, keys)
    hinges = _with_margins(assembly, keys)
    if "pace" in keys.model_fields_set:
        check_relaxes(assembly, "margin.pace")
    if hinges or not spools:
        shares.refuse_unsupported(assembly, spins=any(keys.spin or ()))
    label, standard = factors.standard(keys.factors)
    evidence = _evidence("evidence", keys.evidence or standard.evidence[0], standard)
    if not hinges and spools:
        _check_parts(keys, [], assembly, standard)
        return AtRest(assembly, keys, label, standard, evidence, None, [], [], spools)
    spin = np.array([*(keys.spin or (0.0, 0.0, 0.0)), *keys.centre])
    with refusing_laws(assembly):
        mechanism = Mechanism(assembly, spin)
        found = shares.shares_of(assembly, keys.parts, evidence, spins=bool(np.any(spin[:3])))
        _check_parts(keys, found, assembly, standard)
        held, start = _waiting(mechanism, keys), mechanism.at_rest(keys.time)
        opened, slow = mechanism.closed(start.t) if held else "", keys.pace == "slow"
        free = Mechanism(assembly, spin, held, relaxed=slow) if held or slow else mechanism
        start = free.at_rest(keys.time)
        asked = lines.with_others(free, lines.coordinates_of(free, keys, start), start)
        still = [_along_travel(free, one, asked, found, keys, (standard, evidence)) for one in asked]
    return AtRest(assembly, keys, label, standard, evidence, mechanism, found, still, spools, opened)


def _waiting(mechanism: Mechanism, keys: Margin) -> list[int]:
    """Rows of hold-downs that keep a coordinate with a margin from moving at rest, which its table leaves out.

    Those with a time of release hold where the key `time` is given, which then says whether they do.
    """
    start = mechanism.at_rest(keys.time)
    held = mechanism.holds(start.t)
    if "time" in keys.model_fields_set:
        held = held[mechanism.whole.constraints["event"][held] != -1]
    if not held.size:
        return []
    asked = lines.coordinates_of(mechanism, keys, start)
    waits = any(mechanism.waits(one.k, [], start) for one in asked)
    return list(held.tolist()) if waits else []


def _with_margins(assembly: Assembly, keys: Margin) -> bool:
    """Whether a hinge or a slide is not left out.

    Raises
    ------
    InputError
        For a name of `lines` that is neither a coordinate nor a reel with a thread.
    """
    coordinates, threads = shares.coordinate_names(assembly), reels.names_of(assembly)
    for name, line in keys.lines.items():
        if name not in coordinates and name not in threads:
            why = f"which has no coordinate; {nearest(name, [*coordinates, *threads])}"
            raise InputError(f"margin.lines has {name!r}, {why}")
        if name not in threads and line.torque is not None:
            raise InputError(f"margin.lines.{name}.torque is of reels; a hinge has the torques of its parts")
    return any(not keys.lines.get(name, MarginLine()).leave_out for name in coordinates)


def _evidence(key: str, word: str, standard: Standard) -> str:
    if word not in standard.evidence:
        raise InputError(f"margin.{key} is {word!r}; {nearest(word, standard.evidence)}")
    return word


def _check_parts(keys: Margin, found: list[Share], assembly: Assembly, standard: Standard) -> None:
    """Refuse keys of parts that have no force, and evidence that the table of factors does not know."""
    known = [share.label for share in found] + [share.part for share in found if share.part]
    known += reels.labels_of(assembly, keys)
    for name, part in keys.parts.items():
        if name not in known:
            there = " has no force" if name in assembly.names else " is no part"
            raise InputError(f"margin.parts has {name!r}, which{there}; {nearest(name, dict.fromkeys(known))}")
        if part.evidence is not None:
            _evidence(f"parts.{name}.evidence", part.evidence, standard)


def _along_travel(
    mechanism: Mechanism, one: lines.MarginCoordinate, asked: list[lines.MarginCoordinate], found: list[Share],
    keys: Margin, known: tuple[Standard, str],
) -> MarginTable:  # fmt: skip
    """The table at rest of one coordinate of those that are asked for, from the start of the system."""
    at = mechanism.at_rest(keys.time)
    held = [mechanism.names.index(name) for name in one.held]
    travels = {k: (float(at.x[k]), float(at.x[k])) for k in held}
    if keys.others != "start":
        for other in (other for other in asked if other.k in travels):
            travels[other.k] = (other.start if keys.others == "together" else other.end), other.end
    travels[one.k] = one.start, one.end
    if keys.others == "together":  # in one order, so that all coordinates have the same stations
        travels = dict(sorted(travels.items()))
    if keys.others == "end":
        at = mechanism.move({**{k: end for k, (_, end) in travels.items()}, one.k: float(at.x[one.k])}, at)
    targets = {k: np.linspace(*ends, keys.stations) for k, ends in travels.items()}
    return tables.along_travel(mechanism, one, found, *mechanism.refined(targets, at), at, known)


def _given(table: MarginTable) -> set[str]:
    """Categories that a part gives along a table."""
    active = np.any(table.values != 0.0, axis=1)
    found = {share.category for share, acts in zip(table.shares, active, strict=True) if acts}
    return found | ({ACCELERATION} if table.coordinate.acceleration > 0.0 else set())


def with_keys(section: Mapping[str, Any], changes: Mapping[str, Any]) -> Margin:
    """The key `margin` of a case with some keys changed.

    Raises
    ------
    InputError
        For keys and values that cannot be used.
    """
    content = dict(section) | {name: value for name, value in changes.items() if value is not None}
    return Margin(**content)
