// A button in the text may lead far away: a way back stays on screen until it is used or no longer needed.

import { calm, make, on } from "../base/dom.js";

/** @type {(() => void) | undefined} removes the last offer */
let withdraw;

/** @param {Element} element */
export const goTo = (element) => element.scrollIntoView({ block: "center", behavior: calm() ? "auto" : "smooth" });

/**
 * @param {HTMLElement} from  what the reader pressed
 */
export function offerWayBack(from) {
  withdraw?.();
  const back = make("button", { type: "button", class: "way-back" }, "Back to where you were");
  let wasAway = false; // whether `from` has been out of view
  const watch = new IntersectionObserver(([{ isIntersecting }]) => {
    if (wasAway && isIntersecting) withdraw?.();
    wasAway ||= !isIntersecting;
  });
  withdraw = () => {
    watch.disconnect();
    back.remove();
    withdraw = undefined;
  };
  on(back, "click", () => {
    withdraw?.();
    goTo(from);
    from.focus({ preventScroll: true });
  });
  document.body.append(back);
  watch.observe(from);
}
