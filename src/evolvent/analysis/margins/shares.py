"""What each part gives to a coordinate: the shares of a mechanism, and the category of each by the part's kind."""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple

import numpy as np

from evolvent.analysis.margins import factors as of
from evolvent.assembly import families
from evolvent.assembly.assembled import Assembly
from evolvent.base.errors import InputError
from evolvent.kernels import resistance
from evolvent.kernels.drive import FREE
from evolvent.model.family import families as family_table

Array = np.ndarray


class Rule(NamedTuple):
    """Where the records of a family stand in the tables.

    Attributes
    ----------
    category : str
    aspect : str, name of the share after that of the part, '' for the part as a whole
    fields : fields that a record keeps of those in `OWN`, or `OF_LINES`; the others are 0
    of_kind : int, of the records to which it applies; None for all
    rates : bool, of the forces of velocities alone, or (False) of those without any; None for both
    """

    category: str
    aspect: str = ""
    fields: tuple[str, ...] = ()
    of_kind: int | None = None
    rates: bool | None = None


#: Shares of a motor beside its torque.
MAGNETIC, GEAR, EDDY = "magnetic", "gear", "eddy"
#: Shares of a contact.
NORMAL, RUBS = "normal", "friction"
#: Shares of a harness.
CURVE, HYSTERESIS = "elastic", "hysteresis"
#: Families of contacts.
CONTACT_FAMILIES = ("contact_surfaces", "body_contacts")
#: Fields of a coordinate's record that make a torque.
OWN = ("stiffness", "damping", "friction", "stop", "latch_stiffness", "latch_damping")
#: Fields of the records of springs and cables that make a force.
OF_LINES = {
    "springs": ("stiffness", "damping", "lateral_stiffness", "lateral_damping", "law"),
    "synchronizations": ("stiffness", "damping"),
}
#: Category of each family of parts with forces. A new kind of part that resists is a row here. What stores energy helps
#: or resists, what takes it always resists: they are shares of their own, or one would cancel the other before the
#: factors.
RULES: dict[str, tuple[Rule, ...]] = {
    "coordinates": (
        Rule(of.SPRING, "stiffness", ("stiffness",)),
        Rule(of.DAMPING, "damping", ("damping",)),
        Rule(of.FRICTION, "friction", ("friction",)),
        Rule(of.SPRING, "stop", ("stop",)),
        Rule(of.SPRING, "latch", ("latch_stiffness",)),
        Rule(of.DAMPING, "latch_damping", ("latch_damping",)),
    ),
    "springs": (
        Rule(of.SPRING, "", ("stiffness", "law"), rates=False),
        Rule(of.SPRING, "law_of_rate", ("law",), rates=True),
        Rule(of.DAMPING, "damping", ("damping", "lateral_damping")),
        Rule(of.SPRING, "lateral", ("lateral_stiffness",)),
    ),
    "custom_forces": (Rule(of.LOAD),),
    "synchronizations": (Rule(of.SPRING, "", ("stiffness",)), Rule(of.DAMPING, "damping", ("damping",))),
    "motors": (Rule(of.MOTOR),),
    "drivetrains": (
        Rule(of.MOTOR_LOSSES, MAGNETIC),
        Rule(of.FRICTION, GEAR),
        Rule(of.DAMPING, EDDY),
    ),
    "resistances": (
        Rule(of.HARNESS, CURVE, of_kind=resistance.HARNESS),
        Rule(of.HARNESS, HYSTERESIS, of_kind=resistance.HARNESS),
        Rule(of.SPRING, of_kind=resistance.TAPE_SPRING),
        Rule(of.ADHESION, of_kind=resistance.ADHESION),
    ),
    "bearings": (Rule(of.FRICTION),),
    **dict.fromkeys(CONTACT_FAMILIES, (Rule(of.SPRING, NORMAL), Rule(of.FRICTION, RUBS, ("friction",)))),
    "beams": (Rule(of.ELASTIC),),
    "rods": (Rule(of.ELASTIC),),
    "threads": (Rule(of.ELASTIC),),
    "reduced_bodies": (Rule(of.ELASTIC),),
    "loads": (Rule(of.LOAD),),
    "thrusters": (Rule(of.LOAD),),
    "beam_loads": (Rule(of.LOAD),),
    "fields": (Rule(of.INERTIA),),
}
#: Families of elastic parts, one record each, whose forces are those of the equilibrium (`elastic`).
ELASTIC_FAMILIES = ("beams", "rods", "threads", "reduced_bodies")
#: Families that hold or carry and make no force of their own along a motion that the constraints allow.
_WITHOUT_FORCE = (
    "bodies",
    "points",
    "joints",
    "links",
    "guides",
    "events",
    "thermal_loads",
    "wheels",
)
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
    aspect, fields, rates : as of `Rule`
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


def refuse_unsupported(assembly: Assembly, *, spins: bool) -> None:
    """Refuse, by name, parts whose forces are not evaluated along a coordinate.

    Parameters
    ----------
    spins : bool, whether everything turns steadily

    Raises
    ------
    InputError
    """
    for name in (family.name for family in family_table().values() if not family.of):
        if name not in RULES and name not in _WITHOUT_FORCE and families.records(assembly.model, name).size:
            who = families.owner(assembly, name, 0)
            raise InputError(
                f"{who!r} is one of the {name.replace('_', ' ')}, which margins of hinges and slides do not support; "
                f"they support rigid and reduced bodies, points, beams, rods and threads with joints, gears, springs, "
                f"synchronizations, motors, resistances and bearings of joints, contacts, loads and fields, and wheels "
                f"without a torque"
            )
    for name, part in assembly.parts.items():
        why = _refused(assembly, name, part, spins=spins)
        if why:
            raise InputError(f"{name!r} {why}; take it out of the case for the margins of hinges and slides")


def _refused(assembly: Assembly, name: str, part: Any, *, spins: bool) -> str:
    """Why a thread or a wheel has no place in the tables, '' of one that has."""
    family, k = assembly.names.get(name, ("", 0))
    if family == "threads":
        row = assembly.model.threads[k]
        if row["drive"] == FREE:
            return "leaves a free spool, which stands at no length of its own"
        return "stands for several threads" if row["copies"] != 1 else ""
    if family != "wheels":
        return ""
    row = assembly.model.wheels[k]
    turns = row["torque"] != 0.0 or row["profile"] >= 0 or row["law"] != 0
    rubs = part.rate != 0.0 and (row["viscous"] != 0.0 or row["friction"] != 0.0)
    if turns or rubs:
        return "is a wheel with a motor or with friction, which turns its body"
    return "is a wheel in a steady turn, which it resists by its momentum" if spins else ""


def coordinate_names(assembly: Assembly) -> list[str]:
    """Name of each row of the family `coordinates`: its spring's, or the joint's that a part on it names."""
    found = [""] * assembly.model.coordinates.size
    for name, (family, index) in assembly.names.items():
        if family == "coordinates":
            found[index] = name
    for name, (family, index) in assembly.names.items():
        part = assembly.parts.get(name)
        if family in ("motors", "resistances") and part is not None:
            k = int(families.records(assembly.model, family)["coordinate"][index])
            found[k] = found[k] or str(part.joint)
        if family == "synchronizations" and part is not None:
            for i, joint in enumerate(part.joints[:-1]):
                rows = assembly.model.synchronizations[index + i]
                for k, own in ((int(rows["a"]), joint), (int(rows["b"]), part.joints[i + 1])):
                    found[k] = found[k] or str(own)
    return found


def _records_of(assembly: Assembly, family: str) -> dict[str, tuple[int, ...]]:
    """Records of a family by the part that wrote them: a part's stand together, named by the first.

    Coordinates have one record each; one that a motor gave its joint makes no torque and has no name.
    """
    firsts = sorted((index, name) for name, (of_, index) in assembly.names.items() if of_ == family)
    if family == "coordinates":
        return {name: (index,) for index, name in firsts}
    size = families.records(assembly.model, family).size
    if not size:
        return {}
    if family == "drivetrains":
        return {families.owner(assembly, family, k): (k,) for k in range(size)}
    if not firsts or firsts[0][0] != 0:
        raise InputError(f"the {family.replace('_', ' ')} of the system have no name, by which margins list them")
    ends = [*(index for index, _ in firsts[1:]), size]
    return {name: tuple(range(index, end)) for (index, name), end in zip(firsts, ends, strict=True)}


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
    for family, rules in RULES.items():
        rows = _records_of(assembly, family)
        for name, own in rows.items():
            for rule in rules:
                records = families.records(assembly.model, family)
                if rule.fields and not any(records[field][own[0]] != 0.0 for field in rule.fields):
                    continue
                if rule.of_kind is not None and records["kind"][own[0]] != rule.of_kind:
                    continue
                if rule.aspect == HYSTERESIS and records["first"][own[0]] == records["last"][own[0]]:
                    continue
                label = f"{name}.{rule.aspect}" if rule.aspect else name
                given = (rule.category, evidence, "", family, own, rule.aspect, rule.fields, rule.rates)
                found.append(Share(label, name, *given))
    if np.any(assembly.model.info.gravity):
        found.append(Share(GRAVITY, "", of.INERTIA, evidence, ""))
    if spins:
        found.append(Share(SPIN, "", of.INERTIA, evidence, ""))
    return [with_keys(share, parts) for share in found]


def with_keys(share: Share, parts: Any) -> Share:
    """A share as the case's keys have it: those of the part, then those of the share."""
    for name in (share.part, share.label):
        keys = parts.get(name) if name else None
        if keys is not None:
            changes = {key: getattr(keys, key) for key in ("category", "evidence", "source") if getattr(keys, key)}
            share = dataclasses.replace(share, **changes)
    return share
