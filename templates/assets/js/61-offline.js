// Keeps the site for offline use: the pages when the browser is idle, the runtime's folder once it is up.
(() => {
  "use strict";

  const { frugal, idle, runtime } = Ladder;

  /** ready: the pages and the runtime are kept, so that everything works without the server. */
  Ladder.offline = { ready: false };

  async function keepRuntime() {
    const { active } = await navigator.serviceWorker.ready;
    const { port1, port2 } = new MessageChannel();
    port1.onmessage = ({ data }) => {
      Ladder.offline.ready = data.kept;
    };
    active.postMessage({ keep: runtime.urls }, [port2]);
  }

  Ladder.keepOffline = function () {
    if (!navigator.serviceWorker || frugal || !location.protocol.startsWith("http")) return;
    idle(async () => {
      try {
        await navigator.serviceWorker.register("sw.js");
      } catch {
        return; // a browser may refuse; the site works all the same
      }
      if (runtime.state === "live") keepRuntime();
      const stop = runtime.on("change", () => {
        if (runtime.state !== "live") return;
        stop();
        idle(keepRuntime);
      });
    });
  };
})();
