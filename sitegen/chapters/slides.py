"""The slides in a chapter's front matter: one mapping per slide, its texts parsed as Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from markdown_it.token import Token

from sitegen.chapters import yaml_schema
from sitegen.chapters.promises import tell_unheld
from sitegen.markup.located import place_of
from sitegen.markup.parser import parse
from sitegen.markup.source import Source
from sitegen.problems import Place, Problems

SLIDE = {
    "title": yaml_schema.text(required=True),
    "text": yaml_schema.text(),
    "equation": yaml_schema.text(),
    "figure": yaml_schema.text(),
    "set": yaml_schema.text(),
    "panels": yaml_schema.texts(),
    "controls": yaml_schema.texts(),
    "readouts": yaml_schema.texts(),
    "plot": yaml_schema.text(),
    "notes": yaml_schema.text(),
}
OF_A_FIGURE = ("set", "panels", "controls", "readouts")
LINE = ["paragraph_open", "inline", "paragraph_close"]
# Elements that are not allowed in a slide's text, and where they belong.
ELSEWHERE = {
    "heading_open": "a slide's only heading is its title",
    "figure": "a figure belongs in the chapter; a slide shows it with figure: id",
    "plot": "a plot belongs in the chapter; a slide shows it with plot: id",
    "picture": "pictures belong in the chapter, beside the words that they show",
    "predict": "predictions belong in the chapter, with their figures",
    "aside": "asides belong in the chapter; in a slide's notes, write plain text",
    "math_block_label": "a numbered equation belongs in the chapter; a slide shows it with equation: label",
    "footnote_ref": "side notes belong in the chapter",
    "claim_open": "claims belong in the chapter, with their tests",
}


@dataclass(frozen=True)
class Slide:
    """One slide as written. title, text and notes: tokens; the rest names things of the chapter, "" or () for none.

    front, index: the front matter and the slide's position in it, for places.
    """

    title: Sequence[Token]
    text: Sequence[Token]
    notes: Sequence[Token]
    equation: str
    figure: str
    set: str
    panels: tuple[str, ...]
    controls: tuple[str, ...]
    readouts: tuple[str, ...]
    plot: str
    front: yaml_schema.Yaml
    index: int

    def at(self, *path: str | int) -> Place:
        """The place of one of the slide's entries in the front matter."""
        return self.front.at("slides", self.index, *path)

    def text_at(self, name: str, offset: int = 0) -> Place:
        """The place of an offset in one of its single-line texts."""
        start = self.front.text_at("slides", self.index, name)
        return Place(start.path, start.line, start.column + offset)


def read_slides(front: yaml_schema.Yaml, chapter: Source, problems: Problems) -> tuple[Slide, ...]:
    """The slides of a chapter's front matter, in order; faults in themselves go to `problems`."""
    entries = front.data.get("slides") if isinstance(front.data, dict) else None
    return tuple(_read(front, i, chapter, problems) for i in range(len(entries) if isinstance(entries, list) else 0))


def _read(front: yaml_schema.Yaml, i: int, chapter: Source, problems: Problems) -> Slide:
    values = yaml_schema.validated(front, SLIDE, problems, "slides", i)

    def parsed(name: str) -> Sequence[Token]:
        start, had = front.text_at("slides", i, name), len(problems.found)
        source = Source(chapter.path, "\n" * (start.line - 1) + values[name], problems, start.column - 1)
        tokens = parse(source).tokens
        all_tokens = [t for token in tokens for t in (token, *(token.children or []))]
        wrong = [t for t in all_tokens if t.type in ELSEWHERE or (t.type == "try" and name != "text")]
        for token in wrong:
            message = ELSEWHERE.get(token.type, "buttons belong in the slide's text")
            problems.add(place_of(token) or front.at("slides", i, name), message)
        if name != "title":  # a title names what the slide shows, as a heading does
            tell_unheld(source.text, source.at, problems)
        elif values[name] and len(problems.found) == had and [token.type for token in tokens] != LINE:
            message = "a slide's title is a line of text, not a list or a quotation: write 1\\. or \\> for the signs"
            problems.add(start, message)
        return () if wrong else tokens

    slide = Slide(
        parsed("title"),
        parsed("text"),
        parsed("notes"),
        values["equation"],
        values["figure"],
        values["set"],
        tuple(values["panels"]),
        tuple(values["controls"]),
        tuple(values["readouts"]),
        values["plot"],
        front,
        i,
    )
    if slide.figure and slide.plot:
        problems.add(slide.at("plot"), "a slide shows a figure or a plot, not both")
    for name in OF_A_FIGURE:
        if values[name] and not slide.figure:
            problems.add(slide.at(name), f"{name}: the slide has no figure; add figure: id")
    if values["title"] and not (values["text"] or slide.equation or slide.figure or slide.plot):
        problems.add(slide.at(), "empty slide: add text, an equation, a figure or a plot")
    return slide
