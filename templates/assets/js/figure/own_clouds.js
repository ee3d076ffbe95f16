// A reader's own clouds: two files, chosen or dropped. Their bytes go to Python in this page's worker and nowhere else;
// Python says what they contain and what is wrong with them.
/** @import { Figure } from "./figure.js" */
/** @import { Overlay } from "./overlay.js" */

import { around, findButton, messageOf, on, save, text } from "../base/dom.js";
import { called, megabytes } from "../base/format.js";
import { addPen } from "./pen.js";
import { runtime } from "../runtime/runtime.js";

const LARGEST = 24_000_000;

/** @typedef {{ name: string, data: Uint8Array }} Thing  a file; a drawing has no name */
/** @typedef {Record<string, Thing>} Things  by slot */
/** @typedef {{ name: string, over: boolean }} Turn  the reading of a slot's latest file; over: read or refused */

/**
 * @param {Figure} figure
 * @param {Overlay} overlay
 */
export function addOwnClouds(figure, overlay) {
  const box = /** @type {HTMLElement | null} */ (figure.root.querySelector(".own"));
  if (!box) return;
  const slots = figure.spec.takes;
  /** @type {Map<string, string>} */
  const words = new Map(); // fingerprint → description
  /** @type {Map<string, Turn>} */
  const turns = new Map(); // by slot: results of earlier turns are ignored

  /** @param {string} slot */
  const statusOf = (slot) => box.querySelector(`[data-told="${slot}"]`);

  /** @param {string} name */
  const waits = (name) => (runtime.state === "live" ? `Reading ${name}.` : `${name} will be read once Python is ready.`);

  /**
   * Describes a file that a record refers to; it may be forgotten by now, or stem from another visit.
   * @param {string | undefined} key
   */
  function describe(key) {
    if (!key) return "Nothing yet.";
    if (runtime.holds(key)) return words.get(key) ?? "";
    const description = words.get(key);
    if (!description) return "Not here: open the file used for this state.";
    return `No longer stored; open it again. It was ${description}`;
  }

  function show() {
    const { given: keys = {} } = figure.record;
    for (const slot of slots) {
      const turn = turns.get(slot);
      text(statusOf(slot), turn?.name && !turn.over ? waits(turn.name) : describe(keys[slot]));
    }
  }

  /**
   * Begins a turn for each thing; `alone`: ends all others.
   * @param {Record<string, { name: string }>} things
   */
  function begin(things, alone = false) {
    if (alone) turns.clear();
    /** @type {Record<string, Turn>} */
    const newTurns = {};
    for (const [slot, { name }] of Object.entries(things)) turns.set(slot, (newTurns[slot] = { name, over: false }));
    show();
    return newTurns;
  }

  /**
   * Has Python read a thing; resolves to its fingerprint.
   * @param {Thing} thing
   * @param {Turn} turn
   */
  async function read({ name, data }, turn) {
    try {
      const { widget } = figure.record;
      const { key, words: summary } = await runtime.give({ figure: figure.id, widget, name, data });
      words.set(key, name ? `${name}: ${summary}` : summary);
      return key;
    } finally {
      turn.over = true;
    }
  }

  /**
   * Has the figure show these things; `alone`: in place of all others.
   * @param {Things} things
   */
  async function bring(things, alone = false, newTurns = begin(things, alone)) {
    /** @param {[slot: string, key?: string]} pair */
    const mine = ([slot]) => turns.get(slot) === newTurns[slot];
    /** @type {[slot: string, key: string][]} */
    const pairs = [];
    runtime.start();
    for (const [slot, thing] of Object.entries(things)) {
      if (!mine([slot])) continue; // another file came while this one was read
      try {
        pairs.push([slot, await read(thing, newTurns[slot])]);
      } catch (error) {
        for (const turn of Object.values(newTurns)) turn.over = true;
        show();
        const reason = messageOf(error).replace(/^ValueError: /, "");
        if (mine([slot])) figure.refuse(`${called(thing.name) || "The drawing"}: ${reason}.`);
        return;
      }
    }
    const heard = pairs.filter(mine);
    if (Object.keys(things).length && !heard.length) return;
    const previous = figure.record.given ?? {};
    /** @type {Record<string, string>} */
    const keys = { ...(alone ? {} : previous), ...Object.fromEntries(heard) };
    const same = slots.every((slot) => previous[slot] === keys[slot]);
    const controls = { ...figure.record.controls, clouds: "own" };
    const log = same ? figure.record.log : []; // a link's actions are kept for the files that they were made with
    figure.ask({ ...figure.record, controls, log, given: keys });
    figure.speak();
    show();
  }

  /**
   * @param {File[]} files
   * @param {string} [preferred]  the slot to fill; by default the first free one
   */
  async function open(files, preferred) {
    if (runtime.state === "file") return figure.refuse("Files cannot be read here.");
    if (files.length > slots.length) {
      figure.refuse(`${files.length} files at once: open ${slots.length}, the ${slots.join(" and the ")}.`);
      return;
    }
    const [first, second] = files;
    const coming = (/** @type {string} */ slot) => turns.get(slot)?.over === false;
    const free = slots.find((slot) => !figure.record.given?.[slot] && !coming(slot)) ?? slots[0];
    /** @type {Record<string, File>} */
    const chosen = second ? { [slots[0]]: first, [slots[1]]: second } : { [preferred ?? free]: first };
    const large = Object.values(chosen).find(({ size }) => size > LARGEST);
    if (large) {
      figure.refuse(`${called(large.name)}: ${megabytes(large.size)} MB exceed the limit of ${LARGEST / 1e6} MB.`);
      return;
    }
    pen.put();
    const newTurns = begin(chosen);
    /** @type {Things} */
    const things = {};
    for (const [slot, file] of Object.entries(chosen)) {
      try {
        things[slot] = { name: file.name, data: new Uint8Array(await file.arrayBuffer()) };
      } catch (error) {
        const last = Object.entries(newTurns).some(([name, turn]) => turns.get(name) === turn);
        for (const turn of Object.values(newTurns)) turn.over = true;
        show();
        if (last) figure.refuse(`${called(file.name)} cannot be read: ${messageOf(error)}.`);
        return;
      }
    }
    bring(things, false, newTurns);
  }

  /** @param {Event} event */
  function chosen(event) {
    const target = /** @type {HTMLInputElement} */ (event.target);
    if (target.type !== "file" || !target.files?.length) return;
    open([...target.files], target.dataset.place);
    target.value = ""; // the same file may be chosen again
  }

  /** @param {DragEvent} event */
  const carries = (event) => event.dataTransfer?.types.includes("Files");

  /** @param {DragEvent} event */
  function over(event) {
    if (!event.dataTransfer || !carries(event)) return;
    event.preventDefault();
    event.dataTransfer.dropEffect = "copy";
    figure.root.classList.add("dropping");
  }

  /** @param {DragEvent} event */
  function left(event) {
    if (!figure.root.contains(/** @type {Node | null} */ (event.relatedTarget))) figure.root.classList.remove("dropping");
  }

  /** @param {DragEvent} event */
  function dropped(event) {
    if (!event.dataTransfer || !carries(event)) return;
    event.preventDefault();
    figure.root.classList.remove("dropping");
    const folder = [...event.dataTransfer.items].map((item) => item.webkitGetAsEntry()).find((entry) => entry?.isDirectory);
    if (folder) {
      figure.refuse(`${called(folder.name)} is a folder: drop files, the source first.`);
      return;
    }
    const files = [...event.dataTransfer.files];
    if (files.length) open(files, around(event, "[data-place]")?.dataset.place);
  }

  function swap() {
    const { given = {} } = figure.record;
    const [first, second] = slots.map((slot) => given[slot]);
    const exchange = { ...(second && { [slots[0]]: second }), ...(first && { [slots[1]]: first }) };
    figure.ask({ ...figure.record, given: exchange, log: [] });
    figure.speak();
  }

  /** @param {MouseEvent} event */
  function take(event) {
    const name = around(event, "[data-file]")?.dataset.file ?? "";
    const content = figure.frame.files?.[name];
    if (content) save(name, content);
  }

  const files = /** @type {NodeListOf<HTMLButtonElement>} */ (box.querySelectorAll("[data-file]"));
  const swapping = findButton(box, "[data-own=swap]");
  const pen = addPen(figure, overlay, (things) => bring(things, true));
  figure.whileReading(() => [...turns.values()].some(({ over }) => !over));
  /** @param {DragEvent} event */
  const missed = (event) => carries(event) && event.preventDefault(); // a drop beside the figure keeps the page
  const shown = () => {
    for (const button of files) button.disabled = !figure.frame.files;
    swapping.disabled = !figure.record.given || figure.record.controls.clouds !== "own";
  };
  on(box, "change", chosen);
  on(box, "click", take);
  on(swapping, "click", swap);
  on(figure.root, "dragover", over);
  on(figure.root, "dragleave", left);
  on(figure.root, "drop", dropped);
  on(document, "dragover", missed);
  on(document, "drop", missed);
  figure.on("asked", show);
  figure.on("state", show);
  figure.on("frame", shown);
  box.hidden = runtime.state === "file";
  show();
  shown();
}
