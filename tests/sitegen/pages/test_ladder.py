"""The ladder beside every page: a chapter's emblem, if it names one, is shown by its rung."""

from __future__ import annotations

import re

from sitegen.assets import emblems
from tests.sitegen.conftest import Project

EMBLEM = re.compile(r'<svg class="emblem"[^>]*aria-hidden="true"><path fill-rule="evenodd" d="([^"]+)"')


def test_a_chapters_emblem_stands_in_the_ladder_of_every_page(project: Project) -> None:
    project.chapter("\n## D {#deep}\n")
    project.build()
    assert not EMBLEM.search(project.page("second.html")), "no emblem, no picture"
    project.chapter("\n## D {#deep}\n", front='title: T\nrung: "1"\nslug: second\nsummary: S\nemblem: nearest')
    project.build()
    for page in ("index.html", "second.html"):
        assert set(EMBLEM.findall(project.page(page))) == {emblems.path("nearest")}, page
