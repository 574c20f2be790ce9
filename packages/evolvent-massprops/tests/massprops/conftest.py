"""What the tests of mass properties share."""

from __future__ import annotations

import pytest

from evolvent_massprops import pictures


@pytest.fixture
def outlined(monkeypatch: pytest.MonkeyPatch) -> None:
    """Images of a certificate are one byte, for tests of what stands in it: drawing them takes most of the time."""
    monkeypatch.setattr(pictures, "content", lambda figure, kind: b"-")
