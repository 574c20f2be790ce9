"""Directives of documentation pages that show the papers."""

from __future__ import annotations

from docutils import nodes
from sphinx.util.docutils import SphinxDirective

from evolvent_papers.papers import ledger


class Ledger(SphinxDirective):
    """``{ledger} thread``: the claims of a paper with verdict, the paper's number, ours and the command, and counts."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Write the table."""
        return self.parse_text_to_nodes(ledger.markdown(self.arguments[0]))
