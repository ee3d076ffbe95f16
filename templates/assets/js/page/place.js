// What is in the middle of the window stays in it when a phone or tablet is turned. The browser itself sees to that
// only where the layout stays the same.
import { on } from "../base/dom.js";

const PARTS = ".text > :not(.figure), .text :is(.figure-body > :not(.figure-desk), .figure-desk > *, figcaption)";

/** For pages of text: a deck keeps its slide. */
export function keepPlace() {
  /** @type {Element | undefined} */
  let kept; // none at the page's top, which stays there
  let width = innerWidth;
  on(globalThis, "onscrollend" in globalThis ? "scrollend" : "scroll", () => {
    if (innerWidth !== width) return;
    const parts = scrollY ? [...document.querySelectorAll(PARTS)] : [];
    kept = parts.find((part) => part.getBoundingClientRect().bottom > innerHeight / 2);
  });
  on(globalThis, "resize", () => {
    if (innerWidth === width) return;
    width = innerWidth;
    const box = kept?.getBoundingClientRect();
    if (!box || (box.top < innerHeight * 0.6 && box.bottom > innerHeight / 4)) return; // the browser has kept it
    kept?.scrollIntoView({ block: "center", behavior: "instant" });
  });
}
