"""Types that questions of all groups share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

Array = np.ndarray
#: Records of a family by its name.
Records = Callable[[str], Any]
#: A time (s) and the states y and s at it.
Moment = tuple[float, Array, Array]
#: What a record acts on: ("bodies", index), ("reduced_bodies", index), ("vectors", index).
End = tuple[str, int]
#: An answer that is a compiled function, which walks over a model's families call (`evolvent.kernels.calls`); None of a
#: family that has none. Of the group `explicit` and the question `force` they find it in `Model.explicit_force_calls`.
Call = Any
