// The picture as a file of its own: an SVG that needs no style sheet, and a PNG of it. Always in light colours, on white.
import { fileName, make, on, save } from "../base/dom.js";

const SVG = "http://www.w3.org/2000/svg";
const MARGIN = 12; // px around the whole
const SHARP = 2; // px of the PNG to one of the screen
const PAINTS = ["fill", "stroke"];
/** What is written out, with the value that need not be. */
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

/** A colour as every program reads it: [#rrggbb, its opacity]. */
const plainColour = (() => {
  const known = new Map();
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 1;
  const brush = canvas.getContext("2d", { willReadFrequently: true });
  return (css) => {
    if (!known.has(css)) {
      brush.clearRect(0, 0, 1, 1);
      brush.fillStyle = css;
      brush.fillRect(0, 0, 1, 1);
      const [r, g, b, a] = brush.getImageData(0, 0, 1, 1).data;
      const hex = [r, g, b].map((each) => each.toString(16).padStart(2, "0")).join("");
      known.set(css, [`#${hex}`, Math.round((100 * a) / 255) / 100]);
    }
    return known.get(css);
  };
})();

/** Writes on `to` how `from`, on the page, is seen. `unit`: user units to a px, which strokes that do not scale need. */
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
      const seen = opacity * Number(style.getPropertyValue(`${name}-opacity`));
      if (opacity && seen < 1) to.setAttribute(`${name}-opacity`, seen.toFixed(2));
    }
  }
  for (const [name, plain] of Object.entries(LOOKS)) {
    const value = style.getPropertyValue(name);
    if (value && value !== plain && !to.hasAttribute(name)) to.setAttribute(name, value);
  }
  if (style.stroke !== "none") {
    const scale = style.vectorEffect === "non-scaling-stroke" ? unit : 1;
    const scaled = (text) => text.replace(/[\d.]+(px)?/g, (each) => (scale * parseFloat(each)).toFixed(2));
    to.setAttribute("stroke-width", scaled(style.strokeWidth));
    if (style.strokeDasharray !== "none") to.setAttribute("stroke-dasharray", scaled(style.strokeDasharray));
  }
  if (from.localName === "text" || from.localName === "tspan") {
    for (const name of WORDS) to.setAttribute(name, style.getPropertyValue(name));
  }
  return [...to.children].forEach((child, i) => kids(from)[i] && write(kids(from)[i], child, unit));
}

const kids = (node) => [...node.children];

function element(name, attributes, ...children) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

/** One drawing at its place in the picture, on its ground. */
function drawn(svg, origin) {
  const rect = svg.getBoundingClientRect();
  const copy = svg.cloneNode(true);
  write(svg, copy, svg.viewBox.baseVal.width / rect.width);
  for (const { name } of [...copy.attributes]) if (name !== "viewBox") copy.removeAttribute(name);
  const place = { x: rect.left - origin.left, y: rect.top - origin.top, width: rect.width, height: rect.height };
  for (const [name, value] of Object.entries(place)) copy.setAttribute(name, (place[name] = value.toFixed(2)));
  const [ground, opaque] = plainColour(getComputedStyle(svg).backgroundColor);
  return opaque ? [element("rect", { ...place, fill: ground }), copy] : [copy];
}

/** A text as the lines that it is broken into: [[words, rect of the first], …]. */
function broken(node) {
  const range = document.createRange();
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

/** A panel's caption as text of the drawing. */
function written(span, origin) {
  const { fontSize, fontFamily, fontWeight, color } = getComputedStyle(span);
  const type = { "font-size": parseFloat(fontSize), "font-family": fontFamily, "font-weight": fontWeight };
  const nodes = [...span.childNodes].filter((node) => node.nodeType === Node.TEXT_NODE);
  return nodes.flatMap(broken).map(({ words, rect }) => {
    const [x, y] = [rect.left - origin.left, rect.bottom - origin.top - 0.26 * rect.height];
    return element("text", { x: x.toFixed(2), y: y.toFixed(2), ...type, fill: plainColour(color)[0] }, words.join(" "));
  });
}

/** The figure once more, unseen and in light colours, for as long as `use` looks at it. */
function inLight(root, use) {
  const twin = root.cloneNode(false);
  const parts = root.querySelectorAll(":scope > .figure-stage, :scope > [role=img]");
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

/** {svg: an element, width, height}: a figure's drawings and their captions as they stand on the page. */
function picture(root) {
  return inLight(root, (twin) => {
    const drawings = [...twin.querySelectorAll("svg")].filter((svg) => svg.getBoundingClientRect().width > 0);
    const captions = [...twin.querySelectorAll(".panel-caption span")];
    const rects = [...drawings, ...captions].map((each) => each.getBoundingClientRect()).filter(({ width }) => width);
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
      ...drawings.flatMap((each) => drawn(each, origin)),
      ...captions.flatMap((each) => written(each, origin)),
    );
    return { svg, width, height };
  });
}

/** The style sheet's faces of a family as a style sheet of their own; where a page may not read them, none. */
async function faces(family) {
  const face = (rule) => rule instanceof CSSFontFaceRule && rule.style.fontFamily.replaceAll('"', "") === family;
  try {
    const sheets = [...document.styleSheets].filter(({ href }) => href);
    const rules = sheets.flatMap(({ href, cssRules }) => [...cssRules].filter(face).map((rule) => ({ href, rule })));
    const made = rules.map(async ({ href, rule: { style } }) => {
      const [, url] = style.getPropertyValue("src").match(/url\("?([^")]+)"?\)/);
      const bytes = new Uint8Array(await (await fetch(new URL(url, href))).arrayBuffer());
      const data = btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
      return `@font-face{font-family:"${family}";font-weight:${style.fontWeight || 400};src:url(data:font/woff2;base64,${data})}`;
    });
    return (await Promise.all(made)).join("");
  } catch {
    return "";
  }
}

/** The picture as text that stands alone. */
async function alone({ svg }) {
  svg.prepend(element("style", {}, await faces("Ladder Sans")));
  return `${new XMLSerializer().serializeToString(svg)}\n`;
}

/** The PNG of an SVG text. */
async function bitmap(svg, { width, height }) {
  const image = new Image();
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svg)}`;
  await image.decode();
  const canvas = make("canvas", { width: SHARP * width, height: SHARP * height });
  canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
  return new Promise((resolve) => canvas.toBlob(resolve, "image/png"));
}

/** The buttons that hand a figure's picture out, in what is folded under its caption. */
export function addPictureButtons(root) {
  const more = root.querySelector(".figure-more");
  if (!more) return () => {};
  const button = (what) => make("button", { type: "button", "data-picture": what }, `Save as ${what.toUpperCase()}`);
  const box = make("div", { class: "figure-take" }, make("span", {}, "The picture:"), button("svg"), button("png"));
  more.append(box);
  const stop = on(box, "click", async (event) => {
    const what = event.target.dataset.picture;
    if (!what) return;
    const now = picture(root);
    const svg = await alone(now);
    if (what === "svg") save(fileName(root.id, ".svg"), svg, "image/svg+xml");
    else save(fileName(root.id, ".png"), await bitmap(svg, now), "image/png");
  });
  return () => {
    stop();
    box.remove();
  };
}
