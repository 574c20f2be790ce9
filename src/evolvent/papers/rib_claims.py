"""The claims of Yi, Yuan, Dong & Li (2017), wrapped rib: the ledger of `evolvent claims rib`."""

from __future__ import annotations

from evolvent.papers.ledger import Claim

CLAIMS: tuple[Claim, ...] = ()
