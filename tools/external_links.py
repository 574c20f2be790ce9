"""Links of the pages and sources that lead elsewhere: python tools/external_links.py lists them, --check asks each."""

from __future__ import annotations

import argparse
import pathlib
import re
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator

ROOT = pathlib.Path(__file__).parents[1]
#: Files that are searched, and addresses that are examples or names of formats.
PLACES = ("*.md", "docs/**/*.md", "packages/*/src/**/*.py")
NO_PAGES = re.compile(r"localhost|127\.0\.0\.1|example\.|w3\.org/|//\{|schema\.org|json-schema\.org")
_LINK = re.compile(r"https?://[^\s<>\"'`\\{}|^\[\]]+")
#: Answers that say that a page is there, though not for programs.
_THERE = (401, 403, 405, 406, 418, 429, 503)


def links(text: str) -> Iterator[str]:
    """Addresses in a text, without the signs of the sentence behind them, and parts of a page."""
    for match in _LINK.finditer(text):
        found = match[0].rstrip(".,;:!?*_")
        if found.endswith(")") and found.count(")") > found.count("("):
            found = found[: found.rindex(")")].rstrip(".,;:")
        found = found.partition("#")[0]
        if not NO_PAGES.search(found) and "." in found:
            yield found


def collected(root: pathlib.Path = ROOT) -> dict[str, list[str]]:
    """Addresses and the files that have them."""
    found: dict[str, list[str]] = {}
    for place in PLACES:
        for path in sorted(root.glob(place)):
            if not {"_build", "jupyter_execute"} & set(path.parts):
                for one in links(path.read_text(encoding="utf-8")):
                    found.setdefault(one, []).append(path.relative_to(root).as_posix())
    return found


def why_dead(address: str) -> str:
    """Why a page is not there; '' where it is."""
    request = urllib.request.Request(address, headers={"User-Agent": "Mozilla/5.0 (link check)"})
    try:
        with urllib.request.urlopen(request, timeout=30):
            return ""
    except urllib.error.HTTPError as error:
        return "" if error.code in _THERE else f"status {error.code}"
    except (OSError, ValueError) as error:
        return str(error)


def main() -> int:
    """List the links, or ask for each of them and state those that are dead."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--check", action="store_true", help="ask for every page")
    checks, dead = options.parse_args().check, 0
    for address, files in sorted(collected().items()):
        why = why_dead(address) if checks else ""
        dead += bool(why)
        if why or not checks:
            print(f"{address}{': ' if why else ''}{why} ({', '.join(dict.fromkeys(files))})")
    return int(dead > 0)


if __name__ == "__main__":
    sys.exit(main())
