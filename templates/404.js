
// The site's root is the first folder of the address that holds this build's style sheet.
(async () => {
  const link = document.querySelector("[data-beside]");
  const folders = location.pathname.split("/").slice(0, -1);
  for (const i of folders.keys()) {
    const start = `${location.origin}${folders.slice(0, i + 1).join("/")}/`;
    const answer = await fetch(start + link.dataset.beside, { method: "HEAD" }).catch(() => null);
    if (!answer?.ok || !/css/.test(answer.headers.get("content-type"))) continue;
    link.href = `${start}index.html`;
    return;
  }
})();
