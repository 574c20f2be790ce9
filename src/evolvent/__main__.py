"""``python -m evolvent``."""

from evolvent.base.cli import main

main()
