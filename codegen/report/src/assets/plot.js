// A chart with one pair of axes: drawn at its available width, zoomed by dragging, read by hovering, saved as CSV.
const COLORS = ["--s1", "--s2", "--s3", "--s4", "--blue", "--ink", "--orange", "--edge"];

class Plot {
  constructor(figure, data, options) {
    this.figure = figure;
    this.data = data;
    this.options = Object.assign({ height: data.height || 300 }, options);
    this.series = data.series.map(s => ({ ...s, x: values(s.x), y: values(s.y), off: false }));
    this.small = !!this.options.small;
    const named = this.series.filter(s => s.name);
    this.ends = !data.keys && named.length > 0 && named.length <= 4;
    this.svg = element("svg", { role: "img", "aria-label": data.label || data.title }, figure);
    if (!this.small) {
      const tools = html("div", figure, "", "aside");
      this.read = html("span", tools, "", "read");
      this.reset = html("button", tools, "Whole");
      this.reset.addEventListener("click", () => this.zoom(null));
      const csv = html("button", tools, "CSV", "csv");
      csv.title = "points of this figure";
      csv.addEventListener("click", () => download(data.id + ".csv", this.csv()));
      if (!this.ends && named.length > 1) {
        this.bar = html("div", figure, "", "bar");
        this.keys();
      }
      this.hint = "";
      this.events();
    }
    this.zoom(null);
  }

  keys() {
    for (const s of this.series.filter(s => s.name)) {
      const key = html("button", this.bar, "", "key");
      const sample = element("svg", { viewBox: "0 0 20 8" }, key);
      if (s.style === "dots") element("circle", { cx: 10, cy: 4, r: 3, fill: this.color(s) }, sample);
      else element("path", { d: "M0 4H20", stroke: this.color(s), "stroke-width": 2, "stroke-dasharray": s.style === "dash" ? "5 3" : "none" }, sample);
      html("span", key, s.name);
      key.addEventListener("click", () => { s.off = !s.off; key.classList.toggle("off", s.off); this.zoom(this.window); });
    }
  }

  color(s) { return "var(" + COLORS[s.color % COLORS.length] + ")"; }
  seen() { return this.series.filter(s => !s.off); }
  place(v, axis) { return axis.log ? (v > 0 ? Math.log10(v) : NaN) : v; }

  // Limits of x and y; without zoom, those of all visible data.
  limits() {
    const { x, y, y_limits } = this.data;
    const of = pick => {
      let low = Infinity, high = -Infinity;
      for (const s of this.seen()) for (let k = 0; k < s.x.length; k++) {
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
    const wide = of((s, k) => this.place(s.x[k], x));
    if (this.options.range || y_limits) return [wide, (this.options.range || y_limits).map(v => this.place(v, y))];
    const tall = of((s, k) => this.place(s.y[k], y)), room = 0.05 * (tall[1] - tall[0]);
    return [wide, [tall[0] - room, tall[1] + room]];
  }

  zoom(within) {
    this.window = within;
    this.range = within || this.limits();
    if (this.reset) this.reset.style.display = within ? "" : "none";
    this.draw();
  }

  span(k) { const i = this.inner; return k ? [this.size[1] - i.bottom, i.top] : [i.left, this.size[0] - i.right]; }
  to(k, v) { const [a, b] = this.range[k], [p, q] = this.span(k); return p + (v - a) / (b - a) * (q - p); }
  from(k, at) { const [a, b] = this.range[k], [p, q] = this.span(k); return a + (at - p) / (q - p) * (b - a); }
  toX(v) { return this.to(0, this.place(v, this.data.x)); }
  toY(v) { return this.to(1, this.place(v, this.data.y)); }

  draw() {
    const { svg, data, small } = this;
    const wide = Math.max(this.figure.clientWidth || (small ? 236 : 560), 120);
    const narrow = wide < 420, notes = data.notes || [];
    const right = notes.some(n => n.k === "band" || n.k === "level") || this.ends;
    this.size = [wide, small ? 116 : narrow ? Math.min(this.options.height, 260) : this.options.height];
    this.inner = small ? { left: 42, right: 10, top: 14, bottom: 20 } : { left: 58, right: right ? (narrow ? 84 : 100) : 14, top: 14, bottom: data.bare ? 8 : 26 };
    svg.setAttribute("viewBox", "0 0 " + this.size.join(" "));
    svg.replaceChildren();
    const [x0, x1] = this.span(0), [y0, y1] = this.span(1);
    this.defs(x0, x1, y0, y1);
    this.behind(notes, x0, x1, y0, y1);
    let last = -Infinity;
    for (const [at, text] of ticks(...this.range[0], data.x.log, small ? 3 : narrow ? 4 : 6)) {
      const p = this.to(0, at);
      if (!small) element("line", { x1: p, x2: p, y1: y1, y2: y0, class: "grid" }, svg);
      if (data.bare || p - last < 7 * text.length + 6 || (!small && !right && p > x1 - 24)) continue;
      last = p;
      element("text", { x: p, y: y0 + 16, "text-anchor": "middle" }, svg, text);
    }
    if (!small && !data.bare) element("text", { x: right ? x1 + 14 : x1 + 4, y: y0 + 16, "text-anchor": right ? "start" : "end" }, svg, data.x.unit || data.x.label);
    const rows = small && this.options.range ? [this.range[1][0], 0, this.range[1][1]].filter((v, k) => k !== 1 || this.range[1][0] < 0 && this.range[1][1] > 0).map(v => [v, data.y.log ? number(Math.pow(10, v)) : number(v)]) : ticks(...this.range[1], data.y.log, small ? 2 : this.size[1] < 170 ? 3 : 5);
    for (const [at, text] of rows) {
      const p = this.to(1, at);
      element("line", { x1: x0, x2: x1, y1: p, y2: p, class: at === 0 && !data.y.log ? "axis" : "grid" }, svg);
      element("text", { x: x0 - 6, y: p + 4, "text-anchor": "end" }, svg, text);
    }
    if (!small) element("text", { "text-anchor": "middle", transform: "translate(11 " + (y0 + y1) / 2 + ") rotate(-90)" }, svg, axisText(data.y));
    const lines = element("g", { "clip-path": "url" + "(#" + this.clip + ")" }, svg);
    const travel = this.seen().map(s => this.travel(s));
    const bands = travel.filter(t => t > 8000).length;
    let drawn = 0;
    this.seen().forEach((s, k) => { drawn += travel[k] > 8000 && bands > 1 ? this.outline(s, lines) : this.curve(s, lines); });
    this.before(notes, x0, x1, y0, y1);
    this.over = element("g", {}, svg);
    this.figure.dataset.points = (Number(this.figure.dataset.points) || 0) + drawn;
    if (this.read) this.read.textContent = this.hint;
  }

  defs(x0, x1, y0, y1) {
    this.clip = "clip-" + this.data.id + (this.small ? "-s" : "-l") + (this.options.tag || "");
    const clip = element("clipPath", { id: this.clip }, this.svg);
    // Dots at the edge are not clipped.
    const room = this.data.series.every(s => s.style === "dots") ? 4 : 0;
    element("rect", { x: x0 - room, y: y1 - 1 - room, width: Math.max(x1 - x0, 1) + 2 * room, height: y0 - y1 + 2 + 2 * room }, clip);
  }

  // Bands: the usual range, and the range beyond a limit.
  behind(notes, x0, x1, y0, y1) {
    for (const n of notes) {
      if (n.k === "band") {
        const [a, b] = n.y.map(v => this.toY(v));
        const top = Math.max(Math.min(a, b), y1), bottom = Math.min(Math.max(a, b), y0);
        if (bottom > top) element("rect", { x: x0, y: top, width: x1 - x0, height: bottom - top, fill: "var(--blue2)" }, this.svg);
      } else if (n.k === "beyond") {
        const p = Math.min(Math.max(this.toY(n.y), y1), y0), up = n.up;
        element("rect", { x: x0, y: up ? y1 : p, width: x1 - x0, height: Math.max(0, up ? p - y1 : y0 - p), fill: "var(--orange2)" }, this.svg);
        element("line", { x1: x0, x2: x1, y1: p, y2: p, stroke: "var(--orange)" }, this.svg);
        if (!this.small) element("text", { x: x0 + 6, y: up ? p - 5 : p + 14, class: "orange halo" }, this.svg, n.text);
      }
    }
  }

  // Events, rings, segments and the labels on the right.
  before(notes, x0, x1, y0, y1) {
    const { svg, small } = this, labels = [];
    for (const n of notes) {
      if (n.k === "cause" && !small) {
        const p = this.toX(n.x);
        if (!(p >= x0 && p <= x1)) continue;
        element("line", { x1: p, x2: p, y1: y1, y2: y0, stroke: "var(--orange)", "stroke-width": 1.5, "stroke-dasharray": "4 3" }, svg);
        if (n.text) element("text", { x: p > (x0 + x1) / 2 ? p - 5 : p + 5, y: y0 - 6, "text-anchor": p > (x0 + x1) / 2 ? "end" : "start", class: "orange halo" }, svg, n.text);
      } else if (n.k === "ring" && !small) {
        const p = this.toX(n.x), q = this.toY(n.y);
        if (!(p >= x0 && p <= x1 && q >= y1 - 1 && q <= y0 + 1)) continue;
        element("circle", { cx: p, cy: q, r: 4, fill: "none", class: "ink", "stroke-width": 1.5 }, svg);
        const left = p > x1 - 130;
        element("text", { x: left ? p - 9 : p + 9, y: q + 4, "text-anchor": left ? "end" : "start", class: "strong halo" }, svg, n.text);
      } else if (n.k === "segment") {
        const p = this.toX(n.x), [a, b] = n.y.map(v => this.toY(v));
        element("line", { x1: p, x2: p, y1: a, y2: b, class: "ink", "stroke-width": 3 }, svg);
        const left = p > (x0 + x1) / 2 + 20;
        element("text", { x: left ? p - 8 : p + 8, y: (a + b) / 2 + 4, "text-anchor": left ? "end" : "start", class: "strong halo" }, svg, n.text);
      } else if (n.k === "modes" && !small) {
        let last = -Infinity;
        n.x.forEach((v, k) => {
          const p = this.toX(v);
          if (!(p >= x0 && p <= x1)) return;
          element("line", { x1: p, x2: p, y1: y0, y2: y0 - 7, class: "axis", "stroke-width": 2 }, svg);
          if (p - last < 14) return;
          last = p;
          element("text", { x: p, y: y0 - 10, "text-anchor": "middle", class: "halo" }, svg, n.text[k]);
        });
        labels.push([y0 - 6, "modes", ""]);
      } else if (n.k === "band" && !small) {
        const [low, high] = n.y;
        for (const [v, text] of [[high, n.text[0]], [low, n.text[1]]]) if (text) labels.push([this.toY(v), text, "blue"]);
      } else if (n.k === "level" && !small) {
        const p = this.toY(n.y);
        element("line", { x1: x0, x2: x1, y1: p, y2: p, class: "axis" }, svg);
        labels.push([p, n.text, "strong"]);
      }
    }
    if (this.ends && !small) for (const s of this.seen()) {
      if (!s.name) continue;
      let k = s.x.length - 1;
      while (k >= 0 && !isFinite(this.toX(s.x[k]) + this.toY(s.y[k]))) k--;
      if (k >= 0) labels.push([Math.min(Math.max(this.toY(s.y[k]), y1), y0), s.name, "", this.color(s)]);
    }
    for (const [y, text, kind, fill] of apart(labels, 15, y1 + 2, y0)) {
      const label = element("text", { x: x1 + 6, y: y + 4, class: kind || "strong" }, svg, text);
      if (fill) label.style.fill = fill;
    }
    if (small && this.data.short) element("text", { x: x1, y: 12, "text-anchor": "end", class: "strong halo" }, svg, this.data.short);
  }

  // Vertical length of a curve, px: noise fills a band.
  travel(s) {
    if (s.style !== "line") return 0;
    let sum = 0, last = NaN;
    for (let k = 0; k < s.x.length; k++) {
      const p = this.toY(s.y[k]);
      if (isFinite(p) && isFinite(last)) sum += Math.abs(p - last);
      last = p;
    }
    return sum;
  }

  curve(s, parent) {
    let path = "", pen = false, drawn = 0;
    for (let k = 0; k < s.x.length; k++) {
      const px = this.toX(s.x[k]), py = this.toY(s.y[k]);
      if (!isFinite(px) || !isFinite(py)) { pen = false; continue; }
      drawn++;
      if (s.style === "dots") element("circle", { cx: px.toFixed(1), cy: py.toFixed(1), r: 3.5, fill: this.color(s) }, parent);
      else path += (pen ? "L" : "M") + px.toFixed(1) + " " + py.toFixed(1);
      pen = true;
    }
    const dash = s.style === "dash";
    if (path) element("path", { d: path, fill: "none", stroke: this.color(s), "stroke-width": this.small ? 1 : s.style === "wide" ? 3 : 1.5, "stroke-dasharray": dash ? "4 3" : "none", "stroke-linejoin": "round" }, parent);
    return drawn;
  }

  // Where bands overlap, each is drawn as two lines, minimum and maximum, so that all are visible.
  outline(s, parent) {
    const step = Math.max(2, Math.ceil(s.x.length / (this.size[0] / 4)));
    let low = "", high = "", drawn = 0;
    for (let k = 0; k < s.x.length; k += step) {
      const part = s.y.slice(k, k + step).map(v => this.toY(v)).filter(isFinite), px = this.toX(s.x[k]);
      if (!part.length || !isFinite(px)) continue;
      drawn += part.length;
      low += (low ? "L" : "M") + px.toFixed(1) + " " + Math.max(...part).toFixed(1);
      high += (high ? "L" : "M") + px.toFixed(1) + " " + Math.min(...part).toFixed(1);
    }
    element("path", { d: low + high, fill: "none", stroke: this.color(s), "stroke-width": 1 }, parent);
    return drawn;
  }

  // Pointer position in the picture, clipped to the frame.
  at(event) {
    const box = this.svg.getBoundingClientRect(), [x0, x1] = this.span(0), [y0, y1] = this.span(1);
    const x = (event.clientX - box.left) / box.width * this.size[0], y = (event.clientY - box.top) / box.height * this.size[1];
    return [Math.min(Math.max(x, x0), x1), Math.min(Math.max(y, y1), y0)];
  }

  events() {
    let start = null;
    this.svg.addEventListener("pointerdown", e => { start = this.at(e); this.svg.setPointerCapture(e.pointerId); });
    this.svg.addEventListener("pointermove", e => {
      const to = this.at(e);
      this.over.replaceChildren();
      if (start) element("rect", { x: Math.min(start[0], to[0]), y: Math.min(start[1], to[1]), width: Math.abs(to[0] - start[0]), height: Math.abs(to[1] - start[1]), class: "box" }, this.over);
      else this.tell(to);
    });
    this.svg.addEventListener("pointerup", e => {
      const to = this.at(e), from = start;
      start = null;
      this.over.replaceChildren();
      if (!from) return;
      const size = [0, 1].map(k => Math.abs(to[k] - from[k]));
      if (size[0] < 6 && size[1] < 6) return;
      const sorted = (a, b) => (a < b ? [a, b] : [b, a]);
      // A narrow box zooms only along its long axis.
      this.zoom([0, 1].map(k => (size[k] < 6 ? this.range[k] : sorted(this.from(k, from[k]), this.from(k, to[k])))));
    });
    this.svg.addEventListener("pointercancel", () => { start = null; this.over.replaceChildren(); });
    this.svg.addEventListener("pointerleave", () => { if (!start) { this.over.replaceChildren(); this.read.textContent = this.hint; } });
    this.svg.addEventListener("dblclick", () => this.zoom(null));
  }

  // The nearest drawn point.
  tell([x, y]) {
    let best = null;
    for (const s of this.seen()) for (let k = 0; k < s.x.length; k++) {
      const dx = this.toX(s.x[k]) - x, dy = this.toY(s.y[k]) - y, d = dx * dx + dy * dy;
      if (d < (best ? best.d : Infinity)) best = { d, s, k, x: x + dx, y: y + dy };
    }
    if (!best) return;
    const [x0, x1] = this.span(0), [y0, y1] = this.span(1);
    element("line", { x1: best.x, x2: best.x, y1: y1, y2: y0, class: "cross" }, this.over);
    element("line", { x1: x0, x2: x1, y1: best.y, y2: best.y, class: "cross" }, this.over);
    element("circle", { cx: best.x, cy: best.y, r: 3.5, fill: this.color(best.s) }, this.over);
    const unit = axis => (axis.unit ? "\u2009" + axis.unit : "");
    this.read.textContent = (best.s.name ? best.s.name + ": " : "") + number(best.s.x[best.k]) + unit(this.data.x) + ", " + number(best.s.y[best.k]) + unit(this.data.y);
  }

  csv() {
    const rows = [["series", axisText(this.data.x), axisText(this.data.y)].map(quoted).join(",")];
    for (const s of this.series) for (let k = 0; k < s.x.length; k++) rows.push([quoted(s.name || this.data.title), Number(s.x[k].toPrecision(7)), Number(s.y[k].toPrecision(6))].join(","));
    return rows.join("\n") + "\n";
  }
}
