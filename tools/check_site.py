"""Check the built documentation: every link leads somewhere, and no page needs a network.

Run from the repository: python -m tools.check_site build/docs

Links within the site are followed to the file and to the place in it. Links that leave it are only looked at: there is
no network where the site is built.
"""

from __future__ import annotations

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import SplitResult, unquote, urlsplit

LOADED = {"img": "src", "script": "src", "link": "href", "source": "src", "iframe": "src"}
"""Elements whose address the browser loads by itself."""


class Links(HTMLParser):
    """The anchors of a page, the links on it, and what it loads."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.anchors, self.links, self.loaded = {"top", ""}, list[str](), list[str]()
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        found = {name: value or "" for name, value in attributes}
        self.anchors |= {found[name] for name in ("id", "name") if name in found}
        if tag == "a" and "href" in found:
            self.links.append(found["href"])
        if tag in LOADED and found.get(LOADED[tag]) and found.get("rel") != "canonical":
            self.loaded.append(found[LOADED[tag]])


def problems(site: Path) -> list[str]:
    """What is wrong with the links of a site, one sentence each."""
    written = [path for path in sorted(site.rglob("*.html")) if "_static" not in path.parts]
    pages = {path.resolve(): Links(path.read_text(encoding="utf-8")) for path in written}
    found = []
    for path, page in pages.items():
        where = str(path.relative_to(site.resolve()))
        found += [f"{where} loads {link} from elsewhere" for link in page.loaded if urlsplit(link).netloc]
        for link in (*page.links, *page.loaded):
            wrong = _wrong(path, link, pages)
            found += [f"{where}: {link} {wrong}"] if wrong else []
    return found


def _wrong(path: Path, link: str, pages: dict[Path, Links]) -> str:
    """What is wrong with a link on a page, in words; empty where nothing is."""
    try:
        address = urlsplit(link)
    except ValueError:
        return "is no address"
    if address.scheme == "data":
        return ""
    if address.scheme or address.netloc:
        return "" if well_formed(address) else "is no address of a page"
    target = (path.parent / unquote(address.path)).resolve() if address.path else path
    if not target.is_file():
        return "leads nowhere"
    if target in pages and unquote(address.fragment) not in pages[target].anchors:
        return "leads to a place that the page does not have"
    return ""


def well_formed(address: SplitResult) -> bool:
    """Whether an address that leaves the site can be one of a page."""
    return address.scheme in ("http", "https") and "." in (address.hostname or "") and " " not in address.geturl()


def main() -> int:
    """Print what is wrong with the site that is named; 1 if anything is."""
    site = Path(sys.argv[1])
    found = problems(site)
    print(*found, sep="\n") if found else print(f"{site}: all links lead somewhere")
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
