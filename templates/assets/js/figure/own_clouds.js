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
/** @typedef {Record<string, Thing>} Things  by place */
/** @typedef {{ name: string, over: boolean }} Turn  the reading of a place's latest file; over: read or refused */

/**
 * @param {Figure} figure
 * @param {Overlay} overlay
 */
export function addOwnClouds(figure, overlay) {
  const box = /** @type {HTMLElement | null} */ (figure.root.querySelector(".own"));
  if (!box) return;
  const places = figure.spec.takes;
  /** @type {Map<string, string>} */
  const words = new Map(); // fingerprint → description
  /** @type {Map<string, Turn>} */
  const turns = new Map(); // by place: results of earlier turns are ignored

  /** @param {string} place */
  const told = (place) => box.querySelector(`[data-told="${place}"]`);

  /** @param {string} name */
  const waits = (name) => (runtime.state === "live" ? `Reading ${name}.` : `${name} will be read once Python is ready.`);

  /**
   * Describes a file that a record refers to; it may be forgotten by now, or stem from another visit.
   * @param {string | undefined} key
   */
  function named(key) {
    if (!key) return "Nothing yet.";
    if (runtime.holds(key)) return words.get(key) ?? "";
    const known = words.get(key);
    return known ? `No longer stored; open it again. It was ${known}` : "Not here: open the file used for this state.";
  }

  function show() {
    const { given = {} } = figure.record;
    for (const place of places) {
      const turn = turns.get(place);
      text(told(place), turn?.name && !turn.over ? waits(turn.name) : named(given[place]));
    }
  }

  /**
   * Begins a turn for each thing; `alone`: ends all others.
   * @param {Record<string, { name: string }>} things
   */
  function begin(things, alone = false) {
    if (alone) turns.clear();
    /** @type {Record<string, Turn>} */
    const begun = {};
    for (const [place, { name }] of Object.entries(things)) turns.set(place, (begun[place] = { name, over: false }));
    show();
    return begun;
  }

  /**
   * Has Python read a thing; resolves to its fingerprint.
   * @param {Thing} thing
   * @param {Turn} turn
   */
  async function read({ name, data }, turn) {
    try {
      const { key, words: said } = await runtime.give({ figure: figure.id, widget: figure.record.widget, name, data });
      words.set(key, name ? `${name}: ${said}` : said);
      return key;
    } finally {
      turn.over = true;
    }
  }

  /**
   * Has the figure show these things; `alone`: in place of all others.
   * @param {Things} things
   */
  async function bring(things, alone = false, begun = begin(things, alone)) {
    /** @param {[place: string, key?: string]} found */
    const mine = ([place]) => turns.get(place) === begun[place];
    /** @type {[place: string, key: string][]} */
    const found = [];
    runtime.start();
    for (const [place, thing] of Object.entries(things)) {
      if (!mine([place])) continue; // another file came while this one was read
      try {
        found.push([place, await read(thing, begun[place])]);
      } catch (error) {
        for (const turn of Object.values(begun)) turn.over = true;
        show();
        const why = messageOf(error).replace(/^ValueError: /, "");
        if (mine([place])) figure.refuse(`${called(thing.name) || "The drawing"}: ${why}.`);
        return;
      }
    }
    const heard = found.filter(mine);
    if (Object.keys(things).length && !heard.length) return;
    const before = figure.record.given ?? {};
    /** @type {Record<string, string>} */
    const given = { ...(alone ? {} : before), ...Object.fromEntries(heard) };
    const same = places.every((place) => before[place] === given[place]);
    const controls = { ...figure.record.controls, clouds: "own" };
    const log = same ? figure.record.log : []; // a link's actions are kept for the files that they were made with
    figure.ask({ ...figure.record, controls, log, given });
    figure.speak();
    show();
  }

  /**
   * @param {File[]} files
   * @param {string} [place]
   */
  async function open(files, place) {
    if (files.length > places.length) {
      figure.refuse(`${files.length} files at once: open ${places.length}, the ${places.join(" and the ")}.`);
      return;
    }
    const [one, other] = files;
    const coming = (/** @type {string} */ each) => turns.get(each)?.over === false;
    const free = places.find((each) => !figure.record.given?.[each] && !coming(each)) ?? places[0];
    /** @type {Record<string, File>} */
    const chosen = other ? { [places[0]]: one, [places[1]]: other } : { [place ?? free]: one };
    const large = Object.values(chosen).find(({ size }) => size > LARGEST);
    if (large) {
      figure.refuse(`${called(large.name)}: ${megabytes(large.size)} MB exceed the limit of ${LARGEST / 1e6} MB.`);
      return;
    }
    pen.put();
    const begun = begin(chosen);
    /** @type {Things} */
    const things = {};
    for (const [each, file] of Object.entries(chosen)) {
      try {
        things[each] = { name: file.name, data: new Uint8Array(await file.arrayBuffer()) };
      } catch (error) {
        const last = Object.entries(begun).some(([place, turn]) => turns.get(place) === turn);
        for (const turn of Object.values(begun)) turn.over = true;
        show();
        if (last) figure.refuse(`${called(file.name)} cannot be read: ${messageOf(error)}.`);
        return;
      }
    }
    bring(things, false, begun);
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
    const folder = [...event.dataTransfer.items].map((item) => item.webkitGetAsEntry()).find((each) => each?.isDirectory);
    if (folder) {
      figure.refuse(`${called(folder.name)} is a folder: drop files, the source first.`);
      return;
    }
    const files = [...event.dataTransfer.files];
    if (files.length) open(files, around(event, "[data-place]")?.dataset.place);
  }

  function swap() {
    const { given = {} } = figure.record;
    const [one, other] = places.map((place) => given[place]);
    const turned = { ...(other && { [places[0]]: other }), ...(one && { [places[1]]: one }) };
    figure.ask({ ...figure.record, given: turned, log: [] });
    figure.speak();
  }

  /** @param {MouseEvent} event */
  function take(event) {
    const name = around(event, "[data-file]")?.dataset.file ?? "";
    const held = figure.frame.files?.[name];
    if (held) save(name, held);
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
