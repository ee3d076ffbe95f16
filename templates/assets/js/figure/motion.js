// A motion from the old place to the new: Python gives the end pose and how it came about, the page moves the group.
import { calm } from "../base/dom.js";
import { limits } from "../base/limits.js";

const ease = (part) => 1 - (1 - part) ** 3;

/**
 * Starts the group at the inverse of the motion and lets it go to where it is drawn. A new frame ends it.
 * motion: turned by `turn` degrees about `about`, then moved by `shift`, in SVG units.
 */
export function startMotion(figure, { group, turn, about, shift }) {
  const moved = document.getElementById(group);
  if (calm() || !moved) return;
  const drawing = moved.ownerSVGElement;
  const began = performance.now();
  const length = figure.running ? Math.min(limits.run, limits.motion) : limits.motion;

  function draw(now) {
    const part = Math.min(1, Math.max(0, (now - began) / length));
    if (part === 1) {
      figure.moving.end();
      figure.tell();
      return;
    }
    const left = 1 - ease(part);
    const [x, y] = shift.map((value) => -value * left);
    moved.setAttribute("transform", `rotate(${-turn * left} ${about.join(" ")}) translate(${x} ${y})`);
    request = requestAnimationFrame(draw);
  }

  let request = 0;
  drawing.classList.add("moving");
  figure.moving = {
    end() {
      cancelAnimationFrame(request);
      moved.removeAttribute("transform");
      drawing.classList.remove("moving");
      figure.moving = null;
    },
  };
  draw(began);
}
