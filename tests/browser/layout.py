"""What can be wrong in a page's layout, each as a script that lists it."""

from __future__ import annotations

from playwright.sync_api import Page

SETTLED = 3_000  # ms: a figure's handles follow a new width a frame or two later
# Where the focus can go, in its order: where it stands on the page and what it belongs to.
STOPS = """() => [...document.querySelectorAll('a[href], button, input, summary, [tabindex="0"]')]
  .filter(e => e.tabIndex >= 0 && !e.disabled && e.checkVisibility({visibilityProperty: true}))"""
# A link in a line of text is as tall as the line; so are the marks in it.
SMALL = f"""() => ({STOPS})().map(e => e.matches('input[type=radio], input[type=checkbox]') ? e.closest('label') : e)
  .filter(e => !(e.matches('a') && getComputedStyle(e).display === 'inline')
    && !e.matches('.claim-mark, .note-number, .formula, .contents a, .figure-number a, pre, .skip, div'))
  .map(e => [e, e.getBoundingClientRect()]).filter(([, r]) => r.width && (r.width < 43.5 || r.height < 43.5))
  .map(([e, r]) => `${{e.outerHTML.slice(0, 90)}}: ${{r.width}} × ${{r.height}}`)"""
# What reaches beyond the screen, but for what scrolls in a box of its own.
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
SIDEWAYS = """() => document.documentElement.scrollWidth > innerWidth ? ['the page scrolls sideways'] : []"""
SMALL_TEXT = """() => [...document.querySelectorAll('body *')].filter(e => {
  if (![...e.childNodes].some(n => n.nodeType === 3 && n.data.trim())) return false;
  const r = e.getBoundingClientRect();
  if (!r.width || !r.height || e.closest('.visually-hidden, math')) return false;
  const svg = e.closest('svg');
  const scale = svg ? svg.getBoundingClientRect().width / svg.viewBox.baseVal.width : 1;
  return parseFloat(getComputedStyle(e).fontSize) * scale < 10.95;
}).map(e => e.tagName + '.' + (e.getAttribute('class') || '') + ': ' + e.textContent.slice(0, 30)).slice(0, 8)"""

# Words in a drawing that its edge cuts off; a line of text is some px taller and wider than its letters.
CUT = """() => [...document.querySelectorAll('svg.plot text, .graph-svg text')].filter(e => {
  const whole = e.closest('svg').getBoundingClientRect(), r = e.getBoundingClientRect();
  if (!r.width || !whole.width || !e.checkVisibility()) return false;
  return Math.max(whole.left - r.left, r.right - whole.right, whole.top - r.top, r.bottom - whole.bottom) > 4;
}).map(e => `${e.closest('figure').id} cuts off: ${e.textContent}`)"""


def remaining(page: Page, script: str) -> list[str]:
    """What a script finds wrong once the page is laid out anew, and goes on finding."""
    return page.evaluate(  # type: ignore[no-any-return]
        f"""() => new Promise(done => {{
          const began = performance.now(), find = {script};
          const look = () => {{
            const found = find();
            if (!found.length || performance.now() > began + {SETTLED}) done(found); else requestAnimationFrame(look);
          }};
          requestAnimationFrame(() => requestAnimationFrame(look));
        }})"""
    )
