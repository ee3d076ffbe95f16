// Handles: buttons over the picture that a pointer drags and arrow keys move. A key is a drag to the place that the
// frame names for it.
(() => {
  "use strict";

  const { make, on, record: records } = Ladder;
  const HINT = "handle-hint";
  const MOST_KEYS = 50;

  function hint() {
    const words = "Arrow keys move, Shift for larger steps.";
    if (!document.getElementById(HINT)) document.body.append(make("p", { id: HINT, hidden: true }, words));
  }

  function made({ name, kind, radius }) {
    const attributes = { type: "button", class: `handle ${kind}`, "data-handle": name, "aria-describedby": HINT };
    const button = make("button", attributes);
    button.style.width = button.style.height = `${Math.max(44, 2 * radius)}px`;
    return button;
  }

  Ladder.handles = function (figure, overlay) {
    const buttons = new Map();
    const of = (name) => figure.frame.handles.find((handle) => handle.name === name);
    const drags = Ladder.drags(figure, overlay, { of, button: (name) => buttons.get(name), update });
    let keys = []; // [handle, key] pressed faster than frames come

    function update() {
      for (const [name, button] of buttons) {
        if (of(name)) continue;
        overlay.remove(button);
        buttons.delete(name);
      }
      for (const handle of figure.frame.handles) {
        if (!buttons.has(handle.name)) buttons.set(handle.name, overlay.layer.appendChild(made(handle)));
        const button = buttons.get(handle.name);
        const label = `${handle.label}: ${handle.value}`;
        if (button.getAttribute("aria-label") !== label) button.setAttribute("aria-label", label);
        if (drags.held !== handle.name) overlay.put(button, handle.panel, handle.left, handle.top);
      }
    }

    function key(event) {
      const name = event.target.closest(".handle")?.dataset.handle;
      if (!name || event.altKey || event.ctrlKey || event.metaKey) return;
      const which = (event.shiftKey ? "Shift+" : "") + event.key;
      if (!of(name)?.keys[which]) return;
      event.preventDefault();
      if (!drags.held && keys.length < MOST_KEYS) keys.push([name, which]);
      next(event.timeStamp);
    }

    /** A key's place holds for the frame that is seen: the next key waits for the next frame. */
    function next(at) {
      if (!keys.length || figure.asked || figure.waiting.length) return;
      const [name, which] = keys.shift();
      const to = of(name)?.keys[which];
      if (to) figure.ask(records.drag(figure.record, name, to), { merge: `drag:${name}`, by: "key", at });
      figure.speaks = true;
    }

    const disposers = [
      figure.on("frame", () => {
        update();
        next();
      }),
      figure.on("asked", (by) => {
        if (by !== "key") keys = [];
      }),
      on(overlay.layer, "keydown", key),
      drags.dispose,
    ];
    hint();
    update();
    return () => disposers.forEach((dispose) => dispose());
  };
})();
