"""The worker without a page around it: its messages, and what it reports when a file is missing or wrong."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page

from sitegen.assets.hosting import POLICY
from sitegen.bench.starts import WORKER
from sitegen.runtime.assemble import RuntimeInfo, assemble
from sitegen.serve.static_files import serving
from widgets.engine.contract import preset
from widgets.engine.host import Host
from widgets.engine.registry import WIDGETS

pytestmark = pytest.mark.browser

# Sends `talk`'s messages one after another, each once the `until` of the one before has arrived; resolves to everything
# received.
TALK = """([worker, talk]) => new Promise((resolve) => {
  const heard = [];
  const running = new Worker(worker, { type: "module" });
  const next = () => (talk.length ? running.postMessage(talk[0].send) : (running.terminate(), resolve(heard)));
  running.onmessage = ({ data }) => {
    heard.push(data);
    if (data.type === "failed") talk.length = 1;
    if (data.type === "failed" || talk[0].until === data.type) (talk.shift(), next());
  };
  next();
})"""


@pytest.fixture(scope="module")
def info() -> RuntimeInfo:
    return assemble()


class Served:
    """A copy of the runtime on loopback that a test may damage."""

    def __init__(self, root: Path, origin: str, info: RuntimeInfo, page: Page) -> None:
        self.root, self.origin, self.info, self.page = root, origin, info, page

    def file(self, ending: str) -> Path:
        files = (*self.info.files, *self.info.later)
        (name,) = [file.name for file in files if file.name.endswith(ending)]
        return self.root / "runtime" / name

    def before(self, script: str) -> None:
        """Make the worker run this first."""
        (self.root / "worker.mjs").write_text(script + WORKER.read_text("utf-8"), "utf-8")

    def talk(self, *exchanges: tuple[dict[str, Any], str], known: bool = False) -> list[dict[str, Any]]:
        runtime = f"{self.origin}/runtime/"
        start = {"type": "start", "runtime": runtime, "files": self.info.start_files(), "known": known}
        talk = [{"send": start, "until": "ready"}, *({"send": send, "until": until} for send, until in exchanges)]
        self.page.goto(self.origin)
        messages: list[dict[str, Any]] = self.page.evaluate(TALK, ["worker.mjs", talk])
        return messages

    def failure(self, known: bool = False) -> str:
        messages = self.talk(known=known)
        assert [m["type"] for m in messages].count("failed") == 1
        assert messages[-1]["type"] == "failed"
        return str(messages[-1]["message"])


@pytest.fixture
def served(info: RuntimeInfo, browser: Browser, tmp_path: Path) -> Iterator[Served]:
    info.write(tmp_path / "runtime")
    shutil.copyfile(WORKER, tmp_path / "worker.mjs")
    (tmp_path / "index.html").write_text("<!doctype html><title>worker</title>", "utf-8")
    (tmp_path / "_headers").write_text(f"/*\n  Content-Security-Policy: {POLICY}\n", "utf-8")
    context = browser.new_context()
    with serving(tmp_path) as server:
        yield Served(tmp_path, server.origin, info, context.new_page())
        context.close()


def test_it_starts_draws_and_says_what_went_wrong(served: Served) -> None:
    name, widget = next(iter(WIDGETS.items()))
    request = json.dumps({"figure": "f", "record": preset(widget).plain()})
    messages = served.talk(
        ({"type": "frame", "id": 7, "request": request}, "frame"),
        ({"type": "frame", "id": 8, "request": '{"figure": "f", "record": {"widget": "no such"}}'}, "error"),
        ({"type": "frame", "id": 9, "request": request}, "frame"),
        ({"type": "heap"}, "heap"),
    )
    by_type: dict[str, list[dict[str, Any]]] = {}
    for message in messages:
        by_type.setdefault(message["type"], []).append(message)
    assert [m["stage"] for m in by_type["stage"]] == ["download", "python", "numpy", "widgets"]
    sizes = [m["loaded"] for m in by_type["progress"]]
    assert sizes == sorted(sizes)
    assert sizes[-1] == served.info.size == by_type["progress"][-1]["total"]
    assert len(sizes) <= by_type["ready"][0]["milliseconds"] / 100 + 2
    first, second = by_type["frame"]
    assert (first["id"], second["id"]) == (7, 9)
    assert first["frame"] == second["frame"] == Host().frame(request), f"{name}: not the same bytes as natively"
    assert first["python_ms"] > 0
    (error,) = by_type["error"]
    assert error["id"] == 8
    assert error["message"].startswith("ValueError: no widget 'no such'")
    assert "widgets/engine/host.py" in error["trace"]
    assert by_type["heap"][0]["bytes"] > 10_000_000


def question(widget: str, number: int) -> dict[str, Any]:
    request = json.dumps({"figure": "f", "record": preset(WIDGETS[widget]).plain()})
    return {"type": "frame", "id": number, "request": request}


def test_what_a_figure_needs_is_loaded_when_it_is_first_asked_for(served: Served) -> None:
    """A figure loads its own pack, and one with many scans theirs as well; the second answer loads nothing more."""
    names: list[str] = []
    served.page.on("request", lambda request: names.append(request.url.rpartition("/")[2]))
    graph, kabsch = question("pose-loop", 1), question("kabsch", 2)
    messages = served.talk((graph, "frame"), (kabsch, "frame"), (graph, "frame"))
    frames = [m["frame"] for m in messages if m["type"] == "frame"]
    natively = [Host().frame(message["request"]) for message in (graph, kabsch, graph)]
    assert frames == natively, "not the same bytes as natively"
    later = {Path(file.name).name for file in served.info.later}
    assert [name for name in names if name in later] == ["figure-pose_loop.pack", "drive.pack", "figure-kabsch.pack"]


def test_only_the_start_gives_way_to_a_page_s_other_requests(served: Served) -> None:
    """The start's files have a low priority, so that tapes go first; what a figure waits for does not."""
    served.before("""
      const fetch = self.fetch.bind(self);
      self.fetch = (url, given) => {
        self.postMessage({ type: "asks", url, priority: given.priority });
        return fetch(url, given);
      };
    """)
    messages = served.talk((question("kabsch", 1), "frame"))
    asked = {m["url"].removeprefix(f"{served.origin}/runtime/"): m["priority"] for m in messages if m["type"] == "asks"}
    (own,) = [file.name for file in served.info.later if file.name.endswith("figure-kabsch.pack")]
    assert asked == {file.name: "low" for file in served.info.files} | {own: "auto"}


def test_questions_are_answered_in_turn_while_one_waits_for_its_files(served: Served) -> None:
    """Requests made meanwhile are answered after it."""
    served.before("""
      const fetch = self.fetch.bind(self);
      self.fetch = async (...given) => {
        const response = await fetch(...given);
        if (String(given[0]).endsWith("figure-kabsch.pack")) await new Promise((go) => setTimeout(go, 300));
        return response;
      };
    """)
    served.page.goto(served.origin)
    start = {"type": "start", "runtime": f"{served.origin}/runtime/", "files": served.info.start_files()}
    order = served.page.evaluate(
        """([start, questions]) => new Promise((done) => {
          const worker = new Worker("worker.mjs", { type: "module" }), ids = [];
          worker.onmessage = ({ data }) => {
            if (data.type === "ready") questions.forEach((question) => worker.postMessage(question));
            if (data.type === "frame" && ids.push(data.id) === questions.length) done(ids);
          };
          worker.postMessage(start);
        })""",
        [start, [question("kabsch", 1), question("icp", 2), question("kabsch", 3)]],
    )
    assert order == [1, 2, 3]


def test_a_pack_that_does_not_come_fails_its_figure_alone_and_is_asked_for_again(served: Served) -> None:
    path = served.file("/figure-kabsch.pack")
    data = path.read_bytes()
    path.write_bytes(data[:-9])
    messages = served.talk((question("kabsch", 1), "error"), (question("icp", 2), "frame"))
    assert "figure-kabsch.pack is not the file that was built" in messages[-2]["message"]
    path.unlink()
    messages = served.talk((question("kabsch", 1), "error"), (question("kabsch", 2), "error"))
    assert "figure-kabsch.pack could not be loaded: the server answered 404" in messages[-1]["message"]


# Adds to the message that all is ready: how many bytes were compiled while Python waited, how many functions the engine
# has, how many of them the table by which libraries link, and the names of those that lead elsewhere from there.
LINKED = """
const tell = self.postMessage.bind(self), instantiate = WebAssembly.instantiate;
let bytes = 0, functions = [];
const construct = (Module, [given]) => ((bytes += given.length), new Module(given));
WebAssembly.Module = new Proxy(WebAssembly.Module, { construct });
WebAssembly.instantiate = async (...given) => {
  const instance = await instantiate.apply(WebAssembly, given);
  const exported = Object.entries(instance.exports).filter(([, what]) => typeof what === "function");
  if (exported.length > functions.length) functions = exported; // the engine's are the most
  return instance;
};
const links = ({ GOT, wasmTable }) => {
  const linked = functions.filter(([name]) => name in GOT);
  const astray = linked.filter(([name, own]) => wasmTable.get(GOT[name].value) !== own);
  return { bytes, functions: functions.length, linked: linked.length, astray: astray.map(([name]) => name) };
};
self.postMessage = (message) => tell(message.type === "ready" ? { ...message, ...links(python._module) } : message);
"""


def test_libraries_are_compiled_beforehand_and_link_to_the_functions_they_ask_for(served: Served) -> None:
    served.before(LINKED)
    ready = served.talk()[-1]
    assert ready["astray"] == []
    assert 0 < ready["linked"] < ready["functions"] / 10, "not all of the engine"
    (numpy,) = [file for file in served.info.files if file.name.endswith("/numpy.pack")]
    assert 0 < ready["bytes"] < numpy.size / 50, "no library; the linker's wrappers have 35 bytes each"


@pytest.mark.parametrize(
    "ending",
    [
        *("pyodide.mjs", "pyodide.asm.mjs", "pyodide.asm.wasm"),
        *("python_stdlib.pack", "numpy.pack", "lock.json", "later.json"),
    ],
)
def test_a_missing_file_is_named(served: Served, ending: str) -> None:
    path = served.file(f"/{ending}" if ending == "pyodide.mjs" else ending)
    path.unlink()
    message = served.failure()
    assert path.name in message
    assert "could not be loaded" in message


@pytest.mark.parametrize("ending", ["python_stdlib.pack", "numpy.pack", "ladder.pack"])
def test_a_changed_file_is_named(served: Served, ending: str) -> None:
    path = served.file(ending)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    assert f"{ending} is not the file that was built" in served.failure()


# Bits whose change a browser's own parsers do not notice: in a message, in the engine's data.
FLIPPED = {"pyodide.asm.mjs": b"Aborted(", "/pyodide.mjs": b"Pyodide", "pyodide.asm.wasm": b"Fatal Python error"}
NOT_SECURE = "Object.defineProperty(self.crypto, 'subtle', { value: undefined });"


@pytest.mark.parametrize("secure", [True, False])
@pytest.mark.parametrize("known", [False, True])
@pytest.mark.parametrize("ending", FLIPPED)
def test_a_flipped_bit_is_never_live(served: Served, ending: str, known: bool, secure: bool) -> None:
    """Even if the engine has started before, and on an insecure page, where no hashes can be computed."""
    path = served.file(ending)
    data = bytearray(path.read_bytes())
    data[data.index(FLIPPED[ending])] ^= 1
    path.write_bytes(data)
    if not secure:
        served.before(NOT_SECURE)
    reason = "is not the file that was built" if secure else "could not be loaded"
    assert f"{path.name} {reason}" in served.failure(known)


# The file arrives only when Pyodide waits for nothing else, and everything that goes wrong in the worker is reported.
LATE = """
const tell = self.postMessage.bind(self), plain = self.fetch, { instantiate } = WebAssembly;
const complaint = (text) => tell({ type: "complaint", text: String(text) });
self.addEventListener("unhandledrejection", ({ reason }) => complaint(reason));
console.error = complaint;
self.postMessage = (message) => void setTimeout(setTimeout, 0, tell, 0, message); // after the complaints
let up;
const engine = new Promise((go) => (up = go));
WebAssembly.instantiate = (...given) => instantiate.apply(WebAssembly, given).finally(up);
self.fetch = async (...asked) => {
  if (asked[0].endsWith("FILE")) await engine;
  return plain(...asked);
};
"""


@pytest.mark.parametrize("ending", ["python_stdlib.pack", "numpy.pack"])
def test_a_file_that_fails_while_python_waits_for_it_is_told_once(served: Served, ending: str) -> None:
    """The worker reports it; Pyodide, which waits for it too, leaves no error of its own."""
    path = served.file(ending)
    path.write_bytes(path.read_bytes()[:-9])
    served.before(LATE.replace("FILE", path.name))
    messages = served.talk()
    assert f"{ending} is not the file that was built" in messages[-1]["message"]
    assert [m["text"] for m in messages if m["type"] == "complaint"] == []


@pytest.mark.parametrize("known", [False, True])
def test_a_damaged_engine_is_named(served: Served, known: bool) -> None:
    path = served.file("pyodide.asm.wasm")
    path.write_bytes(path.read_bytes()[:-1000])
    assert "pyodide.asm.wasm is not the file that was built" in served.failure(known)


# The connection is lost in the middle of the engine, once.
DROPPED = """
const plain = self.fetch;
let lost = false;
self.fetch = async (...asked) => {
  const answer = await plain(...asked);
  if (lost || !asked[0].endsWith(".wasm")) return answer;
  lost = true;
  let left = 3;
  const transform = (chunk, to) => (left-- ? to.enqueue(chunk) : to.error(new TypeError("network error")));
  return new Response(answer.body.pipeThrough(new TransformStream({ transform })), { headers: answer.headers });
};
"""


@pytest.mark.parametrize("known", [False, True])
def test_an_engine_whose_connection_is_lost_is_fetched_again(served: Served, known: bool) -> None:
    """As every other file is; and progress neither falls nor says that all is there before it is."""
    served.before(DROPPED)
    messages = served.talk(known=known)
    assert messages[-1]["type"] == "ready"
    progress = [m["loaded"] for m in messages if m["type"] == "progress"]
    assert progress == sorted(progress)
    assert [loaded for loaded in progress if loaded >= served.info.size] == [served.info.size]


def test_an_engine_that_a_browser_cannot_compile_is_not_called_damaged(served: Served) -> None:
    served.before("""
      const refuse = async () => { throw new WebAssembly.CompileError("unknown section"); };
      Object.assign(WebAssembly, { compile: refuse, compileStreaming: refuse });
    """)
    assert "pyodide.asm.wasm could not be compiled: unknown section" in served.failure()


# Reports the address of what is compiled while it streams: browsers cache compiled code by that address.
COMPILED = """
const compile = WebAssembly.compileStreaming;
WebAssembly.compileStreaming = (response) => {
  postMessage({ type: "compiled", address: response.url });
  return compile.call(WebAssembly, response);
};
"""
MISNAMED = """
const plain = self.fetch;
self.fetch = async (...asked) => {
  if (!asked[0].endsWith(".wasm")) return plain(...asked);
  const { body } = await plain(...asked);
  return new Response(body, { headers: { "content-type": "text/plain" } });
};
"""


@pytest.mark.parametrize("known", [False, True])
def test_an_engine_that_came_up_before_is_compiled_as_it_comes(served: Served, known: bool) -> None:
    """Only then: at a first start its bytes are counted and hashed on the way. Progress is complete either way."""
    served.before(COMPILED)
    messages = served.talk(known=known)
    (address,) = [m["address"] for m in messages if m["type"] == "compiled"]
    engine = served.file("pyodide.asm.wasm").relative_to(served.root).as_posix()
    assert address == (f"{served.origin}/{engine}" if known else "")
    assert [m["loaded"] for m in messages if m["type"] == "progress"][-1] == served.info.size
    assert messages[-1]["type"] == "ready"


def test_a_host_that_calls_the_engine_something_else_is_forgiven(served: Served) -> None:
    """A known engine starts even if its type keeps the browser from compiling it while it streams."""
    served.before(MISNAMED)
    assert served.talk(known=True)[-1]["type"] == "ready"


def test_a_module_that_is_not_there_is_told(served: Served) -> None:
    start = {"type": "start", "runtime": f"{served.origin}/runtime/", "files": served.info.start_files()}
    served.page.goto(served.origin)
    talk = [{"send": {**start, "modules": ["solvers", "no_such_module"]}, "until": "ready"}]
    messages = served.page.evaluate(TALK, ["worker.mjs", talk])
    assert messages[-1]["type"] == "failed"
    assert "No module named 'no_such_module'" in messages[-1]["message"]
