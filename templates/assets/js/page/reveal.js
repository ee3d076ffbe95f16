// Opens the folded section around the element that the address names, for browsers that do not do so themselves.
import { named } from "../base/address.js";
import { on } from "../base/dom.js";

function reveal() {
  const target = named();
  const folded = target?.closest("details:not([open])");
  if (!(folded instanceof HTMLDetailsElement)) return;
  folded.open = true;
  target?.scrollIntoView();
}

export function revealNamed() {
  reveal();
  on(globalThis, "hashchange", reveal);
}
