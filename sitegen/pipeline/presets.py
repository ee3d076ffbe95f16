"""Try every preset of every figure, so that those that no chapter shows yet are known to work."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from sitegen.cache import pool
from sitegen.chapters.surveyed import Survey
from sitegen.figures.bakery import Bakery, draw_ahead, known_by_name
from sitegen.figures.picture_faults import FigureFault
from sitegen.figures.wire import Plain
from sitegen.problems import Problems
from sitegen.progress import Progress
from widgets.engine.contract import Widget, preset


def try_presets(
    widgets: Mapping[str, Widget],
    surveys: Sequence[Survey],
    bakery: Bakery,
    cache: Path,
    problems: Problems,
    progress: Progress,
) -> None:
    """Draw each preset, untouched and after each of its press buttons; cached frames are not drawn again."""
    places = {figure.widget.name: figure.place for survey in reversed(surveys) for figure in survey.figures.values()}
    states = [(name, _states(widget, choice)) for name, widget in widgets.items() for choice in widget.presets]
    ours = [(f"fig-{name}", records) for name, records in states if known_by_name(widgets[name])]
    lacking = [(draw_ahead, (*pair, cache)) for pair in ours if bakery.lacks_frames(*pair)]
    pool.make("trying presets", lacking, progress)
    for name, records in states:
        try:
            bakery.frames(f"fig-{name}", records)
        except FigureFault as fault:
            fault.tell(problems, places.get(name))


def _states(widget: Widget, name: str) -> list[Plain]:
    plain = preset(widget, name).plain()
    presses = [button.name for button in widget.buttons if button.does == "press"]
    return [plain, *({**plain, "log": [["press", press]]} for press in presses)]
