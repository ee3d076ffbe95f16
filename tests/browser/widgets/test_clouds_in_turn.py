"""Files for the same place in quick succession: the figure shows the last one chosen."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from playwright.sync_api import expect

from sitegen.bench.pages import until
from tests.browser.conftest import Reader
from tests.browser.widgets.test_own_clouds import choose, clouds, expect_message, lines, open_clouds

HELD = """() => {
    const { arrayBuffer } = File.prototype;
    globalThis.held = [];
    globalThis.heard = [];
    File.prototype.arrayBuffer = function () {
        const wait = this.name.startsWith("slow") ? new Promise((go) => held.push(go)) : Promise.resolve();
        return wait.then(() => arrayBuffer.call(this)).finally(() => setTimeout(() => heard.push(this.name)));
    };
}"""
DROP = """(figure, [names, texts]) => {
    const dataTransfer = new DataTransfer();
    for (const [at, text] of texts.entries()) dataTransfer.items.add(new File([text], names[at]));
    figure.dispatchEvent(new DragEvent("drop", { dataTransfer, bubbles: true, cancelable: true }));
}"""
# Whether the first panel is as Python drew it.
DRAWN = """(root, id) => {
    const template = document.createElement("template");
    const [{ name, svg }] = Ladder.figures.get(id).frame.panels;
    template.innerHTML = svg;
    return Ladder.drawing(root, name).outerHTML === template.innerHTML;
}"""


def test_a_file_chosen_later_is_not_replaced_by_one_that_took_longer(reader: Callable[..., Reader]) -> None:
    """Each is named while it is read; the earlier one's result is ignored."""
    page, own = open_clouds(reader)
    source, target = clouds()
    page.evaluate(HELD)
    choose(own, "source", "slow.csv", lines(target))
    expect_message(own, "source", "Reading slow.csv")
    choose(own, "source", "quick.csv", lines(source))
    expect_message(own, "source", f"quick.csv: {len(source)} points")
    own.settled()
    given = own.record()["given"]
    page.evaluate("held.forEach(go => go())")
    until(page, "heard.includes('slow.csv')")
    choose(own, "target", "target.csv", lines(target))  # Python, which reads files in order, has received any slow one
    expect_message(own, "target", f"target.csv: {len(target)} points")
    own.settled()
    assert own.record()["given"]["source"] == given["source"]
    expect_message(own, "source", "quick.csv")


def test_two_files_dropped_one_by_one_take_both_places(reader: Callable[..., Reader]) -> None:
    """The second is not put where the first is still being read."""
    page, own = open_clouds(reader)
    page.evaluate(HELD)
    texts = [lines(points).decode() for points in clouds()]
    own.root.evaluate(DROP, [["slow.csv"], texts[:1]])
    own.root.evaluate(DROP, [["quick.csv"], texts[1:]])
    expect_message(own, "target", "quick.csv")
    until(page, "held.length === 1")
    page.evaluate("held[0]()")
    expect_message(own, "source", "slow.csv: ")
    own.settled()
    assert set(own.record()["given"]) == {"source", "target"}
    expect(own.root.locator('[data-told="target"]')).to_contain_text("quick.csv")
    assert np.unique(list(own.record()["given"].values())).size == 2


def test_beside_a_faulty_file_a_good_one_waits_for_nothing(reader: Callable[..., Reader]) -> None:
    """Both are refused because of the one; then each place takes a file, one by one."""
    _, own = open_clouds(reader)
    good, second = [lines(points).decode() for points in clouds()]
    own.root.evaluate(DROP, [["bad.csv", "good.csv"], ["no numbers", good]])
    expect(own.root.locator(".figure-status")).to_contain_text("bad.csv: line")
    expect_message(own, "source", "Nothing yet.")
    expect_message(own, "target", "Nothing yet.")
    own.root.evaluate(DROP, [["next.csv"], [good]])
    expect_message(own, "source", "next.csv: ")
    own.root.evaluate(DROP, [["third.csv"], [second]])
    expect_message(own, "target", "third.csv: ")
    own.settled()
    assert set(own.record()["given"]) == {"source", "target"}


def test_a_figure_is_busy_until_a_stroke_is_in_its_picture(reader: Callable[..., Reader]) -> None:
    """The line under the pen stays until the points of the stroke are drawn, and no longer; likewise if the cloud is
    full and the picture does not change."""
    page, own = open_clouds(reader)
    own.root.locator('[data-pen="source"]').click()
    own.settled()
    own.seen()
    box = own.root.locator('[data-panel="main"] > svg.panel').bounding_box()
    assert box is not None

    def move(across: float, down: float) -> None:
        page.mouse.move(box["x"] + across * box["width"], box["y"] + down * box["height"])

    for count, full in ((60, False), (1, True)):
        text = own.root.locator('[data-told="source"]').inner_text()
        move(0.1, 0.1)
        page.mouse.down()
        for k in range(count):  # between two places the pen spaces its points evenly
            move(0.9 - 0.8 * (k % 2), 0.1 + 0.8 * k / count)
        assert own.root.evaluate(DRAWN, own.name) is False
        page.mouse.up()
        own.settled()
        assert own.root.evaluate(DRAWN, own.name) is True
        assert (own.root.locator('[data-told="source"]').inner_text() == text) is full
