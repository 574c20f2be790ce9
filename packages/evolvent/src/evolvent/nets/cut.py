"""Files of lengths to which the cords of a net are cut."""

from __future__ import annotations

import functools
import json
from typing import Any

import numpy as np

from evolvent_base import safe_open
from evolvent_base.errors import InputError

Array = np.ndarray


@functools.lru_cache(maxsize=8)
def read_cut(key: str, path: str, digest: str, count: int) -> Array:
    """Lengths (m,), m, without tension, of all cords of a net, from a file with the key `lengths`.

    Parameters
    ----------
    key : str, for messages; path, digest : str, the file and its content; count : int, of cords that the net has

    Raises
    ------
    InputError
        If the file cannot be read, or its lengths do not fit the net.
    """
    text: Any = safe_open.content(path, most=safe_open.LARGEST_TEXT)
    try:
        found = np.array(json.loads(text)["lengths"], dtype=float)
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{key} is {path!r}, which has no list `lengths` of numbers ({error})") from None
    if found.shape != (count,):
        raise InputError(f"{key} is {path!r} with {found.size} lengths; the net has {count} cords")
    if not (np.isfinite(found).all() and found.min() > 0.0):
        raise InputError(
            f"{key} is {path!r}, whose length {int(found.argmin())} is {found.min():g} m; it must be above 0"
        )
    return found
