// Runs code in stock Pyodide with numpy, and with our wheel if one is named; the answer is the value of its last line.

self.onmessage = async ({ data }) => {
  try {
    const { loadPyodide } = await import(new URL("pyodide.mjs", data.folder).href);
    const python = await loadPyodide({ indexURL: data.folder, packageBaseUrl: data.folder });
    const faults = [];
    await python.loadPackage("numpy", { messageCallback() {}, errorCallback: (fault) => faults.push(fault) });
    if (faults.length) throw new Error(faults.join("; "));
    if (data.wheel) {
      const wheel = await fetch(data.wheel);
      python.unpackArchive(await wheel.arrayBuffer(), "wheel");
    }
    self.postMessage({ type: "ready", answer: python.runPython(data.code) });
  } catch (error) {
    self.postMessage({ type: "failed", message: error.message });
  }
};
