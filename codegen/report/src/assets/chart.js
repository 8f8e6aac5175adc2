"use strict";
// Charts of the report: drawn from data, zoomed by dragging, saved as CSV. No library.
const SVG = "http://www.w3.org/2000/svg";

function element(name, attributes, parent) {
  const made = document.createElementNS(SVG, name);
  for (const key of Object.keys(attributes)) made.setAttribute(key, attributes[key]);
  if (parent) parent.appendChild(made);
  return made;
}

function html(name, parent, text, kind) {
  const made = document.createElement(name);
  if (text) made.textContent = text;
  if (kind) made.className = kind;
  if (parent) parent.appendChild(made);
  return made;
}

// Values as they were written: even, scaled integers, or plain.
function values(packed) {
  if (Array.isArray(packed)) return packed.map(v => (v === null ? NaN : v));
  if (packed.v) return packed.v.map(v => v * packed.k);
  return Array.from({ length: packed.n }, (_, k) => packed.a + packed.d * k);
}

function ticks(low, high, log, wanted) {
  const list = [];
  if (log) {
    const span = high - low;
    const factors = span > 3.5 ? [1] : span > 1.2 ? [1, 3] : [1, 2, 3, 5, 7];
    for (let decade = Math.floor(low); decade <= Math.ceil(high); decade++)
      for (const factor of factors) {
        const at = decade + Math.log10(factor);
        if (at >= low && at <= high) list.push([at, factor * Math.pow(10, decade)]);
      }
    if (list.length > 1) return list.map(([at, v]) => [at, number(v)]);
    return ticks(Math.pow(10, low), Math.pow(10, high), false, wanted).map(([v, text]) => [Math.log10(v), text]);
  }
  const rough = (high - low) / wanted;
  const decade = Math.pow(10, Math.floor(Math.log10(rough)));
  const step = [1, 2, 5, 10].find(f => f * decade >= rough * 0.999) * decade;
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step && list.length < 30; k++) {
    const v = k * step;
    list.push([v, digits > 6 || Math.abs(v) >= 1e6 ? v.toExponential(1) : v.toFixed(digits)]);
  }
  return list;
}

function number(v) {
  if (!isFinite(v)) return "–";
  const size = Math.abs(v);
  if (v !== 0 && (size < 1e-3 || size >= 1e5)) return v.toExponential(2).replace("e+", "e");
  return String(Number(v.toPrecision(4)));
}

function axisText(axis) { return axis.unit ? axis.label + " (" + axis.unit + ")" : axis.label; }

class Chart {
  constructor(figure, data) {
    this.figure = figure;
    this.data = data;
    this.series = data.series.map(s => ({ ...s, x: values(s.x), y: values(s.y), off: false }));
    this.size = [460, 290];
    this.inner = { left: 62, right: 12, top: 12, bottom: 42 };
    this.svg = element("svg", { viewBox: "0 0 460 290", role: "img", "aria-label": data.title }, figure);
    this.bar = html("div", figure, "", "bar");
    this.keys();
    const csv = html("button", this.bar, "CSV", "tool");
    csv.title = "the points of this chart";
    csv.addEventListener("click", () => this.save());
    this.reset = html("button", this.bar, "whole", "tool");
    this.reset.addEventListener("click", () => this.zoom(null));
    this.read = html("div", this.bar, "", "read");
    this.hint = "drag to zoom, double click for the whole, hover to read";
    this.events();
    this.zoom(null);
  }

  keys() {
    for (const s of this.series) {
      const key = html("button", this.bar, "", "key");
      const sample = element("svg", { viewBox: "0 0 20 8" }, key);
      if (s.style === "dots") element("circle", { cx: 10, cy: 4, r: 3, fill: this.color(s) }, sample);
      else element("path", { d: "M0 4H20", stroke: this.color(s), "stroke-width": 2, "stroke-dasharray": s.style === "dash" ? "5 3" : "none" }, sample);
      html("span", key, s.name);
      key.addEventListener("click", () => {
        s.off = !s.off;
        key.classList.toggle("off", s.off);
        this.zoom(this.window);
      });
    }
  }

  color(s) { return "var(--c" + (s.color % 11) + ")"; }
  seen() { return this.series.filter(s => !s.off); }

  place(v, axis) { return axis.log ? (v > 0 ? Math.log10(v) : NaN) : v; }

  // Limits of x and y; without a window those of everything that is seen.
  limits(within) {
    const { x, y } = this.data;
    const of = (pick, keep) => {
      let low = Infinity, high = -Infinity;
      for (const s of this.seen())
        for (let k = 0; k < s.x.length; k++) {
          if (!keep(s, k)) continue;
          const v = pick(s, k);
          if (v < low) low = v;
          if (v > high) high = v;
        }
      if (!(low <= high)) [low, high] = [0, 1];
      if (high - low < 1e-12 * Math.max(Math.abs(low), Math.abs(high), 1e-30)) {
        const room = low === 0 ? 1 : 0.1 * Math.abs(low);
        [low, high] = [low - room, high + room];
      }
      return [low, high];
    };
    const px = (s, k) => this.place(s.x[k], x), py = (s, k) => this.place(s.y[k], y);
    if (within) return within;
    const wide = of(px, () => true), tall = of(py, () => true), room = 0.04 * (tall[1] - tall[0]);
    return [wide, [tall[0] - room, tall[1] + room]];
  }

  zoom(within) {
    this.window = within;
    this.range = this.limits(within);
    this.reset.style.visibility = within ? "visible" : "hidden";
    this.draw();
  }

  toX(v) { const [a, b] = this.range[0], i = this.inner; return i.left + (v - a) / (b - a) * (this.size[0] - i.left - i.right); }
  toY(v) { const [a, b] = this.range[1], i = this.inner; return this.size[1] - i.bottom - (v - a) / (b - a) * (this.size[1] - i.top - i.bottom); }
  fromX(p) { const [a, b] = this.range[0], i = this.inner; return a + (p - i.left) / (this.size[0] - i.left - i.right) * (b - a); }
  fromY(p) { const [a, b] = this.range[1], i = this.inner; return a + (this.size[1] - i.bottom - p) / (this.size[1] - i.top - i.bottom) * (b - a); }

  draw() {
    const { svg, inner, size, data } = this;
    svg.replaceChildren();
    const right = size[0] - inner.right, bottom = size[1] - inner.bottom;
    for (const [at, text] of ticks(this.range[0][0], this.range[0][1], data.x.log, 6)) {
      const p = this.toX(at);
      element("line", { x1: p, x2: p, y1: inner.top, y2: bottom, class: "grid" }, svg);
      element("text", { x: p, y: bottom + 16, "text-anchor": "middle" }, svg).textContent = text;
    }
    for (const [at, text] of ticks(this.range[1][0], this.range[1][1], data.y.log, 5)) {
      const p = this.toY(at);
      element("line", { x1: inner.left, x2: right, y1: p, y2: p, class: "grid" }, svg);
      element("text", { x: inner.left - 6, y: p + 4, "text-anchor": "end" }, svg).textContent = text;
    }
    const id = "clip-" + data.id;
    const clip = element("clipPath", { id }, svg);
    element("rect", { x: inner.left, y: inner.top, width: right - inner.left, height: bottom - inner.top }, clip);
    const lines = element("g", { "clip-path": "url" + "(#" + id + ")" }, svg);
    let drawn = 0;
    for (const s of this.seen()) drawn += this.curve(s, lines);
    element("rect", { x: inner.left, y: inner.top, width: right - inner.left, height: bottom - inner.top, class: "frame" }, svg);
    element("text", { x: (inner.left + right) / 2, y: size[1] - 6, "text-anchor": "middle" }, svg).textContent = axisText(data.x);
    element("text", { x: 13, y: (inner.top + bottom) / 2, "text-anchor": "middle", transform: "rotate(-90 13 " + (inner.top + bottom) / 2 + ")" }, svg).textContent = axisText(data.y);
    this.over = element("g", {}, svg);
    this.figure.dataset.points = drawn;
    this.read.textContent = this.hint;
  }

  curve(s, parent) {
    const { x, y } = this.data;
    let path = "", pen = false, drawn = 0, last = 0, travel = 0;
    for (let k = 0; k < s.x.length; k++) {
      const px = this.toX(this.place(s.x[k], x)), py = this.toY(this.place(s.y[k], y));
      if (!isFinite(px) || !isFinite(py)) { pen = false; continue; }
      drawn++;
      if (s.style === "dots") element("circle", { cx: px.toFixed(1), cy: py.toFixed(1), r: 3.5, fill: this.color(s) }, parent);
      else path += (pen ? "L" : "M") + px.toFixed(1) + " " + py.toFixed(1);
      if (pen) travel += Math.abs(py - last);
      last = py;
      pen = true;
    }
    // Noise fills a band: others have to be seen through it.
    const band = travel > 12000;
    if (path) element("path", { d: path, fill: "none", stroke: this.color(s), "stroke-opacity": band ? 0.5 : 1, "stroke-width": band ? 0.8 : s.style === "dash" ? 1.6 : 1.3, "stroke-dasharray": s.style === "dash" ? "6 4" : "none", "stroke-linejoin": "round" }, parent);
    return drawn;
  }

  // Place of the pointer in the units of the picture, held to the frame.
  at(event) {
    const box = this.svg.getBoundingClientRect(), i = this.inner;
    const x = (event.clientX - box.left) / box.width * this.size[0], y = (event.clientY - box.top) / box.height * this.size[1];
    return [Math.min(Math.max(x, i.left), this.size[0] - i.right), Math.min(Math.max(y, i.top), this.size[1] - i.bottom)];
  }

  events() {
    let from = null;
    this.svg.addEventListener("pointerdown", e => { from = this.at(e); this.svg.setPointerCapture(e.pointerId); });
    this.svg.addEventListener("pointermove", e => {
      const to = this.at(e);
      this.over.replaceChildren();
      if (from) {
        element("rect", { x: Math.min(from[0], to[0]), y: Math.min(from[1], to[1]), width: Math.abs(to[0] - from[0]), height: Math.abs(to[1] - from[1]), class: "box" }, this.over);
      } else this.tell(to);
    });
    this.svg.addEventListener("pointerup", e => {
      const to = this.at(e), start = from;
      from = null;
      this.over.replaceChildren();
      if (!start) return;
      const [wide, tall] = [Math.abs(to[0] - start[0]), Math.abs(to[1] - start[1])];
      if (wide < 6 && tall < 6) return;
      const sorted = (a, b) => (a < b ? [a, b] : [b, a]);
      // A flat or a narrow box zooms the one axis that it marks.
      this.zoom([wide < 6 ? this.range[0] : sorted(this.fromX(start[0]), this.fromX(to[0])), tall < 6 ? this.range[1] : sorted(this.fromY(start[1]), this.fromY(to[1]))]);
    });
    this.svg.addEventListener("pointercancel", () => { from = null; this.over.replaceChildren(); });
    this.svg.addEventListener("pointerleave", () => { if (!from) { this.over.replaceChildren(); this.read.textContent = this.hint; } });
    this.svg.addEventListener("dblclick", () => this.zoom(null));
  }

  // The nearest drawn point.
  tell([x, y]) {
    let best = null;
    for (const s of this.seen())
      for (let k = 0; k < s.x.length; k++) {
        const dx = this.toX(this.place(s.x[k], this.data.x)) - x, dy = this.toY(this.place(s.y[k], this.data.y)) - y;
        const d = dx * dx + dy * dy;
        if (d < (best ? best.d : Infinity)) best = { d, s, k, x: x + dx, y: y + dy };
      }
    if (!best) return;
    const i = this.inner;
    element("line", { x1: best.x, x2: best.x, y1: i.top, y2: this.size[1] - i.bottom, class: "cross" }, this.over);
    element("line", { x1: i.left, x2: this.size[0] - i.right, y1: best.y, y2: best.y, class: "cross" }, this.over);
    element("circle", { cx: best.x, cy: best.y, r: 3.5, fill: this.color(best.s) }, this.over);
    const unit = axis => (axis.unit ? " " + axis.unit : "");
    this.read.textContent = best.s.name + ": " + number(best.s.x[best.k]) + unit(this.data.x) + ", " + number(best.s.y[best.k]) + unit(this.data.y);
  }

  csv() {
    const quoted = text => (/[",\n]/.test(text) ? '"' + text.replace(/"/g, '""') + '"' : text);
    const rows = [["series", axisText(this.data.x), axisText(this.data.y)].map(quoted).join(",")];
    for (const s of this.series) for (let k = 0; k < s.x.length; k++) rows.push([quoted(s.name), Number(s.x[k].toPrecision(7)), Number(s.y[k].toPrecision(6))].join(","));
    return rows.join("\n") + "\n";
  }

  save() { download(this.data.id + ".csv", this.csv()); }
}

function download(name, text) {
  const link = document.createElement("a");
  link.href = "data:text/csv;charset=utf-8," + encodeURIComponent(text);
  link.download = name;
  link.click();
}
