// Makes the site work offline after the first visit. The build fills in every file with its size and content hash.
//
// A version is stored whole or not at all: each download is checked against its hash, and the first file that differs,
// is missing or does not fit ends the attempt and removes the new cache. A new version waits until no page of the old
// one is open. Files in the folders below are named by their content, so that a page finds those of its own build or
// none; everything else comes from the network if that answers, otherwise from one version alone.
//
// Stored files may be damaged or evicted later, so they are checked again when a page asks for them; Python's files are
// checked by the page's worker, which fetches a wrong one again, past all caches. Wrong files are dropped, and the next
// visit with a network restores whatever is missing.
"use strict";

const VERSION = "__VERSION__";
/** [name, bytes, integrity] of the pages and the files that they load, and of Python's files. */
const FILES = __FILES__;
const RUNTIME_FILES = __RUNTIME__;

const worker = /** @type {ServiceWorkerGlobalScope} */ (/** @type {unknown} */ (self));
const { scope } = worker.registration;
const OURS = `ladder-offline:${new URL(scope).pathname}:`;
const SITE = `${OURS}site:${VERSION}`;
const RUNTIME = `${OURS}runtime:__RUNTIME_VERSION__`;
const PATIENCE = 3000; // ms to wait for the network when a stored copy exists

/** Folders whose files are named by their content. */
const IMMUTABLE = __IMMUTABLE__;
const ANY = { ignoreVary: true };

/** @param {Listed[]} files */
const bytes = (files) => files.reduce((sum, [, size]) => sum + size, 0);

/** @param {string} file */
const immutable = (file) => IMMUTABLE.some((folder) => file.startsWith(folder));
/** @param {string} file */
const addressOf = (file) => new URL(file, scope).href;
const INTEGRITY = new Map(FILES.map(([file, , integrity]) => [addressOf(file), integrity]));

/** @param {Response} response */
async function integrityOf(response) {
  const hash = await crypto.subtle.digest("SHA-256", await response.arrayBuffer());
  return `sha256-${btoa(String.fromCharCode(...new Uint8Array(hash)))}`;
}

/** @param {string} url */
async function drop(url) {
  for (const name of await caches.keys()) {
    if (name.startsWith(OURS)) await (await caches.open(name)).delete(url, ANY);
  }
}

/**
 * The stored response for an address, checked against its hash if that is known; undefined if storage fails, so that
 * the network answers. A second copy is hashed: browsers keep compiled scripts with a response that was not read.
 * @param {string} url
 * @param {{ cacheName?: string, integrity?: string }} [known]
 */
async function storedResponse(url, { cacheName, integrity } = {}) {
  const find = () => caches.match(url, { ...ANY, cacheName });
  try {
    const response = await find();
    if (!response || !integrity) return response;
    const copy = await find();
    if (copy && integrity === (await integrityOf(copy))) return response;
    await drop(url);
  } catch {
    // as if it were not there
  }
  return undefined;
}

/**
 * A response that may answer a navigation: browsers reject one that was reached through a redirect.
 * @param {Response} response
 */
const plain = (response) =>
  response.redirected ? new Response(response.body, { status: response.status, headers: response.headers }) : response;

/**
 * Fetches the exact bytes that were built; bypasses the browser's cache if that holds others.
 * @param {string} url
 * @param {string} integrity
 * @param {RequestCache} cache
 */
async function load(url, integrity, cache) {
  const response = await fetch(url, { integrity, cache, priority: "low" }).catch((error) => {
    if (cache !== "default") throw error;
    return fetch(url, { integrity, cache: "reload", priority: "low" });
  });
  if (!response.ok) throw new Error(`${url}: ${response.status}`);
  return plain(response);
}

/** @param {string} name @param {Listed[]} files */
async function whole(name, files) {
  return (await caches.has(name)) && (await (await caches.open(name)).keys()).length === files.length;
}

/**
 * Completes a cache, reusing stored files whose names identify their content; on failure removes a new cache.
 * @param {string} name
 * @param {Listed[]} files
 */
async function keep(name, files) {
  if (await whole(name, files)) return;
  const exists = await caches.has(name);
  const cache = await caches.open(name);
  try {
    await Promise.all(
      files.map(async ([file, , integrity]) => {
        const url = addressOf(file);
        if (await cache.match(url, ANY)) return;
        const fixed = immutable(file);
        const stored = fixed ? await storedResponse(url, { integrity }) : undefined;
        await cache.put(url, stored ?? (await load(url, integrity, fixed ? "default" : "no-cache")));
      }),
    );
    if (!(await caches.has(name))) throw new Error(`${name} was taken away meanwhile`);
  } catch (error) {
    if (!exists) await caches.delete(name);
    throw error;
  }
}

/** Stores this version before it may take over; includes Python if the last version had it. */
async function install() {
  await keep(SITE, FILES);
  const promised = (await caches.keys()).some((name) => name.startsWith(`${OURS}runtime:`));
  if (!promised) return;
  await keep(RUNTIME, RUNTIME_FILES).catch(async (error) => {
    await caches.delete(SITE);
    throw error;
  });
}

/** Deletes the caches of older versions: none of their pages is open any more. */
async function activate() {
  for (const name of await caches.keys()) {
    if (name.startsWith(OURS) && name !== SITE && name !== RUNTIME) await caches.delete(name);
  }
  await worker.clients.claim();
}

/**
 * This version's page for an address; hosts also serve pages at a folder's address or without .html.
 * @param {string} url
 */
async function ownPage(url) {
  const { origin, pathname } = new URL(url);
  for (const path of [pathname, `${pathname}index.html`, `${pathname}.html`]) {
    const page = await storedResponse(origin + path, { cacheName: SITE, integrity: INTEGRITY.get(origin + path) });
    if (page) return page;
  }
  return undefined;
}

/**
 * The network's answer, or the stored page if that is late, absent or a server error.
 * @param {Request} request
 */
async function newest(request) {
  const stored = await ownPage(request.url);
  if (!stored) return fetch(request);
  const fresh = fetch(request).then(
    (response) => (response.status >= 500 ? stored : response),
    () => stored,
  );
  return Promise.race([fresh, new Promise((resolve) => void setTimeout(resolve, PATIENCE, stored))]);
}

/**
 * A file named by its content. A request with cache `reload` says that the last answer was wrong: its copy is dropped.
 * @param {Request} request
 */
async function fixed(request) {
  if (request.cache === "reload") await drop(request.url).catch(() => {}); // storage fails: the network answers
  return (await storedResponse(request.url, { integrity: INTEGRITY.get(request.url) })) ?? fetch(request);
}

worker.addEventListener("install", (event) => event.waitUntil(install()));

worker.addEventListener("activate", (event) => event.waitUntil(activate()));

worker.addEventListener("fetch", (event) => {
  const { request } = event;
  if (request.method !== "GET" || !request.url.startsWith(scope)) return;
  event.respondWith(immutable(request.url.slice(scope.length)) ? fixed(request) : newest(request));
});

let keeping = null; // one attempt serves all pages that ask

/** A page asks for everything to be stored: the first request fetches Python, and any request restores lost files. */
worker.addEventListener("message", (event) => {
  const [port] = event.ports;
  keeping ??= keep(SITE, FILES)
    .then(() => keep(RUNTIME, RUNTIME_FILES))
    .finally(() => {
      keeping = null;
    });
  event.waitUntil(
    keeping.then(
      () => port.postMessage({ kept: true, bytes: bytes(FILES) + bytes(RUNTIME_FILES) }),
      () => port.postMessage({ kept: false }),
    ),
  );
});
