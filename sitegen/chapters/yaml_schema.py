"""Authors' YAML, validated against a small schema; every fault has the exact line and column."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from datetime import date
from typing import Any

import yaml

from sitegen.chapters.yaml_faults import Loader, cause
from sitegen.problems import Place, Problems, hint

Path = tuple[str | int, ...]
KEY = re.compile(r"[a-z][a-z0-9-]*")
MARKUP = re.compile(
    r"\$[^\s$](?:[^$]*[^\s$])?\$|\*\*|`|\]\(|(?<!\w):[a-z]+\[|\[@|(?<![\w*])\*[^\s*](?:[^*]*[^\s*])?\*(?![\w*])"
)
CUT = re.compile(r" +#(?=[^\s#])")  # our comments have a blank after the #
TEXT = "tag:yaml.org,2002:str"
MERGE = "tag:yaml.org,2002:merge"  # of the key <<
CUT_OFF = "YAML reads a # after a space as the start of a comment: quote the text"


@dataclass(frozen=True)
class Field:
    """The schema of one key: `expects` describes it in words, `accepts` tests a value, `default` replaces none.

    plain: a text that is printed as it is, and so may not look like markup.
    """

    expects: str
    accepts: Callable[[Any], bool]
    required: bool = False
    default: Any = None
    plain: bool = False


def text(required: bool = False, default: str = "") -> Field:
    """A text."""
    return Field("text", lambda v: isinstance(v, str) and bool(v.strip()), required, default)


def plain(required: bool = False) -> Field:
    """A text that is printed as it stands: no Markdown, no formula."""
    return dataclasses.replace(text(required), plain=True)


def texts() -> Field:
    """A list of texts."""
    return Field(
        "a list of strings", lambda v: isinstance(v, list) and all(isinstance(t, str) and t for t in v), False, []
    )


def flag() -> Field:
    """true or false."""
    return Field("true or false", lambda v: isinstance(v, bool), False, False)


def year(required: bool = False) -> Field:
    """A year."""
    return Field("a year", lambda v: isinstance(v, int) and not isinstance(v, bool) and 1000 <= v <= 2999, required)


@dataclass(frozen=True)
class Yaml:
    """Parsed data with the place of every key and list item, by its path; `texts`: the place of each text's first
    letter; `written`: each value as its author wrote it."""

    data: Any
    places: Mapping[Path, Place]
    root: Place
    texts: Mapping[Path, Place] = dataclasses.field(default_factory=dict)
    written: Mapping[Path, str] = dataclasses.field(default_factory=dict)

    def at(self, *path: str | int) -> Place:
        """The place of a key or item, or of its nearest parent."""
        while path:
            if path in self.places:
                return self.places[path]
            path = path[:-1]
        return self.root

    def text_at(self, *path: str | int) -> Place:
        """The place of a text's first letter. The lines of a text after `|` all begin in that column."""
        return self.texts.get(path) or self.at(*path)


def read(source: str, path: str, problems: Problems, first_line: int = 1) -> Yaml | None:
    """Parse YAML; None, and a problem, if it is invalid."""
    places: dict[Path, Place] = {}
    texts: dict[Path, Place] = {}
    raw: dict[Path, str] = {}
    try:
        loader = Loader(source)
        try:
            node = loader.get_single_node()
            if node is not None:
                _collect(node, (), places, path, first_line, problems)
                lines = source.split("\n")
                for at, scalar in _scalars(node, ()):
                    texts[at] = _text_place(scalar, lines, Place(path, first_line, 1))
                    raw[at] = scalar.value
                    end = scalar.end_mark
                    remainder = CUT.match(lines[end.line], end.column)
                    if remainder and not scalar.style:  # a quoted text, or one below a |, is not cut off
                        problems.add(Place(path, first_line + end.line, remainder.end()), CUT_OFF)
            data = None if node is None else loader.construct_document(node)
            return Yaml(data, places, Place(path, first_line, 1), texts, raw)
        finally:
            loader.dispose()
    except yaml.MarkedYAMLError as error:
        place = Place(path, first_line, 1)
        line, column, message = cause(source, error)
        problems.add(Place(path, place.line + line, place.column + column), f"invalid YAML: {message}")
    # These errors have no mark: a control character, a 31st of February, a list that contains itself.
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        problems.add(Place(path, first_line, 1), f"invalid YAML: {str(error).splitlines()[0]}")
    problems.unread.add(path)
    return None


def _collect(node: Any, at: Path, places: dict[Path, Place], path: str, first: int, problems: Problems) -> None:
    """Note the places of keys and items. Every key becomes the text that its author wrote, even `no`, `null` or `1`."""
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            if not isinstance(key, yaml.ScalarNode):
                continue  # not a valid key; the loader reports it, or the schema as unknown
            key.tag = key.tag if key.tag == MERGE else TEXT
            place = Place(path, first + key.start_mark.line, key.start_mark.column + 1)
            if (*at, key.value) in places:
                problems.add(place, f"duplicate key {key.value!r}")
            places[(*at, key.value)] = place
            _collect(value, (*at, key.value), places, path, first, problems)
    elif isinstance(node, yaml.SequenceNode):
        for i, item in enumerate(node.value):
            places[(*at, i)] = Place(path, first + item.start_mark.line, item.start_mark.column + 1)
            _collect(item, (*at, i), places, path, first, problems)


def _scalars(node: Any, at: Path) -> Iterator[tuple[Path, Any]]:
    """Yield the texts, numbers and other scalars below a node, each with its path."""
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            yield from _scalars(value, (*at, key.value) if isinstance(key, yaml.ScalarNode) else at)
    elif isinstance(node, yaml.SequenceNode):
        for i, item in enumerate(node.value):
            yield from _scalars(item, (*at, i))
    else:
        yield at, node


def _text_place(node: Any, lines: list[str], root: Place) -> Place:
    """Where a text begins: after its quote, or for a block text below its | or >, after the indentation."""
    line, column = node.start_mark.line, node.start_mark.column + (node.style in ("'", '"'))
    if node.style in ("|", ">"):
        line += 1
        first = next((text for text in lines[line:] if text.strip()), "")
        column = len(first) - len(first.lstrip())
    return Place(root.path, root.line + line, column + 1)


def validated(document: Yaml, fields: Mapping[str, Field], problems: Problems, *at: str | int) -> dict[str, Any]:
    """The mapping at a path, with defaults filled in; unknown, missing and invalid keys go to `problems`."""
    mapping = document.data
    for step in at:
        mapping = mapping[step]
    result = {name: field.default for name, field in fields.items()}
    if not isinstance(mapping, dict):
        problems.add(document.at(*at), "expected a mapping of names to values")
        return result
    for name, value in mapping.items():
        if name not in fields:
            problems.add(document.at(*at, name), f"unknown key {str(name)!r}{hint(str(name), fields)}")
        elif not fields[name].accepts(value):
            problems.add(document.at(*at, name), f"{name}: {_type_message(fields[name], name, value, document, at)}")
        else:
            result[name] = value
            if fields[name].plain and (markup := MARKUP.search(value)):
                message = f"{name}: plain text only; {markup[0]!r} would be printed as is"
                problems.add(document.at(*at, name), message)
    for name, field in fields.items():
        if field.required and name not in mapping:
            problems.add(document.at(*at), f"missing {name}: expected {field.expects}")
    return result


def _type_message(field: Field, name: Any, value: Any, document: Yaml, at: Path) -> str:
    """The message for an invalid value; quotes it as written if YAML read it as something else."""
    if value is None:
        return f"expected {field.expects}, got nothing"
    raw = document.written.get((*at, name), str(value))
    quoted = isinstance(value, (int, float, date)) and field.accepts(raw)
    suggestion = f"; quote it: {name}: \"{raw}\"" if quoted else ""
    return f"expected {field.expects}, got {raw if isinstance(value, (int, float, date)) else repr(value)}{suggestion}"


def entries(source: str, path: str, things: str, problems: Problems) -> tuple[Yaml | None, tuple[Any, ...]]:
    """Parse a file that is a mapping of keys to `things`, and return it with its keys; invalid keys are problems.
    A file that is not a mapping counts as unread: the names that it may mean to define are not missed elsewhere."""
    document = read(source, path, problems)
    if document is None or document.data is None:
        return None, ()
    if not isinstance(document.data, dict):
        problems.add(document.at(), f"expected a mapping of keys to {things}")
        problems.unread.add(path)
        return None, ()
    for key in document.data:
        if not KEY.fullmatch(str(key)):
            message = f"invalid key {key!r}: use lower-case ASCII letters, digits and hyphens, starting with a letter"
            problems.add(document.at(key), message)
    return document, tuple(document.data)
