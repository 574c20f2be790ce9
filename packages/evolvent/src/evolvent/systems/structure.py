"""Structure: any system of parts, written as a case. Its key `parts` holds what `evolvent.parts` has, by name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from evolvent import cases
from evolvent.analysis.definition import SystemDefinition
from evolvent.analysis.margins.keys import Margin
from evolvent.analysis.reflector_keys import ReflectorKeys
from evolvent.analysis.start_motion import Spins, StartMotion
from evolvent.analysis.start_state import KEY as START
from evolvent.analysis.storage import Store, storage_of
from evolvent.analysis.system import System
from evolvent.parts.registry import PartsByName
from evolvent.solvers.time.explicit import methods as explicit_methods
from evolvent.solvers.time.implicit import methods as implicit_method
from evolvent_base import units
from evolvent_base.figures import Number
from evolvent_base.file_keys import FileKey
from evolvent_base.schema import Section

if TYPE_CHECKING:
    from evolvent.analysis.system import System

    MethodName = str
else:
    MethodName = Literal[("auto", *implicit_method.METHODS, *reversed(explicit_methods.METHODS))]


class Simulate(Section):
    """How the motion is integrated, and what is kept of it."""

    until: units.Duration = Field(description="end of the run")
    every: units.Duration | None = Field(None, description="time between samples; left out, a 400th of the run")
    fine: bool = Field(True, description="whether finer samples are kept where the motion is fast")
    method: MethodName = Field(
        "auto", description="auto chooses from the parts; the results say which method it is, and why"
    )
    step: units.Duration | None = Field(None, description="of a method with fixed steps; chosen if left out")
    tolerance: units.Tolerance | None = Field(None, description="of an adaptive method")
    absolute_tolerance: units.Tolerance | None = Field(
        None, description="of dopri5, in addition to tolerance; a hundredth of it if left out"
    )
    spectral_radius: units.Fraction | None = Field(None, description="of implicit methods, at infinite frequency")

    def settings(self) -> dict[str, Any]:
        """Arguments of `System.simulate`."""
        return self.model_dump(exclude_none=True)


class Equilibrium(Section):
    """How the equilibrium is found, of ``evolvent equilibrium`` and ``evolvent modes``."""

    time: units.DurationOrZero = Field(0.0, description="at which loads and drives are evaluated")
    rotating: units.AngularVelocity | None = Field(None, description="steady turn of everything, inertial axes")
    load_steps: Annotated[int, units.Whole(least=1, most=10_000)] | None = Field(
        None, description="equal steps of the load factor on whose equilibria the path lands"
    )
    relaxed: bool = Field(
        False,
        description="whether viscoelastic parts have relaxed whole; if not, they answer at once, from the strains that "
        "storage has left",
    )


class ModesSection(Section):
    """Which modes are found, of ``evolvent modes``."""

    count: Annotated[int, units.Whole(least=1, most=10_000)] = 10
    damped: bool = Field(False, description="whether dampers and viscoelastic losses count")


class StructureCase(Section):
    """A case of the system `structure`."""

    system: Literal["structure"] = "structure"
    title: str = Field("", description="title of figures")
    gravity: units.Acceleration = Field((0.0, 0.0, 0.0), description="acts on every mass, inertial axes")
    spin: Spins = Field((), description="rotation of the whole, or of parts, at the start, beside their own velocities")
    velocity: units.Velocity = Field((0.0, 0.0, 0.0), description="of the whole at the start, inertial axes")
    start: Annotated[str, FileKey(endings=(".nc",))] = Field(
        "", description="saved run of the same parts, from whose end this one starts"
    )
    parts: PartsByName
    store: Store | None = None
    simulate: Simulate | None = None
    equilibrium: Equilibrium = Equilibrium()
    modes: ModesSection = ModesSection()
    margin: Margin | None = None
    reflector: ReflectorKeys | None = None
    limits: tuple[str, ...] = Field(
        (), description='bounds on results, "hinge 1.torque.abs_max <= 2 N m", of runs, dispersions and designs'
    )


class Structure(SystemDefinition):
    """Any system of parts."""

    Case = StructureCase
    start_key = START

    def build(self, case: StructureCase, *, laws: Mapping[str, Any] | None = None) -> System:
        """The parts of a case."""
        sections: dict[str, Any] = {}
        if case.store is not None:
            sections["store"] = case.store.model_dump(exclude_defaults=True)
        sections |= StartMotion(spin=case.spin, velocity=case.velocity).written()
        if case.start:
            sections[START] = case.start
        system = System(gravity=case.gravity, title=case.title, sections=sections)
        for name, part in case.parts.items():
            system.add(part, name)
        return system

    def settings(self, case: StructureCase) -> dict[str, Any]:
        """How a case is run; empty where it says nothing of it."""
        return {} if case.simulate is None else case.simulate.settings()

    def sections(self, case: StructureCase) -> dict[str, Any]:
        """The sections of analyses of a case, where it says something of them."""
        given = case.model_dump(mode="json", exclude_defaults=True)
        kept = (START, "store", "equilibrium", "modes", "margin", "reflector", "limits")
        moves = StartMotion(spin=case.spin, velocity=case.velocity).written()
        return {name: given[name] for name in kept if name in given} | moves

    def numbers(self, run: Any) -> list[Number]:
        """Rows of the table on the screen, and the storage that the run follows."""
        section = storage_of(cases.content_of_run(run))
        stored = [] if section is None else [Number(label="stored before", value=section.shown)]
        return [*super().numbers(run), *stored]

    def unstored(self, case: StructureCase) -> StructureCase:
        """A case without the section `store`."""
        return case if case.store is None else case.replaced(store=None)


SYSTEM = Structure()
