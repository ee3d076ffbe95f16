"""Where a reader may go next from a chapter's end: a few places on the site, each with a reason to go there."""

from __future__ import annotations

from dataclasses import dataclass

from sitegen.chapters import yaml_schema
from sitegen.problems import Place, Problems

ONWARD = {"to": yaml_schema.text(required=True), "says": yaml_schema.plain(required=True)}
MOST = 3


@dataclass(frozen=True)
class Onward:
    """A target, written as for `:ref`, and the reason in plain words. at: its place in the front matter."""

    to: str
    says: str
    at: Place


def read_onward(front: yaml_schema.Yaml, problems: Problems) -> tuple[Onward, ...]:
    """The targets under `next:`, in order; faults go to `problems`, except for missing targets."""
    entries = front.data.get("next") if isinstance(front.data, dict) else None
    targets: list[Onward] = []
    for i in range(len(entries) if isinstance(entries, list) else 0):
        values = yaml_schema.validated(front, ONWARD, problems, "next", i)
        if i == MOST:
            problems.add(front.at("next", i), f"next: at most {MOST} entries, so that readers can choose")
        if not values["to"] or not values["says"]:
            continue
        if values["to"] in [target.to for target in targets]:
            problems.add(front.text_at("next", i, "to"), f"next: duplicate {values['to']!r}")
        targets.append(Onward(values["to"], values["says"], front.text_at("next", i, "to")))
    return tuple(targets)
