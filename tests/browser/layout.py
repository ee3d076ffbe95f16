"""Faults of a page's layout, each listed by a script."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from playwright.sync_api import Page

SETTLED = 3_000  # ms: a figure's handles follow a new width a frame or two later
# The elements that can have the focus, in tab order.
STOPS = """() => [...document.querySelectorAll('a[href], button, input, select, summary, [tabindex="0"]')]
  .filter(e => e.tabIndex >= 0 && !e.disabled && e.checkVisibility({visibilityProperty: true}))"""
# Targets smaller than 44 px. A link in a line of text is as tall as the line; so are the marks in it.
SMALL = f"""() => ({STOPS})().map(e => e.matches('input[type=radio], input[type=checkbox]') ? e.closest('label') : e)
  .filter(e => !(e.matches('a') && getComputedStyle(e).display === 'inline')
    && !e.matches('.claim-mark, .note-number, .formula, .contents a, .figure-number a, pre, .skip, div'))
  .map(e => [e, e.getBoundingClientRect()]).filter(([, r]) => r.width && (r.width < 43.5 || r.height < 43.5))
  .map(([e, r]) => `${{e.outerHTML.slice(0, 90)}}: ${{r.width}} × ${{r.height}}`)"""
# Elements that extend beyond the screen, except in a box that scrolls by itself.
BEYOND = """() => {
  const width = document.documentElement.clientWidth;
  const boxed = e => {
    for (let p = e.parentElement; p && p !== document.body; p = p.parentElement)
      if (getComputedStyle(p).overflowX !== 'visible') return true;
    return false;
  };
  const found = [...document.querySelectorAll('body *')].filter(e => {
    const r = e.getBoundingClientRect();
    return r.width && r.height && (r.right > width + 1 || r.left < -1) && !e.closest('.visually-hidden, .card')
      && e.checkVisibility({visibilityProperty: true}) && !boxed(e);
  }).map(e => `${e.tagName}.${e.getAttribute('class') ?? ''} ${e.textContent.trim().slice(0, 30)}`);
  return document.documentElement.scrollWidth > width ? ['the page scrolls sideways', ...found] : found;
}"""
# Spaces a page's text as WCAG 1.4.12 has it, by a style sheet that a strict policy lets in.
SPACED = """() => {
  const sheet = new CSSStyleSheet();
  sheet.replaceSync(`
    * { line-height: 1.5 !important; letter-spacing: 0.12em !important; word-spacing: 0.16em !important }
    p { margin-bottom: 2em !important }`);
  document.adoptedStyleSheets = [...document.adoptedStyleSheets, sheet];
}"""
# Boxes that scroll sideways and that the keyboard would not reach where the browser makes no tab stop of them itself.
UNREACHED = """() => [...document.querySelectorAll('body *')].filter(e => e.scrollWidth > e.clientWidth + 1
    && ['auto', 'scroll'].includes(getComputedStyle(e).overflowX) && e.checkVisibility()
    && e.tabIndex < 0 && !e.closest('button') && !e.querySelector('a, button, input, [tabindex]'))
  .map(e => `not reached by keyboard: ${e.className} ${e.textContent.slice(0, 30)}`)"""
SIDEWAYS = """() => document.documentElement.scrollWidth > innerWidth ? ['the page scrolls sideways'] : []"""
SMALL_TEXT = """() => [...document.querySelectorAll('body *')].filter(e => {
  if (![...e.childNodes].some(n => n.nodeType === 3 && n.data.trim())) return false;
  const r = e.getBoundingClientRect();
  if (!r.width || !r.height || e.closest('.visually-hidden, math')) return false;
  const svg = e.closest('svg');
  const scale = svg ? svg.getBoundingClientRect().width / svg.viewBox.baseVal.width : 1;
  return parseFloat(getComputedStyle(e).fontSize) * scale < 10.95;
}).map(e => e.tagName + '.' + (e.getAttribute('class') || '') + ': ' + e.textContent.slice(0, 30)).slice(0, 8)"""

# Texts in a drawing that its edge cuts off, or the margin beyond it that is drawn too; a line of text is some px taller
# and wider than its letters.
CUT = """() => [...document.querySelectorAll('svg.panel text, .plot-svg text')].filter(e => {
  const svg = e.closest('svg'), whole = svg.getBoundingClientRect(), r = e.getBoundingClientRect();
  if (!r.width || !whole.width || !e.checkVisibility()) return false;
  const spare = 4 + (parseFloat(getComputedStyle(svg).overflowClipMargin) || 0);
  return Math.max(whole.left - r.left, r.right - whole.right, whole.top - r.top, r.bottom - whole.bottom) > spare;
}).map(e => `${e.closest('figure').id} cuts off: ${e.textContent}`)"""
# Texts of a drawing whose letters meet: those of a line lie within 0.36 em of its middle.
MEETING = """() => [...document.querySelectorAll('svg.panel, .plot-svg')].flatMap(svg => {
  if (!svg.checkVisibility()) return [];
  const scale = svg.getBoundingClientRect().width / svg.viewBox.baseVal.width;
  const boxes = [...svg.querySelectorAll('text')].filter(e => e.checkVisibility()).map(e => {
    const r = e.getBoundingClientRect(), half = 0.36 * scale * parseFloat(getComputedStyle(e).fontSize);
    return {e, left: r.left, right: r.right, top: (r.top + r.bottom) / 2 - half, bottom: (r.top + r.bottom) / 2 + half};
  });
  const meet = (a, b) => Math.min(a.right, b.right) - Math.max(a.left, b.left) > 2
    && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 1;
  return boxes.flatMap((a, i) => boxes.slice(0, i).filter(b => meet(a, b))
    .map(b => `${svg.closest('figure').id}: ${a.e.textContent} meets ${b.e.textContent}`));
})"""
# Claim marks that begin a line, apart from what they mark.
TORN = """() => [...document.querySelectorAll('.claim-mark')].filter(e => e.checkVisibility()).filter(e => {
  const before = document.createRange();
  before.setStart(e.parentElement, 0);
  before.setEndBefore(e);
  const line = [...before.getClientRects()].filter(r => r.width).at(-1);
  return e.getBoundingClientRect().top > line.bottom;
}).map(e => `a mark begins a line after: ${e.parentElement.textContent.slice(-30)}`)"""
# Emblems at the ends of the ladder's rungs that its edge cuts off.
CUT_RUNGS = """() => [...document.querySelectorAll('.step .emblem')].filter(e => {
  const r = e.getBoundingClientRect();
  return r.width && r.right > e.closest('.ladder').getBoundingClientRect().right;
}).map(e => `the ladder cuts off the sign of ${e.closest('.step').textContent.trim()}`)"""
# Fonts that a page preloads but does not use.
UNUSED_FONTS = """async () => {
  await document.fonts.ready;
  const bare = name => name.replaceAll('"', '');
  const all = [...document.styleSheets].flatMap(sheet => [...sheet.cssRules]);
  const rules = all.filter(r => r instanceof CSSFontFaceRule);
  const face = r => [...document.fonts].find(f => bare(f.family) === bare(r.style.fontFamily)
    && f.style === (r.style.fontStyle || 'normal') && f.weight === (r.style.fontWeight || 'normal')
    && f.unicodeRange === (r.style.getPropertyValue('unicode-range') || 'U+0-10FFFF'));
  const rule = href => rules.find(r => r.style.getPropertyValue('src').includes(href.split('/').pop()));
  return [...document.querySelectorAll('link[rel=preload][as=font]')].map(link => link.getAttribute('href'))
    .filter(href => face(rule(href))?.status !== 'loaded');
}"""
# Fonts that were used but not preloaded. A few single letters have small files of their own; with `letters`, those of
# the upright text count: they are preloaded where a page begins with them. The others load when they are seen.
LATE_FONTS = """(letters) => {
  const early = [...document.querySelectorAll('link[rel=preload]')].map(e => e.href);
  const styles = [...document.styleSheets].flatMap(sheet => [...sheet.cssRules].map(rule => rule.style));
  const few = styles.filter(style => style?.unicodeRange && (!letters || style.fontStyle === 'italic'));
  const rare = few.map(style => style.src).join();
  return performance.getEntriesByType('resource').map(e => e.name)
    .filter(name => name.endsWith('.woff2') && !rare.includes(name.split('/').pop()) && !early.includes(name));
}"""
# Resolves once the figures are alive, and formulas that are too wide below this have become tab stops.
ALIVE = """() => globalThis.Ladder?.alive.then(() => new Promise((done) =>
  requestAnimationFrame(() => requestAnimationFrame(done))))"""
# The distances from the lead sentence's top to the bottoms of what must be seen with it, per figure.
BOTTOMS = """() => [...document.querySelectorAll('figure.figure')].map(figure => {
  const first = figure.querySelector('.figure-lead') ?? figure.querySelector('.figure-stage');
  const {top} = first.getBoundingClientRect();
  const bottom = selector => Math.max(0, ...[...figure.querySelectorAll(selector)]
    .map(e => e.getBoundingClientRect()).filter(r => r.height).map(r => r.bottom - top));
  const many = figure.querySelector('.many > .figure-stage > .large');
  return {
    id: figure.id,
    stage: bottom('.figure-stage'),
    panel: many ? bottom('.figure-panel.large > svg') : bottom('.figure-stage > .figure-panel:first-child > svg'),
    button: bottom('.figure-desk > .buttons > :is(.primary, button:first-child)'),
    controls: bottom('.figure-desk .control'),
    first: bottom('.figure-desk .control:first-child'),
    readouts: bottom('.figure-desk .readouts'),
    asked: bottom('.figure-desk > .predict'),
  };
})"""
# Parts of a slide that are cut off, lie under the bar, or are too small to be read from afar.
MISFITS = """() => {
  const bar = document.querySelector('.deck-bar').getBoundingClientRect().height;
  return [...document.querySelectorAll('.slide')].flatMap(slide => {
    const inside = slide.querySelector('.slide-inside'), box = inside.getBoundingClientRect();
    const seen = [...inside.querySelectorAll('*')].filter(e =>
      e.checkVisibility({visibilityProperty: true}) && !e.closest('svg, math, .figure-handles, .visually-hidden'));
    const out = seen.concat(...inside.querySelectorAll('svg')).filter(e => {
      const r = e.getBoundingClientRect();
      return r.width && r.height && (r.top < box.top - 1 || r.left < -1 || r.right > innerWidth + 1
        || r.bottom > box.top + innerHeight - bar + 1);
    }).map(e => `${e.tagName}.${e.getAttribute('class') ?? ''} ends at ${e.getBoundingClientRect().bottom - box.top}`);
    const type = parseFloat(getComputedStyle(document.documentElement).fontSize);
    const small = [...slide.querySelectorAll('.slide-text > :is(p, ul, ol)')].filter(e =>
      !e.matches('.slide-ways, .tries') && parseFloat(getComputedStyle(e).fontSize) < 1.49 * type)
      .map(e => `small: ${e.textContent.slice(0, 30)}`);
    const words = [...slide.querySelectorAll('.figure-panel:not([hidden]) text, .plot-wide text')].map(e => {
      const svg = e.closest('svg'), scale = svg.getBoundingClientRect().width / svg.viewBox.baseVal.width;
      return [e.textContent, scale * parseFloat(getComputedStyle(e).fontSize) * 16 / type];
    }).filter(([, px]) => px < 10.95).map(([words, px]) => `${words} has ${px.toFixed(1)} px`);
    const rows = box.height > innerHeight + 1 ? [`as tall as ${box.height}`] : [];
    return [...out.slice(0, 3), ...small, ...words, ...rows].map(each => `${slide.id}: ${each}`);
  });
}"""
# Opens details; a few of a chapter's many checks represent all of them.
DETAILS = "[...document.querySelectorAll('details')].slice(0, 9).forEach(each => { each.open = true; })"
FRAMES = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"


def count_figures(site: Path, path: str) -> int:
    """The number of figures that the build has put into a page."""
    return (site / path).read_text("utf-8").count('data-widget="')


def low(page: Page, parts: Sequence[str], width: int, height: int, percent: int) -> tuple[int, list[str]]:
    """The number of figures of a page of this size with this text size in percent, and the parts that do not fit."""
    page.set_viewport_size({"width": width, "height": height})
    page.evaluate("percent => { document.documentElement.style.fontSize = `${percent}%`; }", percent)
    page.evaluate("(scrollTo(0, 0), document.fonts.ready)")  # scrolled, a picture may stick while its figure passes by
    page.evaluate(FRAMES)
    result = page.evaluate(BOTTOMS)
    page.evaluate("() => { document.documentElement.style.fontSize = ''; }")
    wrong = [(item, part) for item in result for part in parts if item[part] > height]
    return len(result), [f"{item['id']}: {part} ends at {item[part]:.0f} of {height}" for item, part in wrong]


def remaining(page: Page, *scripts: str) -> list[str]:
    """The faults that the scripts find once the page has been laid out again, and keep finding."""
    return page.evaluate(  # type: ignore[no-any-return]
        f"""() => new Promise(done => {{
          const began = performance.now(), find = () => [{", ".join(scripts)}].flatMap(each => each());
          const look = () => {{
            const found = find();
            if (!found.length || performance.now() > began + {SETTLED}) done(found); else requestAnimationFrame(look);
          }};
          requestAnimationFrame(() => requestAnimationFrame(look));
        }})"""
    )
