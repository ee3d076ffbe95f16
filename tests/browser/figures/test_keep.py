"""What a reader keeps: pins, links, experiments, the theme; and citation cards."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from tests.browser.conftest import Reader
from tests.browser.figure import Figure, experiments


def test_pins_hold_controls_and_readouts_and_restore(reader: Callable[..., Reader]) -> None:
    """Two pinned runs differ in the control that was moved; Restore brings a run back; pins survive a reload."""
    page = reader(reduced_motion="reduce").open("kabsch.html")
    solve = Figure(page, "fig-solve").live()
    before = solve.readout("rms")
    solve.button("solve").click()
    first = solve.changes("rms", before)
    solve.reached("[data-pin]").click()
    solve.set("noise", "0.4")
    second = solve.changes("rms", first)
    solve.reached("[data-pin]").click()
    rows = solve.root.locator(".runs tbody tr")
    expect(rows).to_have_count(2)
    expect(rows.nth(0)).to_contain_text(first)
    expect(rows.nth(1)).to_contain_text(second)
    expect(rows.nth(1)).to_contain_text("0.4")
    rows.nth(0).get_by_role("button", name=re.compile("restore", re.I)).click()
    solve.shows("rms", first)
    page.reload()
    expect(Figure(page, "fig-solve").root.locator(".runs tbody tr")).to_have_count(2)
    Figure(page, "fig-solve").root.locator(".runs tbody tr").nth(0).get_by_role(
        "button", name=re.compile("remove", re.I)
    ).click()
    expect(Figure(page, "fig-solve").root.locator(".runs tbody tr")).to_have_count(1)


def test_a_page_with_two_addresses_has_one_set_of_pins_and_predictions(reader: Callable[..., Reader]) -> None:
    """The first page is / and /index.html."""
    visitor = reader(reduced_motion="reduce")
    page = visitor.open("")
    for address, count in (("", 1), ("index.html", 2)):
        page.goto(f"{visitor.origin}/{address}")
        page.evaluate("Ladder.alive")
        hand = Figure(page, "fig-by-hand").seen()
        expect(hand.root.locator(".runs tbody tr")).to_have_count(count - 1)
        hand.reached("[data-pin]").click()
        expect(hand.root.locator(".runs tbody tr")).to_have_count(count)
        figure = Figure(page, "fig-map").seen()
        figure.root.locator(".predict-answers button").first.click()
        expect(figure.root.locator(".predict-score")).to_contain_text("of 1 right")


def test_a_pin_from_before_a_control_was_there_is_still_a_pin(reader: Callable[..., Reader]) -> None:
    """Its record is completed like a link's: nothing in the table is missing, and the page becomes live."""
    page = reader(reduced_motion="reduce").open("kabsch.html")
    solve = Figure(page, "fig-solve").seen()
    solve.reached("[data-pin]").click()
    page.evaluate(
        """() => {
          const key = Object.keys(localStorage).find(name => name.startsWith("ladder-pins:"));
          const [pin] = JSON.parse(localStorage.getItem(key));
          const { noise, ...others } = pin.record.controls;
          const made = controls => ({ ...pin, record: { ...pin.record, controls } });
          localStorage.setItem(key, JSON.stringify([made(others), made(null)]));
        }"""
    )
    page.reload()
    rows = solve.root.locator(".runs tbody tr")
    expect(rows).to_have_count(2)
    expect(solve.root.locator(".runs")).not_to_contain_text("NaN")
    rows.nth(1).get_by_role("button", name=re.compile("restore", re.I)).click()
    solve.settled()
    assert solve.record()["controls"]["noise"] == 0


def test_a_pin_that_is_not_stored_or_that_drops_another_says_so(reader: Callable[..., Reader]) -> None:
    """If nothing more can be stored, the run is pinned for this page only; the 51st pin replaces the first."""
    page = reader(reduced_motion="reduce").open("kabsch.html")
    solve = Figure(page, "fig-solve").seen()
    pin, status = solve.reached("[data-pin]"), solve.root.locator(".figure-status")
    rows = solve.root.locator(".runs tbody tr")
    pin.click()
    expect(status).to_have_text(re.compile(r"^Run 1 pinned\.\s*$"))
    page.evaluate(
        """() => {
          const key = Object.keys(localStorage).find(name => name.startsWith("ladder-pins:"));
          const [pin] = JSON.parse(localStorage.getItem(key));
          const seeds = [7, ...Array(47).fill(9)].map(seed => ({ ...pin, record: { ...pin.record, seed } }));
          localStorage.setItem(key, JSON.stringify([pin, ...seeds]));
        }"""
    )
    pin.click()
    expect(rows).to_have_count(50)
    expect(status).to_have_text(re.compile(r"^Run 50 pinned\.\s*$"))
    pin.click()
    expect(status).to_contain_text("Run 50 pinned. At most 50 are kept: the oldest was dropped.")
    expect(rows).to_have_count(50)
    expect(rows.first.locator("td").nth(1)).to_have_text("7")
    page.evaluate("() => { Storage.prototype.setItem = () => { throw new Error('full'); }; }")
    rows.first.get_by_role("button", name="Remove").click()
    pin.click()
    expect(status).to_contain_text(
        "Run 50 pinned. This browser could not store it: it will be lost when you leave this page."
    )
    expect(rows).to_have_count(50)


def test_a_readout_with_several_units_has_each_beside_its_value(reader: Callable[..., Reader]) -> None:
    """In the file the units have a column; with one unit it is in the heading."""
    page = reader(reduced_motion="reduce").open("surfaces.html")
    look = Figure(page, "fig-look").live()
    label = look.root.locator('[data-readout="rms"] dt').text_content()
    head, rows = look.root.locator(".runs th[scope=col]"), look.root.locator(".runs tbody tr")
    pin = look.reached("[data-pin]")
    pin.click()
    plane = look.readout("rms")
    expect(head.filter(has_text=f"{label} (u)")).to_have_count(1)
    look.set("residual", "gicp")
    gicp = look.changes("rms", plane)
    pin.click()
    expect(head.filter(has_text=re.compile(f"^{label}$"))).to_have_count(1)
    expect(rows.nth(0)).to_contain_text(f"{plane}\u00a0u")
    expect(rows.nth(1)).to_contain_text(f"{gicp}\u00a0σ")
    with page.expect_download() as coming:
        look.root.get_by_role("button", name="Save as CSV").click()
    first, *runs = csv.reader(coming.value.path().read_text("utf-8").splitlines())
    at = first.index(str(label))
    assert [first[at + 1], *(run[at : at + 2] for run in runs)] == [f"{label}: unit", [plane, "u"], [gicp, "σ"]]


def test_a_pinned_setting_is_called_as_its_slider_is(reader: Callable[..., Reader]) -> None:
    """On one rung the length is RANSAC's threshold; of runs of several rungs it is a length scale."""
    dial = Figure(reader(reduced_motion="reduce").open("ransac.html"), "fig-dial-wrong").live()
    head, pin = dial.root.locator(".runs th[scope=col]"), dial.reached("[data-pin]")
    pin.click()
    dial.set("length", "3")
    dial.settled()
    pin.click()
    expect(head.filter(has_text="Threshold ε (u)")).to_have_count(1)
    dial.set("rung", "nearest")
    dial.settled()
    pin.click()
    expect(head.filter(has_text="Length scale (u)")).to_have_count(1)
    expect(head.filter(has_text="Threshold ε")).to_have_count(0)


@pytest.mark.parametrize("width", [390, 1280])
def test_the_buttons_of_a_pinned_run_are_on_the_screen(reader: Callable[..., Reader], width: int) -> None:
    """They follow the run's number; the headings, above as many columns, have at least two words to a line."""
    nearest = Figure(reader(width, 900, reduced_motion="reduce").open("icp.html"), "fig-nearest").seen()
    nearest.reached("[data-pin]").click()
    [box] = nearest.boxes(".runs-scroll")
    for button in nearest.boxes(".runs-do button"):
        assert button["x"] + button["width"] <= box["x"] + box["width"]
    [head] = nearest.boxes(".runs thead")
    assert head["height"] < 6.5 * 18


def test_a_further_pin_leaves_the_table_where_it_was_scrolled(reader: Callable[..., Reader]) -> None:
    """On a narrow screen; the focus stays on its button too, even when another tab pins."""
    visitor = reader(420, 900, reduced_motion="reduce")
    solve, second = (Figure(visitor.open("kabsch.html"), "fig-solve").seen() for _ in range(2))
    solve.reached("[data-pin]").click()
    rows = solve.root.locator(".runs tbody tr")
    expect(rows).to_have_count(1)
    script = "() => document.querySelector('#fig-solve .runs-scroll').scrollLeft"
    restore = solve.root.get_by_role("button", name="Restore run 1")
    restore.focus()
    solve.page.evaluate("document.querySelector('#fig-solve .runs-scroll').scrollLeft = 120")
    position = solve.page.evaluate(script)
    assert position > 0
    second.reached("[data-pin]").click()
    expect(rows).to_have_count(2)
    expect(restore).to_be_focused()
    assert solve.page.evaluate(script) == position


def test_a_link_restores_the_state(reader: Callable[..., Reader]) -> None:
    """The copied link opened in a new page shows the same frame."""
    visitor = reader(reduced_motion="reduce")
    solve = Figure(visitor.open("kabsch.html"), "fig-solve").live()
    before = solve.readout("rms")
    solve.drag("source", -70, 50)
    moved = solve.changes("rms", before)
    link = solve.page.evaluate("name => Ladder.figures.get(name).link()", solve.name)
    page = visitor.page()
    page.goto(link)
    Figure(page, "fig-solve").live().shows("rms", moved)


def test_a_hostile_link_harms_nothing(reader: Callable[..., Reader]) -> None:
    """Damaged and hostile states in the address leave the figure at its preset, with a note."""
    visitor = reader()
    for state in ("%%%", "bm90IGpzb24"):
        page = visitor.open(f"kabsch.html#fig-solve?s={state}")
        solve = Figure(page, "fig-solve").live()
        expect(solve.root.locator(".figure-status")).not_to_be_empty()
        expect(solve.root.locator("svg.panel").first).to_be_visible()
        solve.button("reset").click()
        before = solve.readout("rms")
        solve.button("solve").click()
        solve.changes("rms", before)
        page.close()


def test_experiments_set_the_figure(reader: Callable[..., Reader]) -> None:
    """Every Try this button sets the controls that it names and brings the figure into view."""
    page = reader(reduced_motion="reduce").open("kabsch.html")
    Figure(page, "fig-solve").live()
    names = page.locator("button.try").evaluate_all("all => [...new Set(all.map((each) => each.dataset.figure))]")
    buttons = [button for name in names for button in experiments(page, name).all()]
    assert len(buttons) >= 4
    for button in buttons:
        figure = Figure(page, button.get_attribute("data-figure") or "")
        button.click()
        expected = page.evaluate("b => JSON.parse(b.dataset.record)", button.element_handle())
        figure.settled()
        record = figure.record()
        assert {**record["controls"], **expected["controls"]} == record["controls"]
        assert record["log"] == expected["log"]
        expect(figure.root.locator("svg.panel").first).to_be_in_viewport()


def test_the_theme_switch_keeps(reader: Callable[..., Reader]) -> None:
    """Auto, light, dark: the choice changes the colours and survives a reload."""
    page = reader(color_scheme="light").open("kabsch.html")
    ground = "getComputedStyle(document.documentElement).backgroundColor"
    light = page.evaluate(ground)
    for _ in range(3):
        page.locator("button.theme").click()
        if page.locator("html").get_attribute("data-theme") == "dark":
            break
    dark = page.evaluate(ground)
    assert dark != light
    page.reload()
    assert page.evaluate(ground) == dark
    page.evaluate("""() => {
      localStorage.clear();
      dispatchEvent(new PageTransitionEvent("pageshow", { persisted: true }));
    }""")
    assert page.evaluate(ground) == light, "forgotten on another page, then gone back to this one"


def test_a_citation_s_card_opens_by_pointer_focus_and_tap(reader: Callable[..., Reader]) -> None:
    """A card opens on hover and on focus, closes with Escape, and on touch opens at the first tap."""
    page = reader().open("kabsch.html")
    cite = page.locator("a.cite").first
    card = page.locator("#" + (cite.get_attribute("data-card") or "none"))
    expect(card).to_be_hidden()
    cite.hover()
    expect(card).to_be_visible()
    page.keyboard.press("Escape")
    expect(card).to_be_hidden()
    page.mouse.move(0, 0)
    cite.focus()
    expect(card).to_be_visible()
    page.keyboard.press("Escape")
    expect(card).to_be_hidden()
    phone = reader(390, 800, has_touch=True).open("kabsch.html")
    cite = phone.locator("a.cite").first
    cite.tap()
    expect(phone.locator("#" + (cite.get_attribute("data-card") or "none"))).to_be_visible()
    assert phone.url.endswith("kabsch.html")


def test_a_term_shows_what_it_means(reader: Callable[..., Reader]) -> None:
    """On focus and on hover its card shows the meaning, and Escape closes it; the link leads to its entry."""
    page = reader().open("surfaces.html")
    link = page.locator("a.term[data-card]").first
    card = page.locator(f"#{link.get_attribute('data-card')}")
    expect(card).to_be_hidden()
    link.focus()
    expect(card).to_be_visible()
    page.keyboard.press("Escape")
    expect(card).to_be_hidden()
    link.hover()
    expect(card).to_be_visible()
    name = str(link.get_attribute("data-card")).removeprefix("card-")
    text = card.inner_text().partition(". ")[2]
    link.click()
    expect(page.locator(f"#{name}")).to_be_in_viewport()
    expect(page.locator(f"#{name} dd")).to_contain_text(text)


def test_the_run_that_is_removed_is_the_one_beside_the_button(reader: Callable[..., Reader]) -> None:
    """The others keep their order, and the focus goes to the button that took its place; after the last to Pin. In the
    file, a minus is one that a spreadsheet reads."""
    page = reader(reduced_motion="reduce").open("icp.html")
    nearest = Figure(page, "fig-nearest").live()
    rows, pin = nearest.root.locator(".runs tbody tr"), nearest.reached("[data-pin]")
    turns = ["-60", "-30", "45", "60"]
    for turn in turns:
        nearest.set("turn", turn)
        nearest.settled()
        pin.click()
    expect(rows).to_have_count(4)
    remove = nearest.root.locator(".runs").get_by_role("button", name=re.compile("^Remove run"))
    for index, focused in ((1, 1), (2, 1)):
        remove.nth(index).click()
        del turns[index]
        expect(rows).to_have_count(len(turns))
        expect(remove.nth(focused)).to_be_focused()
        with page.expect_download() as coming:
            nearest.root.get_by_role("button", name="Save as CSV").click()
        runs = list(csv.DictReader(coming.value.path().read_text("utf-8").splitlines()))
        label = nearest.control("turn").evaluate("e => e.labels[0].querySelector('.control-label').textContent.trim()")
        (column,) = [name for name in runs[0] if name.startswith(label)]
        assert [float(run[column]) for run in runs] == [float(turn) for turn in turns]
    for _ in range(2):
        remove.first.click()
    expect(pin).to_be_focused()
    expect(rows).to_have_count(0)
