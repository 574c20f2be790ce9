"""What each part gives to a coordinate: the shares of a mechanism, by what families say of them (`model.shares`)."""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

import numpy as np

from evolvent.assembly.assembled import Assembly
from evolvent.assembly.families import owner, records
from evolvent.kernels.ends import OfCoordinates
from evolvent.model import zeros
from evolvent.model.family import Family
from evolvent.model.registry import families, motions, motions_of
from evolvent.model.shares import INERTIA, Rule, Shares, Tie
from evolvent_base.errors import InputError

Array = np.ndarray
#: Shares that are no part's.
GRAVITY, SPIN = "gravity", "spin"


@dataclasses.dataclass(frozen=True)
class Share:
    """A force of one part.

    Attributes
    ----------
    label : str, such as "hinge 1.stiffness", "motor" or "gravity"
    part : str, '' of what is no part's
    category : str
    evidence : str, a word of the table of factors
    source : str
    family : str, and rows : (n,) int, its records
    aspect, fields, rates : as of `model.shares.Rule`
    stores : bool, whether it stores the energy that it takes, beside the coordinates that are held
    """

    label: str
    part: str
    category: str
    evidence: str
    source: str
    family: str = ""
    rows: tuple[int, ...] = ()
    aspect: str = ""
    fields: tuple[str, ...] = ()
    rates: bool | None = None
    stores: bool = False

    @functools.cached_property
    def evaluated(self) -> Shares:
        """How the shares of its family are evaluated."""
        return of_family(self.family)

    @functools.cached_property
    def _mask(self) -> Array:
        """Bytes of a record that it keeps: (itemsize,) uint8, 0 in fields that the family's rules name for others."""
        record: Any = families()[self.family].record
        found = np.full(record.itemsize, 255, dtype=np.uint8)
        for kind, start in (record.fields[field][:2] for field in self.evaluated.fields if field not in self.fields):
            found[start : start + kind.itemsize] = 0
        return found

    def taken(self, records: Array) -> Array:
        """Copies of its records among those of the family, with 0 in the fields of other shares."""
        return (bytes_of(records)[self._own] & self._mask).view(records.dtype)[:, 0]

    @functools.cached_property
    def _own(self) -> Array:
        """Its rows as an index array, which numpy need not convert."""
        return np.array(self.rows, dtype=np.intp)


def bytes_of(records: Array) -> Array:
    """Records as bytes, (n, itemsize) uint8: copied at once, where numpy goes through all fields of each."""
    return records.view(np.uint8).reshape(records.size, records.itemsize)


def of_family(name: str) -> Shares:
    """What a family says of the shares of its parts; nothing of what is no family's."""
    family = families().get(name)
    return (family.in_margins if family is not None else None) or Shares()


def is_held(family: Family) -> bool:
    """Whether records act on coordinates alone: those that are held take their torques in an equilibrium."""
    return family.coupling.through or isinstance(family.ends, OfCoordinates)


def unforced(model: Any) -> dict[str, Array]:
    """Arrays of a model without any force but those of constraints and weight."""
    found: dict[str, Array] = {}
    for family in families().values():
        own = of_family(family.name)
        if own.unforced is not None:
            found |= own.unforced(model)
        elif _is_removed(family):
            found[family.name] = zeros(family.name, 0)
    return found


def _is_removed(family: Family) -> bool:
    """Whether a mechanism without forces has no records of a family."""
    if family.of:
        return family.ends is not None and _is_removed(families()[family.of])
    own = of_family(family.name)
    return own.unforced is None and bool(own.rules)


def measured(model: Any) -> frozenset[int]:
    """Coordinates that records measure alone."""
    fields = {family: of_family(family.name).measured for family in families().values()}
    return frozenset(int(k) for family, field in fields.items() if field for k in family.records(model)[field])


def ties_of(model: Any) -> list[Tie]:
    """Coordinates that loops of cables tie to one another."""
    own = [(of_family(family.name).tie, family.records(model)) for family in families().values()]
    return [tie(row) for tie, rows in own if tie is not None for row in rows]


def has_elastic_parts(model: Any) -> bool:
    """Whether parts follow the coordinates by their stiffness: elastic parts, and points on springs."""
    found = [family for family in families().values() if family.records(model).size]
    if any(of_family(family.name).elastic is not None for family in found):
        return True
    held = any(_holds_points(family) for family in found)
    return held and bool(np.any(model.points["mass"] > 0.0))


def _holds_points(family: Family) -> bool:
    """Whether records hold points by a stiffness."""
    own = of_family(family.name)
    return own.contact is None and not is_held(family) and any(rule.stores for rule in own.rules)


def refuse_unsupported(assembly: Assembly, *, spins: bool) -> None:
    """Refuse, by name, parts whose forces are not evaluated along a coordinate.

    Parameters
    ----------
    spins : bool, whether everything turns steadily

    Raises
    ------
    InputError
    """
    for family in families().values():
        if not family.of and family.in_margins is None and family.records(assembly.model).size:
            raise InputError(
                f"{owner(assembly, family.name, 0)!r} is one of the {family.name.replace('_', ' ')}, which margins of "
                f"hinges and slides do not support; they support rigid and reduced bodies, points, beams, rods and "
                f"threads with joints, springs, motors, resistances and bearings of joints, "
                f"contacts, loads and fields, and wheels without a torque"
            )
    for name, part in assembly.parts.items():
        kind, k = assembly.names.get(name, ("", 0))
        refused = of_family(kind).refused
        why = "" if refused is None else refused(records(assembly.model, kind)[k], part, spins)
        if why:
            raise InputError(f"{name!r} {why}; take it out of the case for the margins of hinges and slides")


def coordinate_names(assembly: Assembly) -> list[str]:
    """Name of each motion between parts: its spring's, or the joint's that a part on it names."""
    found = [""] * motions_of(assembly.model).size
    for name, (kind, index) in assembly.names.items():
        if kind == motions():
            found[index] = name
    for name, (kind, index) in assembly.names.items():
        part, family = assembly.parts.get(name), families().get(kind)
        if part is None or family is None or not isinstance(family.ends, OfCoordinates):
            continue
        joints, fields = getattr(part, "joints", None) or [getattr(part, "joint", "")], family.ends.fields
        for i in range(len(joints) - len(fields) + 1):
            row = family.records(assembly.model)[index + i]
            for field, own in zip(fields, joints[i:], strict=False):
                found[int(row[field])] = found[int(row[field])] or str(own)
    return found


def _records_of(assembly: Assembly, family: Family) -> dict[str, tuple[int, ...]]:
    """Records of a family with shares, by the part that wrote them."""
    found: dict[str, tuple[int, ...]] = {}
    for k, row in enumerate(family.records(assembly.model)):
        name = owner(assembly, family.name, k)
        if name != family.name or name in assembly.names:
            found[name] = (*found.get(name, ()), k)
        elif any(_applies(rule, row) for rule in of_family(family.name).rules):
            raise InputError(f"the {name.replace('_', ' ')} of the system have no name, by which margins list them")
    return found


def _applies(rule: Rule, row: Any) -> bool:
    """Whether a record has a share."""
    if rule.fields and not any(row[field] != 0.0 for field in rule.fields):
        return False
    return rule.which is None or rule.which(row)


def shares_of(assembly: Assembly, parts: Any, evidence: str, *, spins: bool) -> list[Share]:
    """Shares of all parts with forces, and of the weight and the turn.

    Parameters
    ----------
    parts : mapping, name of a part or of a share -> `keys.MarginPart`
    evidence : of parts that have no own key
    spins : bool, whether everything turns steadily

    Raises
    ------
    InputError
        For a name that is no part's with a force.
    """
    found: list[Share] = []
    for family in sorted(families().values(), key=lambda family: of_family(family.name).place):
        rules, rows = of_family(family.name).rules, family.records(assembly.model)
        for name, own in (_records_of(assembly, family) if rules else {}).items():
            for rule in (rule for rule in rules if _applies(rule, rows[own[0]])):
                label = f"{name}.{rule.aspect}" if rule.aspect else name
                stores = rule.stores and not is_held(family)
                given = (family.name, own, rule.aspect, rule.fields, rule.rates, stores)
                found.append(Share(label, name, rule.category, evidence, "", *given))
    if np.any(assembly.model.info.gravity):
        found.append(Share(GRAVITY, "", INERTIA, evidence, ""))
    if spins:
        found.append(Share(SPIN, "", INERTIA, evidence, ""))
    return [with_keys(share, parts) for share in found]


def with_keys(share: Share, parts: Any) -> Share:
    """A share as the case's keys have it: those of the part, then those of the share."""
    for name in (share.part, share.label):
        keys = parts.get(name) if name else None
        if keys is not None:
            changes = {key: getattr(keys, key) for key in ("category", "evidence", "source") if getattr(keys, key)}
            share = dataclasses.replace(share, **changes)
    return share
