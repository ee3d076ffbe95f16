"""Splits a drag's time: our own share, Python and page script, apart from the browser's; and a control figure, which
shows how long the browser takes for the same pictures without our code around them.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from typing import Any

from playwright.sync_api import Locator, Page, Route

from sitegen.bench.pages import WATCH

CONTROL = "control.html"
# Records for every answer of the worker the time in Python, and the time in the page's scripts since the previous one:
# their listeners, frames and promises; and the last forty answers. It wraps the page's callbacks without changing them.
HOOK = """() => {
  const answers = [], spent = { ms: 0 };
  window.split = { answers, spent, frames: [] };
  const timed = does => function (...given) {
    const began = performance.now();
    try { return does.apply(this, given); }
    finally { queueMicrotask(() => { spent.ms += performance.now() - began; }); }
  };
  for (const type of ['pointerrawupdate', 'pointermove', 'input']) {
    let began = 0;
    addEventListener(type, () => { began = performance.now(); }, { capture: true });
    addEventListener(type, () => { spent.ms += performance.now() - began; });
  }
  const frame = requestAnimationFrame;
  window.requestAnimationFrame = does => frame.call(window, String(does).includes('seen.') ? does : timed(does));
  window.Worker = class extends Worker {
    set onmessage(hear) {
      const heard = timed(hear);
      super.onmessage = event => {
        heard(event);
        const { type, frame, python_ms } = event.data;
        if (type !== 'frame') return;
        queueMicrotask(() => {
          answers.push([python_ms, spent.ms]);
          spent.ms = 0;
          if (split.frames.push(frame) > 40) split.frames.shift();
        });
      };
    }
  };
}"""

# The figure's visible panels, each with its class and box on the stage, and the box of its handle.
_SEEN = """(figure, handle) => {
  const stage = figure.querySelector('.figure-stage'), from = stage.getBoundingClientRect();
  const box = e => { const r = e.getBoundingClientRect(); return [r.x - from.x, r.y - from.y, r.width, r.height]; };
  const panels = [...figure.querySelectorAll('.figure-panel[data-panel]')].filter(e => e.checkVisibility());
  return { panels: panels.map(e => [e.dataset.panel, e.className, ...box(e)]), handle: box(handle),
    size: [from.width, from.height] };
}"""

# One question at a time and at most one per animation frame, as figures ask; each answer replaces whole drawings.
_SCRIPT = """
const { frames, panels } = JSON.parse(document.querySelector('script').textContent);
const code = `let all, i = 0;
  onmessage = ({ data }) => data.frames ? all = data.frames : postMessage(all[i++ % all.length])`;
const worker = new Worker(URL.createObjectURL(new Blob([code])));
worker.postMessage({ frames });
const handle = document.querySelector('button'), boxes = [...document.querySelectorAll('.figure-panel')];
let at = null, asked = false, ahead = 0, last = null;
globalThis.Ladder = { figures: new Map([['control', { get busy() { return asked || last !== null; } }]]) };
function ask() {
  if (asked || ahead || last === null) return;
  performance.mark('ladder:input', { startTime: last });
  last = null;
  asked = true;
  ahead = requestAnimationFrame(() => { ahead = 0; ask(); });
  worker.postMessage(JSON.stringify({ figure: 'control' }));
}
worker.onmessage = ({ data }) => {
  const drawn = JSON.parse(data).panels;
  panels.forEach((name, i) => { boxes[i].innerHTML = drawn.find(panel => panel.name === name).svg; });
  performance.mark('ladder:swap');
  asked = false;
  ask();
};
handle.onpointerdown = event => { at = [event.clientX, event.clientY]; handle.setPointerCapture(event.pointerId); };
handle.onpointerup = () => { at = null; };
addEventListener('pointerrawupdate', event => {
  if (!at) return;
  handle.style.translate = `${event.clientX - at[0]}px ${event.clientY - at[1]}px`;
  last = event.timeStamp;
  ask();
});
"""


def begin(page: Page) -> None:
    """Forget the answers so far."""
    page.evaluate("split.answers.length = split.frames.length = split.spent.ms = 0")


def shares(page: Page) -> list[tuple[float, float]]:
    """For each answer since `begin`: the time in Python and in the page's scripts, in ms."""
    return [(python, script) for python, script in page.evaluate("split.answers")]


@contextmanager
def laid_control(page: Page, figure: Locator, handle: Locator, origin: str) -> Iterator[Page]:
    """A page with a control figure: panels and a handle in the figure's places, and a worker that returns the figure's
    last frames."""
    layout: dict[str, Any] = figure.evaluate(_SEEN, handle.element_handle())
    frames: list[str] = page.evaluate("split.frames")
    style = page.locator("link[rel=stylesheet]").first.get_attribute("href")
    body = _page(layout, frames, style or "")
    assert page.context.browser
    context = page.context.browser.new_context(viewport=page.viewport_size, service_workers="block")
    context.add_init_script(f"({WATCH})()")
    control = context.new_page()

    def answer(route: Route) -> None:
        route.fulfill(body=body, content_type="text/html; charset=utf-8")

    control.route(f"{origin}/{CONTROL}", answer)
    control.goto(f"{origin}/{CONTROL}", wait_until="load")
    try:
        yield control
    finally:
        context.close()


def _page(layout: dict[str, Any], frames: list[str], style: str) -> str:
    svgs = {panel["name"]: panel["svg"] for panel in json.loads(frames[0])["panels"]}
    panels = "".join(
        f'<div class="{escape(classes)}" style="position:absolute;{_box(box)}">{svgs[name]}</div>'
        for name, classes, *box in layout["panels"]
    )
    width, height = layout["size"]
    data = json.dumps({"frames": frames, "panels": [name for name, *_ in layout["panels"]]}).replace("<", "\\u003c")
    return (
        '<!doctype html><html lang="en" class="js"><title>Control</title>'
        f'<link rel="stylesheet" href="{escape(style)}"><body style="display:block;padding:100px">'
        f'<figure class="figure"><div class="figure-stage" style="display:block;width:{width}px;height:{height}px">'
        f'{panels}<button type="button" style="position:absolute;touch-action:none;opacity:0;{_box(layout["handle"])}">'
        "</button></div></figure>"
        f'<script type="application/json">{data}</script><script>{_SCRIPT}</script>'
    )


def _box(box: list[float]) -> str:
    return ";".join(f"{side}:{px}px" for side, px in zip(("left", "top", "width", "height"), box, strict=True))
