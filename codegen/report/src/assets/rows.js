// Rows on a common axis: dots with a line, or bars that add up on a squared axis.
class Rows {
  constructor(figure, data) {
    this.figure = figure;
    this.data = data;
    this.svg = element("svg", { role: "img", "aria-label": data.label || data.title }, figure);
    this.draw();
  }

  place(v) { return this.data.scale === "log" ? Math.log10(v) : this.data.scale === "square" ? v * v : v; }

  draw() {
    const { svg, data } = this, wide = Math.max(this.figure.clientWidth || 390, 240);
    const left = data.above ? 4 : Math.min(data.left || 118, wide * 0.34), right = wide < 380 ? Math.min(data.right || 16, 84) : data.right || 16;
    const top = (data.legend || data.band ? 22 : 4) + (data.head || []).length * 15, step = data.step || 32, y0 = top + step * data.rows.length + 4;
    svg.setAttribute("viewBox", "0 0 " + wide + " " + (y0 + 22));
    svg.replaceChildren();
    const a = this.place(data.range[0]), b = this.place(data.range[1]);
    const toX = v => left + (this.place(v) - a) / (b - a) * (wide - left - right);
    const inside = v => Math.min(Math.max(toX(v), left), wide - right);
    if (data.band) {
      const [p, q] = [inside(data.band.from), inside(data.band.to)];
      element("rect", { x: p, y: top, width: Math.max(2, q - p), height: y0 - top, fill: "var(--orange2)" }, svg);
      element("text", { x: (p + q) / 2, y: top - 7, "text-anchor": "middle", class: "orange" }, svg, data.band.text);
    }
    let last = -Infinity, end = null;
    const list = data.ticks ? data.ticks.map(v => [v, (data.prefix || "") + number(v)]) : ticks(a, b, data.scale === "log", 4).map(([v, text]) => [data.scale === "log" ? Math.pow(10, v) : v, text]);
    for (const [v, text] of list) {
      const p = toX(v);
      if (p < left - 1 || p > wide - right + 1) continue;
      element("line", { x1: p, x2: p, y1: top, y2: y0, class: "grid" }, svg);
      if (p - last < 6.5 * text.length + 8) continue;
      last = p;
      end = element("text", { x: p, y: y0 + 15, "text-anchor": "middle" }, svg, text);
    }
    if (end && data.unit) {
      end.textContent += "\u2009" + data.unit;
      if (last > wide - 44) Object.entries({ x: wide - 1, "text-anchor": "end" }).forEach(([key, value]) => end.setAttribute(key, value));
    }
    let legend = wide - 2;
    for (const one of (data.legend || []).slice().reverse()) {
      const label = element("text", { x: legend, y: top - 7, "text-anchor": "end", class: "strong" }, svg, one.text);
      legend -= (label.getComputedTextLength ? label.getComputedTextLength() : 30) + 10 || 40;
      this.mark(one.m, legend, top - 11, svg);
      legend -= 12;
    }
    let drawn = 0;
    data.rows.forEach((row, k) => { drawn += this.row(row, top + step * k + step / 2, { left, wide, right, toX, inside, step }); });
    this.figure.dataset.points = drawn;
  }

  row(row, y, { left, wide, right, toX, inside, step }) {
    const { svg, data } = this;
    if (row.box) element("rect", { x: 1, y: y - step / 2 + 1, width: wide - 2, height: step - 2, rx: 3, fill: "none", class: "ink", "stroke-width": 1.5 }, svg);
    element("text", { x: data.above ? left : row.box || data.left ? 6 : 0, y: data.above ? y - 6 : y + 4, class: "strong" }, svg, row.name);
    const at = data.above ? y + 7 : y;
    if (row.line) element("line", { x1: inside(row.line[0]), x2: inside(row.line[1]), y1: at, y2: at, stroke: row.over ? "var(--orange)" : "var(--s3)", "stroke-width": 2 }, svg);
    let drawn = 0;
    let edge = left;
    for (const part of row.parts || []) {
      const p = toX(part.from), q = toX(part.to), shade = part.shade;
      element("rect", { x: p, y: y - 13, width: Math.max(0, q - p - 1), height: 26, fill: "var(--s" + (shade + 1) + ")" }, svg);
      if (q - p > 34) element("text", { x: (p + q) / 2, y: y + 4, "text-anchor": "middle" }, svg, part.text).style.fill = shade < 2 ? "var(--on)" : shade === 2 ? "var(--on3)" : "var(--on4)";
      edge = q;
      drawn += 2;
    }
    if (row.total) {
      const p = toX(row.total.x);
      element("line", { x1: p, x2: p, y1: y - 16, y2: y + 16, class: "ink", "stroke-width": 2 }, svg);
      element("text", { x: Math.max(p, edge) + 7, y: y + 4, class: "strong halo" }, svg, row.total.text);
      drawn += 1;
    }
    for (const mark of row.marks || []) {
      const p = inside(mark.x);
      this.mark(mark.m, p, at, svg);
      drawn += 1;
      if (mark.text) element("text", { x: mark.before ? p - 9 : p + 9, y: at + 4, "text-anchor": mark.before ? "end" : "start", class: (mark.soft ? "" : "strong ") + "halo" }, svg, mark.text);
    }
    if (row.limit) {
      const p = inside(row.limit);
      element("line", { x1: p, x2: p, y1: at - 9, y2: at + 9, stroke: "var(--orange)", "stroke-width": 2 }, svg);
    }
    if (row.note) element("text", { x: row.notex ? inside(row.notex) + 12 : wide - (row.box ? 6 : 2), y: at + 4, "text-anchor": row.notex ? "start" : "end", class: row.box ? "strong" : "halo" }, svg, row.note);
    return Math.max(drawn, row.note ? 2 : 0);
  }

  mark(kind, x, y, parent) {
    const blue = "var(--blue)";
    if (kind === "dot") element("circle", { cx: x, cy: y, r: 4.5, fill: blue }, parent);
    else if (kind === "hollow") element("circle", { cx: x, cy: y, r: 4.5, fill: "var(--card)", stroke: blue, "stroke-width": 2 }, parent);
    else if (kind === "square") element("rect", { x: x - 6, y: y - 6, width: 12, height: 12, fill: "none", stroke: blue, "stroke-width": 2 }, parent);
    else element("path", { d: "M" + (x - 3) + " " + (y - 5) + "l8 5l-8 5z", fill: blue }, parent);
  }
}
