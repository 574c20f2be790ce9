"""Sections that are known by names, such as materials: a name stands for all keys."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from pydantic import GetCoreSchemaHandler
from pydantic_core import PydanticCustomError, core_schema

from evolvent_base.errors import nearest
from evolvent_base.schema import Section


@dataclasses.dataclass(frozen=True, eq=False)
class Named:
    """A pydantic annotation: the name of a known section stands for it.

    Parameters
    ----------
    what : str, what messages call it, such as "a material"
    known : mapping, name -> section
    """

    what: str
    known: Mapping[str, Section]

    def read(self, value: Any) -> Any:
        """The section of a name; any other value as it is."""
        if not isinstance(value, str):
            return value
        if value not in self.known:
            message = f"{self.what} by name must be known; {nearest(value, self.known)}"
            raise PydanticCustomError("named", "{message}", {"message": message})
        return self.known[value]

    def written_out(self, value: Any) -> Any:
        """The section of a known name as a file holds it, with all its keys; any other value as it is."""
        if not isinstance(value, str) or value not in self.known:
            return value
        return self.known[value].model_dump(mode="json", exclude_none=True)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        """A validator before that of the section."""
        return core_schema.no_info_before_validator_function(self.read, handler(source))

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> dict[str, Any]:
        """A name, or the keys of the section."""
        return {"anyOf": [{"enum": sorted(self.known)}, handler(schema)]}
