"""Decks of a much larger site: with many chapters of long titles, each title slide still fits."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from sitegen.assets import typefaces
from sitegen.cache.files import cache_dir
from sitegen.pages.title_slide import QUESTION, RUNGS, TITLE
from sitegen.pipeline.build import build
from sitegen.pipeline.context import Parts
from tests.browser.conftest import Reader
from tests.browser.layout import BEYOND, MISFITS, remaining
from tests.browser.server import SiteServer
from tests.sitegen.conftest import TOY, Project

LONG = "A title that is as long as any that its slide has room for, among words of all lengths"
ASKS = "How much of a question can be read from the last row of a lecture hall while its speaker is still looking for "
SIZES = [(1280, 720), (1366, 650), (1920, 1080), (1024, 768), (960, 544)]
RUNGS_SEEN = """() => [...document.querySelectorAll('.slide-title .step')].map(e => {
  const r = e.getBoundingClientRect();
  return [e.textContent.trim(), Math.round(r.height), e.classList.contains('current')];
})"""


def grow(folder: Path, count: int) -> Path:
    """Build a site of this many chapters, each with slides and the longest title and question allowed."""
    project = Project(folder, cache_dir())
    for path in (folder / "content").glob("*.md"):
        path.unlink()
    for i in range(count):
        title = (LONG + " and so on")[: TITLE - 3] + f" {i:02}"
        question = (ASKS + "the pointer, and the light")[:QUESTION]
        front = f'title: "{title}"\nslug: c{i:02}\nrung: "{i}"\nquestion: "{question}"\nsummary: S'
        project.write(f"content/{i:02}-c{i:02}.md", f"---\n{front}\nslides:\n  - title: A\n    text: B\n---\n\nText.\n")
    project.write("content/references.yaml", "")
    ladder = "".join(f'  - {{rung: "{i}", title: "{LONG}"}}\n' for i in range(count))
    site = (folder / "content/site.yaml").read_text("utf-8")
    project.write("content/site.yaml", re.sub(r"ladder:\n(?:  - .*\n)+", f"ladder:\n{ladder}", site))
    own = {"assemble": None, "search": None, "cut_fonts": typefaces.make, "licences": lambda names, cache: []}
    parts = Parts({"toy": TOY}, {}, **own)
    build(folder, project.site, pack=False, parts=parts)
    return project.site


@pytest.fixture(scope="module", params=[RUNGS, 25, 60])
def many(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[int, Path]:
    return request.param, grow(tmp_path_factory.mktemp("grown"), request.param)


@pytest.fixture
def server(many: tuple[int, Path]) -> Iterator[SiteServer]:
    running = SiteServer(many[1])
    yield running
    running.stop()


def test_the_title_slide_fits_however_many_chapters_there_are(
    reader: Callable[..., Reader], many: tuple[int, Path]
) -> None:
    """On each screen: the first, a middle and the last deck; a rung is tall enough to be clicked."""
    count, result = many[0], []
    visitor = reader(reduced_motion="reduce")
    for number in (0, count // 2, count - 1):
        page = visitor.open(f"slides-c{number:02}.html")
        for width, height in SIZES:
            page.set_viewport_size({"width": width, "height": height})
            result += [f"deck {number} at {width} × {height}: {fault}" for fault in remaining(page, MISFITS)]
            if width >= 1200:
                rungs = page.evaluate(RUNGS_SEEN)
                assert min(high for _, high, _ in rungs) >= 24, rungs
        page.set_viewport_size({"width": 390, "height": 844})
        result += [f"deck {number} at 390: {fault}" for fault in remaining(page, BEYOND)]
        stands(page, number, count)
        page.close()
    assert not result, "\n".join(result)


def stands(page: Page, number: int, count: int) -> None:
    """The deck's own rung is among those shown; links state how many others there are and lead to them."""
    rungs = [text for text, _, _ in page.evaluate(RUNGS_SEEN)]
    assert [text.split()[0] for text, _, current in page.evaluate(RUNGS_SEEN) if current] == [str(number)]
    assert len(rungs) == min(count, RUNGS)
    rest = [int(match[1]) for text in rungs if (match := re.fullmatch(r"…\s+(\d+) more (?:above|below)", text))]
    assert len(rungs) - len(rest) + sum(rest) == count
    links = page.locator(".slide-title .step a", has_text=" more ")
    assert links.count() == len(rest)
    for link in links.all():
        expect(link).to_have_attribute("href", "slides.html")
