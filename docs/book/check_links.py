#!/usr/bin/env python3
"""Checks the links of a built book: files and anchors inside it exist. Addresses elsewhere are not opened.

docs/book/check_links.py FOLDER"""

import re
import sys
from pathlib import Path
from urllib.parse import unquote

FOLDER = Path(sys.argv[1]).resolve()
# The page for printing repeats all others, the page for errors has links from the site's root.
LEFT_OUT = {"print.html", "404.html", "toc.html"}


def main():
    pages = {page: page.read_text() for page in sorted(FOLDER.rglob("*.html"))}
    anchors = {page: set(re.findall(r'\bid="([^"]+)"', text)) for page, text in pages.items()}
    faults, count = [], 0
    for page, text in pages.items():
        if page.name in LEFT_OUT:
            continue
        for target in re.findall(r'<(?:a|img)\b[^>]*?\b(?:href|src)="([^"]*)"', text):
            if re.match(r"[a-z]+:", target):
                continue
            count += 1
            path, _, anchor = unquote(target).partition("#")
            file = (page.parent / path).resolve() if path else page
            if not file.exists():
                faults.append(f"{page.relative_to(FOLDER)}: {target}: no such file")
            elif anchor and file in anchors and anchor not in anchors[file]:
                faults.append(f"{page.relative_to(FOLDER)}: {target}: no such anchor")
    print("\n".join(faults) or f"{count} links of {len(pages)} pages are right")
    sys.exit(1 if faults or count < 500 else 0)


main()
