"""The page for an address that is none. A host answers with it at any depth, where no relative address is of use.

So it loads nothing: its style stands in it, and its way to the start is absolute where the settings hold the site's
`url`. Without one it leads to the start of its own folder, and a small script finds the folder that the site lies in.
Policies name both by their hashes.
"""

from __future__ import annotations

from dataclasses import dataclass

from jinja2 import Environment

from sitegen.assets.hosting import policy, source_of
from sitegen.assets.tokens import colours
from sitegen.chapters.content import Site


@dataclass(frozen=True)
class Inline:
    """What stands in the page itself."""

    style: str
    script: str

    @property
    def hashes(self) -> dict[str, str]:
        """What a policy calls them."""
        return {"style": source_of(self.style), "script": source_of(self.script)}


def inline(templates: Environment) -> Inline:
    """The page's style, in the site's colours, and its script."""
    style = templates.get_template("404.css").render(colours=colours())
    return Inline(style, templates.get_template("404.js").render())


def lost(templates: Environment, site: Site, beside: str) -> str:
    """404.html. beside: the name of a file of this build, by which the script knows the site's folder."""
    parts = inline(templates)
    return templates.get_template("404.html").render(
        site=site, inline=parts, policy=policy(**parts.hashes), beside=beside
    )
