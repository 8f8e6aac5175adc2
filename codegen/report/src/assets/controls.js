// Controls. A disabled control shows why; controls that move the machine from rest must be held for a second.
const HELD = 1000;

const by = id => document.getElementById(id);

// Held for a second, by pointer or key.
function slow(button, act) {
  let since = null, frame = 0;
  const stop = () => { since = null; cancelAnimationFrame(frame); button.style.setProperty("--pressed", "0%"); };
  const go = now => {
    if (since === null || button.disabled) return stop();
    const part = (performance.now() - since) / HELD;
    button.style.setProperty("--pressed", Math.min(100, 100 * part) + "%");
    if (part >= 1) { stop(); act(); } else frame = requestAnimationFrame(go);
  };
  const start = () => { if (since === null && !button.disabled) { since = performance.now(); frame = requestAnimationFrame(go); } };
  button.addEventListener("pointerdown", e => { button.setPointerCapture(e.pointerId); start(); });
  for (const end of ["pointerup", "pointercancel", "blur"]) button.addEventListener(end, stop);
  button.addEventListener("keydown", e => { if (e.key === " " || e.key === "Enter") { e.preventDefault(); start(); } });
  button.addEventListener("keyup", stop);
}

// Enables a control, or disables it with a reason.
function allow(button, why, text) {
  button.disabled = why !== "";
  button.title = why;
  const line = button.querySelector("span");
  if (line) line.textContent = why || text || "";
}

function choose(box, act) {
  box.addEventListener("click", e => {
    const button = e.target.closest("button");
    if (!button) return;
    [...box.children].forEach(one => { one.classList.toggle("on", one === button); one.setAttribute("aria-pressed", String(one === button)); });
    act(button.dataset.value);
  });
}

const JOGS = [["+y", 2, 1, "y", 1], ["−x", 1, 2, "x", -1], ["+x", 3, 2, "x", 1], ["−y", 2, 3, "y", -1], ["+z", 5, 1, "z", 1], ["−z", 5, 3, "z", -1], ["−", 7, 1, "rx", -1], ["+", 9, 1, "rx", 1], ["−", 7, 2, "ry", -1], ["+", 9, 2, "ry", 1], ["−", 7, 3, "rz", -1], ["+", 9, 3, "rz", 1]];

// One step per press: in nm, or in nrad for an equal motion of the edge, ten per nm.
function jog(box, act) {
  const buttons = JOGS.map(([text, column, row, axis, sign]) => {
    const button = html("button", box, text);
    button.style.gridArea = row + " / " + column;
    button.setAttribute("aria-label", (sign > 0 ? "plus " : "minus ") + axis);
    button.addEventListener("click", () => act(axis, sign));
    return button;
  });
  ["x", "y", "z"].forEach((axis, k) => {
    const label = html("span", box);
    label.innerHTML = "θ<sub>" + axis + "</sub>";
    label.style.gridArea = k + 1 + " / 8";
  });
  return buttons;
}

// A factor from ×0.25 to ×8 on a log scale; the unstable part is marked as a limit.
class Gain {
  constructor(svg, margin) {
    [this.svg, this.margin, this.factor] = [svg, margin, 1];
    const at = e => { const box = svg.getBoundingClientRect(); this.set(this.from((e.clientX - box.left) / box.width)); };
    let held = false;
    svg.addEventListener("pointerdown", e => { held = true; svg.setPointerCapture(e.pointerId); at(e); });
    svg.addEventListener("pointermove", e => held && at(e));
    for (const end of ["pointerup", "pointercancel"]) svg.addEventListener(end, () => { held = false; });
    svg.addEventListener("keydown", e => {
      const by = { ArrowLeft: 1 / 1.05, ArrowDown: 1 / 1.05, ArrowRight: 1.05, ArrowUp: 1.05 }[e.key];
      if (!by) return;
      e.preventDefault();
      e.stopPropagation();
      this.set(this.factor * by);
    });
    this.set(1);
  }

  from(part) { return 0.25 * Math.pow(32, part); }
  to(factor) { return Math.log(factor / 0.25) / Math.log(32); }

  set(factor) {
    this.factor = Number(Math.min(8, Math.max(0.25, factor)).toPrecision(3));
    if (Math.abs(this.factor - 1) < 0.03) this.factor = 1;
    this.draw();
    if (this.changed) this.changed();
  }

  draw() {
    const { svg, margin } = this, wide = svg.clientWidth || 240, x = v => 6 + this.to(v) * (wide - 12), at = x(this.factor);
    svg.replaceChildren();
    svg.setAttribute("aria-valuenow", this.factor);
    element("rect", { x: 6, y: 13, width: wide - 12, height: 8, fill: "var(--track)" }, svg);
    element("rect", { x: 6, y: 13, width: Math.max(0, at - 6), height: 8, fill: "var(--blue)" }, svg);
    if (margin && margin < 8) {
      element("rect", { x: x(margin), y: 9, width: x(8) - x(margin), height: 16, fill: "var(--orange2)", stroke: "var(--orange)", "stroke-dasharray": "3 2" }, svg);
      element("line", { x1: x(margin), x2: x(margin), y1: 4, y2: 30, stroke: "var(--orange)", "stroke-width": 2 }, svg);
      element("text", { x: x(margin) + 5, y: 21, class: "orange" }, svg, "unstable");
      element("text", { x: x(margin), y: 44, class: "orange", "text-anchor": "middle" }, svg, "×" + number(Number(margin.toPrecision(3))));
    }
    for (const v of [0.25, 1, 2]) if (!margin || Math.abs(x(v) - x(margin)) > 34) element("text", { x: x(v), y: 44, "text-anchor": v === 0.25 ? "start" : "middle" }, svg, "×" + v);
    element("rect", { x: at - 6, y: 5, width: 12, height: 24, rx: 3, fill: "var(--card)", stroke: "var(--blue)", "stroke-width": 3 }, svg);
    element("text", { x: at, y: 0, "text-anchor": "middle", class: "strong" }, svg, "×" + this.factor);
  }
}
