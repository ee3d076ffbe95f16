"""What a figure announces, where the focus goes and that it is visible, reduced motion, and forced colours."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import pytest
from playwright.sync_api import Page, expect

from sitegen.bench.pages import until
from tests.browser.accessibility.test_axe import violations
from tests.browser.conftest import Reader
from tests.browser.figure import LIVE, Figure, experiments
from tests.browser.figures.test_hover import pixel
from tests.browser.layout import ALIVE, FRAMES, STOPS

# Records every change of every live region: its time, and the region's text then.
LISTEN = """() => {
  window.heard = [];
  const hear = new MutationObserver(all => { for (const {target} of all) {
    const e = target.nodeType === 1 ? target : target.parentElement;
    heard.push([performance.now(), e.closest('[role=status], output').textContent.trim()]);
  } });
  for (const e of document.querySelectorAll(':is([role=status], output, [aria-live]):not([aria-live=off])'))
    hear.observe(e, {childList: true, characterData: true, subtree: true});
}"""


def announcements(page: Page) -> list[tuple[float, str]]:
    """The announcements since the last call; the page goes on."""
    return [(at, words) for at, words in page.evaluate("heard.splice(0)")]


def until_announced(page: Page, part: str) -> None:
    """Wait until an announcement contains `part`."""
    until(page, f"heard.some(([, words]) => words.includes({part!r}))")


def test_a_drag_is_told_now_and_then_and_its_end_always(reader: Callable[..., Reader]) -> None:
    """Nothing is announced before anything is done; during many moves, at most one announcement per second, the last
    with the last numbers; after a press, its note and what it changed."""
    page = reader(reduced_motion="reduce").open("kabsch.html")
    page.evaluate(LISTEN)
    solve = Figure(page, "fig-solve").live().settled()
    page.mouse.move(400, 400, steps=5)
    assert announcements(page) == []
    frames = solve.frames()
    solve.drag("source", 120, 60, steps=150)
    solve.settled()
    error = solve.readout("translation_error")
    until_announced(page, f"Translation error: {error} u")
    moved = announcements(page)
    assert solve.frames() - frames > 3 * len(moved), "most frames are not spoken of"
    assert all(b - a > 900 for (a, _), (b, _) in pairwise(moved)), moved
    assert f"Translation error: {error} u" in moved[-1][1]
    solve.button("solve").click()
    until_announced(page, "Solved in closed form")
    assert f"RMS residual now: {solve.readout('rms')} u" in announcements(page)[-1][1]
    solve.reached("[data-link]").click()
    until_announced(page, "Link")


def test_keys_are_told_as_values_and_as_what_they_led_to(reader: Callable[..., Reader]) -> None:
    """A handle is a slider whose text follows the keys, and so is a crosshair; a passing pointer is not announced."""
    page = reader(reduced_motion="reduce").open("ndt-map.html")
    page.evaluate(LISTEN)
    cells = Figure(page, "fig-cells").live().settled()
    page.evaluate("Object.assign(Ladder.limits, { gap: 0, pause: 1 })")  # whatever is announced is announced at once
    before = cells.readout("mean")
    page.mouse.move(*pixel(cells, 0.5, 1.4))  # a wall
    cells.changes("mean", before)
    page.evaluate("new Promise(done => setTimeout(done, Ladder.limits.pause))")  # after the timer of any announcement
    assert announcements(page) == [], "the pointer's passing was told"
    cross = cells.root.locator(".crosshair")
    cross.focus()
    text = cross.get_attribute("aria-valuetext") or ""
    before = cells.readout("mean")
    for _ in range(4):
        page.keyboard.press("Shift+ArrowRight")
    expect(cross).not_to_have_attribute("aria-valuetext", text)
    cells.changes("mean", before)
    cells.settled()
    until_announced(page, "Mean μ")
    expect(cross).to_be_focused()


def test_a_slider_alone_tells_its_number(reader: Callable[..., Reader]) -> None:
    """The number beside it is not told as well; what the number led to is."""
    page = reader(reduced_motion="reduce").open("kabsch.html")
    page.evaluate(LISTEN)
    solve = Figure(page, "fig-solve").live().settled()
    before = solve.readout("rms")
    solve.set("wrong", "6")
    rms = solve.changes("rms", before)
    until_announced(page, rms)
    assert [words for _, words in announcements(page) if rms not in words] == []


def test_the_focus_stays_where_something_is(reader: Callable[..., Reader]) -> None:
    """If a handle goes or Retry is used, the picture gets the focus. Stop returns it to the job's Begin button."""
    visitor = reader(reduced_motion="reduce")
    four = Figure(visitor.open("four.html"), "fig-four").live().settled()
    turn = four.root.locator(".handle.turn:not([aria-hidden])")
    turn.focus()
    four.page.evaluate("(f => f.ask(Ladder.record.press(f.record, 'iterate')))(Ladder.figures.get('fig-four'))")
    four.settled()
    expect(turn).to_have_count(0)
    expect(four.root.locator(".figure-stage")).to_be_focused()
    four.page.evaluate("Ladder.runtime.kill()")
    four.page.evaluate("Ladder.limits.frame = 300")
    four.button("finish").click()
    retry = four.root.locator('[data-way="Retry"]')
    retry.focus()
    four.page.keyboard.press("Enter")
    expect(four.root.locator(".figure-stage")).to_be_focused()
    four.page.close()

    race = Figure(visitor.open("race.html"), "fig-race").live()
    begin, stop = (race.reached(f'.job [data-do="{action}"]') for action in ("begin", "stop"))
    begin.focus()
    race.page.keyboard.press("Enter")
    expect(stop).to_be_focused()
    expect(race.root.locator(".job-words")).to_contain_text("step", timeout=LIVE)
    race.page.keyboard.press("Enter")
    expect(begin).to_be_focused()
    faults = [*violations(race.page, "race with a result")]
    assert faults == []


def test_every_stop_of_the_keyboard_is_seen(reader: Callable[..., Reader]) -> None:
    """Tab goes through a whole page in both themes; each stop shows its focus, and none is skipped."""
    for scheme in ("light", "dark"):
        page = reader(color_scheme=scheme, reduced_motion="reduce").open("kabsch.html")
        page.evaluate(ALIVE)
        stops = page.evaluate(f"() => ({STOPS})().length")
        faults, count, steps = [], 0, 0
        page.keyboard.press("Tab")
        while page.evaluate("document.activeElement !== document.body") and steps <= 2 * stops:
            visible, name, new = page.evaluate(SHOWN)
            count, steps = count + new, steps + 1
            if not visible:
                faults.append(name)
            page.keyboard.press("Tab")
        assert faults == [], scheme
        radios = page.evaluate(RADIOS)
        assert count == stops - radios, "all radio buttons of one choice are one stop"
        knob = page.locator("#fig-solve input[type=range]").first
        before = knob.screenshot()
        knob.focus()
        assert knob.screenshot() != before, scheme


def test_on_a_phone_no_stop_lies_under_the_picture_or_beyond_an_edge(reader: Callable[..., Reader]) -> None:
    """The race's picture takes most of the window: sliders, headings of a table that scrolls, the crosshair of a chart
    below it."""
    page = reader(390, 844, reduced_motion="reduce").open("race.html")
    figure = Figure(page, "fig-race").live().settled()
    figure.root.locator("details.figure-rest > summary").click()
    figure.button("run").focus()
    faults, stops = [], 0
    for way in ("Tab", "Shift+Tab"):
        page.keyboard.press(way)
        while page.evaluate("document.activeElement.closest('#fig-race :is(.figure-body, .figure-rest)') !== null"):
            page.evaluate(FRAMES)
            faults += page.evaluate(HIDDEN)
            stops += 1
            page.keyboard.press(way)
    assert stops > 60
    assert not faults, "\n".join(faults)


# Of what has the focus, where it is not on the picture itself: what lies under that or beyond what scrolls. Of a
# table a part is enough.
HIDDEN = """() => {
  const e = document.activeElement, stage = e.closest('.figure').querySelector('.figure-stage');
  const name = e.outerHTML.slice(0, 60), rim = (e.closest('label') ?? e).getBoundingClientRect();
  if (stage.contains(e) && !e.matches('.crosshair')) return [];
  const box = e.parentElement.closest('.runs-scroll')?.getBoundingClientRect();
  if (box && (rim.left < box.left - 1 || rim.right > box.right + 1)) return [`${name} beside its table`];
  const chart = e.matches('.crosshair') && e.closest('.figure').querySelector(`[data-panel="${e.dataset.pick}"] > svg`);
  const over = chart && chart.getBoundingClientRect(), middle = (rim.top + rim.bottom) / 2;
  if (over && (middle < over.top || middle > over.bottom)) return [`${name} off its chart`];
  const onTop = document.elementFromPoint((rim.left + rim.right) / 2, (rim.top + rim.bottom) / 2);
  const lid = e.closest('.job')?.contains(onTop) ? 0 : stage.getBoundingClientRect().bottom; // a job slides over it
  const seen = Math.min(rim.bottom, innerHeight) - Math.max(rim.top, lid);
  return seen < Math.min(120, 0.95 * rim.height) ? [`${name}: ${seen} of ${rim.height}`] : [];
}"""


def test_a_table_that_fades_shows_that_it_has_the_focus(reader: Callable[..., Reader]) -> None:
    """The mask that fades it would cut off the focus ring."""
    page = reader(width=390, height=844).open("docs-commands.html")
    table = page.locator(".table").first
    table.scroll_into_view_if_needed()
    assert table.evaluate("e => getComputedStyle(e).maskImage") != "none"
    page.keyboard.press("Tab")  # from here on the focus is shown
    table.focus()
    assert table.evaluate("e => [e.matches(':focus-visible'), getComputedStyle(e).maskImage]") == [True, "none"]


# An outline of the element, of its pseudo-element or of the label around it; a slider's knob cannot be examined.
SHOWN = """() => {
  const e = document.activeElement;
  const rims = [[e], [e, '::before'], [e.closest('label')]].filter(([x]) => x);
  const style = rims.map(([x, part]) => getComputedStyle(x, part))
    .map(s => [s.outlineStyle, parseFloat(s.outlineWidth)]);
  const seen = e.matches('.crosshair') ? getComputedStyle(e).opacity === '1'
    : e.matches('input[type=range]') || style.some(([line, width]) => line !== 'none' && width >= 2);
  // A card is a stop more, if the eye rests long enough on its link for it to open, and may lead back to that.
  const met = window.met ??= new Set(), fresh = !met.has(e) && !e.closest('.card');
  met.add(e);
  return [seen, e.outerHTML.slice(0, 90), fresh];
}"""
RADIOS = """() => { const sets = [...document.querySelectorAll('.options')].filter(e => e.checkVisibility());
  return sets.reduce((sum, e) => sum + e.querySelectorAll('input').length - 1, 0); }"""


def test_nothing_moves_where_that_is_asked(reader: Callable[..., Reader]) -> None:
    """Under reduced motion no rule animates or transitions, and a press jumps: no intermediate picture is drawn."""
    page = reader(reduced_motion="reduce").open("kabsch.html")
    solve = Figure(page, "fig-solve").live().settled()
    assert page.evaluate(GLIDES) == []
    page.evaluate(WATCH)
    solve.button("solve").click()
    solve.shows("rotation_error", "0.0").settled()
    experiments(page, solve.name).first.click()
    solve.settled()
    assert page.evaluate("[seen.frames > 3, seen.moved, document.getAnimations().length]") == [True, 0, 0]


GLIDES = """() => [...document.querySelectorAll('*')].flatMap(e => [null, '::before', '::after'].map(part => [e, part]))
  .filter(([e, part]) => { const s = getComputedStyle(e, part);
    return s.transitionDuration.split(',').some(d => parseFloat(d) > 0) || s.animationName !== 'none'
      || s.scrollBehavior === 'smooth'; })
  .map(([e, part]) => e.outerHTML.slice(0, 60) + (part ?? ''))"""
WATCH = """() => {
  window.seen = {frames: 0, moved: 0};
  const look = () => {
    seen.frames++;
    seen.moved += document.querySelectorAll('svg.panel [transform], svg.panel.moving').length;
    requestAnimationFrame(look);
  };
  look();
}"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_systems_colours_leave_everything_to_be_seen(reader: Callable[..., Reader], scheme: str) -> None:
    """Source and target differ in shape, size and colour; every legend key, knob, switch and button is visible."""
    visitor = reader(forced_colors="active", color_scheme=scheme, reduced_motion="reduce")
    for path in ("kabsch.html", "ransac.html", "ndt-score.html"):
        page = visitor.open(path)
        page.evaluate("document.documentElement.dataset.theme = 'dark'")
        assert page.evaluate(LOST) == [], path
    clouds = visitor.open("kabsch.html").evaluate(CLOUDS)
    assert clouds["source"][0] != clouds["target"][0]
    assert clouds["source"][1] > 1.15 * clouds["target"][1]
    assert clouds["source"][2:] == ["round"]
    assert clouds["target"][2:] == ["square"]


CLOUDS = """() => Object.fromEntries(['source', 'target'].map(role => {
  const s = getComputedStyle(document.querySelector(`svg.panel path.${role}:is(.dot, .square)`));
  return [role, [s.stroke, parseFloat(s.strokeWidth), s.strokeLinecap]];
}))"""
# Elements that have the background's own colour, and so are invisible.
LOST = """() => {
  const canvas = getComputedStyle(document.documentElement).backgroundColor;
  const clear = c => c === canvas || /^rgba.*, 0\\)$/.test(c);
  const all = (select, part, seen) => [...document.querySelectorAll(select)]
    .filter(e => e.checkVisibility({visibilityProperty: true}))
    .filter(e => !seen(getComputedStyle(e, part), e)).map(e => select + (part ?? '') + ' ' + e.outerHTML.slice(0, 80));
  const filled = s => !clear(s.backgroundColor) || (s.backgroundImage !== 'none' && s.forcedColorAdjust === 'none');
  const rimmed = s => parseFloat(s.borderTopWidth) > 0 && s.borderTopStyle !== 'none' && !clear(s.borderTopColor);
  const told = s => s.color !== s.backgroundColor && (s.forcedColorAdjust === 'none' || !clear(s.color));
  const found = [
    ...all('.legend .key', '::before', s => filled(s) || rimmed(s)),
    ...all('.handle:not(.copy)', '::before', rimmed),
    ...all('.handle:not(.copy)', '::after', filled),
    ...all('.claim-mark', '::before', filled),
    ...all('.figure .buttons button', null, s => (rimmed(s) || filled(s)) && told(s)),
    ...all('.options label', null, (s, e) => e.querySelector(':checked') ? filled(s) : rimmed(s) && !filled(s)),
    ...all('[role=switch]', null, (s, e) => rimmed(s) && filled(s) === e.checked),
    ...all('[role=switch]', '::before', (s, e) => e.checked ? clear(s.backgroundColor) : filled(s)),
  ];
  for (const path of document.querySelectorAll('svg.panel path:not(.grid, .heat path)'))
    if (clear(getComputedStyle(path).stroke)) found.push(path.getAttribute('class'));
  return found;
}"""


def test_more_contrast_is_more(reader: Callable[..., Reader]) -> None:
    """With more contrast requested, text is black on white or white on black, and panels have outlines."""
    for scheme, ink in (("light", "rgb(0, 0, 0)"), ("dark", "rgb(255, 255, 255)")):
        page = reader(contrast="more", color_scheme=scheme).open("kabsch.html")
        assert page.evaluate("getComputedStyle(document.documentElement).color") == ink
        assert page.locator(".figure-panel > svg").first.evaluate("e => getComputedStyle(e).outlineStyle") == "solid"
        assert [*violations(page, scheme, runOnly={"type": "rule", "values": ["color-contrast"]})] == []
        page.close()
