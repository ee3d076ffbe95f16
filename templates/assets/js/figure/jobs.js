// Jobs: long computations that a figure offers. They run slice by slice, so that everything else comes first, and Stop
// only has to stop asking. The result is a sortable table with drawings; one run can be kept to compare with the next.
/** @import { Column, FigureRecord, JobResult, Row } from "../base/types.js" */
/** @import { Figure } from "./figure.js" */

import { around, copy, fileName, find, findButton, make, messageOf, on, save, text } from "../base/dom.js";
import { withUnit } from "../base/format.js";
import { runtime } from "../runtime/runtime.js";
import { secondWorker } from "../runtime/second.js";
import { runParts } from "./parts.js";

const TELL_EVERY = 200; // ms; the page's painting takes a core's time from the two workers

/** @typedef {{ by: number | null, falls: boolean }} Order  by a column; -1: by label; null: as given */

/**
 * The rows sorted by a column; rows without a value come last.
 * @type {(rows: Row[], order: Order) => Row[]}
 */
function sorted(rows, { by, falls }) {
  if (by === null) return rows;
  const way = falls ? -1 : 1;
  /** @param {Row} row */
  const value = (row) => row.values[by];
  return [...rows].sort((a, b) => {
    if (by < 0) return way * a.label.localeCompare(b.label);
    const [x, y] = [value(a), value(b)];
    if (x === null || y === null) return Number(x === null) - Number(y === null);
    return way * (x - y);
  });
}

/** @type {(columns: Column[], heading: string, order: Order) => HTMLElement} */
function head(columns, heading, order) {
  /** @type {(label: string, i: number) => HTMLElement} */
  const cell = (label, i) => {
    const way = order.by === i ? (order.falls ? "descending" : "ascending") : "none";
    const button = make("button", { type: "button", class: "sort", "data-sort": i }, label);
    return make("th", { scope: "col", "aria-sort": way }, button);
  };
  return make("tr", {}, cell(heading, -1), ...columns.map((column, i) => cell(withUnit(column), i)));
}

/**
 * A row; its numbers are followed by those of the kept run, if that has the row too.
 * @type {(row: Row, was: Row | undefined) => HTMLElement}
 */
function line(row, was) {
  const name = make("th", { scope: "row" }, make("span", { class: `key line ${row.mark}` }, row.label));
  const cells = row.texts.map((value, i) =>
    was ? make("td", {}, make("span", {}, value), make("span", { class: "was" }, was.texts[i])) : make("td", {}, value),
  );
  return make("tr", {}, name, ...cells);
}

/** @param {number} width */
const size = (width) =>
  width <= __PANEL_SMALL__ ? "small" : width <= __PANEL_THIRD__ ? "third" : width <= __PANEL_HALF__ ? "half" : "wide";

/** @param {JobResult} result */
function drawings({ panels }) {
  return panels.map(({ svg, width }) => {
    const panel = make("div", { class: `figure-panel panel-${size(width)}` });
    panel.innerHTML = svg;
    return panel;
  });
}

/**
 * The result that the page was built with; its drawings are read from the page.
 * @param {HTMLElement} box
 * @returns {JobResult}
 */
function built(box) {
  const result = /** @type {JobResult} */ (JSON.parse(find(box, "script.job-result").textContent ?? ""));
  const svgs = [...box.querySelectorAll(".job-panels svg.panel")].map((svg) => svg.outerHTML);
  return { ...result, panels: result.panels.map((panel, i) => ({ ...panel, svg: svgs[i] })) };
}

/**
 * @param {Figure} figure
 * @param {HTMLElement} box
 */
function job(figure, box) {
  const name = box.dataset.job ?? "";
  const output = find(box, ".job-found");
  const bar = /** @type {HTMLProgressElement} */ (box.querySelector("progress"));
  const [begin, stop] = ["begin", "stop"].map((action) => findButton(box, `.job-head [data-do="${action}"]`));
  const [words, heard] = [".job-words", ".job-heard"].map((selector) => find(box, selector));
  let current = built(box);
  /** @type {JobResult | null} */
  let baseline = null;
  /** @type {Order} */
  let order = { by: null, falls: false };
  /** @type {{ record: FigureRecord, rows: boolean } | null} */
  let run = null; // { record, rows: whether any has arrived } while a run is under way

  /** @param {string} message */
  function tell(message, aloud = true) {
    text(words, message);
    if (aloud) text(heard, message);
  }

  function show() {
    /** @param {Row} row */
    const was = (row) => baseline?.rows.find((candidate) => candidate.name === row.name);
    const focused = document.activeElement;
    const focus = focused instanceof HTMLElement && output.contains(focused) ? focused.dataset : {};
    const oldScroll = output.querySelector(".job-scroll");
    const [hadFocus, scrollLeft] = [oldScroll === document.activeElement, oldScroll?.scrollLeft ?? 0];
    const table = make(
      "table",
      {},
      make("thead", {}, head(current.columns, current.heading, order)),
      make("tbody", {}, ...sorted(current.rows, order).map((row) => line(row, was(row)))),
    );
    const region = { class: "job-scroll runs-scroll", tabindex: "0", role: "group", "aria-label": current.caption };
    const scroll = make("div", region, table);
    /** @type {(action: string, label: string) => HTMLButtonElement} */
    const tool = (action, label) => make("button", { type: "button", "data-do": action }, label);
    output.replaceChildren(
      make("p", { class: "job-caption" }, current.caption),
      ...(baseline ? [make("p", { class: "job-caption was" }, `Kept run, in smaller print: ${baseline.caption}`)] : []),
      scroll,
      make("div", { class: "job-panels" }, ...drawings(current)),
      ...(baseline
        ? [
            make("p", { class: "job-caption was" }, "Kept:"),
            make("div", { class: "job-panels" }, ...drawings(baseline)),
          ]
        : []),
      make(
        "div",
        { class: "job-tools" },
        baseline ? tool("drop", "Remove the kept run") : tool("keep", "Keep to compare"),
        tool("csv", "Copy as CSV"),
        tool("save", "Save as CSV"),
        tool("python", "Copy the Python"),
      ),
    );
    const selector = focus.sort ? `[data-sort="${focus.sort}"]` : focus.do ? `.job-tools [data-do="${focus.do}"]` : "";
    scroll.scrollLeft = scrollLeft;
    if (hadFocus) scroll.focus({ preventScroll: true });
    if (!selector) return;
    /** @type {HTMLElement | null} */
    const target = output.querySelector(selector);
    (target ?? find(output, ".job-tools button")).focus({ preventScroll: true });
  }

  /** @param {string} message */
  function end(message) {
    run = null;
    begin.disabled = false;
    if (document.activeElement === stop) begin.focus({ preventScroll: true });
    stop.disabled = true;
    box.dataset.state = "";
    tell(message);
  }

  async function work() {
    if (runtime.state === "file") return tell("A page opened from disk has no Python to run this.");
    /** @type {{ record: FigureRecord, rows: boolean }} */
    const mine = { record: figure.record, rows: false };
    let isLive = runtime.state === "live"; // or has answered since
    run = mine;
    begin.disabled = true;
    stop.disabled = false;
    stop.focus({ preventScroll: true });
    box.dataset.state = "running";
    bar.value = 0;
    tell(isLive ? "Running." : "Python is starting; the run begins when it is ready.");
    if (runtime.state === "failed") runtime.restart();
    else runtime.start();
    const began = performance.now();
    let due = began;
    try {
      await runParts(
        { figure: figure.id, record: mine.record, name },
        {
          going: () => run === mine,
          hear(fraction, message) {
            isLive = true;
            if (performance.now() < due) return;
            due = performance.now() + TELL_EVERY;
            bar.value = fraction;
            if (message) tell(message, false); // the second worker may be heard first
          },
          show(result) {
            mine.rows = true;
            current = result;
            show();
          },
        },
      );
      if (run === mine) end(`Done in ${((performance.now() - began) / 1000).toFixed(1)} s.`);
    } catch (error) {
      const stopped = error instanceof Error && "stopped" in error;
      const reason = isLive ? "Python stopped before the run was finished" : runtime.message; // why it did not start
      if (run === mine) end(`${(stopped && reason) || messageOf(error)}.`);
    }
  }

  function halt() {
    if (!run) return;
    const { record, rows } = run;
    end(rows ? "Stopped. The table shows the finished rows." : "Stopped. The table is from the previous run.");
    runtime.job({ figure: figure.id, record, name, does: "stop" }).catch(() => {});
  }

  /** @type {(description: string, value: string) => Promise<void>} */
  async function hand(description, value) {
    if (await copy(value)) tell(`${description} copied.`);
    else figure.offer(`${description}:`, value);
  }

  const csv = () =>
    baseline ? `${current.caption}\n${current.csv}\n${baseline.caption}\n${baseline.csv}` : current.csv;

  /** @type {Record<string, () => void>} */
  const actions = {
    begin: work,
    stop: halt,
    keep() {
      baseline = current;
      show();
    },
    drop() {
      baseline = null;
      show();
    },
    csv: () => hand("Table", csv()),
    save: () => save(fileName(figure.id, `-${name}.csv`), csv(), "text/csv"),
    python: () => hand("Python", current.python),
  };

  /**
   * Chromium does not scroll to a heading that is partly visible.
   * @param {FocusEvent} event
   */
  function reveal({ target }) {
    if (!(target instanceof HTMLElement) || !target.matches(".sort:focus-visible")) return;
    target.scrollIntoView({ block: "nearest", inline: "nearest" });
  }

  /** @param {MouseEvent} event */
  function press(event) {
    const node = around(event, "[data-do], [data-sort]");
    if (!(node instanceof HTMLButtonElement) || node.disabled) return;
    if (node.dataset.do) return actions[node.dataset.do]();
    const by = Number(node.dataset.sort);
    order = { by, falls: order.by === by && !order.falls };
    show();
  }

  find(box, ".job-head").hidden = false; // before `show` replaces the placeholder
  on(box, "click", press);
  for (const intent of ["pointerover", "focusin"]) on(begin, intent, secondWorker);
  on(box, "focusin", reveal);
  show();
}

/** @param {Figure} figure */
export function addJobs(figure) {
  const boxes = /** @type {HTMLElement[]} */ ([...figure.root.querySelectorAll("section.job")]);
  for (const box of boxes) job(figure, box);
}
