"""``python -m evolvent``."""

from evolvent_base.cli import main

main()
