"""A reader's clouds stay whatever else is pressed; and reasons for refusing a file are given in full."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from tests.browser.conftest import Reader
from tests.browser.layout import SIDEWAYS
from tests.browser.widgets.test_clouds_in_turn import DROP
from tests.browser.widgets.test_own_clouds import choose, choose_both, clouds, expect_message, lines, open_clouds


def test_clouds_outlive_a_prediction_and_a_button_in_the_text(reader: Callable[..., Reader]) -> None:
    """Both show other clouds; the reader's remain available all the while, and are shown on request."""
    page, own = open_clouds(reader)
    source, target = clouds()
    choose(own, "source", "source.csv", lines(source))
    choose(own, "target", "target.csv", lines(target))
    expect_message(own, "target", f"target.csv: {len(target)} points")
    own.settled()
    given, points = own.record()["given"], own.readout("points")
    assert len(given) == 2

    own.root.locator(".predict-answers button").first.click()
    expect(own.root.locator(".predict[data-told]")).to_be_visible(timeout=60_000)
    own.settled()
    assert (own.record()["given"], own.record()["controls"]["clouds"] == "own") == (given, False)
    tries = page.locator('details:has(button.try[data-figure="fig-own"])').first
    tries.locator("summary").click()
    tries.locator("button.try").first.click()
    own.settled()
    assert own.record()["given"] == given
    own.root.locator(".predict [data-do=again]").click()
    own.settled()
    assert own.record()["given"] == given
    expect_message(own, "source", f"source.csv: {len(source)} points")

    swap = own.root.locator('[data-own="swap"]')
    expect(swap).to_be_disabled()  # the clouds shown are not the reader's
    own.set("clouds", "own")
    own.settled()
    assert own.readout("points") == points
    expect(swap).to_be_enabled()


GIVE = """async ([first, last]) => {
  for (let i = first; i < last; i++) {
    const data = new TextEncoder().encode(`1,${i}\n2,${i}`);
    await Ladder.runtime.give({ figure: "fig-own", widget: "own-clouds", name: `${i}.csv`, data });
  }
}"""


def test_a_file_that_is_no_longer_kept_is_told_so(reader: Callable[..., Reader]) -> None:
    """After many others it is forgotten: its run says so beside the button that opens it, as the figure does. One in
    use is kept, however many are opened."""
    page, own = open_clouds(reader)
    choose_both(own)
    own.reached("[data-pin]").click()
    own.warm()  # the warm-up draws these two files, and a drawn file is the last to be forgotten
    for i in range(3):
        page.evaluate(GIVE, (10 * i, 10 * i + 10))
        own.button("step").click()
        own.settled()
        assert page.evaluate("Object.values(Ladder.figures.get('fig-own').record.given).every(Ladder.runtime.holds)")
    page.evaluate(GIVE, (30, 50))
    own.root.locator(".runs").get_by_role("button", name="Restore").click()
    expect_message(own, "source", "No longer stored; open it again. It was source.csv: ")
    expect(own.root.locator(".figure-status")).to_contain_text("Choose or draw a source and a target first.")
    choose_both(own)
    expect_message(own, "source", "source.csv: ")
    own.changes("rms", "–")


def test_more_files_than_places_are_refused(reader: Callable[..., Reader]) -> None:
    """None of them is taken, since nobody knows which two were meant."""
    _, own = open_clouds(reader)
    source, _ = clouds()
    text = lines(source).decode()
    own.root.evaluate(DROP, [["a.csv", "b.csv", "c.csv"], [text] * 3])
    expect(own.root.locator(".figure-status")).to_contain_text("3 files at once: open 2, the source and the target.")
    assert not own.record().get("given")


@pytest.mark.parametrize("width", [360, 390, 544])
def test_the_two_downloads_stay_side_by_side(reader: Callable[..., Reader], width: int) -> None:
    _, own = open_clouds(reader, width=width, height=844)
    first, second = own.boxes(".own [data-file]")
    assert first["y"] == second["y"]
    assert 0 < second["x"] - first["x"] - first["width"] < 20


def test_a_long_name_leaves_room_for_the_reason(reader: Callable[..., Reader]) -> None:
    """A name without spaces, as scanners write them: the page keeps its width, and the reason is shown in full."""
    page, own = open_clouds(reader, width=390, height=844)
    name = f"2026-05-17_{'building-A_' * 20}final.csv"
    choose(own, "source", name, b"1,2\n3,four\n")
    status = own.root.locator(".figure-status")
    expect(status).to_contain_text("line 2: 'four' is not a number", timeout=60_000)
    expect(status).to_contain_text("final.csv")
    assert page.evaluate(SIDEWAYS) == []
