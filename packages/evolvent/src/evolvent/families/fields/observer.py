"""Observations of fields: their resultant, power and work."""

from __future__ import annotations

from evolvent.results.observe.variables import Observed, observer
from evolvent.results.observe.view import View


@observer("fields")
def observe_field(view: View, name: str) -> Observed:
    """Resultant of a field on all masses, its power and work."""
    found = Observed()
    found.results("fields", view.fields["fields"], view.index(name))
    found.plots = ["force"]
    return found
