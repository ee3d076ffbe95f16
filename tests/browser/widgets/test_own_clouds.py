"""Your own clouds: files of every format, a drop, a drawing by mouse and keys, and what can be saved. None of it leaves
the machine: the reader's fixture fails on any request to another origin."""

from __future__ import annotations

import json
import re
import struct
import subprocess
import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from sitegen.bench.pages import until
from solvers import Pose
from solvers.scenes.rooms import room
from tests.browser.conftest import Reader
from tests.browser.figure import Figure, finger, link_of, tap_after_drag
from tests.browser.server import SiteServer

ROOT = Path(__file__).resolve().parents[3]
TRUTH = Pose.from_angle(np.radians(12.0), (400.5, -80.25))  # for clouds of some hundred units, such as millimetres


def clouds() -> tuple[np.ndarray, np.ndarray]:
    scene = room("clean", seed=66)
    return TRUTH.inverse().apply(100 * scene.source + TRUTH.t), 100 * scene.target + TRUTH.t


def lines(points: np.ndarray, separator: str = ",") -> bytes:
    return "\n".join(separator.join(f"{v:.4f}" for v in row) for row in points).encode()


def in_space(points: np.ndarray) -> np.ndarray:
    """The points in space, with walls 250 units high."""
    heights = np.random.default_rng(1).uniform(0, 250, len(points))
    return np.column_stack([points, heights])


def ply(points: np.ndarray) -> bytes:
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz"[: points.shape[1]]) + "end_header\n"
    return head.encode() + b"".join(struct.pack(f"<{len(row)}f", *row) for row in points)


def pcd(points: np.ndarray) -> bytes:
    d, n = points.shape[1], len(points) + 1
    head = f"# .PCD v0.7\nVERSION 0.7\nFIELDS {'x y z'[: 2 * d - 1]}\nSIZE{' 4' * d}\nTYPE{' F' * d}\nCOUNT{' 1' * d}\n"
    head += f"WIDTH {n}\nHEIGHT 1\nPOINTS {n}\nDATA ascii\n"
    return head.encode() + lines(points, " ") + b"\n" + b"nan " * d + b"\n"


def open_clouds(reader: Callable[..., Reader], **options: Any) -> tuple[Page, Figure]:
    page = reader(reduced_motion="reduce", **options).open("clouds.html")
    return page, Figure(page, "fig-own").live()


def choose(figure: Figure, side: str, name: str, data: bytes) -> None:
    chooser = figure.root.locator(f'input[type=file][data-place="{side}"]')
    chooser.set_input_files({"name": name, "mimeType": "application/octet-stream", "buffer": data})


def expect_message(figure: Figure, side: str, words: str) -> None:
    expect(figure.root.locator(f'[data-told="{side}"]')).to_contain_text(words, timeout=60_000)


def to_the_end(figure: Figure) -> None:
    figure.button("finish").click()
    expect(figure.root.locator('[data-readout="stop"] .value')).to_contain_text("converged", timeout=60_000)
    expect(figure.button("finish")).to_have_text("To the end")


def run_script(script: str, folder: Path) -> dict[str, float]:
    """The numbers printed by a script that runs beside the reader's files in an interpreter with only the solvers."""
    (folder / "register.py").write_text(script, "utf-8")
    run = f"import sys; sys.path.insert(0, {str(ROOT)!r}); exec(open('register.py', encoding='utf-8').read())"
    process = subprocess.run(
        [sys.executable, "-I", "-c", run], cwd=folder, capture_output=True, text=True, encoding="utf-8", check=False
    )
    assert process.returncode == 0, process.stderr
    return {name: float(value) for name, value in (line.split(" ", 1) for line in process.stdout.splitlines())}


def save(page: Page, figure: Figure, name: str) -> str:
    with page.expect_download() as download:
        figure.root.locator(f'[data-file="{name}"]').click()
    return Path(download.value.path()).read_text("utf-8")


FORMATS: dict[str, Callable[[np.ndarray], bytes]] = {
    "csv": lambda p: b"x,y\n" + lines(p),
    "xyz": lambda p: lines(in_space(p), " "),
    "ply": lambda p: ply(in_space(p)),
    "pcd": lambda p: pcd(in_space(p)),
}


def test_two_files_give_a_pose_that_their_script_finds_again(reader: Callable[..., Reader], tmp_path: Path) -> None:
    """In every format: opened and run to the end, the pose is near the truth; the script, run by itself beside the
    files, finds the same pose."""
    page, own = open_clouds(reader, accept_downloads=True)
    source, target = clouds()
    middle = source.mean(axis=0)[None]
    for kind, write in FORMATS.items():
        for side, points in (("source", source), ("target", target)):
            data = write(points)
            (tmp_path / f"{side}.{kind}").write_bytes(data)
            choose(own, side, f"{side}.{kind}", data)
            expect_message(own, side, f"{side}.{kind}: {len(points)} points in {2 if kind == 'csv' else 3}-D")
        if kind == "pcd":
            expect_message(own, "target", "1 row with NaN or infinity left out")
        own.settled()
        to_the_end(own)
        report = json.loads(save(page, own, "pose.json"))
        pose = Pose(np.array(report["matrix_3x3"])[:2, :2], np.array(report["translation"]))
        assert abs(report["angle_degrees"] - 12.0) < 2.0
        assert np.abs(pose.apply(middle) - TRUTH.apply(middle)).max() < 15.0
        matrix = [[float(v) for v in row.split(",")] for row in save(page, own, "pose.csv").splitlines()]
        assert matrix == report["matrix_4x4"]
        result = run_script(own.frame()["python"], tmp_path)
        assert result["rotation"] == pytest.approx(report["angle_degrees"], abs=1e-7)
        assert [result["x"], result["y"]] == pytest.approx(report["translation"], abs=1e-5)
        assert result["rms"] == pytest.approx(report["residual_rms"], abs=1e-6)


def test_what_is_wrong_with_a_file_is_said_where_it_is_read(reader: Callable[..., Reader]) -> None:
    """With its name and line, within the figure; the last picture stays. A name never becomes markup."""
    _, own = open_clouds(reader)
    before = own.frames()
    choose(own, "source", "<img src=x onerror=alert(1)>.csv", b"x,y\n1,2\n3,four\n")
    status = own.root.locator(".figure-status")
    expect(status).to_contain_text("<img src=x onerror=alert(1)>.csv: line 3: 'four' is not a number", timeout=60_000)
    assert own.frames() == before
    assert own.root.locator("img").count() == 0
    choose(own, "source", "nul.ply", b"ply\nformat ascii 1.0\nelement vertex 3\nend_header\n")
    expect(status).to_contain_text("nul.ply: line 3: the vertices have nothing", timeout=60_000)
    own.button("step").click()
    expect(status).not_to_contain_text("nul.ply")


def test_a_drop_thins_slices_and_outlives_the_worker(reader: Callable[..., Reader]) -> None:
    """With two files dropped at once, excess points are thinned with a notice, a slice leaves fewer, and a restarted
    worker is handed the clouds again."""
    page, own = open_clouds(reader)
    floor = np.random.default_rng(2).uniform([-300, -300, 0], [300, 300, 2], (3000, 3))
    texts = [lines(np.concatenate([in_space(points), floor]), " ").decode() for points in clouds()]
    page.evaluate(
        """texts => {
          const data = new DataTransfer();
          texts.forEach((text, i) => data.items.add(new File([text], `scan-${i}.xyz`)));
          const figure = document.querySelector("#fig-own");
          for (const type of ["dragover", "drop"]) {
            figure.dispatchEvent(new DragEvent(type, { dataTransfer: data, bubbles: true, cancelable: true }));
          }
        }""",
        texts,
    )
    expect_message(own, "source", "scan-0.xyz: ")
    expect_message(own, "target", "scan-1.xyz: ")
    status = own.root.locator(".figure-status")
    expect(status).to_contain_text("Thinned: source", timeout=60_000)
    points = own.root.locator('[data-readout="points"] .value')
    expect(points).to_contain_text("of 3,1")
    own.set("thickness", "60")
    own.set("height", "65")
    expect(points).not_to_contain_text("of", timeout=60_000)
    own.settled()
    before = own.readout("rms")
    page.evaluate("Ladder.runtime.restart()")
    own.live()
    own.button("step").click()
    own.changes("rms", before)
    own.root.locator('[data-own="swap"]').click()
    expect_message(own, "source", "scan-1.xyz: ")


def test_clouds_are_drawn_by_mouse_and_by_keys(reader: Callable[..., Reader], tmp_path: Path) -> None:
    """A stroke, a point by key, Undo, the target as the moved source; the script contains the drawn points."""
    page, own = open_clouds(reader)
    own.root.locator('[data-pen="source"]').click()
    expect(own.root.locator(".figure-status")).to_contain_text("Choose or draw a source and a target", timeout=60_000)
    panel = own.root.locator('[data-panel="main"]')
    panel.scroll_into_view_if_needed()
    box = panel.bounding_box()
    assert box is not None
    x, y, w, h = (box[side] for side in ("x", "y", "width", "height"))
    page.mouse.move(x + 0.3 * w, y + 0.3 * h)
    page.mouse.down()
    page.mouse.move(x + 0.7 * w, y + 0.35 * h, steps=6)
    page.mouse.move(x + 0.6 * w, y + 0.7 * h, steps=6)
    page.mouse.up()
    expect_message(own, "source", "Drawn by hand:")
    stroke = own.root.locator('[data-told="source"]').inner_text()
    cross = own.root.locator('.crosshair[data-pick="main"]')
    cross.focus()
    for key in ("ArrowLeft", "ArrowUp", "Enter"):
        page.keyboard.press(key)
    expect(own.root.locator('[data-told="source"]')).not_to_have_text(stroke, timeout=60_000)
    own.root.locator('[data-own="undo"]').click()
    expect_message(own, "source", stroke)
    own.root.locator('[data-own="copy"]').click()
    expect_message(own, "target", stroke)
    own.root.locator('[data-pen="source"]').click()
    own.set("method", "cpd-rigid")
    own.settled()
    to_the_end(own)
    result = run_script(own.frame()["python"], tmp_path)
    assert result["rotation"] == pytest.approx(180 / 7, abs=0.05)
    assert float(own.readout("rms")) < 0.01


def test_a_finger_draws_where_it_else_scrolls(reader: Callable[..., Reader]) -> None:
    """On a phone, with the pen selected, a finger leaves points and the page stays; without it the page scrolls."""
    page, own = open_clouds(reader, width=390, height=844, has_touch=True, is_mobile=True)
    panel, script = own.root.locator('.figure-panel[data-panel="main"]'), "window.scrollY"
    counts = []
    for side, lean in (("source", 0.0), ("target", 0.1)):
        tap_after_drag(own.root.locator(f'[data-pen="{side}"]'))
        panel.scroll_into_view_if_needed()
        box = panel.bounding_box()
        assert box is not None
        corners = [(0.35, 0.7), (0.4 + lean, 0.25), (0.7, 0.35 + lean)]
        before = page.evaluate(script)
        finger(page, along([(box["x"] + u * box["width"], box["y"] + v * box["height"]) for u, v in corners]))
        expect_message(own, side, "Drawn by hand: ")
        counts.append(int(re.findall(r"\d+", own.root.locator(f'[data-told="{side}"]').inner_text())[0]))
        assert page.evaluate(script) == before
    assert min(counts) > 20
    tap_after_drag(own.root.locator('[data-pen="target"]'))
    own.settled()
    panel.scroll_into_view_if_needed()
    box, before = panel.bounding_box(), page.evaluate(script)
    assert box is not None
    x, y = box["x"] + 0.5 * box["width"], box["y"]
    finger(page, along([(x, y + 0.9 * box["height"]), (x, y + 0.2 * box["height"])]))
    until(page, f"{script} > {before} + 50")
    assert own.root.locator('[data-told="target"]').inner_text().startswith("Drawn by hand: ")


def along(corners: list[tuple[float, float]], steps: int = 12) -> list[tuple[float, float]]:
    """Places along the way round the corners."""
    way = [
        (a + (c - a) * i / steps, b + (d - b) * i / steps)
        for (a, b), (c, d) in pairwise(corners)
        for i in range(1, steps + 1)
    ]
    return [corners[0], *way]


def test_a_link_says_that_the_clouds_are_not_in_it(reader: Callable[..., Reader]) -> None:
    """Opened elsewhere it asks for the files; once they are there, its settings and steps apply."""
    visitor = reader(reduced_motion="reduce")
    own = Figure(visitor.open("clouds.html"), "fig-own").live()
    files = {side: lines(points) for side, points in zip(("source", "target"), clouds(), strict=True)}
    for side, data in files.items():
        choose(own, side, f"{side}.csv", data)
        expect_message(own, side, f"{side}.csv: ")
    own.set("method", "gicp")
    own.settled()
    before = own.readout("rotation")
    own.button("ten").click()
    after = own.changes("rotation", before)
    own.reached("[data-link]").click()
    expect(own.root.locator(".figure-status")).to_contain_text(re.compile("not contain your clouds|Link to this state"))
    link = own.page.evaluate("name => Ladder.figures.get(name).link()", own.name)
    page = visitor.page()
    page.goto(link)
    second = Figure(page, "fig-own").live()
    expect(second.root.locator(".figure-status")).to_contain_text("Choose or draw a source", timeout=60_000)
    for side, data in files.items():
        choose(second, side, f"{side}.csv", data)
        expect_message(second, side, f"{side}.csv: ")
    second.shows("rotation", after)


def choose_both(figure: Figure) -> None:
    """Open the two clouds."""
    for side, points in zip(("source", "target"), clouds(), strict=True):
        choose(figure, side, f"{side}.csv", lines(points))
        expect_message(figure, side, f"{side}.csv: ")
    figure.settled()


def test_a_pinned_run_of_files_comes_back_with_them(reader: Callable[..., Reader]) -> None:
    """On the same page it brings the files too; on a later visit it says that they are missing, and is restored once
    they are opened."""
    page, own = open_clouds(reader)
    choose_both(own)
    before = own.readout("rms")
    own.button("ten").click()
    after = own.changes("rms", before)
    pin, rows = own.reached("[data-pin]"), own.root.locator(".runs tbody tr")
    pin.click()
    own.set("clouds", "room")
    own.changes("rms", after)
    pin.click()
    expect(rows).to_have_count(2)
    rows.first.get_by_role("button", name="Restore").click()
    own.shows("rms", after)
    expect_message(own, "source", "source.csv: ")
    page.reload()
    own.live()
    rows.first.get_by_role("button", name="Restore").click()
    expect_message(own, "source", "Not here: open the file used for this state.")
    expect(own.root.locator(".figure-status")).to_contain_text("Choose or draw a source and a target")
    choose_both(own)
    own.shows("rms", after)


def test_files_chosen_before_python_is_up_outlive_retry(reader: Callable[..., Reader], server: SiteServer) -> None:
    """They wait for the next Python, as the page promises."""
    visitor = reader(alone=True, reduced_motion="reduce")
    visitor.context.add_init_script("window.LADDER_PATIENCE = 300;")
    server.hold("/runtime/.*wasm")
    own = Figure(visitor.open("clouds.html"), "fig-own").seen()
    for side, points in zip(("source", "target"), clouds(), strict=True):
        choose(own, side, f"{side}.csv", lines(points))
        expect_message(own, side, f"{side}.csv will be read once Python is ready.")
    retry = own.root.get_by_role("button", name="Retry")
    expect(retry).to_be_visible(timeout=60_000)
    own.page.evaluate("window.LADDER_PATIENCE = 60000")
    retry.click()
    server.release()
    for side in ("source", "target"):
        expect_message(own, side, f"{side}.csv: ")
    own.settled().live()
    assert set(own.record()["given"]) == {"source", "target"}


PRINT = "0123456789abcdef" * 2


@pytest.mark.parametrize(
    ("given", "words", "expected"),
    [
        ({"source": [PRINT], "target": PRINT}, "the source", {"target": PRINT}),
        ({"source": PRINT, "target": 7, "third": PRINT}, "the target, “third”", {"source": PRINT}),
        ([PRINT], "your files", None),
        (None, "your files", None),
    ],
)
def test_a_link_with_faulty_files_opens_with_what_is_sound(
    reader: Callable[..., Reader], given: Any, words: str, expected: Any
) -> None:
    """It says what was left out; the settings apply, and a named file that is missing can be opened."""
    state = {"widget": "own-clouds", "controls": {"clouds": "own", "method": "gicp"}, "log": [], "given": given}
    page = reader(reduced_motion="reduce").open(f"clouds.html#fig-own?s={link_of(state)}")
    own = Figure(page, "fig-own").live().settled()
    message = f"Ignored in the state in this page’s address: {words}."
    expect(own.root.locator(".figure-status")).to_contain_text(message)
    assert own.record().get("given") == expected
    assert own.record()["controls"]["method"] == "gicp"
    for side in expected or {}:
        expect_message(own, side, "Not here: open the file used for this state.")
    own.becomes("live")


def test_two_scans_of_the_drive_are_chosen_by_number_with_the_keys(reader: Callable[..., Reader]) -> None:
    """Real scans bring the wheels' start; arrow keys choose others; the run ends where the drive's graph has it."""
    page, figure = open_clouds(reader)
    figure.control("clouds").and_(page.locator("[value=drive]")).focus()
    page.keyboard.press("Space")
    figure.shows("points", "329 and 336")
    assert figure.control("start").and_(page.locator("[value=wheels]")).is_checked()
    figure.control("scan").focus()
    page.keyboard.press("ArrowLeft")
    figure.shows("points", "342 and 336")
    to_the_end(figure)
    assert float(figure.readout("translation_graph")) < 0.05
