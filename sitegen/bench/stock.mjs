// The reference for the cold start: stock Pyodide and numpy, to the end of `import numpy`.

self.onmessage = async ({ data }) => {
  try {
    const { loadPyodide } = await import(new URL("pyodide.mjs", data.folder).href);
    const python = await loadPyodide({ indexURL: data.folder, packageBaseUrl: data.folder });
    const faults = [];
    await python.loadPackage("numpy", { messageCallback() {}, errorCallback: (fault) => faults.push(fault) });
    if (faults.length) throw new Error(faults.join("; "));
    python.runPython("import numpy");
    self.postMessage({ type: "ready" });
  } catch (error) {
    self.postMessage({ type: "failed", message: error.message });
  }
};
