"""Figures asked for frames, natively or in the page's Python: the questions are the same, the answers are compared."""

import json

from widgets.engine.contract import preset
from widgets.engine.host import Host
from widgets.engine.jobs import finished
from widgets.engine.registry import WIDGETS


def main(text):
    """The frames for {"frames": requests}, and where "jobs" says so the whole result of every job of every figure."""
    asked = json.loads(text)
    host = Host()
    frames = [host.frame(json.dumps(request)) for request in asked["frames"]]
    jobs = {
        f"{name} {job.name}": finished(job, preset(widget).controls, preset(widget).seed, "fig-x")
        for name, widget in WIDGETS.items()
        for job in widget.jobs
        if asked["jobs"]
    }
    return json.dumps({"frames": frames, "jobs": jobs})
