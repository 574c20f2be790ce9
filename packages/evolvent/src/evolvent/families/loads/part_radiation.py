"""Radiation pressure of sunlight on panels of bodies, on shells and on strips."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from evolvent.assembly.builder import Builder
from evolvent.families.loads.part_rows import add_load, add_rod_loads, refuse_ground, spread_of, window
from evolvent.kernels import loads as kernels, markers
from evolvent.parts.applies import Applies, given, left_out, refuse_unfit
from evolvent.parts.base import Group, Part, PointReference, Reference, unit
from evolvent_base import units
from evolvent_base.errors import InputError, nearest


class Radiation(Part):
    """Radiation pressure of sunlight on a flat panel of a body, a shell, or a blade: a strip that is a rod or a thread.

    Parameters
    ----------
    at : point, optional
        Centre of the panel, a point of a body.
    along : str, optional
        In place of a panel: the rod, y of whose section is the normal of the strip at each node, or the thread, whose
        chord keeps the direction of the spool's axis.
    over : str, optional
        In place of a panel: the shell, whose nodes are panels with the area for which they stand, across their normals.
    area : float, m^2, optional
        Of one side of the panel.
    normal : (3,) float, optional
        Of the panel, body axes.
    width : float, m, optional
        Chord of the blade, across the thread's tangent; of a rod, if left out, the extent of its section along z.
    pressure : float, Pa
        Of light that is wholly absorbed at normal incidence (4.56e-6 at one astronomical unit).
    direction : (3,) float
        In which the light travels, inertial axes.
    specular, diffuse : float
        Fractions that are reflected specularly (1 is a mirror) and diffusely (Lambert); the rest is absorbed.
    specular_bottom, diffuse_bottom : float, optional
        Of the side of a panel, a rod or a shell from which its normal points; as those of the other side if left out.
    start : float, s
        When the light begins; on a thread it acts at all times.
    until : float, s, optional
        When it ends; never if left out.
    ramp : float, s
        Over which it grows smoothly; in statics it has grown.

    Notes
    -----
    F = p A a [(1 - specular) s + (2 specular a + 2/3 diffuse) m], with the direction s of the light, the magnitude a of
    the cosine of its angle to the normal, and the normal m on the shaded side (McInnes, Solar Sailing, 1999). The force
    per length of a blade has the width in place of the area. On a rod it acts at each node on the length that the node
    represents, as a `Load` along it does, and on a shell on the area of each node. Shadows of other parts are not
    modelled.
    """

    applies: ClassVar[Applies] = {
        "at": (left_out("along", "over"),),
        "along": (left_out("at", "over"),),
        "over": (left_out("at", "along"),),
        "area": (given("at"),),
        "normal": (given("at"),),
        "width": (given("along"),),
    }
    kind: Literal["radiation"] = "radiation"
    group = Group.LOADS
    symbol = "panel"
    at: PointReference | None = None
    along: Annotated[str, Reference(what="a rod or a thread")] | None = None
    over: Annotated[str, Reference(what="a surface")] | None = None
    area: units.Area | None = None
    normal: units.Direction | None = None
    width: units.LengthOrZero | None = None
    pressure: units.PressureOrZero
    direction: units.Direction = (0.0, 0.0, 1.0)
    specular: units.Fraction = 0.0
    diffuse: units.Fraction = 0.0
    specular_bottom: units.Fraction | None = None
    diffuse_bottom: units.Fraction | None = None
    start: units.Time = 0.0
    until: units.Time | None = None
    ramp: units.DurationOrZero = 0.0

    def write(self, builder: Builder, name: str) -> None:
        """Write the load into the family `loads`, on a rod or a shell as light on a panel at each node."""
        refuse_unfit(name, self)
        optics = self._optics
        for side, total in (("", optics[0] + optics[1]), ("_bottom", optics[2] + optics[3])):
            if total > 1.0 + 1e-12:
                raise InputError(
                    f"{name}.specular{side} and {name}.diffuse{side} add up to {total:g}; they share at most 1"
                )
        if self.at is not None:
            self._write_panel(builder, name)
        elif self.along is not None:
            self._write_blade(builder, name)
        elif self.over is not None:
            self._write_surface(builder, name)
        else:
            raise InputError(f"{name}.at is missing; give at, along or over")

    @property
    def _optics(self) -> list[float]:
        """Fractions that both sides reflect specularly and diffusely, of the top first."""
        below = self.specular_bottom, self.diffuse_bottom
        top = [self.specular, self.diffuse]
        return top + [same if own is None else own for own, same in zip(below, top, strict=True)]

    def _write_surface(self, builder: Builder, name: str) -> None:
        """Write light on the nodes of a surface."""
        over = str(self.over)
        spread = spread_of(builder, over)
        if spread is None or not spread.surface:
            known = [n for n in builder.specs if (found := spread_of(builder, n)) is not None and found.surface]
            raise InputError(f"{name}.over is {over!r}; it must be a surface; {nearest(over, known)}")
        light, index = self.pressure * unit(self.direction), len(builder.rows["loads"])
        rest = [0.0, *window(builder, name, self), 0.0, 0.0, 1.0, *self._optics]
        for node, share in zip(spread.nodes, spread.shares, strict=True):
            target = builder.marker(f"{over}[{node}]", f"{name}.over")
            add_load(builder, kernels.PANEL, target, [*(share * light), *rest])
        builder.names[name] = ("loads", index)

    def _write_panel(self, builder: Builder, name: str) -> None:
        """Write light on a panel."""
        if self.area is None or self.normal is None:
            raise InputError(f"{name}.{'area' if self.area is None else 'normal'} is missing; a panel needs it")
        target = builder.marker(self.at, f"{name}.at")
        if builder.rows["markers"][target]["kind"] != markers.ON_BODY:
            raise InputError(f"{name}.at is {self.at!r}; this load needs a body")
        refuse_ground(builder, name, self.at, target)
        light, times = self.pressure * self.area * unit(self.direction), window(builder, name, self)
        values = [*light, 0.0, *times, *unit(self.normal), *self._optics]
        builder.names[name] = ("loads", add_load(builder, kernels.PANEL, target, values))

    def _write_blade(self, builder: Builder, name: str) -> None:
        """Write light on a strip."""
        optics, width, along = self._optics, self.width, str(self.along)
        family, thread = builder.names.get(along, ("", -1))
        if family not in ("rods", "threads"):
            known = [n for n, (of, _) in builder.names.items() if of in ("rods", "threads")]
            raise InputError(f"{name}.along is {along!r}; it must be a rod or a thread; {nearest(along, known)}")
        if family == "rods" and width is None:
            sides = builder.specs[along].section.sides
            width = None if sides is None else sides[1]
        if width is None:
            which = "a thread" if family == "threads" else "a rod whose section has none"
            raise InputError(f"{name}.width is missing; {along!r} is {which}; give it, such as '10 cm'")
        light = self.pressure * width * unit(self.direction)
        if family == "rods":
            rest = [*window(builder, name, self), 0.0, 1.0, 0.0, *optics]
            add_rod_loads(builder, name, kernels.PANEL, along, light, rest)
            return
        if optics[:2] != optics[2:]:
            below = "specular_bottom" if self.specular_bottom is not None else "diffuse_bottom"
            raise InputError(f"{name}.{below} is given, but {along!r} is a thread, whose sides are alike")
        key = next((key for key in ("start", "until", "ramp") if getattr(self, key)), None)
        if key is not None:
            raise InputError(f"{name}.{key} is given, but light on a thread, {along!r}, acts at all times")
        builder.names[name] = ("loads", add_load(builder, kernels.RADIATION, thread, [*light, *optics[:2]]))
