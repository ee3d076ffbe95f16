// The service worker's list of files: stored completely or not at all, and no known file is fetched twice.

import assert from "node:assert/strict";
import { createHash, webcrypto } from "node:crypto";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import vm from "node:vm";

const SOURCE = new URL("../../templates/assets/sw.js", import.meta.url);
const SCOPE = "https://example.org/ladder/";
const integrity = (text) => `sha256-${createHash("sha256").update(text).digest("base64")}`;

/** The worker with these files filled in, on a server that answers with `served`, and with these caches. */
function worker(files, served, stores = new Map()) {
  const list = JSON.stringify(Object.entries(files).map(([name, text]) => [name, text.length, integrity(text)]));
  const filled = { VERSION: "v", FILES: list, RUNTIME: "[]", RUNTIME_VERSION: "r", IMMUTABLE: '["assets/"]' };
  const code = readFileSync(SOURCE, "utf8").replace(/__([A-Z_]+)__/g, (_, name) => filled[name]);
  const asked = [];
  const heard = {};
  const urlOf = (request) => String(request.url ?? request);
  const cacheOf = (store) => ({
    match: async (url) => store.get(urlOf(url))?.clone(),
    put: async (url, response) => void store.set(urlOf(url), response),
    delete: async (url) => store.delete(urlOf(url)),
    keys: async () => [...store.keys()],
  });
  const open = (name) => stores.get(name) ?? stores.set(name, new Map()).get(name);
  const caches = {
    open: async (name) => cacheOf(open(name)),
    has: async (name) => stores.has(name),
    delete: async (name) => stores.delete(name),
    keys: async () => [...stores.keys()],
    match: async (url, { cacheName } = {}) => {
      const among = cacheName ? [stores.get(cacheName)] : [...stores.values()];
      return among.find((store) => store?.has(urlOf(url)))?.get(urlOf(url)).clone();
    },
  };
  async function fetch(url, { integrity: wanted } = {}) {
    const name = urlOf(url).slice(SCOPE.length);
    asked.push(name);
    if (!(name in served)) return new Response("", { status: 404 });
    if (wanted && wanted !== integrity(served[name])) throw new TypeError("integrity");
    return new Response(served[name]);
  }
  const self = { registration: { scope: SCOPE }, addEventListener: (type, handler) => (heard[type] = handler) };
  const given = { self, caches, fetch, crypto: webcrypto, Response, URL, btoa, Uint8Array, Promise, setTimeout };
  vm.runInNewContext(code, given);
  const install = () => new Promise((resolve, reject) => heard.install({ waitUntil: (done) => done.then(resolve, reject) }));
  /** The worker's answer to a page's request. */
  const answer = (name, cache = "default") =>
    new Promise((respondWith) => heard.fetch({ request: { method: "GET", url: SCOPE + name, cache }, respondWith }));
  return { install, answer, caches, asked, stores };
}

const FILES = { "index.html": "<p>one</p>", "assets/site.0123456789.css": "p {}" };

test("all files of a version are kept", async () => {
  const { install, stores, asked } = worker(FILES, FILES);
  await install();
  const [[name, store]] = stores;
  assert.equal(name, "ladder-offline:/ladder/:site:v");
  assert.deepEqual([...store.keys()].sort(), Object.keys(FILES).map((file) => SCOPE + file).sort());
  assert.deepEqual(asked.sort(), Object.keys(FILES).sort());
});

test("one file that is not as it was built leaves nothing", async () => {
  const { install, stores } = worker(FILES, { ...FILES, "index.html": "another" });
  await assert.rejects(install());
  assert.equal(stores.size, 0);
});

test("one file that is missing leaves nothing", async () => {
  const { install, stores } = worker(FILES, { "index.html": FILES["index.html"] });
  await assert.rejects(install());
  assert.equal(stores.size, 0);
});

test("a file named by its content comes from the version before", async () => {
  const before = worker({ ...FILES, "index.html": "old" }, { ...FILES, "index.html": "old" });
  await before.install();
  const [[, store]] = before.stores;
  const stores = new Map([["ladder-offline:/ladder/:site:older", store]]);
  const { install, asked } = worker(FILES, FILES, stores);
  await install();
  assert.deepEqual(asked, ["index.html"]);
});

test("what is damaged in the version before is fetched anew", async () => {
  const css = "assets/site.0123456789.css";
  const damaged = new Map([[SCOPE + css, new Response("damaged")]]);
  const { install, asked, stores } = worker(FILES, FILES, new Map([["ladder-offline:/ladder/:site:older", damaged]]));
  await install();
  assert.deepEqual(asked.sort(), Object.keys(FILES).sort());
  assert.equal(await stores.get("ladder-offline:/ladder/:site:v").get(SCOPE + css).text(), FILES[css]);
});

test("where storage fails the network answers, also a request past all caches", async () => {
  const { answer, caches } = worker(FILES, FILES);
  for (const method of Object.keys(caches)) caches[method] = () => Promise.reject(new Error("storage fails"));
  for (const [name, text] of Object.entries(FILES)) {
    for (const cache of ["default", "reload"]) assert.equal(await (await answer(name, cache)).text(), text, cache);
  }
});
