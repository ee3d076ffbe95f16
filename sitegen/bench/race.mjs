// Runs code in a tab: stock Pyodide and numpy, our wheel, one call; the answer is text.

self.onmessage = async ({ data }) => {
  try {
    const { loadPyodide } = await import(new URL("pyodide.mjs", data.folder).href);
    const python = await loadPyodide({ indexURL: data.folder, packageBaseUrl: data.folder });
    const faults = [];
    await python.loadPackage("numpy", { messageCallback() {}, errorCallback: (fault) => faults.push(fault) });
    if (faults.length) throw new Error(faults.join("; "));
    const wheel = await fetch(data.wheel);
    python.unpackArchive(await wheel.arrayBuffer(), "wheel");
    self.postMessage({ type: "done", answer: python.runPython(data.code) });
  } catch (error) {
    self.postMessage({ type: "failed", message: error.message });
  }
};
