"""The papers behind the systems: their tables and figures (`evolvent figure`) and their claims (`evolvent claims`).

`ENTRIES` names the tables and figures; a function that makes one takes `Options` and returns a `Made`. The claims of a
paper (`CLAIMS_OF`) are data, each a `evolvent_papers.papers.ledger.Claim`.
"""

from __future__ import annotations

import dataclasses
import importlib
from collections.abc import Callable
from typing import TYPE_CHECKING, Literal

from evolvent_base.errors import InputError, nearest
from evolvent_papers.papers.rib_captions import CAPTIONS

if TYPE_CHECKING:
    from evolvent_base.figures import Figure

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
    function : str, module of `evolvent_papers.papers` and function that makes it, "rib.table_1"
    """

    kind: Literal["table", "figure"]
    paper: str
    title: str
    seconds: tuple[int, int]
    function: str

    def make(self, options: Options) -> Made:
        """Compute it."""
        module, _, name = self.function.partition(".")
        made: Made = getattr(importlib.import_module(f"evolvent_papers.papers.{module}"), name)(options)
        return made


def _entries(paper: str, *rows: tuple[str, int, int, str, str]) -> dict[str, Entry]:
    """Tables and figures by name: name within the paper, seconds in full and quick, function, title of each."""
    return {
        f"{paper}-{name}": Entry(
            kind="table" if ".table" in function else "figure", paper=CLAIMS_OF[paper], title=title,
            seconds=(full, quick), function=function,
        )
        for name, full, quick, function, title in rows
    }  # fmt: skip


#: Tables and figures of the paper on the reeled thread.
THREAD: dict[str, Entry] = _entries(
    "thread",
    ("figure-2-1", 2, 2, "thread_schematics.figure_2_1", "schematic: unwinding from the spool"),
    ("figure-3-1", 2, 2, "thread_schematics.figure_3_1", "schematic: nodes of the model"),
    ("figure-3-2", 2, 2, "thread_schematics.figure_3_2", "schematic: the boundary node"),
    ("figure-3-3", 8, 8, "thread_spool_node.figure_3_3", "eqs. (3, 4) on the boundary node, no external forces"),
    ("figure-3-4", 8, 8, "thread_spool_node.figure_3_4", "eqs. (7, 8) on the boundary node, no external forces"),
    ("figure-4-1", 2, 2, "thread_schematics.figure_4_1", "schematic: sail with two blades, lag of a node"),
    ("figure-4-2", 45, 10, "thread.figure_4_2", "rate of the body: 14 runs and eq. (18) for each"),
    ("figure-4-3", 45, 10, "thread.figure_4_3", "lag of the tip, n = 20 and 40, seven dampings"),
    ("figure-4-4", 60, 8, "thread.figure_4_4", "lag of the tip, c = 1e7, 1e8 and 1e9 N/m"),
    ("soft", 6, 6, "thread.soft", "ours: lag of the tip, c = 1e2, 1e3 and 1e4 N/m, beside figure IV.4"),
    ("strip-payout", 30, 15, "thread_strip.figure",
     "ours: largest pay-out rate of a strip before it buckles in its plane, and its lag beside the thread"),
    ("spool-node-map", 160, 12, "thread_spool_node.node_map",
     "ours: distance from the plane by eqs. (3, 4), over c, d and nodes a turn, beside figure III.3"),
    ("table-4-1", 1, 1, "thread.table_4_1", "data of the deployment, and what they imply for the film"),
)  # fmt: skip

#: Tables and figures of the paper on the wrapped rib.
RIB: dict[str, Entry] = _entries(
    "rib",
    *((f"figure-{k}", 1, 1, f"rib_schematics.figure_{k}", f"schematic: {CAPTIONS[k]}") for k in range(1, 6)),
    ("figure-6", 3, 2, "rib_figures.figure_6", f"{CAPTIONS[6]} (our torque and damping)"),
    ("figure-7", 12, 5, "rib_figures.figure_7", f"{CAPTIONS[7]} (our torque)"),
    ("figure-8", 12, 5, "rib_figures.figure_8", f"{CAPTIONS[8]} (our torque and damping)"),
    ("figure-9", 12, 5, "rib_figures.figure_9", f"{CAPTIONS[9]} (our torque)"),
    ("root-damping", 10, 5, "rib_figures.root_damping", "ours: damping in the first element or hinge alone"),
    ("deployment-damping", 40, 20, "rib_deployment.figure", "ours: hinge dampers while the rib deploys"),
    ("points-at-rest", 3, 2, "rib_figures.points_at_rest", "ours: wound rib at rest, gaps of the contact points"),
    ("table-1", 240, 30, "rib.table_1",
     "CPU time of two methods (caption translated by us): implicit and explicit, two models, error over the step"),
    ("figure-10", 60, 20, "rib.figure_10", f"{CAPTIONS[10]} (our torque, a chain of links in place of LS-DYNA)"),
)  # fmt: skip

#: Tables and figures of the paper on the inertia stand.
STAND: dict[str, Entry] = _entries(
    "stand",
    ("figure-1", 1, 1, "stand_schematic.figure_1", "schematic of the stand (axes of rotation: ours)"),
    ("figure-2", 8, 4, "stand.figure_2", "distribution of the energy over the modes (our reading: bars, offsets)"),
    ("figure-3", 8, 4, "stand.figure_3", "amplitudes by modes and numbers of the springs (our reading: bars, offsets)"),
    ("figure-4", 2, 2, "stand.figure_4", "surface of the least energies of the modes, 999 offsets"),
    ("figure-5", 5, 3, "stand.figure_5", "two frequencies over the x offset"),
    ("energies", 8, 4, "stand.energies", "ours: energies of the three modes over the offset"),
    ("amplitudes", 8, 4, "stand.amplitudes", "ours: amplitudes of each mode at each spring over the offset"),
    ("pulls", 4, 4, "stand_pulls.figure", "ours: least energies with pulls at two springs, at a point, in two records"),
    ("prony", 60, 8, "stand_prony.figure_prony",
     "ours: frequencies and decrements by Prony's method and VARPRO: errors over rate, number of samples, noise"),
    ("error", 15, 6, "stand_error.table_error",
     "ours: where the error of the identified moments comes from: time step, Prony's method, static tilt"),
)  # fmt: skip

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
