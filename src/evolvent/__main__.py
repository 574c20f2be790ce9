"""``python -m evolvent``."""

from evolvent.commands.cli import main

main()
