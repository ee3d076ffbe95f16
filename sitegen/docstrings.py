"""Docstrings in the house's style, read: prose, and in it `name: what it means`, which may name several at once.

A label stands at the beginning of a paragraph or after a full stop, a semicolon or a comma; what it means goes on to
the next label, or to the end of its paragraph.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from markupsafe import Markup, escape

_PAREN = r"(?:\s?\([^()]*\))?"
# A sentence about the whole, where a label's meaning would else go on.
_OF_ALL = ("It stops when", "A stage ends", "Where poses come", "The others", "Raises", "Degenerate:", "The arrays")
_WHOLE = re.compile(rf"(?<=\.)\s+(?={'|'.join(_OF_ALL)})")
_SENTENCE = re.compile(r"(?<=\.)\s+(?=[A-Z])")
_LOW = dict(zip("ᵢⱼₖₘₙₓ", "ijkmnx", strict=True))
_AS_IN = re.compile(r"(?:\b[Aa]s(?: in)?)\s+`([\w.]+)`")


@dataclass(frozen=True)
class Label:
    """Names, as the docstring writes them, and what it says that they mean."""

    names: tuple[str, ...]
    head: str
    says: str

    def of(self, name: str) -> str:
        """What it says of one of its names, with what stands in brackets after that."""
        own = re.search(rf"\b{re.escape(name)}\s?(\([^()]*\))", self.head)
        return f"{self.says} {own[1]}" if own else self.says


Piece = str | Label  # of prose, a paragraph each, or a label


def paragraphs(doc: str) -> list[str]:
    """The paragraphs of a cleaned docstring (inspect.cleandoc); indented ones keep their lines."""
    return [part for part in re.split(r"\n\s*\n", doc.strip("\n")) if part.strip()]


def pieces(doc: str, names: Sequence[str]) -> list[Piece]:
    """A docstring in order: paragraphs of prose, and the labels of these names."""
    found: list[Piece] = []
    for paragraph in paragraphs(doc):
        if paragraph.startswith(("    ", "- ")) or not names:
            found.append(paragraph)
            continue
        text = " ".join(paragraph.split())
        starts = list(_label(names).finditer(text))
        before = text[: starts[0].start()] if starts else text
        if before.strip():
            found.append(before.strip())
        ends = [*(match.start() for match in starts[1:]), len(text)]
        for match, end in zip(starts, ends, strict=False):
            says, *rest = _WHOLE.split(text[match.end() : end], maxsplit=1)
            given = tuple(re.findall(r"\w+", re.sub(r"\([^()]*\)", "", match["head"])))
            named = tuple(name for name in given if name in names)
            found.append(Label(named, match["head"], _trimmed(says)))
            found += [one.strip() for one in rest]
    return found


def meanings(
    doc: str, names: Sequence[str], of: Callable[[str], Mapping[str, str]] = lambda path: {}
) -> dict[str, str]:
    """What a docstring says of each of these names; "" where it says nothing.

    Where a name has no label, the sentences that say it in backticks tell it, those of other labels too. `of(path)`
    gives the meanings of what "as in `path`" refers to.
    """
    text = " ".join(" ".join(paragraphs(doc)).split())
    parts = pieces(doc, names)
    labelled = {name: one.of(name) for one in parts if isinstance(one, Label) for name in one.names}
    sentences = [each for one in parts for each in _SENTENCE.split(one if isinstance(one, str) else one.says)]
    referred = [of(path) for path in _AS_IN.findall(text)]
    found = {}
    for name in names:
        own = labelled.get(name) or " ".join(one for one in sentences if f"`{name}`" in " ".join(one.split()))
        base = next((other[name] for other in referred if other.get(name)), "")
        if not own or (base and _AS_IN.search(own)):
            own = base
        elif base and text.startswith("As `"):
            own = f"{base}; here {own}"
        found[name] = own
    return found


def said(text: str) -> Markup:
    """A piece of prose as HTML: code in backticks, nothing else is markup."""
    parts = [_lowered(part) for part in re.split(r"`([^`]+)`", " ".join(text.split()))]
    inner = [part if i % 2 == 0 else Markup("<code>{}</code>").format(part) for i, part in enumerate(parts)]
    return Markup("").join(inner)


def _lowered(text: str) -> Markup:
    """Text as HTML, the letters that stand below the line as subscripts: the site's typefaces have no such letters."""
    runs = re.compile(f"[{''.join(_LOW)}]+")
    return Markup(runs.sub(lambda run: f"<sub>{''.join(_LOW[c] for c in run[0])}</sub>", escape(text)))


def rendered(doc: str, names: Sequence[str]) -> Markup:
    """A docstring as HTML: paragraphs, what is indented as it stands, lists, and its labels as terms."""
    parts: list[Markup] = []
    for one in pieces(doc, names):
        if isinstance(one, Label):
            parts.append(Markup('<p class="meaning"><code>{}</code> {}</p>').format(one.head, said(one.says)))
        elif one.startswith("    "):
            lines = re.sub(r"^    ", "", one, flags=re.MULTILINE)
            parts.append(Markup('<pre tabindex="0"><code>{}</code></pre>').format(_lowered(lines)))
        elif one.startswith("- "):
            items = [said(item) for item in re.split(r"(?:^|\n)- ", one) if item.strip()]
            parts.append(Markup("<ul>{}</ul>").format(Markup("").join(map(Markup("<li>{}</li>").format, items))))
        else:
            parts.append(Markup("<p>{}</p>").format(said(one)))
    return Markup("\n").join(parts)


def _label(names: Sequence[str]) -> re.Pattern[str]:
    one = rf"(?:{'|'.join(map(re.escape, sorted(names, key=len, reverse=True)))}){_PAREN}"
    return re.compile(rf"(?:^|(?<=[.;,:]\s)|(?<=,\sand\s))(?P<head>{one}(?:(?:, | and ){one})*):\s")


def _trimmed(text: str) -> str:
    return re.sub(r"(?:,?\s+and|[;,.])\s*$", "", text.strip()).strip()
