"""Kinds of parts in groups, in the order in which a structure is built up."""

from __future__ import annotations

from collections.abc import Iterator

from evolvent.parts.registry import kinds

#: Groups of the kinds that are built in.
GROUPS: dict[str, tuple[str, ...]] = {
    "bodies, beams and threads": ("rigid-body", "reduced-body", "point", "beam", "rod", "reel", "thread"),
    "joints": ("joint",),
    "springs and resistances": ("spring", "joint-spring", "resistance", "bearing"),
    "motors, control and events": ("motor", "reaction-wheel", "thruster", "attitude-controller", "event"),
    "contact": ("contact",),
    "loads and fields": ("load", "field", "radiation", "magnetic-torque", "thermal-load", "custom-force"),
}  # fmt: skip
#: The group of kinds that other packages add.
OTHERS = "of other packages"


def grouped() -> Iterator[tuple[str, list[str]]]:
    """Groups, and the kinds of each that there are."""
    known = kinds()
    for name, members in GROUPS.items():
        yield name, [kind for kind in members if kind in known]
    others = sorted(set(known) - {kind for members in GROUPS.values() for kind in members})
    if others:
        yield OTHERS, others
