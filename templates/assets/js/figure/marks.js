// A drawing set in place: of two markups of one panel only what differs is written into its elements, so that what stays
// is neither parsed nor styled anew, and the page around it is not laid out again.

const TAGS = /<[^>]*>[^<]*/g; // a tag with the words after it; in an attribute Python writes > as &gt;
const ATTRIBUTES = /([\w-]+)="([^"]*)"/g;

/**
 * The tags of a markup, in order.
 * @param {string} markup
 * @returns {string[]}
 */
export const tagsOf = (markup) => markup.match(TAGS) ?? [];

/** @param {string} tag */
const nameOf = (tag) => tag.slice(0, tag.search(/[\s/>]/));

/** @param {string} tag */
const attributesOf = (tag) => new Map([...tag.matchAll(ATTRIBUTES)].map(([, name, value]) => [name, value]));

/**
 * What has to be written to make one markup of another: the element's number in the drawing, its new attributes, its
 * words where they are others. Null where that takes more than attributes and words: other elements, or references.
 * @param {string[]} before
 * @param {string[]} now
 * @returns {{ index: number, attributes: [string, string][], words: string | null }[] | null}
 */
export function changes(before, now) {
  if (before.length !== now.length) return null;
  const found = [];
  let index = -1;
  for (const [i, tag] of now.entries()) {
    const old = before[i];
    if (!tag.startsWith("</")) index++;
    if (tag === old) continue;
    const [attributes, known] = [attributesOf(tag), attributesOf(old)];
    const same = nameOf(tag) === nameOf(old) && [...attributes.keys()].join() === [...known.keys()].join();
    if (!same || `${tag}${old}`.includes("&")) return null;
    const written = [...attributes].filter(([name, value]) => known.get(name) !== value);
    const [words, were] = [tag, old].map((each) => each.slice(each.indexOf(">") + 1));
    found.push({ index, attributes: written, words: words === were ? null : words });
  }
  return found;
}

/**
 * Sets a drawing in place; false where it has to be swapped whole: it is no longer what was drawn before (a pen's ink is
 * in it), or other elements are.
 * @param {SVGSVGElement} drawing
 * @param {string[]} before  its tags as they are
 * @param {string[]} now
 */
export function redraw(drawing, before, now) {
  const elements = drawing.getElementsByTagName("*"); // without the drawing itself
  const found = changes(before, now);
  if (!found || elements.length !== now.filter((tag) => !tag.startsWith("</")).length - 1) return false;
  for (const { index, attributes, words } of found) {
    const element = index ? elements[index - 1] : drawing;
    for (const [name, value] of attributes) element.setAttribute(name, value);
    if (words !== null) element.textContent = words;
  }
  return true;
}
