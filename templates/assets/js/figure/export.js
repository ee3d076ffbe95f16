// Exports the picture as an SVG that needs no style sheet, or as a PNG of it. Always in light colours, on white.
/** @import { Rect } from "./coordinates.js" */

/** @typedef {Pick<Rect, "left" | "top">} Origin  of the picture, on the screen */
/** @typedef {{ svg: SVGElement, width: number, height: number }} Picture  a figure's drawings and captions as on the page */

import { around, fileName, make, messageOf, on, save, SVG, text } from "../base/dom.js";

const MARGIN = 12; // px around the whole
const SHARP = 2; // px of the PNG per px of the screen
const PAINTS = ["fill", "stroke"];
/**
 * Properties that are written as attributes, with the default that is left out.
 * @type {Record<string, string>}
 */
const LOOKS = {
  "fill-opacity": "1",
  "stroke-opacity": "1",
  opacity: "1",
  "stroke-linecap": "butt",
  "stroke-linejoin": "miter",
  "paint-order": "normal",
  "shape-rendering": "auto",
};
const WORDS = ["font-family", "font-size", "font-weight", "text-anchor", "dominant-baseline"];

/**
 * A colour in a form that every program reads: [#rrggbb, opacity].
 * @type {(css: string) => [hex: string, opacity: number]}
 */
const plainColour = (() => {
  /** @type {Map<string, [hex: string, opacity: number]>} */
  const colours = new Map();
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 1;
  const brush = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d", { willReadFrequently: true }));
  return (css) => {
    const cached = colours.get(css);
    if (cached) return cached;
    brush.clearRect(0, 0, 1, 1);
    brush.fillStyle = css;
    brush.fillRect(0, 0, 1, 1);
    const [r, g, b, a] = brush.getImageData(0, 0, 1, 1).data;
    const hex = [r, g, b].map((channel) => channel.toString(16).padStart(2, "0")).join("");
    /** @type {[string, number]} */
    const colour = [`#${hex}`, Math.round((100 * a) / 255) / 100];
    colours.set(css, colour);
    return colour;
  };
})();

/**
 * Writes the computed style of `from`, on the page, onto `to`. `unit`: user units per px, for strokes that do not
 * scale.
 * @type {(from: Element, to: Element, unit: number) => void}
 */
function write(from, to, unit) {
  const style = getComputedStyle(from);
  if (style.display === "none") return to.remove();
  to.removeAttribute("class");
  for (const name of PAINTS) {
    const css = style.getPropertyValue(name);
    if (css === "none" || css.startsWith("url")) to.setAttribute(name, css);
    else {
      const [hex, opacity] = plainColour(css);
      to.setAttribute(name, opacity ? hex : "none");
      const alpha = opacity * Number(style.getPropertyValue(`${name}-opacity`));
      if (opacity && alpha < 1) to.setAttribute(`${name}-opacity`, alpha.toFixed(2));
    }
  }
  for (const [name, plain] of Object.entries(LOOKS)) {
    const value = style.getPropertyValue(name);
    if (value && value !== plain && !to.hasAttribute(name)) to.setAttribute(name, value);
  }
  if (style.stroke !== "none") {
    const scale = style.vectorEffect === "non-scaling-stroke" ? unit : 1;
    /** @param {string} text */
    const scaled = (text) => text.replace(/[\d.]+(px)?/g, (number) => (scale * parseFloat(number)).toFixed(2));
    to.setAttribute("stroke-width", scaled(style.strokeWidth));
    if (style.strokeDasharray !== "none") to.setAttribute("stroke-dasharray", scaled(style.strokeDasharray));
  }
  if (from.localName === "text" || from.localName === "tspan") {
    for (const name of WORDS) to.setAttribute(name, style.getPropertyValue(name));
  }
  const children = [...from.children];
  [...to.children].forEach((child, i) => children[i] && write(children[i], child, unit));
}

/**
 * @template {keyof SVGElementTagNameMap} Name
 * @param {Name} name
 * @param {Record<string, string | number>} attributes
 * @param {(Node | string)[]} children
 * @returns {SVGElementTagNameMap[Name]}
 */
function element(name, attributes, ...children) {
  const node = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, String(value));
  node.append(...children);
  return node;
}

/**
 * One drawing at its place in the picture, on its background.
 * @type {(svg: SVGSVGElement, origin: Origin) => SVGElement[]}
 */
function drawingAt(svg, origin) {
  const rect = svg.getBoundingClientRect();
  const copy = /** @type {SVGSVGElement} */ (svg.cloneNode(true));
  write(svg, copy, svg.viewBox.baseVal.width / rect.width);
  for (const { name } of [...copy.attributes]) if (name !== "viewBox") copy.removeAttribute(name);
  const box = {
    x: (rect.left - origin.left).toFixed(2),
    y: (rect.top - origin.top).toFixed(2),
    width: rect.width.toFixed(2),
    height: rect.height.toFixed(2),
  };
  for (const [name, value] of Object.entries(box)) copy.setAttribute(name, value);
  const [ground, opaque] = plainColour(getComputedStyle(svg).backgroundColor);
  return opaque ? [element("rect", { ...box, fill: ground }), copy] : [copy];
}

/**
 * The lines that a text is broken into, each with the box of its first word.
 * @param {Text} node
 */
function broken(node) {
  const range = document.createRange();
  /** @type {{ words: string[], rect: DOMRect }[]} */
  const lines = [];
  for (const { index, 0: word } of node.data.matchAll(/\S+/g)) {
    range.setStart(node, index);
    range.setEnd(node, index + word.length);
    const rect = range.getBoundingClientRect();
    const line = lines.at(-1);
    if (line && Math.abs(line.rect.top - rect.top) < rect.height / 2) line.words.push(word);
    else lines.push({ words: [word], rect });
  }
  return lines;
}

/**
 * The texts in a node; a browser's translation wraps each in elements of its own.
 * @type {(node: Node) => Text[]}
 */
const texts = (node) => (node instanceof Text ? [node] : [...node.childNodes].flatMap(texts));

/**
 * A panel's caption as SVG text. `scale`: of its slide.
 * @type {(span: Element, origin: Origin, scale: number) => SVGElement[]}
 */
function captionText(span, origin, scale) {
  const { fontSize, fontFamily, fontWeight, color } = getComputedStyle(span);
  const type = { "font-size": scale * parseFloat(fontSize), "font-family": fontFamily, "font-weight": fontWeight };
  return texts(span).flatMap(broken).map(({ words, rect }) => {
    const [x, y] = [rect.left - origin.left, rect.bottom - origin.top - 0.26 * rect.height];
    return element("text", { x: x.toFixed(2), y: y.toFixed(2), ...type, fill: plainColour(color)[0] }, words.join(" "));
  });
}

const PARTS = [
  ":scope > .figure-body > .figure-stage",
  ":scope > .figure-body > .figure-desk > .figure-charts",
  ":scope > .figure-body > .figure-rest[open] > .figure-rest-panels",
  ":scope > [role=img]",
].join();

/**
 * Runs `use` on a copy of the figure that is off screen and in light colours.
 * @template T
 * @param {HTMLElement} root
 * @param {(twin: HTMLElement) => T} use
 * @returns {T}
 */
function inLight(root, use) {
  const twin = /** @type {HTMLElement} */ (root.cloneNode(false));
  const parts = root.querySelectorAll(PARTS);
  twin.append(...[...parts].map((part) => part.cloneNode(true)));
  twin.removeAttribute("id");
  twin.inert = true;
  const unseen = { position: "absolute", left: "-300vw", top: "0", display: "block", colorScheme: "light" };
  Object.assign(twin.style, { ...unseen, width: `${(parts[0].clientWidth ? parts[0] : root).clientWidth}px` });
  root.after(twin);
  try {
    return use(twin);
  } finally {
    twin.remove();
  }
}

/** @param {Element} node */
const drawn = (node) => node.getBoundingClientRect().width > 0;

/** @type {(root: HTMLElement) => Picture} */
function picture(root) {
  return inLight(root, (twin) => {
    const drawings = [...twin.querySelectorAll("svg")].filter(drawn);
    const captions = [...twin.querySelectorAll(".panel-caption span")].filter(drawn);
    const rects = [...drawings, ...captions].map((node) => node.getBoundingClientRect());
    const scale = twin.getBoundingClientRect().width / twin.offsetWidth;
    /** @type {(side: "left" | "top" | "right" | "bottom", pick: (...values: number[]) => number) => number} */
    const edge = (side, pick) => pick(...rects.map((rect) => rect[side]));
    const origin = { left: edge("left", Math.min) - MARGIN, top: edge("top", Math.min) - MARGIN };
    const width = Math.ceil(edge("right", Math.max) - origin.left + MARGIN);
    const height = Math.ceil(edge("bottom", Math.max) - origin.top + MARGIN);
    const svg = element(
      "svg",
      { viewBox: `0 0 ${width} ${height}`, width, height },
      element("title", {}, `${root.querySelector(".figure-number")?.textContent ?? ""} · ${document.title}`),
      element("desc", {}, root.querySelector(".figure-words")?.textContent ?? ""),
      element("rect", { width, height, fill: "#ffffff" }),
      ...drawings.flatMap((drawing) => drawingAt(drawing, origin)),
      ...captions.flatMap((caption) => captionText(caption, origin, scale)),
    );
    return { svg, width, height };
  });
}

/**
 * The @font-face rules of a family with their fonts inlined; "" if the page may not read them.
 * @param {string} family
 */
async function faces(family) {
  /** @type {(rule: CSSRule) => rule is CSSFontFaceRule} */
  const face = (rule) =>
    rule instanceof CSSFontFaceRule && rule.style.getPropertyValue("font-family").replaceAll('"', "") === family;
  try {
    const sheets = [...document.styleSheets].filter(({ href }) => href);
    const rules = sheets.flatMap(({ href, cssRules }) => [...cssRules].filter(face).map((rule) => ({ href, rule })));
    const fontFaces = rules.map(async ({ href, rule: { style } }) => {
      const [, url] = style.getPropertyValue("src").match(/url\("?([^")]+)"?\)/) ?? ["", ""];
      const bytes = new Uint8Array(await (await fetch(new URL(url, href ?? undefined))).arrayBuffer());
      const data = btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
      return `@font-face{font-family:"${family}";font-weight:${style.getPropertyValue("font-weight") || 400};src:url(data:font/woff2;base64,${data})}`;
    });
    return (await Promise.all(fontFaces)).join("");
  } catch {
    return "";
  }
}

/**
 * The picture as the text of a self-contained SVG.
 * @param {Picture} picture
 */
async function alone({ svg }) {
  svg.prepend(element("style", {}, await faces("Ladder Sans")));
  return `${new XMLSerializer().serializeToString(svg)}\n`;
}

/**
 * The PNG of an SVG text.
 * @type {(svg: string, picture: Picture) => Promise<Blob>}
 */
async function bitmap(svg, { width, height }) {
  const image = new Image();
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svg)}`;
  await image.decode();
  const canvas = make("canvas", { width: SHARP * width, height: SHARP * height });
  canvas.getContext("2d")?.drawImage(image, 0, 0, canvas.width, canvas.height);
  return new Promise((resolve, reject) => {
    canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("too large for an image"))), "image/png");
  });
}

/**
 * Adds the buttons that save a figure's picture to the details under its caption.
 * @param {HTMLElement} root
 * @param {() => void} [endMotion]  in the picture
 */
export function addPictureButtons(root, endMotion) {
  const details = root.querySelector(".figure-more");
  if (!details) return;
  /** @param {string} format */
  const button = (format) =>
    make("button", { type: "button", "data-picture": format }, `Save as ${format.toUpperCase()}`);
  const status = make("span", { role: "status" });
  const box = make("div", { class: "figure-take" }, make("span", {}, "The picture:"), button("svg"), button("png"), status);
  details.append(box);
  on(box, "click", async (event) => {
    const format = around(event, "[data-picture]")?.dataset.picture;
    if (!format) return;
    text(status, "");
    endMotion?.();
    const current = picture(root);
    const svg = await alone(current);
    if (format === "svg") return save(fileName(root.id, ".svg"), svg, "image/svg+xml");
    try {
      save(fileName(root.id, ".png"), await bitmap(svg, current), "image/png");
    } catch (error) {
      text(status, `No PNG can be made: ${messageOf(error)}. Save it as SVG.`);
    }
  });
}
