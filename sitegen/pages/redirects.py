"""The page at a chapter's old name, which leads to the same place of the new page.

Without scripts it leads to the top of it: a refresh drops the part of the address after #, which names a heading, or a
figure with its state.
"""

from __future__ import annotations

from jinja2 import Environment

from sitegen.assets.hosting import policy
from sitegen.chapters.content import Chapter, Site


def inline_script(templates: Environment) -> str:
    """The page's inline script."""
    return templates.get_template("redirect.js").render()


def redirect(templates: Environment, site: Site, chapter: Chapter) -> str:
    """Render the page that leads to the chapter."""
    script = inline_script(templates)
    page = templates.get_template("redirect.html")
    return page.render(site=site, chapter=chapter, script=script, policy=policy(scripts=[script]))
