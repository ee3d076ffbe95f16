// What is far from what is seen is left undrawn: a long page's figures, formulas and lines cost every frame of a drag.
import { on } from "../base/dom.js";

/**
 * Marks what is more than a screen away; the style sheet has the browser skip that, at the height it had. A mark goes
 * long before its element comes into sight, so that nothing is ever cut at its edge; and all go where heights change.
 * @param {Iterable<Element>} parts
 */
export async function markFar(parts) {
  const near = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) target.toggleAttribute("data-far", !isIntersecting);
  }, { rootMargin: "100% 0%" });

  function begin() {
    near.disconnect();
    for (const part of parts) {
      part.removeAttribute("data-far");
      near.observe(part);
    }
  }

  await document.fonts.ready;
  begin();
  let width = innerWidth;
  on(globalThis, "resize", () => {
    if (innerWidth !== width) begin();
    width = innerWidth;
  });
}
