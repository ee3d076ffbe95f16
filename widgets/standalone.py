"""Panels as one SVG file that needs no page: side by side, each under its name, in the light theme's colours."""

from __future__ import annotations

from collections.abc import Sequence

from .picture import Panel
from .svg import panel_svg, written

GAP = 24.0  # px round and between the panels
HEAD = 26.0  # px for a panel's name above it

STYLE = """
text { font: 14px system-ui, sans-serif; fill: #1d2125; }
.plot path { fill: none; stroke-linejoin: round; stroke-linecap: round; vector-effect: non-scaling-stroke; }
.plot .label { font-size: 130px; }
.source { stroke: #c45d14; }
.target { stroke: #2760bd; }
.ghost { stroke: #7f7d75; }
.guide { stroke: #6a6e72; }
.ink { stroke: #1d2125; }
.label { stroke: none; }
.plot .line { stroke-width: 1.75px; }
.plot .square { stroke-width: 3.9px; stroke-linecap: square; }
.plot .dot { stroke-width: 4.5px; }
.w1 { opacity: 0.16; } .w2 { opacity: 0.3; } .w3 { opacity: 0.45; } .w4 { opacity: 0.6; } .w5 { opacity: 0.8; }
""".strip()


def document(panels: Sequence[Panel], title: str) -> str:
    """The text of an SVG file: the panels, each under its caption, on white."""
    x, highest, inside = GAP, 0.0, []
    for panel in panels:
        width, height = panel.view.size
        place = f'x="{x:g}" y="{GAP + HEAD:g}" width="{width:g}" height="{height:g}"'
        inside.append(f'<text x="{x:g}" y="{GAP + 12:g}">{written(panel.caption)}</text>')
        inside.append(f'<rect {place} fill="#f3f3ef"/>')
        inside.append(panel_svg(panel, panel.name).replace('<svg class="plot"', f'<svg class="plot" {place}', 1))
        x, highest = x + width + GAP, max(highest, height)
    w, h = f"{x:g}", f"{highest + HEAD + 2 * GAP:g}"
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {w} {h}" width="{w}" height="{h}">\n'
        f'<title>{written(title)}</title>\n<style>{STYLE}</style>\n<rect width="{w}" height="{h}" fill="#fff"/>\n'
        + "\n".join(inside)
        + "\n</svg>\n"
    )
