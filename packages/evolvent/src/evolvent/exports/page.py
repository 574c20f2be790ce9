"""The animation as one HTML page."""

from __future__ import annotations

from typing import Any

from evolvent.exports.request import Request, animation_of, shown_size, size_of
from evolvent.view import animation
from evolvent_base.files import write_file


def write(run: Any, path: str, request: Request) -> str:
    """Write the animation; returns what was written.

    Raises
    ------
    InputError
        If the run holds too little, or the file cannot be written.
    """
    motion = animation_of(run, request.clearance)
    wanted = min(max(2, request.frames or animation.MOST_FRAMES), motion.time.size)
    page, frames = animation.page(motion, frames=wanted, speed=request.speed)
    write_file(path, page)
    held = f"{frames} frames"
    if frames < wanted:
        held += f" (of the {wanted} asked for; a page holds {shown_size(animation.LARGEST)})"
    elif frames < motion.time.size:
        held += f" of {motion.time.size} samples"
    return f"{path}: {held}, {shown_size(size_of(path))}"
