"""The 404 page. Hosts serve it for missing addresses at any depth, where relative links do not work.

So it loads nothing: its style is inline, and its link to the home page is absolute if the settings have the site's
`url`. Otherwise the link leads to the requested folder, and a small script finds the folder of the site. Policies allow
both by their hashes.
"""

from __future__ import annotations

from dataclasses import dataclass

from jinja2 import Environment

from sitegen.assets.hosting import policy
from sitegen.assets.tokens import colours
from sitegen.chapters.content import Site


@dataclass(frozen=True)
class Inline:
    """The page's inline style and script."""

    style: str
    script: str


def inline(templates: Environment) -> Inline:
    """Render the page's style, in the site's colours, and its script."""
    style = templates.get_template("404.css").render(colours=colours())
    return Inline(style, templates.get_template("404.js").render())


def lost(templates: Environment, site: Site, beside: str) -> str:
    """Render 404.html. beside: the name of a file of this build, by which the script recognises the site's folder."""
    parts = inline(templates)
    allowed = policy([parts.style], [parts.script])
    return templates.get_template("404.html").render(site=site, inline=parts, policy=allowed, beside=beside)
