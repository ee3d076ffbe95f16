// Offline after the first visit. The build fills in the site's files and the hash of their contents.
// Pages come from the network while it answers; all else is kept under names or versions that change with content.
"use strict";

const VERSION = "__VERSION__";
const FILES = __FILES__;
const SITE = `ladder-site-${VERSION}`;
const RUNTIME = "ladder-runtime";
const PATIENCE = 3000; // ms for a page from the network when there is a kept one

const HASHED = /[./-][0-9a-f]{8,}[./]/;

/** A response that may answer a navigation: one that was reached through a redirect may not. */
const plain = (response) =>
  response.redirected ? new Response(response.body, { status: response.status, headers: response.headers }) : response;

/** Puts the files into a cache, from an older one where their names hold their hash. */
async function keep(name, urls) {
  const cache = await caches.open(name);
  await Promise.all(
    urls.map(async (url) => {
      const known = HASHED.test(url) ? await caches.match(url) : undefined;
      const response = known ?? (await fetch(url, HASHED.test(url) ? {} : { cache: "no-cache" }));
      if (!response.ok) throw new Error(`${url}: ${response.status}`);
      await cache.put(url, plain(response));
    }),
  );
  return cache;
}

async function keepRuntime(urls) {
  const cache = await keep(RUNTIME, urls);
  const wanted = new Set(urls);
  for (const request of await cache.keys()) if (!wanted.has(request.url)) await cache.delete(request);
}

async function sweep() {
  for (const name of await caches.keys()) {
    if (name.startsWith("ladder-") && name !== SITE && name !== RUNTIME) await caches.delete(name);
  }
}

/** The kept page for an address: folders and names without .html are what hosts make of pages. */
async function keptPage(url) {
  const { origin, pathname } = new URL(url);
  for (const path of [pathname, `${pathname}index.html`, `${pathname}.html`]) {
    const page = await caches.match(origin + path);
    if (page) return page;
  }
  return undefined;
}

async function page(request) {
  const kept = await keptPage(request.url);
  const late = new Promise((resolve) => kept && setTimeout(resolve, PATIENCE));
  const fresh = fetch(request).catch(() => undefined);
  return (await Promise.race([fresh, late])) ?? kept ?? (await fresh) ?? Response.error();
}

async function file(request) {
  return (await caches.match(request, { ignoreSearch: false })) ?? fetch(request);
}

self.addEventListener("install", (event) => {
  const urls = FILES.map((name) => new URL(name, self.registration.scope).href);
  event.waitUntil(keep(SITE, urls).then(() => self.skipWaiting()));
});

self.addEventListener("activate", (event) => event.waitUntil(sweep().then(() => self.clients.claim())));

self.addEventListener("fetch", (event) => {
  const { request } = event;
  if (request.method !== "GET" || !request.url.startsWith(self.registration.scope)) return;
  event.respondWith(request.mode === "navigate" ? page(request) : file(request));
});

self.addEventListener("message", (event) => {
  const [port] = event.ports;
  const urls = event.data.keep.filter((url) => url.startsWith(self.registration.scope));
  event.waitUntil(
    keepRuntime(urls).then(
      () => port.postMessage({ kept: true }),
      () => port.postMessage({ kept: false }),
    ),
  );
});
