"""Custom forces."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from evolvent.kernels import custom
from evolvent.kernels.ends import of_markers
from evolvent.model.family import End, Family, Kind, Records, record

Array = np.ndarray


def _of_custom(row: Any, records: Records) -> Iterator[End]:
    first = int(row["first_marker"])
    yield from of_markers(slice(first, first + int(row["points"])), records)


def _is_reciprocal(_: Any, found: Array) -> bool:
    return bool(np.all(found["symmetric"] != 0.0))


# a user-defined law between points, which are markers, from first_marker on. balanced: 1 where the last forces had
# neither a resultant nor a moment; symmetric: 1 where their last derivatives by position were symmetric;
# stated: 1 once the law has given an energy or a power
CUSTOM_FORCES = Family(
    "custom_forces",
    record("law first last first_marker points", "", "balanced symmetric stated"),
    order=330,
    kinds=(
        Kind("a custom force", symmetric=_is_reciprocal),
    ),
    ends=_of_custom,
    outside=lambda found: found["points"] == 1,
    scratch=lambda records, _: {
        "custom": np.zeros(max(map(custom.scratch_size, records("custom_forces")["points"].tolist()), default=0))
    },
)  # fmt: skip
