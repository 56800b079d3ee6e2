#!/usr/bin/env python3
"""A preprocessor of mdBook: adds every docs/*.md and docs/stability/*.md as a chapter, and makes relative links lead to chapters or to the repository."""

import json
import re
import sys
from pathlib import Path, PurePosixPath
from posixpath import normpath, relpath

ROOT = Path(__file__).resolve().parents[2]
REPOSITORY = "https://github.com/steradian-renderer/steradian/blob/main/"
SRC = "docs/book/src/"
# Documents for developers; all others are for users.
DEVELOPERS = ["accelerators", "agreement", "dependencies", "flaws", "numerics", "performance", "releasing", "wavefront"]


def file_of(chapter_path):
    """The file in the repository of a chapter."""
    return chapter_path if chapter_path.startswith("docs/") else SRC + chapter_path


def address(target, chapter_path):
    """A link as the book needs it."""
    path, mark, anchor = target.partition("#")
    if not path or "://" in path or path.startswith("mailto:"):
        return target
    file = normpath(f"{PurePosixPath(file_of(chapter_path)).parent}/{path}")
    if file.startswith(SRC):
        # mdBook turns README.md into the index of its folder.
        inside = re.sub(r"(^|/)README\.md$", r"\1index.md", file[len(SRC):])
    elif re.fullmatch(r"docs/(stability/)?[^/]+\.md", file):
        inside = file
    else:
        return REPOSITORY + file + mark + anchor
    return relpath(inside, PurePosixPath(chapter_path).parent.as_posix()) + mark + anchor


def adjust(chapter):
    path = chapter["path"]
    if path:
        chapter["content"] = re.sub(
            r"\]\(([^)\s]+)\)", lambda link: f"]({address(link[1], path)})", chapter["content"]
        )
    for item in chapter["sub_items"]:
        if "Chapter" in item:
            adjust(item["Chapter"])


def document(file):
    text = file.read_text()
    title = "Checks of numerical stability" if file.stem == "stability" else re.search(r"^# (.*)$", text, re.M)[1]
    path = file.relative_to(ROOT).as_posix()
    return {"Chapter": {
        "name": title, "content": text, "number": None, "sub_items": [], "path": path,
        "source_path": path, "parent_names": [],
    }}


if len(sys.argv) > 1 and sys.argv[1] == "supports":
    sys.exit(0)
_, book = json.load(sys.stdin)
items = book.get("items", book.get("sections"))
files = sorted((ROOT / "docs").glob("*.md"))
topics = [document(file) for file in files if file.stem not in DEVELOPERS]
notebooks = [document(file) for file in files if file.stem in DEVELOPERS]
notebooks += [document(file) for file in sorted((ROOT / "docs/stability").glob("*.md"))]
place = next(i for i, item in enumerate(items) if item == {"PartTitle": "For developers"})
items[place:place] = [{"PartTitle": "Topics"}, *topics]
items += [{"PartTitle": "Laboratory notebooks"}, *notebooks]
for item in items:
    if "Chapter" in item:
        adjust(item["Chapter"])
json.dump(book, sys.stdout)
