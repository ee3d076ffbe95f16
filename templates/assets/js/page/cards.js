// Cards of citations and of terms: shown on hover, focus and tap, one at a time; Escape closes; the pointer may move into the card.
import { around, on } from "../base/dom.js";

const OPEN = 120; // ms
const CLOSE = 250;
const EDGE = 8; // px

/** @param {HTMLElement} link */
const cardOf = (link) => document.getElementById(link.dataset.card ?? "");

/** Points screen readers from each link to its card, if it has one. */
export function describeCards() {
  for (const link of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("a[data-card]"))) {
    const card = cardOf(link);
    if (card) link.setAttribute("aria-describedby", card.id);
  }
}

export function addCards() {
  /** @type {{ link: HTMLElement, card: HTMLElement, tapped?: boolean } | null} */
  let current = null;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let timer;
  let finger = false;

  /** @param {Event} event */
  const linkAt = (event) => around(event, "a[data-card]");

  /** @param {Event} event */
  const isInCard = (event) => current?.card.contains(/** @type {Node | null} */ (event.target)) ?? false;

  function close() {
    clearTimeout(timer);
    if (current) current.card.hidden = true;
    current = null;
  }

  /** @param {HTMLElement} link */
  function open(link) {
    clearTimeout(timer);
    const card = cardOf(link);
    if (!card || current?.link === link) return;
    close();
    card.hidden = false;
    current = { link, card };
    place(link, card);
  }

  /**
   * Places the card under the link, or above it if there is no room below; never across the viewport's sides.
   * @param {HTMLElement} link
   * @param {HTMLElement} card
   */
  function place(link, card) {
    const [at] = link.getClientRects();
    if (!at) return close(); // the link is inside something that was folded
    card.style.position = "fixed";
    card.style.left = card.style.top = "0px";
    const { width, height } = card.getBoundingClientRect();
    const left = Math.max(EDGE, Math.min(at.left, document.documentElement.clientWidth - width - EDGE));
    const under = at.bottom + EDGE / 2;
    const top = under + height > innerHeight && at.top > height ? at.top - height - EDGE / 2 : under;
    card.style.left = `${left}px`;
    card.style.top = `${top}px`;
  }

  function follow() {
    if (!current) return;
    const { top, bottom } = current.link.getBoundingClientRect();
    if (bottom < 0 || top > innerHeight) close();
    else place(current.link, current.card);
  }

  /** @type {(callback: () => void, wait: number) => void} */
  function later(callback, wait) {
    clearTimeout(timer);
    timer = setTimeout(callback, wait);
  }

  /**
   * A card opened by focus stays: the page may scroll under a resting pointer.
   * @param {PointerEvent} event
   */
  function over(event) {
    if (event.pointerType === "touch") return;
    const link = linkAt(event);
    if (link) later(() => open(link), OPEN);
    else if (isInCard(event) || current?.link === document.activeElement) clearTimeout(timer);
    else later(close, CLOSE);
  }

  /** @param {MouseEvent} event */
  function tap(event) {
    const link = linkAt(event);
    if (link && finger && event.detail && !(current?.tapped && current.link === link)) {
      event.preventDefault();
      open(link);
      if (current) current.tapped = true;
    } else if (!link && current && !isInCard(event)) close();
  }

  /** @param {FocusEvent} event */
  function focus(event) {
    const link = linkAt(event);
    if (link) open(link);
    else if (current && !isInCard(event)) close();
  }

  describeCards();
  on(document, "pointerover", over);
  on(document, "pointerdown", (event) => {
    finger = event.pointerType === "touch";
  });
  on(document, "click", tap);
  on(document, "focusin", focus);
  on(document, "keydown", (event) => {
    if (event.key === "Escape") close();
  });
  on(globalThis, "scroll", follow, { passive: true });
  on(globalThis, "resize", follow);
  on(globalThis, "pagehide", close); // the back/forward cache may bring the page back as it was left
}
