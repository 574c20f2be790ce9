"""The papers behind the systems: their tables and figures (`evolvent figure`) and their claims (`evolvent claims`).

`ENTRIES` names the tables and figures; a function that makes one takes `Options` and returns a `Made`. The claims of a
paper (`CLAIMS_OF`) are data, each a `evolvent.papers.ledger.Claim`.
"""

from __future__ import annotations

import dataclasses
import importlib
from collections.abc import Callable
from typing import TYPE_CHECKING, Literal

from evolvent.base.errors import InputError, nearest

if TYPE_CHECKING:
    from evolvent.results.figures import Figure

TENENBAUM = "Tenenbaum (2014)"
YI = "Yi, Yuan, Dong & Li (2017)"
BELYAKOV = "Belyakov (2002)"

#: Name of a paper in `evolvent claims` -> the paper.
CLAIMS_OF = {"thread": TENENBAUM, "rib": YI, "stand": BELYAKOV}


def silent(sentence: str) -> None:
    """Report nothing."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Options:
    """How a table or a figure is computed.

    Attributes
    ----------
    quick : bool, fewer runs, and a reference of longer steps
    report : called with a sentence on the progress
    """

    quick: bool = False
    report: Callable[[str], None] = silent


@dataclasses.dataclass(frozen=True, kw_only=True)
class Made:
    """A table or a figure that was computed.

    Attributes
    ----------
    text : str, Markdown
    figure : Figure, None of a table
    complete : bool, False where the computation was interrupted
    """

    text: str
    figure: Figure | None = None
    complete: bool = True


@dataclasses.dataclass(frozen=True, kw_only=True)
class Entry:
    """One table or figure.

    Attributes
    ----------
    kind : what is kept in a file: a table as Markdown, a figure as a picture
    paper, title : str
    seconds : (2,) int, expected CPU time, in full and of the quick form
    function : str, module of `evolvent.papers` and function that makes it, "rib.table_1"
    """

    kind: Literal["table", "figure"]
    paper: str
    title: str
    seconds: tuple[int, int]
    function: str

    def make(self, options: Options) -> Made:
        """Compute it."""
        module, _, name = self.function.partition(".")
        made: Made = getattr(importlib.import_module(f"evolvent.papers.{module}"), name)(options)
        return made


#: Tables and figures of the paper on the reeled thread.
THREAD: dict[str, Entry] = {
    **{
        f"thread-{name}": Entry(
            kind="figure", paper=TENENBAUM, title=title, seconds=(full, quick), function=f"{module}.{function}"
        )
        for name, title, full, quick, module, function in (
            ("figure-2-1", "schematic: unwinding from the spool", 2, 2, "thread_schematics", "figure_2_1"),
            ("figure-3-1", "schematic: nodes of the model", 2, 2, "thread_schematics", "figure_3_1"),
            ("figure-3-2", "schematic: the boundary node", 2, 2, "thread_schematics", "figure_3_2"),
            ("figure-3-3", "eqs. (3, 4) on the boundary node, no external forces", 5, 5, "thread", "figure_3_3"),
            ("figure-3-4", "eqs. (7, 8) on the boundary node, no external forces", 5, 5, "thread", "figure_3_4"),
            ("figure-4-1", "schematic: sail with two blades, lag of a node", 2, 2, "thread_schematics", "figure_4_1"),
            ("figure-4-2", "rate of the body: 14 runs and eq. (18) for each", 45, 10, "thread", "figure_4_2"),
            ("figure-4-3", "lag of the tip, n = 20 and 40, seven dampings", 45, 10, "thread", "figure_4_3"),
            ("figure-4-4", "lag of the tip, c = 1e7, 1e8 and 1e9 N/m", 60, 8, "thread", "figure_4_4"),
            ("soft", "ours: lag of the tip, c = 1e2, 1e3 and 1e4 N/m, beside figure IV.4", 6, 6, "thread", "soft"),
        )
    },
    "thread-table-4-1": Entry(
        kind="table",
        paper=TENENBAUM,
        title="data of the deployment, and what they imply for the film",
        seconds=(1, 1),
        function="thread.table_4_1",
    ),
}

#: Tables and figures of the paper on the wrapped rib.
RIB: dict[str, Entry] = {
    **{
        f"rib-figure-{number}": Entry(
            kind="figure", paper=YI, title=title, seconds=(1, 1), function=f"rib_schematics.figure_{number}"
        )
        for number, title in {
            1: "schematic: antenna folded in orbit, ribs wound on the hub",
            2: "schematic: wrapping process",
            3: "schematic: spatial ANCF beam element with the vectors of its nodes",
            4: "schematic: detection of contact between rib and hub",
            5: "schematic: initial state of rib and hub",
        }.items()
    },
    **{
        f"rib-{name}": Entry(kind="figure", paper=YI, title=title, seconds=seconds, function=f"rib_figures.{function}")
        for name, title, seconds, function in (
            ("figure-6", "winding of a rib: shapes in time (our torque and damping)", (3, 2), "figure_6"),
            ("figure-7", "winding of a rib: tip speed for three mass dampings", (12, 5), "figure_7"),
            (
                "figure-8",
                "winding of a rib: points that touch the hub (our torque and damping)",
                (12, 5),
                "figure_8",
            ),
            ("figure-9", "winding of a rib: contact force for three mass dampings", (12, 5), "figure_9"),
            (
                "root-damping",
                "ours: damping in the first element or hinge alone",
                (10, 5),
                "root_damping",
            ),
            ("points-at-rest", "ours: wound rib at rest, gaps of the contact points", (3, 2), "points_at_rest"),
        )
    },
    "rib-table-1": Entry(
        kind="table",
        paper=YI,
        title="winding of a rib, a = 0: CPU time and error over the step, implicit and explicit, two models",
        seconds=(240, 30),
        function="rib.table_1",
    ),
    "rib-figure-10": Entry(
        kind="figure",
        paper=YI,
        title="winding of a rib, a = 0: tip speed by two methods, implicit and a chain by central differences",
        seconds=(60, 20),
        function="rib.figure_10",
    ),
}

#: Tables and figures of the paper on the inertia stand.
STAND: dict[str, Entry] = {
    "stand-figure-1": Entry(
        kind="figure",
        paper=BELYAKOV,
        title="schematic of the stand (axes of rotation: ours)",
        seconds=(1, 1),
        function="stand_schematic.figure_1",
    ),
    "stand-figure-2": Entry(
        kind="figure",
        paper=BELYAKOV,
        title="distribution of the energy over the modes (our reading: bars, offsets)",
        seconds=(8, 4),
        function="stand.figure_2",
    ),
    "stand-figure-3": Entry(
        kind="figure",
        paper=BELYAKOV,
        title="amplitudes by modes and numbers of the springs (our reading: bars, offsets)",
        seconds=(8, 4),
        function="stand.figure_3",
    ),
    "stand-figure-4": Entry(
        kind="figure",
        paper=BELYAKOV,
        title="surface of the least energies of the modes, 999 offsets",
        seconds=(2, 2),
        function="stand.figure_4",
    ),
    "stand-figure-5": Entry(
        kind="figure",
        paper=BELYAKOV,
        title="two frequencies over the x offset",
        seconds=(5, 3),
        function="stand.figure_5",
    ),
    "stand-energies": Entry(
        kind="figure",
        paper=BELYAKOV,
        title="ours: energies of the three modes over the offset",
        seconds=(8, 4),
        function="stand.energies",
    ),
    "stand-amplitudes": Entry(
        kind="figure",
        paper=BELYAKOV,
        title="ours: amplitudes of each mode at each spring over the offset",
        seconds=(8, 4),
        function="stand.amplitudes",
    ),
    "stand-prony": Entry(
        kind="figure",
        paper=BELYAKOV,
        title="ours: accuracy of Prony's method over samples per period, number of samples, noise; VARPRO compared",
        seconds=(40, 6),
        function="stand_prony.figure_prony",
    ),
    "stand-error": Entry(
        kind="table",
        paper=BELYAKOV,
        title="ours: where the error of the identified moments comes from: time step, Prony's method, static tilt",
        seconds=(15, 6),
        function="stand_error.table_error",
    ),
}

ENTRIES: dict[str, Entry] = {**THREAD, **RIB, **STAND}


def entry(name: str) -> Entry:
    """The table or figure of a name.

    Raises
    ------
    InputError
        If there is none.
    """
    if name not in ENTRIES:
        raise InputError(f"no table or figure is called {name!r}; {nearest(name, ['list', *ENTRIES])}")
    return ENTRIES[name]
