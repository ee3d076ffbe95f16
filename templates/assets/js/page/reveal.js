// What an address names may lie in something folded: that opens, in browsers that do not see to it themselves.
import { on } from "../base/dom.js";

function reveal() {
  const named = document.getElementById(decodeURIComponent(location.hash.slice(1).split("?")[0]));
  const folded = named?.closest("details:not([open])");
  if (!(folded instanceof HTMLDetailsElement)) return;
  folded.open = true;
  named?.scrollIntoView();
}

export function revealNamed() {
  reveal();
  on(globalThis, "hashchange", reveal);
}
