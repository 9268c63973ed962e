#!/usr/bin/env python3
"""Fails when a relative link of the built book or of a page at the top of the repository leads nowhere, or to no such place in a page.

Links to other sites are not looked at: this needs no network.
Usage: book_links.py BOOK_DIR [PAGE.md ...]
"""

import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

# What mdBook makes for itself: the page that is served for every missing address, and all chapters in one page for the printer, whose
# links lead to places within it.
NOT_LOOKED_AT = {"404.html", "print.html"}


class Page(HTMLParser):
    """Every place of a page that a link may name, and every link that it has with its line."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.places, self.links = {"", "top"}, []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if value and (name == "id" or (name == "name" and tag == "a")):
                self.places.add(value)
            elif value and name in ("href", "src", "poster") and tag != "base":
                self.links.append((self.getpos()[0], value))


def slug(heading, known):
    """The anchor that hosts of Git repositories give a heading of Markdown."""
    plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
    plain = re.sub(r"[^\w\- ]", "", plain.replace("`", "").lower()).strip().replace(" ", "-")
    count = known.get(plain, 0)
    known[plain] = count + 1
    return f"{plain}-{count}" if count else plain


class Markdown:
    """As `Page`, of Markdown."""

    def __init__(self, text):
        self.places, self.links = {""}, []
        known, fenced = {}, False
        for number, line in enumerate(text.splitlines(), 1):
            if line.lstrip().startswith("```"):
                fenced = not fenced
            if fenced:
                continue
            if heading := re.match(r"#{1,6}\s+(.*?)\s*#*$", line):
                self.places.add(slug(heading[1], known))
            prose = re.sub(r"`[^`]*`", "", line)
            # A picture may stand in the text of a link, so each target is found by itself.
            found = re.findall(r"\]\(<?([^)\s>]+)>?(?:\s+\"[^\"]*\")?\)", prose)
            found += re.findall(r"^\s*\[[^\]]+\]:\s*(\S+)", prose) + re.findall(r"(?:href|src)=\"([^\"]+)\"", prose)
            self.links += [(number, link) for link in found]


class Links:
    """Looks links up, reading every page once."""

    def __init__(self):
        self.pages, self.looked_at = {}, 0

    def page(self, path):
        if path not in self.pages:
            kind = Markdown if path.suffix == ".md" else Page
            self.pages[path] = kind(path.read_text(encoding="utf-8"))
        return self.pages[path]

    def fault(self, path, link):
        """Why a link of a page leads nowhere; none where it does, or where it leads to another site."""
        parts = urlsplit(link)
        if parts.scheme or parts.netloc:
            return None
        self.looked_at += 1
        target = path if not parts.path else (path.parent / unquote(parts.path)).resolve()
        if target.is_dir() and target.joinpath("index.html").is_file():
            target = target / "index.html"
        if not target.exists():
            return "there is no such file"
        place = unquote(parts.fragment)
        if place and target.suffix in (".html", ".md") and place not in self.page(target).places:
            return f"{target.name} has no place called {place}"
        return None


def main():
    book = Path(sys.argv[1]).resolve()
    chapters = [path for path in sorted(book.rglob("*.html")) if path.relative_to(book).as_posix() not in NOT_LOOKED_AT]
    if len(chapters) < 2:
        print(f"FAIL  {book} holds no book; build it by `mdbook build docs`")
        return 1
    pages = chapters + [Path(page).resolve() for page in sys.argv[2:]]
    links, faults = Links(), 0
    for path in pages:
        told = path.relative_to(book) if path in chapters else path.name
        for line, link in links.page(path).links:
            if fault := links.fault(path, link):
                faults += 1
                print(f"FAIL  {told}:{line}: {link}: {fault}")
    print(f"{'FAIL' if faults else 'ok  '}  {links.looked_at} relative links of {len(pages)} pages, {faults} of them broken")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
