"""Why an implicit run ended before its end: what happened, where, when, and what to try."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from evolvent.algebra.sparse import SparseBlocks
from evolvent.assembly.assembled import Assembly
from evolvent.assembly.blocks import owner_of
from evolvent.assembly.families import owner, row_owner
from evolvent.kernels.blocks import block_at
from evolvent.model.registry import asked
from evolvent.solvers.common import balance as eb
from evolvent.solvers.common.hints import hints_on, without_normal
from evolvent.solvers.common.laws import broken_law, large_law, states_energy, what_may_jump
from evolvent.solvers.common.redundancy import redundant
from evolvent.solvers.time.implicit.workspace import GAINED, NO_CONVERGENCE, NOT_FINITE, REDUNDANT, SINGULAR, Workspace
from evolvent.solvers.time.messages import far_from_origin
from evolvent.solvers.time.pace import Stall
from evolvent_base.errors import InputError


class Tried(Protocol):
    """What messages look at of an implicit run."""

    plan: Any
    assembly: Assembly
    work: Workspace
    matrix: SparseBlocks
    midpoint: bool

    @property
    def tried(self) -> float:
        """Length of the step that was tried last, s."""

    def moments(self) -> list[tuple[float, np.ndarray, np.ndarray]]:
        """Times and states at which the last step may have called a user's law."""


def reason(code: int, run: Tried) -> str:
    """What happened, where, when, and what to try.

    Parameters
    ----------
    code : int, below zero, of the loop
    run : with the last correction and residual in its workspace

    Raises
    ------
    InputError
        For constraints that are redundant from the start.
    """
    work, assembly, fixed = run.work, run.assembly, run.plan.step is not None
    t, h = float(work.loop.time), run.tried
    if code == REDUNDANT and work.loop.steps == 0 and run.midpoint:
        raise InputError(redundant(assembly, run.matrix))
    smaller = "use a smaller `step`, or None" if fixed else "use a smaller `tolerance`"
    when, bent = f"in the step of {h:.3g} s from t = {t:.6g} s", hints_on(assembly, work.y0)
    if code == NO_CONVERGENCE:
        size = float(np.abs(work.x[: work.weight.size] / work.weight).max(initial=0.0))
        where, softer = _where(run)
        rounding = ", or a greater `newton`: the corrections are round-off" if size < 1e-9 else ""
        found = (
            f"Newton's method found no solution {when}, the shortest that was tried; the largest correction, "
            f"{size:.2g} of the size of the system, is at {where}{what_may_jump(assembly)}{bent}; {smaller}{softer}"
            f"{rounding}, and check the last samples"
        )
    elif code == NOT_FINITE:  # a correction that is not finite says less than the residual from which it comes
        found = f"forces stopped being finite {when}, at {_location(assembly, work.r)}{bent}; {smaller}"
    elif code == GAINED:
        found = _gain(run, when, smaller)
    else:
        found = (
            f"the equations are singular {when}: something has no mass, constraints have become redundant, or the step "
            f"leads too far; {smaller}, and check the last samples"
        )
    if code in (NOT_FINITE, SINGULAR):
        found = without_normal(assembly, when) or found
    far = far_from_origin(assembly, work.y0)
    if far:
        found = f"{found.split('; ')[0]}; {far}"
    return found + broken_law(assembly, run.moments())


def _gain(run: Tried, when: str, smaller: str) -> str:
    """A run whose energy balance has gained too much."""
    work, assembly = run.work, run.assembly
    moved, hint = float(eb.moved(work.loop)), states_energy(assembly)
    if not run.midpoint:
        gained = float(work.loop.gain - work.loop.lowest_gain)
        return (
            f"by t = {float(work.loop.time):.6g} s the run has gained {gained:.3g} J without work, "
            f"{gained / max(moved, 1e-300):.2g} of the {moved:.3g} J that were moved, more than "
            f"{float(work.options.gain):.2g}: the step of {run.tried:.3g} s does not resolve the motion or a contact"
            f"{what_may_jump(assembly)}{hint}; {smaller}, or a lower `spectral_radius`"
        )
    share = 100.0 * float(work.options.gain)
    found = f"the energy balance has gained more than {share:g} % of the {moved:.3g} J that were moved {when}"
    if hint:
        return f"{found}{hint}; {smaller}"
    return (
        f"{found}, which no step of this method does: Newton's method leaves too large a residual; use another "
        f"`step` or `tolerance`, and report it"
    )


def stalled(stall: Stall, run: Tried) -> str:
    """Why a run of ever smaller steps was ended, with the part that makes them so short."""
    law = large_law(run.assembly, run.moments())
    if law:
        return f"{stall}{law}; check the law"
    far = far_from_origin(run.assembly, run.work.y0)
    if far:
        return f"{stall}; {far}"
    where, softer = _where(run)
    return (
        f"{stall}; Newton's method corrects most at {where}{what_may_jump(run.assembly)}"
        f"{hints_on(run.assembly, run.work.y0)}; use a greater `tolerance` or `step`{softer}, less damping of what "
        f"moves there (`stiffness_damping`), and look at the last samples"
    )


def _where(run: Tried) -> tuple[str, str]:
    """Where the largest correction is, contacts that touch included; and what to try about them."""
    assembly, work = run.assembly, run.work
    at, touching = _location(assembly, work.x[: work.weight.size] / work.weight), _touching(assembly)
    jumping = "" if run.midpoint or work.loop.contact_set == 0 else _jumping(assembly)
    if jumping:
        return (
            f"{at}: under the law paper the force jumps by c delta' where {jumping} is touched, and neither end of the "
            f"step is consistent: outside there is no force and the point would penetrate, inside the force pushes it "
            f"out",
            ", or a law without jump (`law` hunt-crossley), or less `damping`",
        )
    if not touching:
        return at, ""
    return f"{at}, with contact at {touching}", f", or a softer contact (`stiffness` of {touching})"


def _location(assembly: Assembly, values: np.ndarray) -> str:
    """Name of the part, and its node, to which the largest of values of all velocities (and joints) belongs."""
    size = np.abs(values)
    if not np.all(np.isfinite(size)):
        size = np.where(np.isfinite(size), 0.0, np.inf)
    k = int(np.argmax(size))
    model, n_v = assembly.model, int(assembly.model.info.nv)
    if k >= n_v:
        return repr(row_owner(assembly, k - n_v))
    block = block_at(model, k)
    part = owner(assembly, *owner_of(block))
    alike = model.blocks[(model.blocks["family"] == block["family"]) & (model.blocks["node"] >= 0)]
    nodes = [*dict.fromkeys((int(b["owner"]), int(b["node"])) for b in alike if owner(assembly, *owner_of(b)) == part)]
    at = int(block["owner"]), int(block["node"])
    return f"{part!r}, node {nodes.index(at)} of {len(nodes) - 1}" if len(nodes) > 1 and at in nodes else repr(part)


def _touching(assembly: Assembly) -> str:
    """Names of the contacts whose points press."""
    found = []
    for name, presses in asked("contacts.presses").items():
        found += [repr(owner(assembly, name, int(k))) for k in np.flatnonzero(presses(assembly.model))]
    found = list(dict.fromkeys(found))
    return " and ".join(found[:3]) + (" and others" if len(found) > 3 else "")


def _jumping(assembly: Assembly) -> str:
    """Names of the contacts whose force jumps at the touch."""
    found = {name: mask(getattr(assembly.model, name)) for name, mask in asked("contacts.jumps").items()}
    names = [name for name, (family, k) in assembly.names.items() if family in found and found[family][k]]
    return " or ".join(repr(name) for name in names[:3]) + (" or others" if len(names) > 3 else "")
