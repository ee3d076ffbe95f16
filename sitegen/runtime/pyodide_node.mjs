// Runs Python inside Pyodide under Node: one JSON request on stdin, one JSON answer as the last line of stdout.
//
// Request: { folder, stdlib?, site?, mounts?, env?, python, input }
//   folder    has pyodide.mjs, its wasm, python_stdlib.zip and pyodide-lock.json
//   stdlib    another python_stdlib.zip
//   site      a folder to mount as site-packages
//   mounts    { "/path inside": "folder outside" }
//   env       Python's environment variables
//   python    source that defines main(text: str) -> str, both JSON
//   input     the argument of main
// Python's output goes to stderr.

import { readFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

const request = JSON.parse(readFileSync(0, "utf8"));
const { loadPyodide } = await import(pathToFileURL(join(request.folder, "pyodide.mjs")).href);

const say = (line) => process.stderr.write(line + "\n");
const mount = (FS, target, source) => {
  FS.mkdirTree(target);
  FS.mount(FS.filesystems.NODEFS, { root: source }, target);
};
async function run() {
  const pyodide = await loadPyodide({
    indexURL: request.folder,
    env: request.env ?? {},
    ...(request.stdlib && { stdLibURL: request.stdlib }),
    stdout: say,
    stderr: say,
    fsInit(FS, { sitePackages }) {
      if (request.site) mount(FS, sitePackages, request.site);
      for (const [target, source] of Object.entries(request.mounts ?? {})) mount(FS, target, source);
    },
  });
  pyodide.runPython(request.python);
  return pyodide.globals.get("main")(JSON.stringify(request.input ?? null));
}

// By default, Node would quote the minified line that threw and drop Python's message.
const [code, stream, text] = await run().then(
  (answer) => [0, process.stdout, answer],
  (error) => [1, process.stderr, error.message],
);
stream.write("\n" + text + "\n", () => process.exit(code));
