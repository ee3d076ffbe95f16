// A page that is open while a new version of the site is published asks for files that are gone. Where a file could not
// be loaded, this tells whether that is why: then only a reload helps.

/**
 * Whether a page would load other files later, judged by file names with content hashes. Attributes added by browser
 * extensions are ignored.
 * @param {Document} page
 */
const differs = ({ body }) =>
  Object.entries(body.dataset).some(([name, value]) => value !== document.body.dataset[name]);

/** Whether the server has another version of this page. Rejects if it does not say, as without a network. */
export async function hasNewVersion() {
  const answer = await fetch(location.pathname + location.search, { cache: "no-cache" });
  if (!answer.ok) throw new Error(`the server answered ${answer.status}`);
  return differs(new DOMParser().parseFromString(await answer.text(), "text/html"));
}
