"""What Python and the page's scripts exchange: the scripts' types fit Python's answers; both accept the same links."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from contextlib import suppress
from copy import deepcopy
from functools import partial
from pathlib import Path
from typing import Any

from sitegen.external import fetch
from sitegen.external.node import environment, node_command, run_node
from sitegen.figures.wire import spec
from tests.scripts.test_node import HERE
from widgets.engine.contract import MAX_LOG, Widget, parsed, preset
from widgets.engine.controls import specs
from widgets.engine.host import Host
from widgets.engine.registry import WIDGETS

BASE = HERE.parents[1] / "templates/assets/js/base"
CHECK = """
import { readFileSync } from "node:fs";
import { sound } from %s;
const links = JSON.parse(readFileSync(0, "utf8"));
console.log(JSON.stringify(links.map(([record, initial, spec]) => sound(record, initial, spec))));
"""
FINGERPRINT = "0123456789abcdef" * 2


def taped(widget: Widget) -> dict[str, Any]:
    """The record at the end of the figure's first tape, or its first one."""
    changes, presses = widget.tape[0] if widget.tape else ({}, ())
    return {**preset(widget, "default", changes).plain(), "log": [["press", name] for name in presses]}


def sent_by_python() -> dict[str, list[Any]]:
    """Type → what Python sends of it, for every figure; without drawings, which are just strings."""
    host = Host()
    sent: dict[str, list[Any]] = {name: [] for name in ("Spec", "FigureRecord", "Frame", "JobResult", "Slice")}
    for name, widget in WIDGETS.items():
        record = taped(widget)
        sent["Spec"].append(spec(widget))
        sent["FigureRecord"].append(record)
        sent["Frame"].append(host.render(name, record))
        for job in widget.jobs:
            ask = partial(answer_to, host, {"figure": name, "record": preset(widget).plain(), "job": job.name})
            part, *_ = ask(do="parts")
            piece = ask(do="begin", part=part)
            while not piece["done"]:
                piece = ask(do="go on")
            sent["Slice"].append(piece)
            sent["JobResult"].append(ask(do="result", outcomes={part: piece["outcome"]}))
    for shown in (*sent["Frame"], *sent["JobResult"]):
        for panel in shown["panels"]:
            panel["svg"] = ""
    return sent


def answer_to(host: Host, request: dict[str, Any], **more: Any) -> Any:
    """The host's answer to a request about a job."""
    return json.loads(host.job(json.dumps({**request, **more})))


def test_the_scripts_types_fit_the_answers(tmp_path: Path) -> None:
    """To the key: tsc reports one that is missing, and one that the types do not know."""
    sent = sent_by_python()
    lines = [f"import type {{ {', '.join(sent)} }} from {json.dumps(str(BASE / 'types.js'))};"]
    lines += [f"export const a{name}: {name}[] = {json.dumps(values)};" for name, values in sent.items()]
    script = tmp_path / "answers.ts"
    script.write_text("\n".join(lines), "utf-8")
    compiler = fetch.gather(["typescript"])["typescript/lib/_tsc.js"]
    options = ("--strict", "--noEmit", "--module", "esnext", "--moduleResolution", "bundler", "--pretty", "false")
    command = node_command(compiler, *options, "--lib", "esnext,dom", script)
    process = subprocess.run(command, capture_output=True, encoding="utf-8", env=environment(), check=False)
    assert (process.returncode, process.stdout) == (0, "")


def links(widget: Widget) -> Iterator[dict[str, Any]]:
    """Records from links: the first one, and copies of it, each with one part at or just past a limit."""
    plain = preset(widget).plain()

    def with_log(*log: Any) -> dict[str, Any]:
        return {**deepcopy(plain), "log": [*log]}

    yield plain
    for seed in (0, 2**31 - 1, 2**31, -1, 0.5, "40", None, True):
        yield {**plain, "seed": seed}
    for name, control in specs(widget.controls).items():
        ends = [control.low, control.high, control.low - control.step, control.high + control.step]
        for value in (*(ends if control.kind == "slider" else control.options), True, "toString", None, 1e15, []):
            yield {**plain, "controls": {**plain["controls"], name: value}}
    yield {**plain, "controls": {**plain["controls"], "toString": 1}}
    presses = [button.name for button in widget.buttons]
    places = {"drag": widget.handles, "click": widget.clicks, "hover": widget.hovers}
    for name in (*presses, "toString"):
        yield with_log(["press", name])
        yield with_log(["press", name, 0, 0])
    for kind, names in (*places.items(), ("turn", widget.handles)):
        for name in (*names, "toString"):
            for place in ([0, 0], [999_999.9, -999_999.9], [1e6, 0], [0, -1e6], [0], [0, 0, 0], [0, "0"], [0, None]):
                yield with_log([kind, name, *place])
    for name in (button.name for button in widget.buttons if button.does == "press"):
        yield with_log(*[["press", name]] * MAX_LOG)
        yield with_log(*[["press", name]] * (MAX_LOG + 1))
    for malformed in ([], ["press"], [7, "step"], "press", None, {}):
        yield with_log(malformed)
    for slot in (*widget.takes, "toString"):
        for key in (FINGERPRINT, 7, None):
            yield {**plain, "given": {slot: key}}
    for files in ([], None, 7):
        yield {**plain, "given": files}


def test_the_page_and_python_accept_the_same_links(tmp_path: Path) -> None:
    """Where the page ignores nothing, Python accepts the record as it is; and what is left of any other, it accepts."""
    sent = [(widget, record) for widget in WIDGETS.values() for record in links(widget)]
    script = tmp_path / "sound.mjs"
    script.write_text(CHECK % json.dumps((BASE / "checked_record.js").as_uri()), "utf-8")
    answers = run_node(script, [[record, preset(widget).plain(), spec(widget)] for widget, record in sent])
    for (widget, record), answer in zip(sent, answers, strict=True):
        assert parsed(widget, answer["record"])
        with suppress(ValueError):
            parsed(widget, record)
            assert (answer["record"], answer["ignored"]) == (record, [])
            continue
        assert answer["ignored"], record
