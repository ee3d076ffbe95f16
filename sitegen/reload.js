/* Keeps the page in step with what `python3 build.py serve` builds. Only that server serves this; no published page has it. */
(() => {
  "use strict";
  const shown = document.currentScript.dataset.build;
  let events = null;
  let panel = null;

  const element = (parent, tag, style, text = "") => {
    const made = parent.appendChild(document.createElement(tag));
    made.style.cssText = style;
    made.textContent = text;
    return made;
  };

  const hide = () => {
    panel?.remove();
    panel = null;
  };

  const show = (title, lines) => {
    hide();
    panel = element(
      document.body,
      "div",
      "position: fixed; inset: auto 0 0 0; z-index: 2147483647; box-sizing: border-box; max-height: 70vh; overflow: auto;" +
        "padding: 16px 24px 20px; background: #1d1b1a; color: #f6f2ec; border-top: 4px solid #e5674c;" +
        "font: 15px/1.5 ui-monospace, Menlo, Consolas, monospace; white-space: pre-wrap; overflow-wrap: anywhere",
    );
    panel.id = "build-problems";
    panel.setAttribute("role", "alert");
    const box = panel.attachShadow({ mode: "open" }); // the site's styles stay out
    const button = element(
      box,
      "button",
      "float: right; min-height: 32px; padding: 4px 14px; font: inherit; color: inherit; background: transparent;" +
        "border: 1px solid #8a827a; border-radius: 6px; cursor: pointer",
      "Hide",
    );
    button.addEventListener("click", hide);
    element(box, "strong", "display: block; margin-bottom: 8px; color: #ffb4a2", title);
    for (const line of lines) element(box, "div", "", line);
  };

  const open = () => {
    events = new EventSource("/.ladder/events");
    events.onmessage = (message) => {
      const state = JSON.parse(message.data);
      if (state.lines.length) show(state.title, state.lines);
      else if (state.build !== shown) location.reload();
      else hide();
    };
  };

  // A browser holds six connections to one server, so a page that nobody sees gives its own back.
  const follow = () => {
    if (document.hidden) {
      events?.close();
      events = null;
    } else if (!events) open();
  };
  document.addEventListener("visibilitychange", follow);
  addEventListener("pagehide", () => events?.close());
  addEventListener("pageshow", (event) => event.persisted && open());
  follow();
})();
