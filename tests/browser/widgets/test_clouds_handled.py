"""A reader's own clouds: what the buttons beside them say, and where a file may be dropped."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from tests.browser.conftest import Reader
from tests.browser.widgets.test_own_clouds import choose, choose_both, clouds, expect_message, lines, open_clouds

NOTHING = "Nothing yet."
# Sends a drag event with files to an element, perhaps on its way to another; returns whether the page takes it.
DRAG = """(element, [type, names, to]) => {
  const dataTransfer = new DataTransfer();
  for (const name of names) dataTransfer.items.add(new File(["1,2"], name));
  const relatedTarget = to && document.querySelector(to);
  const event = new DragEvent(type, { dataTransfer, relatedTarget, bubbles: true, cancelable: true });
  return !element.dispatchEvent(event);
}"""


def test_a_pen_says_that_it_is_taken_and_is_put_away_for_a_file(reader: Callable[..., Reader]) -> None:
    """The crosshair that places points is there as long as a pen is taken; pressed again, the pen is put away."""
    _, own = open_clouds(reader)
    pens = {side: own.root.locator(f'[data-pen="{side}"]') for side in ("source", "target")}
    cross = own.root.locator('.crosshair[data-pick="main"]')

    def expect_taken(taken: str) -> None:
        for side, pen in pens.items():
            expect(pen).to_have_attribute("aria-pressed", str(side == taken).lower())
        expect(cross).to_be_visible(visible=bool(taken))

    expect_taken("")
    for press, taken in (("source", "source"), ("target", "target"), ("target", ""), ("source", "source")):
        pens[press].click()
        expect_taken(taken)
    choose(own, "source", "source.csv", lines(clouds()[0]))
    expect_message(own, "source", "source.csv: ")
    expect_taken("")


def test_clear_takes_back_every_stroke(reader: Callable[..., Reader]) -> None:
    """Of both clouds; without points of a source there is nothing to move into a target."""
    _, own = open_clouds(reader)
    copy, clear, undo = (own.root.locator(f"[data-own={action}]") for action in ("copy", "clear", "undo"))
    cross = own.root.locator('.crosshair[data-pick="main"]')
    for side in ("target", "source"):
        own.root.locator(f'[data-pen="{side}"]').click()
        expect(copy).to_be_disabled()
        cross.focus()
        for key in ("ArrowLeft", "Enter", "ArrowUp", "Enter"):
            cross.press(key)
        expect_message(own, side, "Drawn by hand: 2 points")
    expect(copy).to_be_enabled()
    clear.click()
    for side in ("source", "target"):
        expect_message(own, side, NOTHING)
    for button in (copy, clear, undo):
        expect(button).to_be_disabled()


def test_a_single_cloud_changes_its_place_and_gives_nothing_to_save(reader: Callable[..., Reader]) -> None:
    _, own = open_clouds(reader)
    files, swap = own.root.locator(".own [data-file]"), own.root.locator('[data-own="swap"]')
    expect(swap).to_be_disabled()
    choose(own, "source", "source.csv", lines(clouds()[0]))
    expect_message(own, "source", "source.csv: ")
    own.settled()
    for button in files.all():
        expect(button).to_be_disabled()
    swap.click()
    expect_message(own, "target", "source.csv: ")
    expect_message(own, "source", NOTHING)
    swap.click()
    expect_message(own, "source", "source.csv: ")
    choose(own, "target", "target.csv", lines(clouds()[1]))
    for button in files.all():
        expect(button).to_be_enabled()


def test_another_file_begins_anew(reader: Callable[..., Reader]) -> None:
    """The steps of a run were taken with the last one. The same file may be chosen again, since it may have changed."""
    _, own = open_clouds(reader)
    choose_both(own)
    for name, count in (("source.csv", 1), ("other.csv", 0)):
        own.button("step").click()
        assert own.settled().record()["log"] == [["press", "step"]]
        expect(own.root.locator('input[type=file][data-place="source"]')).to_have_value("")
        choose(own, "source", name, lines(clouds()[0] + (0.0 if count else 3.0)))
        expect_message(own, "source", f"{name}: ")
        assert len(own.settled().record()["log"]) == count
        own.button("reset").click()
        own.settled()


def test_files_may_be_dropped_on_the_figure_and_are_kept_off_the_page(reader: Callable[..., Reader]) -> None:
    """Beside it they would replace the page; over it the figure shows that it takes them, whatever part they are over,
    until they are dropped or leave."""
    page, own = open_clouds(reader)
    dropping = "e => e.classList.contains('dropping')"
    beside = page.locator("h1")
    for kind in ("dragover", "drop"):
        assert beside.evaluate(DRAG, [kind, ["a.csv"], None])
        assert not beside.evaluate(DRAG, [kind, [], None]), "text may be dragged as ever"
    assert not own.root.evaluate(dropping)
    stage = own.root.locator(".figure-stage")
    for ending in ("dragleave", "drop"):
        assert stage.evaluate(DRAG, ["dragover", ["a.csv"], None])
        stage.evaluate(DRAG, ["dragleave", ["a.csv"], "#fig-own .buttons"])
        assert own.root.evaluate(dropping)
        stage.evaluate(DRAG, [ending, ["a.csv"] * (3 if ending == "drop" else 1), "h1"])
        assert not own.root.evaluate(dropping)


@pytest.mark.parametrize(
    ("script", "words"),
    [
        ("Object.defineProperty(Blob.prototype, 'size', { get: () => 24_100_000 })",
         "a.csv: 24.1 MB exceed the limit of 24 MB."),
        ("Blob.prototype.arrayBuffer = () => Promise.reject(new Error('It was deleted.'))",
         "a.csv cannot be read: It was deleted."),
    ],
)  # fmt: skip
def test_a_file_that_cannot_be_read_is_named_with_the_reason(
    reader: Callable[..., Reader], script: str, words: str
) -> None:
    page, own = open_clouds(reader)
    page.evaluate(f"() => {{ {script}; }}")
    own.root.locator(".figure-stage").evaluate(DRAG, ["drop", ["a.csv"], None])
    expect(own.root.locator(".status-words")).to_have_text(words)
    expect_message(own, "source", NOTHING)
    own.settled()
