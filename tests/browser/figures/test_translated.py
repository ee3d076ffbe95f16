"""A page in another language: browsers put each text into elements of their own, whenever it is written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

from playwright.sync_api import Page, expect

from sitegen.bench.pages import until
from tests.browser.conftest import Reader
from tests.browser.figure import Figure

# As Chromium does: in two font elements, also what is written later. Drawings are left alone.
TRANSLATE = """() => {
  window.again = 0;
  const one = text => {
    const [outer, inner] = [document.createElement('font'), document.createElement('font')];
    inner.textContent = text.data.replace(/[A-Za-z]+/g, 'Wort');
    outer.append(inner);
    text.replaceWith(outer);
    window.again++;
  };
  const all = root => {
    const walk = document.createTreeWalker(root, NodeFilter.SHOW_TEXT), texts = [];
    while (walk.nextNode()) texts.push(walk.currentNode);
    texts.filter(text => /[A-Za-z]/.test(text.data) && text.parentElement.translate
      && !text.parentElement.closest('svg, script, style, font')).forEach(one);
  };
  all(document.body);
  new MutationObserver(changes => changes.flatMap(change => [...change.addedNodes])
    .filter(node => node.isConnected).forEach(node => all(node.parentElement)))
    .observe(document.body, { childList: true, subtree: true });
}"""


def translated(page: Page) -> None:
    page.evaluate(TRANSLATE)


def test_words_that_stay_are_not_written_again(reader: Callable[..., Reader]) -> None:
    """Labels stay translated while a figure is used, and what changes is translated anew."""
    page = reader(reduced_motion="reduce").open("kabsch.html")
    solve = Figure(page, "fig-solve").live()
    labels = solve.root.locator(".figure-desk :is(.buttons button, dt, .control-label)")
    translated(page)
    before = solve.readout("rms")
    solve.button("solve").click()
    solve.changes("rms", before)
    words = labels.all_text_contents()
    assert len(words) > 5
    assert all("Wort" in label for label in words)
    written = page.evaluate("window.again")
    page.evaluate("window.buttons = [...document.querySelectorAll('#fig-solve .buttons font')]")
    solve.button("back").click()
    solve.shows("rms", before)
    assert labels.all_text_contents() == words
    assert page.evaluate("window.buttons.every(each => each.isConnected)")
    assert page.evaluate("window.again") - written < len(words)


def test_a_button_that_runs_says_so_and_says_its_own_name_again(reader: Callable[..., Reader]) -> None:
    page = reader().open("icp.html")
    nearest = Figure(page, "fig-nearest").live()
    page.evaluate("Ladder.limits.run = 1e9")
    run = nearest.button("run")
    name = run.text_content()
    page.evaluate(TRANSLATE.replace("'Wort'", "word => word.toUpperCase()"))
    for expected in ("PAUSE", (name or "").upper(), "PAUSE"):
        run.click()
        expect(run).to_have_text(expected)


def test_a_saved_picture_has_the_captions_as_they_are_read(reader: Callable[..., Reader], tmp_path: Path) -> None:
    page = reader(reduced_motion="reduce").open("race.html")
    translated(page)
    root = page.locator("#fig-race")
    captions = root.locator(".figure-stage .panel-caption span:visible")
    until(page, "document.querySelectorAll('#fig-race .panel-caption font').length > 8")
    root.locator(".figure-more summary").click()
    with page.expect_download() as coming:
        root.locator('[data-picture="svg"]').click()
    path = tmp_path / "picture.svg"
    coming.value.save_as(path)
    texts = ElementTree.fromstring(path.read_text("utf-8")).findall("{http://www.w3.org/2000/svg}text")
    saved = " ".join(text.text or "" for text in texts)
    assert captions.count() >= 9
    assert saved.count("Wort") >= 9
