/* Messages to the author in the page: the problems of a build, and that another page has changed. */

const FACE = "font: 15px/1.5 ui-monospace, Menlo, Consolas, monospace; color: #f6f2ec; background: #1d1b1a;";
const BUTTON =
  "min-height: 44px; padding: 4px 16px; font: inherit; color: inherit; background: transparent;" +
  "border: 1px solid #8a827a; border-radius: 6px; cursor: pointer;";

/**
 * Appends a styled element. Styles are set by script, since the page's policy blocks style attributes.
 * @template {keyof HTMLElementTagNameMap} T
 * @param {Node} parent
 * @param {T} tag
 * @param {string} style
 */
const element = (parent, tag, style, text = "") => {
  const node = parent.appendChild(document.createElement(tag));
  node.style.cssText = style;
  node.textContent = text;
  return node;
};

/**
 * Adds a fixed box to the page. Its shadow root keeps the site's styles out.
 * @param {string} id
 * @param {string} role
 * @param {string} style
 */
function box(id, role, style) {
  document.getElementById(id)?.remove();
  const host = element(document.body, "div", `position: fixed; z-index: 2147483647; box-sizing: border-box; ${FACE} ${style}`);
  host.id = id;
  host.setAttribute("role", role);
  return { host, inside: host.attachShadow({ mode: "open" }) };
}

/**
 * @param {HTMLElement} host
 * @param {HTMLElement} parent
 * @param {string} style
 */
function hideButton(host, parent, style) {
  const button = element(parent, "button", BUTTON + style, "Hide");
  button.type = "button";
  button.addEventListener("click", () => host.remove());
}

/**
 * Shows the list of problems: file, line and column, and below them the message.
 * @param {string} title
 * @param {string[]} lines
 */
export function problems(title, lines) {
  const { host, inside: content } = box(
    "build-problems",
    "alert",
    "inset: auto 0 0 0; max-height: 60vh; overflow: auto; padding: 16px 24px 20px; border-top: 4px solid #e5674c;",
  );
  const head = element(content, "div", "display: flex; gap: 16px; justify-content: space-between; align-items: center; margin-bottom: 8px");
  element(head, "strong", "color: #ffb4a2", title);
  hideButton(host, head, "");
  const list = element(content, "div", "display: grid; gap: 8px");
  for (const line of lines) {
    const match = /^(\S+?:\d+:\d+: )(.*)$/s.exec(line);
    const row = element(list, "div", "white-space: pre-wrap; overflow-wrap: anywhere", match ? "" : line);
    if (!match) continue;
    element(row, "span", "color: #c9bfb4", match[1]);
    element(row, "span", "display: block; padding-left: 2ch", match[2]);
  }
}

/**
 * Shows a small note with a link to the page of the chapter that was edited.
 * @param {string} page
 * @param {string} file
 */
export function elsewhere(page, file) {
  const { host, inside: content } = box(
    "build-elsewhere",
    "status",
    "inset: auto 16px 16px auto; max-width: calc(100vw - 32px); padding: 8px 8px 8px 16px; border-radius: 8px; border: 1px solid #8a827a;",
  );
  const row = element(content, "div", "display: flex; flex-wrap: wrap; gap: 4px 16px; align-items: center");
  element(row, "span", "", `${file} was edited.`);
  const link = element(row, "a", "color: #cfc4ff; padding: 10px 0", `Go to ${page}`);
  link.href = page;
  hideButton(host, row, "border-color: transparent;");
}

/** Removes all messages. */
export function hide() {
  for (const id of ["build-problems", "build-elsewhere"]) document.getElementById(id)?.remove();
}
