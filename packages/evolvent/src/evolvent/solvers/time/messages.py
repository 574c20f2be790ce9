"""Why a run of any method ended before its end."""

from __future__ import annotations

import numpy as np

from evolvent.assembly.assembled import Assembly
from evolvent.kernels.blocks import POSITION, indices

Array = np.ndarray
#: Distance from the origin, beside the system's own size, from which on it is said to be far from it.
FAR = 1e5


def far_from_origin(assembly: Assembly, y: Array) -> str:
    """What is wrong and what to do where positions are so large that their round-off counts; '' where they are not."""
    blocks = assembly.model.blocks[assembly.model.blocks["kind"] == POSITION]
    if not blocks.size:
        return ""
    places = y[indices(blocks, "iq")]
    far, size = float(np.abs(places).max()), float(np.linalg.norm(np.ptp(places, axis=0))) or 1.0
    if not far > FAR * size:
        return ""
    return (
        f"the system lies {far:.3g} m from the origin, {far / size:.1g} times its own size, so that positions are "
        f"known to {np.spacing(far):.1g} m alone, too little for the accelerations of short steps: place it near the "
        f"origin, where it moves in the same way unless a field depends on the place, or use dopri5 or "
        f"energy-momentum, which feel this less"
    )


def outrun(reached: float) -> str:
    """What happened where a drive outruns its thread."""
    return (
        f"the drive outruns its thread at t = {reached:.6g} s: it pays out more than there is, or reels in what is "
        "already wound; stop the drive in time, end the run earlier, or release the thread's end"
    )
