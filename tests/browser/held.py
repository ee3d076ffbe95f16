"""A slow device under a test's control: while `holding`, Python gets no requests; letting go sends them all at once."""

HELD = """
const { postMessage } = Worker.prototype;
window.waiting = [];
Worker.prototype.postMessage = function (message, ...more) {
  const go = () => postMessage.call(this, message, ...more);
  if (window.holding && ["frame", "give"].includes(message.type)) window.waiting.push(go);
  else go();
};
window.letGo = () => { window.holding = false; window.waiting.splice(0).forEach((go) => go()); };
"""
