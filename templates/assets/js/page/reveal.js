// What an address names may lie in something folded: that opens, in browsers that do not see to it themselves.
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
