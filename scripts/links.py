"""Checks the relative links of all documents, and that nothing is left out of the tables of contents.

    scripts/links.py

A link must lead to a file or folder, its anchor to a heading of that page. Every page of docs is in docs/SUMMARY.md,
every script in scripts/README.md.
"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LINK = re.compile(r"\[(?:[^\[\]]|\[[^\]]*\])*\]\(([^()\s]+)\)")


def prose(text):
    """The text without blocks and spans of code."""
    text = re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)
    return re.sub(r"`[^`\n]*`", lambda span: "" if "](" in span[0] else span[0], text)


def anchors(text):
    """Anchors of the headings, as GitHub and mdBook make them."""
    found = set()
    for heading in re.findall(r"^#+ (.+)$", re.sub(r"^```.*?^```", "", text, flags=re.M | re.S), re.M):
        heading = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).strip().lower()
        anchor = re.sub(r"[^\w\- ]", "", heading).replace(" ", "-")
        found.add(anchor if anchor not in found else f"{anchor}-1")
    return found


def wrong(page):
    """What is wrong with the links of a page, a line each."""
    for match in LINK.finditer(prose(page.read_text())):
        link = match[1]
        if re.match(r"[a-z]+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        name = page.relative_to(ROOT)
        if not target.exists():
            yield f"{name}: {link}: no such file"
        elif anchor and target.suffix == ".md" and anchor not in anchors(target.read_text()):
            yield f"{name}: {link}: no such heading"


def main():
    """Prints everything that is wrong."""
    globs = ["*.md", "docs/**/*.md", "scripts/*.md", "crates/*/README.md"]
    pages = [page for glob in globs for page in ROOT.glob(glob)]
    complaints = [complaint for page in sorted(pages) for complaint in wrong(page)]
    contents = (ROOT / "docs/SUMMARY.md").read_text()
    listed = LINK.findall(contents)
    for page in sorted(ROOT.glob("docs/**/*.md")):
        name = str(page.relative_to(ROOT / "docs"))
        if name != "SUMMARY.md" and listed.count(name) != 1:
            complaints.append(f"docs/SUMMARY.md: {name} is there {listed.count(name)} times")
    index = (ROOT / "scripts/README.md").read_text()
    for script in sorted(ROOT.glob("scripts/*")):
        if script.is_file() and script.name != "README.md" and f"| `{script.name}` |" not in index:
            complaints.append(f"scripts/README.md: no row for {script.name}")
    if complaints:
        sys.exit("\n".join(complaints))
    print(f"links: {len(pages)} pages, nothing leads nowhere")


main()
