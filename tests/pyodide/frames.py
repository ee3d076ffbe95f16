"""Requests frames from the figures, natively or in the page's Python, so that the same requests can be compared."""

import json

from widgets.engine.contract import preset
from widgets.engine.host import Host
from widgets.engine.jobs import finished
from widgets.engine.registry import WIDGETS


def main(text):
    """The frames for {"frames": requests} and, if "jobs" is true, the full result of every figure's jobs."""
    arguments = json.loads(text)
    host = Host()
    frames = [host.frame(json.dumps(request)) for request in arguments["frames"]]
    jobs = {
        f"{name} {job.name}": finished(job, preset(widget).controls, preset(widget).seed, "fig-x")
        for name, widget in WIDGETS.items()
        for job in widget.jobs
        if arguments["jobs"]
    }
    return json.dumps({"frames": frames, "jobs": jobs})
