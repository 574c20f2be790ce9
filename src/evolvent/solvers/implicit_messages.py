"""Why an implicit run ended before its end: what happened, where, when, and what to try."""

from __future__ import annotations

from evolvent.assembly.assembled import Assembly
from evolvent.assembly.families import owner
from evolvent.kernels import contact_laws
from evolvent.kernels.sparse import SparseBlocks
from evolvent.solvers import alpha_state, ordering
from evolvent.solvers import balance as eb
from evolvent.solvers.laws import states_energy, what_may_jump
from evolvent.solvers.pace import Stall
from evolvent.solvers.rod_messages import bending_hint


def redundant(assembly: Assembly, matrix: SparseBlocks) -> str:
    """Which joints repeat what others say."""
    rows = ordering.redundant_unknowns(matrix) - int(assembly.model.info.nv)
    names = sorted({owner(assembly, "joints", int(k)) for k in rows if k >= 0})
    return (
        f"{' and '.join(repr(n) for n in names) or 'a joint'} is redundant: the other joints already impose "
        f"{len(rows)} of its constraints"
    )


def reason(code: int, work: alpha_state.Workspace, step: float | None, assembly: Assembly) -> str:
    """What happened, where, when, and what to try."""
    t = float(work.loop.time)
    h = step if step is not None else float(work.loop.step)
    smaller = "use a smaller `step`, or None" if step is not None else "use a smaller `tolerance`"
    if code == alpha_state.NO_CONVERGENCE:
        met = work.loop.contact_set != 0
        touching = " with contact" if met else ""
        jumps = _jumping(assembly)
        why = law = ""
        if jumps:
            why = (
                f": under the law paper the force jumps by c delta' where {jumps} is touched, and neither end "
                f"of the step "
                f""
                f"is consistent: outside there is no force and the point would penetrate, inside the force "
                f"pushes it out"
            )
            law = "a law without jump (`law` hunt-crossley), or less `damping`"
        elif met:
            law = "a softer contact"
        if step is None:  # only of the smallest of steps is that final
            smaller = "check the last samples" if not law else "take"
        joined = "" if not law else " " if step is None else ", " if jumps else ", or "
        return (
            f"Newton's method found no solution of the step of {h:.3g} s that begins at t = {t:.6g} s{touching}{why}"
            f"{what_may_jump(assembly)}{bending_hint(assembly, work.y0)}; "
            f"{smaller}{joined}{law}"
        )
    if code == alpha_state.NOT_FINITE:
        bent = bending_hint(assembly, work.y0)
        return f"the state stopped being finite in the step of {h:.3g} s from t = {t:.6g} s{bent}; {smaller}"
    if code in (alpha_state.SINGULAR, alpha_state.REDUNDANT):
        return (
            f"the equations of the step of {h:.3g} s from t = {t:.6g} s are singular: something has no mass, "
            f"constraints have become redundant, or the step leads too far; {smaller}, and check the last samples"
        )
    gained, moved = float(work.loop.gain - work.loop.lowest_gain), float(eb.moved(work.loop))
    return (
        f"by t = {t:.6g} s the run has gained {gained:.3g} J without work, {gained / max(moved, 1e-300):.2g} of the "
        f"{moved:.3g} J that were moved, more than {float(work.options.gain):.2g}: the step of {h:.3g} s does not "
        f"resolve the motion or a contact{what_may_jump(assembly)}{states_energy(assembly)}; {smaller}, or a lower "
        f"`spectral_radius`"
    )


def stalled(stall: Stall, law: str) -> str:
    """Why a run of ever smaller steps was ended; `law`: of `laws.large_law`."""
    if law:
        return f"{stall}{law}; check the law"
    return (
        f"{stall}: reduce the damping (`stiffness_damping`) or the contact stiffness of what moves there, or use a "
        f"greater `tolerance` or a fixed `step`"
    )


def _jumping(assembly: Assembly) -> str:
    """Names of the cylinders whose force jumps at the touch."""
    cylinders = assembly.model.flexible.cylinders
    some = (cylinders["law"] == contact_laws.PAPER) & (cylinders["damping"] > 0.0)
    names = [name for name, (family, k) in assembly.names.items() if family == "cylinders" and some[k]]
    return " or ".join(repr(name) for name in names[:3]) + (" or others" if len(names) > 3 else "")
