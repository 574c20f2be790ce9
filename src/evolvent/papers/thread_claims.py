"""The claims of Tenenbaum (2014), reeled thread: the ledger of `evolvent claims thread`."""

from __future__ import annotations

from evolvent.papers.ledger import Claim

CLAIMS: tuple[Claim, ...] = ()
