"""Rows of the table of families: one a kind of records."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import Any

import pytest

from evolvent.assembly import families as table
from evolvent.model.family import Kind
from evolvent.model.registry import families


@dataclasses.dataclass(frozen=True)
class Row:
    """A kind of records of a family."""

    records: str
    kind: Kind

    def __getattr__(self, name: str) -> Any:
        return getattr(self.kind, name)

    def mask(self, model: Any) -> Any:
        return self.kind.mask(getattr(model, self.records))


FAMILIES = tuple(Row(family.name, kind) for family in families().values() for kind in family.kinds)


def set_kinds(monkeypatch: pytest.MonkeyPatch, rows: Iterable[Row], **changed: Any) -> None:
    """Replace the kinds that solvers support by some, all with the same changes."""
    found = [(row.records, dataclasses.replace(row.kind, **changed)) for row in rows]
    given = {
        name: dataclasses.replace(family, kinds=tuple(kind for of, kind in found if of == name))
        for name, family in families().items()
    }
    monkeypatch.setattr(table, "families", lambda: given)
