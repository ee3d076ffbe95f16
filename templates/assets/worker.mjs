// The page's worker: Python with numpy, the solvers and the widgets. Strings and numbers in, strings and numbers out. While
// a job runs, a second one like it takes some of the job's parts.
//
// page → worker                                            worker → page
//   { type: "start", runtime, files, again?, known?,         { type: "progress", loaded, total }    bytes
//     modules? }
//       runtime: absolute address of the runtime's folder    { type: "stage", stage }               download, python, numpy, widgets
//       files: [{ name, size, sha256 }]                      { type: "ready", milliseconds }
//         one of them, later.json, lists files that are loaded when Python first imports a module in them
//       again: an earlier start failed: the engine too is    { type: "failed", message, detail }
//         checked against its hash before it is used
//       known: this very engine has started here before
//   { type: "frame", id, request }                           { type: "frame", id, frame, python_ms }
//   { type: "job", id, request }                             { type: "job", id, slice, python_ms }
//   { type: "give", id, request, data }                      { type: "give", id, told, python_ms }      data: Uint8Array
//   { type: "forget", key }
//                                                            { type: "error", id, message, trace, lacks }   lacks: a file
//   { type: "heap" }                                         { type: "heap", bytes }

const network = self.fetch.bind(self); // start() replaces self.fetch for Pyodide only
const PROGRESS_EVERY = 100; // ms
const WASM = "application/wasm";

/** @type {Pyodide | null} */
let python = null; // set once it is up
/** @type {Answers | null} */
let answers = null; // the methods of the one widgets.engine.host.Host, the only Python objects that are kept
/** @type {Rooms | null} */
let rooms = null; // loads the files that Python needs later
let failed = false;
let turn = Promise.resolve(); // answers one question at a time, even while one waits for a file

/** @param {object} message */
const post = (message) => self.postMessage(message);

/** @param {string} message @param {any} error */
function fail(message, error) {
  if (failed) return; // the first failure names the cause; its consequences do not help
  failed = true;
  post({ type: "failed", message, detail: String(error?.stack ?? error ?? "") });
}

/**
 * Keeps a promise that other code awaits later from counting as unhandled if it fails before that.
 * @template T
 * @param {Promise<T>} promise
 */
const shared = (promise) => (promise.catch(() => {}), promise);

/**
 * For promises that Pyodide awaits: if one fails, `start` says why, and Pyodide must not add an error of its own.
 * @template T
 * @param {Promise<T>} promise
 * @returns {Promise<T>}
 */
const awaited = (promise) => promise.catch(() => new Promise(() => {}));

/** @param {RuntimeFile[]} files @returns {Count} */
function progressTeller(files) {
  const total = files.reduce((sum, file) => sum + file.size, 0);
  let loaded = 0;
  let lastReport = 0;
  return (bytes) => {
    loaded = Math.min(total, loaded + bytes);
    const now = performance.now();
    if (now - lastReport < PROGRESS_EVERY && loaded < total) return;
    lastReport = now;
    post({ type: "progress", loaded, total });
  };
}

/**
 * A file's part of the progress, for any number of attempts to load it: what an earlier one has counted is not counted
 * again, but told, so that the page sees that something arrives.
 * @param {Count} count
 * @returns {() => Count}
 */
function attempts(count) {
  let most = 0;
  return () => {
    let loaded = 0;
    return (bytes) => {
      loaded += bytes;
      const more = Math.max(0, loaded - most);
      most += more;
      count(more);
    };
  };
}

/** @param {RuntimeFile} file @returns {(error: any) => never} */
const throwMissing = (file) => (error) => {
  throw new Error(`${file.name} could not be loaded: ${error.message.replace(/\.$/, "")}`); // Firefox's end with one
};

/** @param {RuntimeFile} file */
const integrity = ({ sha256 }) => `sha256-${btoa(String.fromCharCode(...(sha256.match(/../g) ?? []).map((byte) => parseInt(byte, 16))))}`;

/** @param {string} url @param {RuntimeFile} file @param {RequestCache} cache */
async function open(url, file, cache) {
  const options = self.crypto?.subtle ? {} : { integrity: integrity(file) }; // the browser's check hides the progress
  const priority = python ? "auto" : "low"; // while the start's megabytes load, a figure that comes into view needs its tape
  const response = await network(url, { cache, priority, ...options }).catch(throwMissing(file));
  if (!response.ok) throw new Error(`${file.name} could not be loaded: the server answered ${response.status}`);
  return response;
}

/** @param {Response} response @param {Count} count */
function counted(response, count) {
  const counter = new TransformStream({
    transform(chunk, controller) {
      count(chunk.byteLength);
      controller.enqueue(chunk);
    },
  });
  return /** @type {ReadableStream} */ (response.body).pipeThrough(counter);
}

/** @param {ArrayBuffer} buffer */
const hex = (buffer) => Array.from(new Uint8Array(buffer), (byte) => byte.toString(16).padStart(2, "0")).join("");

/**
 * Checks bytes against the file's hash; without crypto.subtle the browser has already done so during the fetch.
 * @param {ArrayBuffer} bytes
 * @param {RuntimeFile} file
 */
async function hold(bytes, file) {
  if (self.crypto?.subtle && hex(await crypto.subtle.digest("SHA-256", bytes)) !== file.sha256) {
    throw new Error(`${file.name} is not the file that was built: its checksum differs`);
  }
}

/** @param {string} url @param {RuntimeFile} file @param {Count} count @param {RequestCache} cache */
async function checked(url, file, count, cache) {
  const response = await open(url, file, cache);
  const type = response.headers.get("content-type");
  if (file.name.endsWith(".mjs") && !/javascript/i.test(type ?? "")) {
    throw new Error(`${file.name} could not be loaded: the server calls it ${type}, not JavaScript`);
  }
  const bytes = await new Response(counted(response, count)).arrayBuffer().catch(throwMissing(file));
  await hold(bytes, file);
  return bytes;
}

/**
 * The file's bytes, as they were built. The browser's cache may hold a wrong answer: then they are fetched past it.
 * @param {string} url
 * @param {RuntimeFile} file
 * @param {() => Count} attempt
 */
const sound = (url, file, attempt) =>
  checked(url, file, attempt(), "default").catch(() => checked(url, file, attempt(), "reload"));

/**
 * The file's bytes, unpacked if it is a .pack: a gzipped zip of stored members, which travels compressed from any host
 * and is inflated by the browser.
 * @param {string} url
 * @param {RuntimeFile} file
 * @param {() => Count} attempt
 */
async function bytesOf(url, file, attempt) {
  const packed = await sound(url, file, attempt);
  if (!file.name.endsWith(".pack")) return new Uint8Array(packed);
  try {
    const { body } = new Response(packed);
    const inflated = /** @type {ReadableStream} */ (body).pipeThrough(new DecompressionStream("gzip"));
    return new Uint8Array(await new Response(inflated).arrayBuffer());
  } catch (error) {
    throw new Error(`${file.name} is damaged: ${/** @type {Error} */ (error).message}`);
  }
}

/**
 * The members of a zip that stores them uncompressed, as views into it.
 * @param {Uint8Array<ArrayBuffer>} zip
 * @returns {[name: string, bytes: Uint8Array<ArrayBuffer>][]}
 */
function members(zip) {
  const view = new DataView(zip.buffer, zip.byteOffset, zip.byteLength);
  const text = new TextDecoder();
  const end = zip.byteLength - 22;
  if (view.getUint32(end, true) !== 0x06054b50) throw new Error("not a zip as the build writes it");
  /** @type {[string, Uint8Array<ArrayBuffer>][]} */
  const entries = [];
  for (let at = view.getUint32(end + 16, true), count = view.getUint16(end + 10, true); count > 0; count--) {
    const size = view.getUint32(at + 24, true);
    const nameLength = view.getUint16(at + 28, true);
    const local = view.getUint32(at + 42, true);
    const start = local + 30 + view.getUint16(local + 26, true) + view.getUint16(local + 28, true);
    entries.push([text.decode(zip.subarray(at + 46, at + 46 + nameLength)), zip.subarray(start, start + size)]);
    at += 46 + nameLength + view.getUint16(at + 30, true) + view.getUint16(at + 32, true);
  }
  return entries;
}

/** @param {FileSystem} FS @param {string} folder @param {Uint8Array<ArrayBuffer>} zip */
function install(FS, folder, zip) {
  const folders = new Set();
  for (const [name, bytes] of members(zip)) {
    const path = `${folder}/${name}`;
    const parent = path.slice(0, path.lastIndexOf("/"));
    if (!folders.has(parent)) {
      FS.mkdirTree(parent);
      folders.add(parent);
    }
    FS.writeFile(path, bytes, { canOwn: true });
  }
}

/** @param {Start} message */
async function start(message) {
  const { runtime, files, again: careful = false, known: isKnown = false } = message;
  const { modules = ["solvers", "widgets.engine.host"] } = message;
  const began = performance.now();
  post({ type: "stage", stage: "download" });
  const count = progressTeller(files);
  const pick = (/** @type {string} */ ending) => {
    const file = files.find(({ name }) => name.endsWith(ending));
    if (!file) throw new Error(`the page names no ${ending} among the runtime's files`);
    return file;
  };
  const address = (/** @type {RuntimeFile} */ file) => new URL(file.name, runtime).href;
  const load = (/** @type {RuntimeFile} */ file) => shared(bytesOf(address(file), file, attempts(count)));
  const script = async (/** @type {RuntimeFile} */ file) => {
    await sound(address(file), file, attempts(count)); // import() then takes it from the browser's cache
    return import(address(file)).catch(throwMissing(file));
  };

  const wasm = pick("pyodide.asm.wasm");
  const stdlibFile = pick("python_stdlib.pack");
  const wheels = files.filter(({ name }) => name.endsWith(".pack") && name !== stdlibFile.name);

  // Everything at once.
  // The engine compiles while the rest still loads; instantiation, later, finds the module ready.
  /** @type {Promise<void> | undefined} */
  let intact; // awaited once everything is up: a compiler may accept bytes that differ from the build's
  const attempt = attempts(count);
  const compileStreamed = async () => {
    const counter = attempt();
    const response = await open(address(wasm), wasm, "default");
    if (isKnown && response.headers.get("content-type") === WASM) {
      // A browser caches compiled code only for the original response, so a clone is hashed.
      intact = shared(response.clone().arrayBuffer().then((bytes) => hold(bytes, wasm)));
      const module = await WebAssembly.compileStreaming(response);
      counter(wasm.size);
      return module;
    }
    const [forModule, forHash] = counted(response, counter).tee();
    intact = shared(new Response(forHash).arrayBuffer().then((bytes) => hold(bytes, wasm)));
    return WebAssembly.compileStreaming(new Response(forModule, { headers: { "content-type": WASM } }));
  };
  const compileWhole = async () => {
    intact = undefined; // of a stream that broke off
    const bytes = await sound(address(wasm), wasm, attempt);
    return WebAssembly.compile(bytes).catch((error) => {
      throw new Error(`${wasm.name} could not be compiled: ${error.message}`);
    });
  };
  const compiledCore = shared(careful ? compileWhole() : compileStreamed().catch(compileWhole));
  const loader = shared(script(pick("/pyodide.mjs")));
  const engine = shared(script(pick("pyodide.asm.mjs")));
  const json = (/** @type {string} */ ending) => load(pick(ending)).then((bytes) => JSON.parse(new TextDecoder().decode(bytes)));
  const lock = json("pyodide-lock.json");
  const later = shared(json("later.json"));
  const stdlib = load(stdlibFile);
  const archives = wheels.map(load);
  // Libraries are compiled while Python starts; the dynamic linker takes them instead of the bytes.
  const compiled = archives.map(async (archive) => {
    const libraries = members(await archive).filter(([name]) => name.endsWith(".so"));
    return Promise.all(libraries.map(async ([name, bytes]) => /** @type {const} */ ([name, await WebAssembly.compile(bytes)])));
  });
  compiled.forEach(shared);
  let folder = ""; // of packages

  // Answers Pyodide's own requests from these downloads.
  const handed = new Map([
    [address(wasm), async () => new Response()],
    [address(stdlibFile), async () => new Response(await awaited(stdlib))],
  ]);
  const { instantiateStreaming } = WebAssembly;
  self.fetch = (input, init) => (handed.get(input instanceof Request ? input.url : String(input)) ?? (() => network(input, init)))();
  WebAssembly.instantiateStreaming = async (_source, imports) => {
    const module = await awaited(compiledCore);
    const instance = /** @type {any} */ (await WebAssembly.instantiate(module, imports)); // of a module: an Instance
    return { module, instance };
  };

  const downloads = Promise.all([compiledCore, loader, engine, lock, later, stdlib, ...archives]);
  const begin = async () => {
    const { loadPyodide } = await loader;
    return loadPyodide({
      indexURL: new URL("./", address(wasm)).href,
      stdLibURL: address(stdlibFile),
      lockFileContents: lock,
      packageBaseUrl: runtime,
      stdout: (/** @type {string} */ line) => console.log(line),
      stderr: (/** @type {string} */ line) => console.warn(line),
      fsInit: async (/** @type {FileSystem} */ FS, /** @type {{ sitePackages: string }} */ { sitePackages }) => {
        folder = sitePackages;
        for (const archive of archives) install(FS, folder, await awaited(archive));
        post({ type: "stage", stage: "python" });
      },
    });
  };
  // A failed download must be reported as such, not as the error that its absence causes in Python.
  const up = shared(begin());
  await downloads;
  const pyodide = (python = /** @type {Pyodide} */ (await up));
  self.fetch = network;
  WebAssembly.instantiateStreaming = instantiateStreaming;

  rooms = expecting(pyodide, await later, address);
  post({ type: "stage", stage: "numpy" });
  const libraries = (await Promise.all(compiled)).flat();
  pyodide._module.libraries = Object.fromEntries(libraries.map(([name, library]) => [`${folder}/${name}`, library]));
  pyodide.runPython("import numpy.random, numpy.linalg");
  post({ type: "stage", stage: "widgets" });
  for (const name of modules) pyodide.pyimport(name).destroy();
  if (modules.includes("widgets.engine.host")) {
    const host = pyodide.runPython("import widgets.engine.host; widgets.engine.host.Host()");
    const taking = pyodide.runPython("lambda give: lambda request, data: give(request, data.to_bytes())");
    answers = { frame: host.frame, job: host.job, give: taking(host.give), forget: host.forget };
  }
  await intact;
  post({ type: "ready", milliseconds: performance.now() - began });
}

/**
 * Tells Python which modules the later files hold, and loads the file that an import needs.
 * @param {Pyodide} pyodide
 * @param {RuntimeFile[]} files
 * @param {(file: RuntimeFile) => string} address
 * @returns {Rooms}
 */
function expecting(pyodide, files, address) {
  const later = pyodide.runPython("import sitecustomize; sitecustomize.later");
  const packs = new Map(files.map((file) => [file.name, file]));
  for (const [name, { holds: modules = [] }] of packs) for (const top of modules) later.expect(top, name);
  return {
    wanted: () => packs.get(later.taken() ?? ""),
    async bring(file) {
      install(pyodide.FS, later.folder, await bytesOf(address(file), file, () => () => {}));
      later.arrived(file.name);
    },
  };
}

const NAMES = { frame: "frame", job: "slice", give: "told" };

/** @param {Question} question */
async function answer({ type, id, request, data }) {
  for (;;) {
    const began = performance.now();
    try {
      const ask = /** @type {Answers} */ (answers)[type];
      const text = data ? ask(request, data) : ask(request);
      post({ type, id, [NAMES[type]]: text, python_ms: performance.now() - began });
      return;
    } catch (error) {
      const file = rooms?.wanted();
      const fault = file ? await rooms?.bring(file).catch((lack) => lack) : error;
      if (!fault) continue; // retry, now that the missing file is there
      const trace = String(/** @type {any} */ (fault)?.message ?? fault).trim();
      post({ type: "error", id, message: trace.slice(trace.lastIndexOf("\n") + 1), trace, lacks: Boolean(file) });
      return;
    }
  }
}

/**
 * Queues work behind the current answer. An error here means that Python is dead; it is reported, so that later
 * questions do not wait in vain.
 * @param {() => void | Promise<void>} action
 */
function inTurn(action) {
  turn = turn.then(action).catch((error) => fail(error.message, error));
}

self.onmessage = ({ data }) => {
  if (data.type === "start") start(data).catch((error) => fail(error.message, error));
  else if (data.type in NAMES) inTurn(() => answer(data));
  else if (data.type === "forget") inTurn(() => void answers?.forget(data.key));
  else if (data.type === "heap") post({ type: "heap", bytes: python ? python._module.HEAPU8.byteLength : 0 });
};
