"""The claims of Belyakov (2002), inertia stand: the ledger of `evolvent claims stand`."""

from __future__ import annotations

from evolvent.papers.ledger import Claim

CLAIMS: tuple[Claim, ...] = ()
