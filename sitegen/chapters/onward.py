"""Where a reader may go from a chapter's end: a few places on the site, each with the reason to go there."""

from __future__ import annotations

from dataclasses import dataclass

from sitegen.chapters import yaml_schema
from sitegen.problems import Place, Problems

ONWARD = {"to": yaml_schema.text(required=True), "says": yaml_schema.text(required=True)}
MOST = 3


@dataclass(frozen=True)
class Onward:
    """A place as the front matter names it, as `:ref` would, and the reason in plain words. at: where it is named."""

    to: str
    says: str
    at: Place


def read_onward(front: yaml_schema.Yaml, problems: Problems) -> tuple[Onward, ...]:
    """The places under `next:`, in order; what is wrong goes to `problems`, but for names that lead nowhere."""
    entries = front.data.get("next") if isinstance(front.data, dict) else None
    places: list[Onward] = []
    for i in range(len(entries) if isinstance(entries, list) else 0):
        values = yaml_schema.validated(front, ONWARD, problems, "next", i)
        if i == MOST:
            problems.add(front.at("next", i), f"next: {MOST} places at most, so that a reader can choose")
        if not values["to"] or not values["says"]:
            continue
        if values["to"] in [one.to for one in places]:
            problems.add(front.text_at("next", i, "to"), f"next: {values['to']!r} appears twice")
        places.append(Onward(values["to"], values["says"], front.text_at("next", i, "to")))
    return tuple(places)
