// Keeps the numbers, the description and the Python beside a figure in step with its frames.
/** @import { Frame, Readout } from "../base/types.js" */
/** @import { Figure } from "./figure.js" */

import { copy, fileName, make, on, save, text } from "../base/dom.js";

/** @param {Readout} readout */
const row = ({ name, label, role }) =>
  make(
    "div",
    { class: `readout ${role}`.trim(), "data-readout": name },
    make("dt", {}, label),
    make("dd", {}, make("span", { class: "value" }), " ", make("span", { class: "unit" })),
  );

/**
 * @param {HTMLElement} list
 * @param {Frame} frame
 */
function readouts(list, frame) {
  const chosen = list.dataset.chosen?.split(" "); // this list shows only some; others are elsewhere or not shown
  const visible = frame.readouts.filter(({ name }) => chosen?.includes(name) ?? true);
  const names = /** @type {HTMLElement[]} */ ([...list.children]).map((node) => node.dataset.readout).join();
  if (names !== visible.map(({ name }) => name).join()) list.replaceChildren(...visible.map(row));
  visible.forEach(({ label, value, unit }, i) => {
    text(list.children[i].querySelector("dt"), label);
    text(list.children[i].querySelector(".value"), value);
    text(list.children[i].querySelector(".unit"), unit);
    list.children[i].querySelector(".unit")?.classList.toggle("degrees", unit === "°"); // without a space before it
  });
}

/** @param {Figure} figure */
export function showReadouts(figure) {
  const lists = /** @type {HTMLElement[]} */ ([...figure.root.querySelectorAll(".readouts")]);
  figure.on("frame", (frame) => lists.forEach((list) => readouts(list, frame)));
}

/** @param {Figure} figure */
export function showWords(figure) {
  const { root } = figure;
  const words = root.querySelector(".figure-words");
  const code = root.querySelector(".figure-python code");
  figure.on("frame", (frame) => {
    text(words, frame.description);
    text(code, frame.python);
  });
  if (!code) return;
  /** @param {string} label */
  const button = (label) => make("button", { type: "button" }, label);
  const [take, file] = [button("Copy the Python"), button("Download as .py")];
  code.closest("pre")?.after(make("div", { class: "figure-tools" }, take, file));
  const python = () => code.textContent ?? "";
  on(take, "click", async () => {
    if (await copy(python())) figure.say("Python copied.");
    else getSelection()?.selectAllChildren(code);
  });
  on(file, "click", () => save(fileName(figure.id, ".py"), python(), "text/x-python"));
}
