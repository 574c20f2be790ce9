"""What follows from what records act on: isolation, and what acts from outside."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from evolvent.kernels import rigid
from evolvent.model.family import End, Family, Records
from evolvent.model.registry import acting, constraining, families, first_row

Array = np.ndarray


def ends_of(name: str, row: Any, records: Records) -> Iterator[End]:
    """What a record of a family acts on (`Family.ends`).

    Parameters
    ----------
    records : function of the name of a family to its records
    """
    ends = families()[name].ends
    return iter(()) if ends is None else ends(row, records)


def mark_outside(found: Mapping[str, Array], info: Any) -> None:
    """Note which records tie the system to what is not part of it: bodies that are driven, or spin about an axis.

    `info.outside` is 1 where one of those that act at all times does, and `info.open` where forces come from outside.
    """
    free, records = found["bodies"]["motion"] == rigid.FREE, found.__getitem__

    def ties(family: Family) -> Array:
        rows = found[family.name]
        tied = [any(not free[i] for what, i in ends_of(family.name, row, records) if what == "bodies") for row in rows]
        by_itself = np.zeros(rows.size, dtype=bool) if family.outside is None else family.outside(rows)
        return np.asarray(np.array(tied, dtype=bool) | by_itself)

    for family in acting():
        if family.coupling.within:
            continue
        tied = ties(family)
        if family.name in constraining():
            first = first_row(family.name, records)
            found["constraints"]["outside"][first : first + tied.size] = tied
        elif "outside" in (family.record.names or ()):
            found[family.name]["outside"] = tied
        if not family.coupling.at_times:
            info["outside"] |= np.any(tied)
    for family in families().values():
        info["open"] |= not family.of and not family.may_be_isolated(found[family.name], records)
