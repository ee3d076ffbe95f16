"""Numpydoc docstrings → HTML: griffe parses them, this module renders their sections."""

from __future__ import annotations

import re
from collections.abc import Sequence

import griffe
from griffe import DocstringSectionKind as Kind
from markupsafe import Markup, escape

from sitegen.markup.code import highlighted
from sitegen.markup.typography import apostrophes

_LOW = dict(zip("ᵢⱼₖₘₙₓ", "ijkmnx", strict=True))
_LISTED = {
    Kind.parameters: "Parameters",
    Kind.attributes: "Attributes",
    Kind.returns: "Returns",
    Kind.raises: "Raises",
}
_DOI = re.compile(r"doi:(10\.[^\s<]+)")


def sections(thing: griffe.Object) -> list[griffe.DocstringSection]:
    """The sections of an object's docstring; empty if it has none."""
    return thing.docstring.parsed if thing.docstring else []


def parameters(thing: griffe.Object) -> list[griffe.DocstringParameter]:
    """The parameters that an object's docstring lists."""
    return [parameter for part in sections(thing) if part.kind is Kind.parameters for parameter in part.value]


def rendered(thing: griffe.Object) -> Markup:
    """An object's docstring as HTML, its sections in order."""
    return Markup("\n").join(map(_section, sections(thing)))


def prose(text: str) -> Markup:
    """Paragraphs, lists and indented blocks as HTML; the latter are kept verbatim."""
    parts: list[Markup] = []
    for block in re.split(r"\n\s*\n", text.strip("\n")):
        if block.startswith("    "):
            lines = re.sub(r"^    ", "", block, flags=re.MULTILINE)
            parts.append(Markup('<pre tabindex="0"><code>{}</code></pre>').format(_with_subscripts(lines)))
        elif block.startswith("- "):
            parts.append(_list("ul", re.split(r"(?:^|\n)- ", block)))
        elif block.startswith("1. "):
            parts.append(_list("ol", re.split(r"(?:^|\n)\d+\. ", block)))
        elif block.strip():
            parts.append(Markup("<p>{}</p>").format(said(block)))
    return Markup("\n").join(parts)


def said(text: str) -> Markup:
    """A piece of prose as HTML. Only code in backticks and reference numbers count as markup."""
    text = apostrophes(re.sub(r"\[(\d+)\]_", r"[\1]", text))
    parts = [_with_subscripts(part) for part in re.split(r"`([^`]+)`", " ".join(text.split()))]
    inner = [part if i % 2 == 0 else Markup("<code>{}</code>").format(part) for i, part in enumerate(parts)]
    return Markup("").join(inner)


def _section(part: griffe.DocstringSection) -> Markup:
    if part.kind is Kind.text:
        return prose(part.value)
    if part.kind is Kind.examples:
        return _with_title("Examples", Markup("\n").join(_example(kind, text) for kind, text in part.value))
    if part.kind is Kind.admonition and part.title == "References":
        works = re.split(r"(?:^|\n)\.\. \[\d+\] ", part.value.description)
        return _with_title("References", Markup(_DOI.sub(_doi, _list("ol", works))))
    if part.kind is Kind.admonition:
        return _with_title(str(part.title), prose(part.value.description))
    rows = [Markup("<dt>{}</dt><dd>{}</dd>").format(_term(e), prose(e.description)) for e in part.value]
    return _with_title(_LISTED[part.kind], Markup('<dl class="fields">{}</dl>').format(Markup("").join(rows)))


def _term(element: griffe.DocstringElement) -> Markup:
    """A parameter's name with its type and default, or the type of a returned value or an exception."""
    name, kind = getattr(element, "name", ""), str(element.annotation or "")
    if not name or name.startswith("*"):
        return Markup("<code>{}</code>").format(name or kind)
    if isinstance(element, griffe.DocstringParameter) and element.default is not None:
        kind += ", optional" if str(element.default) == "None" else f", default {element.default}"
    return Markup("<code>{}</code> <span>{}</span>").format(name, kind)


def _example(kind: Kind, text: str) -> Markup:
    if kind is Kind.text:
        return prose(text)
    return Markup('<pre class="code" tabindex="0"><code>{}</code></pre>').format(highlighted(text, "pycon"))


def _with_title(title: str, inner: Markup) -> Markup:
    return Markup("<h4>{}</h4>\n{}").format(title, inner)


def _list(tag: str, items: Sequence[str]) -> Markup:
    inner = Markup("").join(Markup("<li>{}</li>").format(said(item)) for item in items if item.strip())
    return Markup("<{0}>{1}</{0}>").format(Markup(tag), inner)


def _doi(match: re.Match[str]) -> str:
    return f'<a href="https://doi.org/{match[1]}">doi:{match[1]}</a>'


def _with_subscripts(text: str) -> Markup:
    """Text as HTML, with Unicode subscript letters as <sub>: the site's typefaces lack them."""
    runs = re.compile(f"[{''.join(_LOW)}]+")
    return Markup(runs.sub(lambda run: f"<sub>{''.join(_LOW[c] for c in run[0])}</sub>", escape(text)))
