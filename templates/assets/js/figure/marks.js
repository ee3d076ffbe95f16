// Updates a drawing in place: only the differences between a panel's old and new markup are written into its elements,
// so that unchanged ones are neither parsed nor styled again, and the page around them is not laid out again.

const TAGS = /<[^>]*>[^<]*/g; // a tag and the text after it; Python writes > as &gt; in attributes
const ATTRIBUTES = /([\w-]+)="([^"]*)"/g;

/**
 * The tags of a markup in order, each with the text after it.
 * @param {string} markup
 * @returns {string[]}
 */
export const tagsOf = (markup) => markup.match(TAGS) ?? [];

/** @param {string} tag */
const nameOf = (tag) => tag.slice(0, tag.search(/[\s/>]/));

/** @param {string} tag */
const attributesOf = (tag) => new Map([...tag.matchAll(ATTRIBUTES)].map(([, name, value]) => [name, value]));

/**
 * The edits that turn one markup into another: the element's index in the drawing, its changed attributes, and its text
 * if that has changed. Null if attributes and text are not enough: other elements, or character references.
 * @param {string[]} previous
 * @param {string[]} current
 * @returns {{ index: number, attributes: [string, string][], words: string | null }[] | null}
 */
export function changes(previous, current) {
  if (previous.length !== current.length) return null;
  const edits = [];
  let index = -1;
  for (const [i, tag] of current.entries()) {
    const old = previous[i];
    if (!tag.startsWith("</")) index++;
    if (tag === old) continue;
    const [attributes, oldAttributes] = [attributesOf(tag), attributesOf(old)];
    const same = nameOf(tag) === nameOf(old) && [...attributes.keys()].join() === [...oldAttributes.keys()].join();
    if (!same || `${tag}${old}`.includes("&")) return null;
    const changed = [...attributes].filter(([name, value]) => oldAttributes.get(name) !== value);
    const [words, were] = [tag, old].map((text) => text.slice(text.indexOf(">") + 1));
    edits.push({ index, attributes: changed, words: words === were ? null : words });
  }
  return edits;
}

/**
 * Updates a drawing in place; false if it must be replaced whole, because its elements have changed or something was
 * added to it since (a pen's ink).
 * @param {SVGSVGElement} drawing
 * @param {string[]} previous  its tags as they are
 * @param {string[]} current
 */
export function redraw(drawing, previous, current) {
  const elements = drawing.getElementsByTagName("*"); // without the drawing itself
  const edits = changes(previous, current);
  if (!edits || elements.length !== current.filter((tag) => !tag.startsWith("</")).length - 1) return false;
  for (const { index, attributes, words } of edits) {
    const element = index ? elements[index - 1] : drawing;
    for (const [name, value] of attributes) element.setAttribute(name, value);
    if (words !== null) element.textContent = words;
  }
  return true;
}
