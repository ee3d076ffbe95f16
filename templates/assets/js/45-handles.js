// Handles: what a pointer drags and arrow keys move. A key is a drag to the place that the frame names for it.
(() => {
  "use strict";

  const { make, on, percent, record: records, world } = Ladder;
  const HINT = "handle-hint";

  function hint() {
    const words = "Arrow keys move, Shift for larger steps.";
    if (!document.getElementById(HINT)) document.body.append(make("p", { id: HINT, hidden: true }, words));
  }

  Ladder.handles = function (figure, overlay) {
    const { root } = figure;
    const buttons = new Map();
    // pointer, name, before: the record to go back to, grip: px from the handle's place to the pointer,
    // to: a place not yet asked for, at: when it came, ahead: the animation frame that will ask
    let drag = null;
    let keys = []; // [handle, key] pressed faster than frames come
    hint();

    const handleOf = (name) => figure.frame.handles.find((handle) => handle.name === name);

    function made({ name, kind, radius }) {
      const attributes = { type: "button", class: `handle ${kind}`, "data-handle": name, "aria-describedby": HINT };
      const button = make("button", attributes);
      button.style.width = button.style.height = `${Math.max(44, 2 * radius)}px`;
      buttons.set(name, button);
      return button;
    }

    function update() {
      const { handles } = figure.frame;
      for (const [name, button] of buttons) {
        if (handles.some((handle) => handle.name === name)) continue;
        overlay.remove(button);
        buttons.delete(name);
      }
      for (const handle of handles) {
        const button = buttons.get(handle.name) ?? overlay.layer.appendChild(made(handle));
        const label = `${handle.label}: ${handle.value}`;
        if (button.getAttribute("aria-label") !== label) button.setAttribute("aria-label", label);
        if (drag?.name !== handle.name) overlay.put(button, handle.panel, handle.left, handle.top);
      }
      pressKey();
    }

    // Dragging

    function take(event) {
      const button = event.target.closest(".handle");
      if (!button || drag || event.button !== 0) return;
      const name = button.dataset.handle;
      overlay.measure();
      const box = button.getBoundingClientRect();
      const grip = [event.clientX - (box.left + box.right) / 2, event.clientY - (box.top + box.bottom) / 2];
      drag = { pointer: event.pointerId, name, before: figure.record, grip, to: null, at: 0, ahead: 0 };
      keys = [];
      try {
        root.setPointerCapture(event.pointerId);
      } catch {
        // the pointer is gone already, or never was (a synthetic event)
      }
      button.focus({ preventScroll: true });
      root.classList.add("dragging");
    }

    function follow(event) {
      if (event.pointerId !== drag?.pointer) return;
      const handle = handleOf(drag.name);
      if (!handle) return;
      const { view } = figure.frame.panels.find(({ name }) => name === handle.panel);
      drag.to = world(overlay.rect(handle.panel), view, event.clientX - drag.grip[0], event.clientY - drag.grip[1]);
      overlay.put(buttons.get(drag.name), handle.panel, ...percent(view, drag.to));
      drag.at = event.timeStamp;
      if (!drag.ahead) ahead();
    }

    /** At most one question an animation frame: the first place at once, the last one of the frame at its end. */
    function ahead() {
      if (!drag?.to) return;
      figure.ask(records.drag(figure.record, drag.name, drag.to), { merge: `drag:${drag.name}`, at: drag.at });
      drag.to = null;
      const held = drag;
      held.ahead = requestAnimationFrame(() => {
        held.ahead = 0;
        if (drag === held) ahead();
      });
    }

    function release(event) {
      if (event.pointerId !== drag?.pointer) return;
      const { to, name, at, ahead: request } = drag;
      cancelAnimationFrame(request);
      done();
      if (to) figure.ask(records.drag(figure.record, name, to), { merge: `drag:${name}`, at });
      finish();
    }

    function done() {
      drag = null;
      root.classList.remove("dragging");
    }

    /** Lets go: the handle goes to where the frame has it, unless the place it was put at still waits for its frame. */
    function finish() {
      if (!figure.busy) update();
      figure.speak();
    }

    function cancel() {
      const { before, ahead: request, pointer } = drag;
      cancelAnimationFrame(request);
      done();
      if (root.hasPointerCapture?.(pointer)) root.releasePointerCapture(pointer);
      figure.ask(before);
      if (!figure.busy) update();
    }

    // Keys

    function key(event) {
      if (drag && event.key === "Escape") {
        event.preventDefault();
        cancel();
        return;
      }
      const name = event.target.closest?.(".handle")?.dataset.handle;
      if (!name || event.altKey || event.ctrlKey || event.metaKey) return;
      const which = (event.shiftKey ? "Shift+" : "") + event.key;
      if (!handleOf(name)?.keys[which]) return;
      event.preventDefault();
      if (!drag && keys.length < 50) keys.push([name, which]);
      pressKey(event.timeStamp);
    }

    /** A key's place holds for the frame that is seen: the next key waits for the next frame. */
    function pressKey(at) {
      if (!keys.length || figure.asked || figure.waiting.length) return;
      const [name, which] = keys.shift();
      const to = handleOf(name)?.keys[which];
      if (to) figure.ask(records.drag(figure.record, name, to), { merge: `drag:${name}`, by: "key", at });
      figure.speaks = true;
    }

    const disposers = [
      figure.on("frame", update),
      figure.on("asked", (by) => {
        if (by !== "key") keys = [];
      }),
      on(overlay.layer, "pointerdown", take),
      on(root, "pointermove", follow),
      on(root, "pointerup", release),
      on(root, "pointercancel", release),
      on(root, "lostpointercapture", release),
      on(root, "keydown", key),
    ];
    update();
    return () => disposers.forEach((dispose) => dispose());
  };
})();
