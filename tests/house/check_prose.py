#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Pages and messages are in present-day English, and links lead somewhere.

The patterns are constructions that early versions of the project's texts were full of and
that a reader stumbles over. Each has the words to use instead. Every pattern is first
tried on a sentence that it has to find.
"""
import pathlib
import re
import sys
import check_files

# (pattern, a sentence that it finds, what to write instead)
PATTERNS = (
    (r"(?:^|[.:;] )(?:Is|Are|Has|Have|Does|Do|Was|Were) [^.?!]{2,60}?, then\b",
     "Is `connected` false, then `status` says why.", "if …, …"),
    (r"\bwhat (?:has )?became of\b", "It says what became of it.", "the result"),
    (r"\b(?:stands|stood) (?:in|at|beside|below|above|there|once|twice|here)\b", "It stands in the file.",
     "is in, see"),
    (r"\b(?:is|are|was|were|be|been|being) told (?!to\b)", "An error is told in one line.", "is reported, is logged"),
    (r"\btells? how\b", "The page tells how to read it.", "explains how"),
    (r"\bwas said\b", "What was said three times.", "was reported, was confirmed"),
    (r"\banew\b", "It is made anew.", "again"),
    (r"\bto and fro\b", "It moves to and fro.", "back and forth"),
    (r"\b(?:[Oo]ne|[Ww]ho|[Ww]hoever) (?:that )?(?:is|are) no\b", "One that is no number drives no device.", "a … that is not"),
    (r"\bwants? (?:of|to be)\b", "It wants to be an address.", "needs, expects"),
    (r"\bupon which\b", "It ends, upon which it starts.", "then"),
    (r"\bis no (?:line|place|matter) for\b", "Wi-Fi is no line for threads.", "is not suitable for"),
    (r"\bis there says\b", "How much is there says `count`.", "… is set by"),
    (r"\bof that with\b", "1.13 of that with none.", "1.13× without"),
    (r"\bfrom the tick\b", "Both fast answers in, from the tick.", "from the start of the cycle"),
    (r"\bcounts more\b", "The one which counts more.", "takes precedence"),
    (r"\bstands it\b", "It stands it only while it is off.", "is allowed only while"),
    (r"\bnever was one's\b", "A folder that never was one's.", "no daemon has used"),
    (r"\bfrom that try on\b", "The time is told from that try on.", "count from that attempt"),
    (r"\basks nobody\b", "A device asks nobody who he is.", "does not authenticate clients"),
    (r"\bnot seen all of\b", "As one that was not seen all of.", "incomplete"),
    (r"\b[Bb]etween nothing and\b", "Between nothing and a whole period old.", "0 to 1"),
    (r"\bit never did\b", "It runs on; it never did.", "previously it did not"),
    (r"\bnot to be had\b", "AF_XDP is not to be had.", "is not available"),
    (r"\bin vain\b", "It waits in vain.", "without result"),
    (r"\blaid over each other\b", "They are laid over each other.", "combined"),
)
COMPILED = [(re.compile(pattern), sentence, instead)
            for pattern, sentence, instead in PATTERNS]
LINK = re.compile(r"(?<!!)\[[^\]]*\]\(([^)\s#]*)(?:#[^)]*)?\)|!\[[^\]]*\]\(([^)\s]+)\)")
PAGES, CODE = (".md", ".scd"), (".c", ".h")
# the protocol's notes quote what others have written
QUOTING = {"docs/protocol.md"}


def pages(root):
    return [name for name in check_files.files_of(root) if name.endswith(PAGES + CODE)]


def prose(text):
    """The text with code blanked out: what a program prints is not judged here."""
    def blank(match):
        return re.sub(r"[^\n]", " ", match.group(0))
    return re.sub(r"^```.*?^```$", blank, text, flags=re.M | re.S)


def dialect(name, text):
    # a sentence may go over the end of a line
    flat = prose(text).replace("\n", " ")
    for pattern, _, instead in COMPILED:
        for match in pattern.finditer(flat):
            line = text.count("\n", 0, match.start()) + 1
            yield f"{name}:{line}: '{match.group(0).strip()}': write '{instead}'"


def messages(name, text):
    """The strings of a C file: what a program prints."""
    def blank(match):
        return re.sub(r"[^\n]", " ", match.group(0))
    code = re.sub(r"/\*.*?\*/", blank, text, flags=re.S)
    # a string may go over the end of a line
    code = re.sub(r'"[ \t]*\n[ \t]*"', lambda match: " " * len(match.group(0)), code)
    for literal in re.finditer(r'"((?:[^"\\\n]|\\.)*)"', code):
        said = re.sub(r" {3,}", "", literal.group(1))
        for pattern, _, instead in COMPILED:
            for match in pattern.finditer(said):
                line = text.count("\n", 0, literal.start()) + 1
                yield f"{name}:{line}: '{match.group(0).strip()}': write '{instead}'"


def links(root, name, text):
    for match in LINK.finditer(prose(text)):
        target = match.group(1) or match.group(2)
        if target and "://" not in target and not target.startswith("mailto:") \
                and not (root / name).parent.joinpath(target).exists():
            line = text.count("\n", 0, match.start()) + 1
            yield f"{name}:{line}: the link leads nowhere: {target}"


def self_test():
    bad = [sentence for pattern, sentence, _ in COMPILED if not pattern.search(sentence)]
    good = "It was told to stop. If it is false, then it ends. The reader stands by. A user who is not a member."
    wrong = [pattern.pattern for pattern, _, _ in COMPILED if pattern.search(good)]
    for fault in [f"not found: {sentence}" for sentence in bad] + [f"found without reason: {p}" for p in wrong]:
        print(fault)
    return not bad and not wrong


def main():
    root = pathlib.Path(sys.argv[1])
    found = [] if self_test() else ["the patterns are wrong, see above"]
    names = pages(root)
    for name in names:
        text = (root / name).read_text(encoding="utf-8")
        if name.endswith(".md"):
            found += links(root, name, text)
        if name.endswith(CODE):
            found += messages(name, text)
        elif name not in QUOTING:
            found += dialect(name, text)
    print("\n".join(found) or f"{len(names)} files in order")
    return 1 if found or not names else 0


if __name__ == "__main__":
    sys.exit(main())
