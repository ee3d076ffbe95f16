"""404.html: hosts serve it at any depth, so it contains its style and knows the way to the start."""

from __future__ import annotations

import re

from sitegen.assets.hosting import source_of
from tests.sitegen.conftest import SITE, Project, policy_of


def test_the_page_for_a_missing_address_stands_at_any_depth(project: Project) -> None:
    """It loads nothing; its link is absolute if the site's address is known, and otherwise found by a script."""
    project.build()
    known = project.page("404.html")
    assert '<a href="https://example.org/ladder/index.html">' in known
    assert "<script" not in known
    project.write("content/site.yaml", SITE.replace("url: https://example.org/ladder\n", ""))
    project.build()
    unknown = project.page("404.html")
    assert re.search(r'<a href="index.html" data-beside="assets/site\.\w+\.css">', unknown)
    for page in (known, unknown):
        assert not re.search(r'(?:src|href)="(?!https:|data:,|index.html)', page)
        for text in re.findall(r"<(?:style|script)>(.*?)</(?:style|script)>", page, re.DOTALL):
            assert source_of(text) in policy_of(page)
