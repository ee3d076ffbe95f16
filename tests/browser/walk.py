"""A reader without a plan: whatever a page offers is pressed, dragged, turned, pointed at and left at random."""

from __future__ import annotations

import math
from collections.abc import Callable
from random import Random
from typing import Any

from playwright.sync_api import Error, Page

from tests.browser.conftest import Reader

# The actions, their elements, and their relative frequencies.
OFFERS = {
    "press": (6, "figure.figure .buttons [data-button]:not([aria-disabled=true])"),
    "slide": (4, "form.controls input[type=range]"),
    "choose": (3, "form.controls label:has(input[type=radio]:not(:checked))"),
    "list": (3, "form.controls select"),
    "toggle": (2, "form.controls label:has(input[type=checkbox])"),
    "drag": (5, ".figure-handles :is(.handle, .ghost-handle)"),
    "move": (3, ".figure-handles :is(.handle:not(.copy), .ghost-handle)"),
    "pick": (4, "figure.figure .figure-panel"),
    "point": (3, "figure.figure .figure-panel"),
    "cross": (3, ".figure-handles .crosshair"),
    "stroke": (4, ".figure-stage.drawing .figure-panel"),
    "try": (2, "button.try"),
    "predict": (2, ".predict button:not([aria-disabled=true])"),
    "tool": (4, "[data-pin], [data-link], .runs [data-do], .job-found button, .own button:not([data-file])"),
    "take": (1, ".figure-tools button, .figure-take button"),
    "unfold": (1, "figure.figure summary, .try-this > summary"),
    "job": (3, ".job-head [data-do]"),
    "theme": (1, "button.theme"),
    "resize": (1, "html"),
    "revisit": (1, "figure.figure"),
    "reload": (0.5, "html"),
    "leave": (0.5, ".pager a"),
}
OFFERED = """kinds => Object.fromEntries(Object.entries(kinds).map(([kind, part]) => {
  const offered = (e) => !e.disabled && e.checkVisibility({ visibilityProperty: true });
  return [kind, [...document.querySelectorAll(part)].flatMap((e, i) => (offered(e) ? [i] : []))];
}))"""
# Brings an element into view; returns its box and words, and what covers its middle.
FOUND = """([part, index]) => {
  const element = document.querySelectorAll(part)[index];
  if (!element?.checkVisibility()) return null;
  element.scrollIntoView({ block: "center", inline: "center", behavior: "instant" });
  const { left, top, width, height } = element.getBoundingClientRect();
  const over = document.elementFromPoint(left + width / 2, top + height / 2);
  const { handle, panel, button, pick } = element.dataset;
  const words = [element.closest("figure")?.id, handle ?? button ?? pick ?? "", panel ?? "", element.name ?? ""];
  const said = handle || button || panel ? "" : element.textContent.trim().replace(/\\s+/g, " ").slice(0, 40);
  const covered = Boolean(over) && !element.contains(over) && over.outerHTML.slice(0, 120);
  return { left, top, width, height, covered, words: [...words, said].filter(Boolean).join(" ") };
}"""
FOCUS = "([part, index]) => document.querySelectorAll(part)[index]?.focus({ preventScroll: true })"
# Waits until no request is pending, nothing moves or is being refined, except runs that go on until paused; then lists
# the faults of the page.
FAULTS = """async () => {
  const wrong = [];
  const { record: records, runtime, figures } = Ladder;
  const end = performance.now() + 60_000;
  const frame = () => new Promise(requestAnimationFrame);
  await frame(); // what was pointed at last is asked for
  while ([...figures.values()].some((figure) => !figure.running && figure.busy)) {
    if (performance.now() > end) return ["its figures do not come to rest"];
    await frame();
  }
  if (["failed", "file"].includes(runtime.state)) wrong.push(`Python is ${runtime.state}: ${runtime.message}`);
  const root = document.documentElement;
  if (root.scrollWidth > root.clientWidth) wrong.push(`${root.scrollWidth - root.clientWidth} px too wide`);
  const ids = [...document.querySelectorAll("[id]")].map(({ id }) => id);
  const twice = ids.filter((id, i) => ids.indexOf(id) !== i);
  if (twice.length) wrong.push(`ids twice: ${twice}`);
  for (const figure of figures.values()) {
    const say = (words) => wrong.push(`${figure.id}: ${words}`);
    const { root, stage, frame, spec } = figure;
    const parts = [stage, ...root.querySelectorAll(".figure-panel")];
    const markup = parts.map((part) => part.innerHTML).join(" ");
    const lines = [".readouts", ".figure-status", ".figure-words", ".controls", ".runs", ".job-found", ".own"];
    const shown = lines.map((part) => root.querySelector(part)?.textContent ?? "").join(" ");
    for (const text of [markup, shown]) {
      const odd = text.match(
        /.{0,60}(\\bNaN\\b|(?<!rotation is )\\bundefined\\b|\\bnull\\b|\\bInfinity\\b|\\[object).{0,60}/,
      );
      if (odd) say(odd[0]);
    }
    if (figure.error) say(figure.error);
    if (figure.running) continue;
    if (!["static", "tape", "live"].includes(root.dataset.state)) say(`its state is ${root.dataset.state}`);
    if (records.key(figure.record) !== records.key(figure.shown)) say("what is asked is not what is shown");
    const drawn = frame.panels.map(({ name, svg }) => [name, svg, Ladder.drawing(root, name)]);
    const template = document.createElement("template");
    for (const [name, svg, there] of drawn) {
      if (!svg) continue; // the build's own
      template.innerHTML = svg;
      if (there?.outerHTML !== template.innerHTML) say(`panel ${name} is not the frame's`);
    }
    if (root.querySelectorAll(".figure-panel[data-panel]").length !== drawn.length) say("another number of panels");
    const told = [...root.querySelectorAll(".readout")].map((e) => [e.dataset.readout,
      e.querySelector(".value").textContent]);
    const wanted = [...root.querySelectorAll(".readouts")].flatMap(({ dataset }) =>
      frame.readouts.filter(({ name }) => dataset.chosen?.split(" ").includes(name) ?? true));
    if (!root.closest(".slide") && wanted.length !== frame.readouts.length) say("readouts are missing");
    if (String(told) !== String(wanted.map(({ name, value }) => [name, value]))) say(`readouts: ${told}`);
    if (root.querySelector(".figure-words")?.textContent !== frame.description) say("words of another frame");
    const forms = [...root.querySelectorAll("form.controls")];
    for (const [name, { kind, step }] of Object.entries(spec.controls)) {
      const field = forms.map((form) => form.elements.namedItem(name)).find(Boolean);
      if (!field) continue;
      const [has, value] = [kind === "toggle" ? field.checked : field.value, figure.shown.controls[name]];
      const same = kind === "slider" ? Math.abs(has - value) <= step / 2 + 1e-9 : has === value;
      if (!same) say(`control ${name} shows ${has} for ${value}`);
    }
    for (const { name, does } of spec.buttons) {
      const off = root.querySelector(`[data-button="${name}"]`).getAttribute("aria-disabled") === "true";
      if (does === "press" && off !== frame.disabled.includes(name)) say(`button ${name} is ${off ? "off" : "on"}`);
      if (does === "back" && off !== !figure.record.log.length) say(`button ${name} is ${off ? "off" : "on"}`);
    }
    for (const { name, panel, left, top } of frame.handles) {
      if (!Ladder.onStage(root, panel)) continue;
      const button = root.querySelector(`.handle[data-handle="${name}"]:not(.copy)`);
      if (button && !button.checkVisibility()) continue; // the pen is in the reader's hand
      const [own, box] = [button?.getBoundingClientRect(), Ladder.drawing(root, panel).getBoundingClientRect()];
      const dx = own ? own.left + own.width / 2 - box.left - (left / 100) * box.width : NaN;
      const dy = own ? own.top + own.height / 2 - box.top - (top / 100) * box.height : NaN;
      if (!(Math.hypot(dx, dy) < 1.5)) say(`handle ${name} is off by ${dx}, ${dy} px`);
    }
  }
  return wrong;
}"""
# A figure as rendered, to be compared with another page's.
SEEN = """id => {
  const { root, shown, frame } = Ladder.figures.get(id);
  const text = (part) => [...root.querySelectorAll(part)].map((e) => e.textContent);
  return {
    svg: frame.panels.map(({ name }) => Ladder.drawing(root, name).outerHTML),
    captions: text(".panel-caption span"),
    readouts: frame.readouts.map(({ name }) =>
      root.querySelector(`.readout[data-readout="${name}"] .value`)?.textContent),
    words: text(".figure-words"),
    python: text(".figure-python code"),
    controls: shown.controls,
  };
}"""
WIDE, NARROW = {"width": 1280, "height": 1000}, {"width": 390, "height": 800}


class Walk:
    """A walk on one page. `tried` lists what was done."""

    def __init__(self, reader: Reader, page: Page, seed: str) -> None:
        self.reader, self.page = reader, page
        self.random = Random(seed)
        self.actions: list[str] = []

    def steps(self, count: int) -> None:
        """Take this many actions, sometimes two or four before anything is checked; then let everything come to rest.
        Raises AssertionError with everything that was tried."""
        hasty = 0
        for _ in range(count):
            self.step()
            hasty = hasty - 1 if hasty else self.random.choice((0, 0, 1, 3))
            if not hasty:
                self.check()
        self.pause()
        self.check()

    def step(self) -> None:
        """Take one action, drawn from what the page offers."""
        offers = self.page.evaluate(OFFERED, {kind: part for kind, (_, part) in OFFERS.items()})
        kinds = [kind for kind in OFFERS if offers[kind]]
        (kind,) = self.random.choices(kinds, [OFFERS[kind][0] for kind in kinds])
        self.do(kind, self.random.choice(offers[kind]))

    def do(self, kind: str, index: int) -> None:
        part = OFFERS[kind][1]
        box = self.page.evaluate(FOUND, [part, index])
        if box is None:  # gone with the answer to the last action
            return
        self.actions.append(f"{kind} {box['words']}")
        if kind in DIRECT:
            DIRECT[kind](self)
        elif kind in KEYED:
            self.page.evaluate(FOCUS, [part, index])
            keys = [self.random.choice(KEYED[kind]) for _ in range(self.random.randint(1, 4))]
            self.actions[-1] += f": {' '.join(keys)}"
            for key in keys:
                self.page.keyboard.press(key)
        else:
            WITH_POINTER[kind](self, box)

    def check(self) -> None:
        """Once the figures are at rest, check for complaints of the browser and faults of the page."""
        try:
            wrong = [*self.page.evaluate(FAULTS), *self.reader.unexpected()]
        except Error as error:
            raise AssertionError(f"{error} after {self.told()}") from error
        assert not wrong, f"{wrong} after {self.told()}"

    def told(self) -> str:
        return "".join(f"\n  {i + 1}. {action}" for i, action in enumerate(self.actions))

    def pause(self) -> None:
        """Pause runs and stop jobs."""
        for part in (".buttons [data-button]", ".job-head [data-do=stop]:not(:disabled)"):
            for node in self.page.locator(part).all():
                if node.inner_text() in ("Pause", "Stop"):
                    node.evaluate("button => button.click()")

    # Pointer actions.

    def place(self, box: dict[str, Any]) -> tuple[float, float]:
        """A place in a box, away from its edges, and on the screen."""
        x, y = (box[low] + box[size] * self.random.uniform(0.1, 0.9) for low, size in SIDES)
        size = self.page.viewport_size
        assert size is not None
        return min(max(x, 1), size["width"] - 1), min(max(y, 1), size["height"] - 1)

    def click(self, box: dict[str, Any]) -> None:
        """Click the middle of a part, which nothing may cover."""
        assert not box["covered"], f"covered by {box['covered']} after {self.told()}"
        times = self.random.choice((1, 1, 1, 2, 3))
        x, y = (box[low] + box[size] / 2 for low, size in SIDES)
        for _ in range(times):
            self.page.mouse.click(x, y)
        self.actions[-1] += f" ×{times}" if times > 1 else ""

    def tap(self, box: dict[str, Any]) -> None:
        """Click once somewhere in a part."""
        x, y = self.place(box)
        self.actions[-1] += f" at {x - box['left']:.0f}, {y - box['top']:.0f} px"
        self.page.mouse.click(x, y)

    def drag(self, box: dict[str, Any]) -> None:
        """Drag by up to 200 px; now and then Escape takes it back."""
        x, y = (box[low] + box[size] / 2 for low, size in SIDES)
        distance, way = self.random.uniform(2, 200), self.random.uniform(0, 2 * math.pi)
        dx, dy = distance * math.cos(way), distance * math.sin(way)
        self.actions[-1] += f" by {dx:.0f}, {dy:.0f} px"
        self.page.mouse.move(x, y)
        self.page.mouse.down()
        self.page.mouse.move(x + dx, y + dy, steps=self.random.randint(1, 4))
        if self.random.random() < 0.15:
            self.actions[-1] += ", Escape"
            self.page.keyboard.press("Escape")
        self.page.mouse.up()

    def point(self, box: dict[str, Any]) -> None:
        for _ in range(self.random.randint(1, 4)):
            self.page.mouse.move(*self.place(box))

    def stroke(self, box: dict[str, Any]) -> None:
        self.page.mouse.move(*self.place(box))
        self.page.mouse.down()
        for _ in range(3):
            self.page.mouse.move(*self.place(box), steps=3)
        self.page.mouse.up()

    # Actions on the page.

    def resize(self) -> None:
        self.page.set_viewport_size(self.random.choice((WIDE, NARROW)))  # type: ignore[arg-type]

    def reload(self) -> None:
        self.page.reload()

    def revisit(self) -> None:
        """Take a figure's link, change the address to it, and sometimes go back."""
        links = self.page.evaluate("[...Ladder.figures.values()].map(figure => figure.link().split('#')[1])")
        self.page.evaluate("hash => { location.hash = hash; }", self.random.choice(links))
        if self.random.random() < 0.5:
            self.actions[-1] += ", back"
            self.page.go_back()

    def leave(self) -> None:
        """Go to a page without figures, and back."""
        self.page.goto(f"{self.reader.origin}/licences.html")
        self.page.go_back()


SIDES = (("left", "width"), ("top", "height"))
ARROWS = [f"{shift}Arrow{way}" for shift in ("", "Shift+") for way in ("Left", "Right", "Up", "Down")]
KEYED = {
    "slide": ["ArrowLeft", "ArrowRight", "PageUp", "PageDown", "Home", "End"],
    "list": ["ArrowDown", "ArrowUp", "Home", "End"],
    "move": ARROWS,
    "cross": [*ARROWS, "Enter", "Enter", "Enter"],
}
CLICKED = ("press", "choose", "toggle", "try", "predict", "tool", "take", "unfold", "job", "theme")
WITH_POINTER: dict[str, Callable[[Walk, dict[str, Any]], None]] = {
    **dict.fromkeys(CLICKED, Walk.click),
    "drag": Walk.drag,
    "pick": Walk.tap,
    "point": Walk.point,
    "stroke": Walk.stroke,
}
DIRECT: dict[str, Callable[[Walk], None]] = {
    "resize": Walk.resize,
    "reload": Walk.reload,
    "revisit": Walk.revisit,
    "leave": Walk.leave,
}
