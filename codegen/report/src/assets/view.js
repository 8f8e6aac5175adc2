// The platform in parallel projection, with rotation, zoom and playback of a motion; or live.
const VIEWS = { "3-D": [-0.62, 0.42], top: [0, Math.PI / 2], front: [0, 0], side: [-Math.PI / 2, 0] };

class View {
  constructor(figure, data) {
    this.figure = figure;
    this.data = data;
    this.poses = data.poses || [];
    this.frame = 0;
    this.playing = false;
    this.bars = this.poses.length > 1;
    this.svg = element("svg", { role: "img", tabindex: 0, "aria-label": data.label + " Arrow keys rotate, plus and minus zoom, 0 resets" + (this.bars ? ", space plays." : ".") }, figure);
    const bar = html("div", figure, "", "bar");
    const choice = html("span", bar, "", "choice");
    this.buttons = Object.keys(VIEWS).map(name => {
      const button = html("button", choice, name);
      button.addEventListener("click", () => { this.turn = [...VIEWS[name]]; this.draw(); });
      return [name, button];
    });
    const near = html("span", bar);
    for (const [text, title, act] of [["\u2212", "zoom out", () => this.nearer(1 / 1.25)], ["+", "zoom in", () => this.nearer(1.25)], ["Reset", "reset view", () => this.start()]]) {
      const button = html("button", near, text);
      button.title = title;
      button.addEventListener("click", act);
      near.append(" ");
    }
    if (this.bars) {
      const controls = html("span", bar);
      this.button = html("button", controls, "Play");
      this.button.addEventListener("click", () => this.play(!this.playing));
      this.time = this.slider(controls, " time", 0, this.poses.length - 1, 0, 1, v => { this.play(false); this.frame = v; });
      this.by = Math.log10(this.largest());
      this.slider(controls, " magnification", 0, 4.3, this.by, 0.02, v => { this.by = v; });
      this.read = html("div", bar, "", "read");
    }
    this.events();
    this.start();
  }

  // A round factor that magnifies the largest motion to a fifth of the height.
  largest() {
    const far = Math.max(1, ...this.poses.flatMap(p => p.slice(0, 3).map(Math.abs))) * 1e-9;
    const factor = this.data.height / 5 / far, decade = Math.pow(10, Math.floor(Math.log10(factor)));
    return Math.max(1, Math.min(20000, Math.floor(factor / decade) * decade));
  }

  start() {
    this.turn = [...VIEWS["3-D"]];
    this.zoom = 1;
    this.frame = 0;
    if (this.time) this.time.value = 0;
    this.play(false);
    this.draw();
  }

  nearer(factor) { this.zoom = Math.min(Math.max(this.zoom * factor, 0.5), 8); this.draw(); }

  slider(parent, name, min, max, value, step, set) {
    const label = html("label", parent, name + " "), input = html("input", label);
    Object.assign(input, { type: "range", min, max, step, value });
    input.addEventListener("input", () => { set(Number(input.value)); this.draw(); });
    return input;
  }

  play(on) {
    if (this.button) this.button.textContent = on ? "Pause" : "Play";
    if (this.playing === on) return;
    this.playing = on;
    let last = null;
    const next = now => {
      if (!this.playing) return;
      if (last !== null) {
        // Play the whole path in at least five seconds.
        this.frame += (now - last) / 1000 / this.data.step / Math.max(1, 5 / (this.data.step * this.poses.length));
        if (this.frame >= this.poses.length) this.frame = 0;
        this.time.value = Math.floor(this.frame);
        this.draw();
      }
      last = now;
      requestAnimationFrame(next);
    };
    if (on) requestAnimationFrame(next);
  }

  tilt(by) { this.turn[1] = Math.min(Math.max(this.turn[1] + by, -Math.PI / 2), Math.PI / 2); }

  events() {
    let from = null;
    this.svg.addEventListener("pointerdown", e => { from = [e.clientX, e.clientY]; this.svg.setPointerCapture(e.pointerId); });
    this.svg.addEventListener("pointermove", e => {
      if (!from) return;
      this.turn[0] += (e.clientX - from[0]) * 0.008;
      this.tilt((e.clientY - from[1]) * 0.008);
      from = [e.clientX, e.clientY];
      this.draw();
    });
    for (const end of ["pointerup", "pointercancel"]) this.svg.addEventListener(end, () => { from = null; });
    const keys = { ArrowLeft: () => { this.turn[0] -= 0.1; }, ArrowRight: () => { this.turn[0] += 0.1; }, ArrowUp: () => this.tilt(-0.1), ArrowDown: () => this.tilt(0.1), "+": () => this.nearer(1.25), "=": () => this.nearer(1.25), "-": () => this.nearer(0.8), "0": () => this.start(), " ": () => this.bars && this.play(!this.playing) };
    this.svg.addEventListener("keydown", e => {
      if (!keys[e.key]) return;
      e.preventDefault();
      keys[e.key]();
      this.draw();
    });
  }

  // R = Rz Ry Rx of the magnified angles, about the origin of the platform.
  moved(p, pose) {
    const [a, b, c] = pose.slice(3);
    let [x, y, z] = p;
    [y, z] = [y * Math.cos(a) - z * Math.sin(a), y * Math.sin(a) + z * Math.cos(a)];
    [x, z] = [x * Math.cos(b) + z * Math.sin(b), z * Math.cos(b) - x * Math.sin(b)];
    [x, y] = [x * Math.cos(c) - y * Math.sin(c), x * Math.sin(c) + y * Math.cos(c)];
    return [x + pose[0], y + pose[1], z + pose[2] + this.data.height];
  }

  // Right, down, depth.
  project([x, y, z]) {
    const [turn, tilt] = this.turn;
    const u = x * Math.cos(turn) - y * Math.sin(turn), v = x * Math.sin(turn) + y * Math.cos(turn), w = z - this.data.height / 2;
    return [this.center[0] + u * this.scale, this.center[1] - (w * Math.cos(tilt) + v * Math.sin(tilt)) * this.scale, v * Math.cos(tilt) - w * Math.sin(tilt)];
  }

  path(points) { return "M" + points.map(p => p[0].toFixed(1) + " " + p[1].toFixed(1)).join("L") + "Z"; }

  // A round plate: the outline of both faces, then the upper face.
  plate(place, radius, thick, style) {
    const ring = dz => Array.from({ length: 72 }, (_, k) => this.project(place([radius * Math.cos(k * Math.PI / 36), radius * Math.sin(k * Math.PI / 36), dz])));
    const top = ring(0), bottom = ring(-thick);
    element("path", { d: this.path(hull(top.concat(bottom))), fill: style.side, stroke: style.edge, "stroke-dasharray": style.dash || "none" }, this.svg);
    element("path", { d: this.path(this.turn[1] < 0 ? bottom : top), fill: style.face, stroke: style.edge, "stroke-width": style.width || 1, "stroke-dasharray": style.dash || "none" }, this.svg);
  }

  line(a, b, attributes) { return element("line", Object.assign({ x1: a[0], y1: a[1], x2: b[0], y2: b[1] }, attributes), this.svg); }

  arrow(a, b, color, width) {
    this.line(a, b, { stroke: color, "stroke-width": width });
    const length = Math.hypot(b[0] - a[0], b[1] - a[1]);
    if (length < 6) return;
    const [u, v] = [(b[0] - a[0]) / length, (b[1] - a[1]) / length], size = 3 + 2 * width;
    element("path", { d: this.path([[b[0] + u * 2, b[1] + v * 2], [b[0] - u * size - v * size / 2, b[1] - v * size + u * size / 2], [b[0] - u * size + v * size / 2, b[1] - v * size - u * size / 2]]), fill: color }, this.svg);
  }

  text(x, y, text, kind, anchor, more) { return element("text", Object.assign({ x, y, class: kind, "text-anchor": anchor || "middle" }, more), this.svg, text); }

  draw() {
    const { data, svg } = this, radius = p => Math.max(...p.map(q => Math.hypot(q[0], q[1])));
    const wide = Math.max(this.figure.clientWidth || 396, 260), aside = this.bars && wide > 640 ? 320 : 0;
    const tall = Math.min(420, Math.max(300, (wide - aside) * 1.02));
    svg.setAttribute("viewBox", "0 0 " + wide + " " + (tall + (this.bars && !aside ? 170 : 0)));
    svg.replaceChildren();
    const rb = radius(data.base), rp = radius(data.platform), reach = Math.max(rb, rp);
    // Leave room above for a magnified pose.
    const rise = Math.max(0, data.ghost ? data.ghost[2] : 0, data.live || 0);
    this.scale = this.zoom * Math.min((wide - aside - 96) / (2 * reach), (tall - 96) / (data.height + rise + 0.9 * rb + 0.1 * rp));
    this.center = [(wide - aside) / 2 - 14, tall / 2 + 6 * this.zoom + rise * this.scale / 2];
    const frame = Math.min(Math.floor(this.frame), Math.max(0, this.poses.length - 1));
    const pose = this.poses[frame] || [0, 0, 0, 0, 0, 0], factor = this.bars ? Math.pow(10, this.by) : 1;
    const drawn = this.bars ? pose.map(v => v * 1e-9 * factor) : data.pose || pose;
    const bad = data.bad || {};
    const on = p => this.moved(p, drawn), thick = 0.06 * rb;
    this.plate(p => p, rb * 1.02, thick, { side: "var(--track)", face: "var(--page)", edge: "var(--edge)" });
    this.axes(0.34 * data.height);
    const base = data.base.map(p => this.project(p)), top = data.platform.map(p => this.project(on(p)));
    const legs = base.map((p, k) => [p, top[k], k]).sort((a, b) => b[0][2] + b[1][2] - a[0][2] - a[1][2]);
    const between = (a, b, t) => [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t];
    for (const [from, to, k] of legs) {
      const color = (bad.legs || []).includes(k) ? "var(--orange)" : null, middle = between(from, to, 0.55);
      this.line(from, to, { stroke: "var(--card)", "stroke-width": 10 });
      this.line(from, to, { stroke: color || "var(--ink2)", "stroke-width": 3 });
      this.line(from, middle, { stroke: color || "var(--edge)", "stroke-width": 7 });
      element("circle", { cx: from[0], cy: from[1], r: 4.5, fill: "var(--card)", class: "ink" }, svg);
    }
    this.plate(on, rp * 1.02, thick * 0.7, { side: "var(--track)", face: "var(--blue2)", edge: "var(--blue)", width: 1.5 });
    for (const [from, to, k] of legs) {
      const at = between(from, to, k % 2 ? 0.34 : 0.4), color = (bad.legs || []).includes(k) ? "var(--orange)" : "var(--edge)";
      element("circle", { cx: at[0], cy: at[1], r: 8.5, fill: "var(--card)", stroke: color }, svg);
      this.text(at[0], at[1] + 4, String(k), "strong");
    }
    if (this.turn[1] > 1.5 && !data.live) { this.joints("B", base); this.joints("P", top); }
    if (data.part) this.box(on, data.part, 0.26 * rp);
    if (!data.ghost) this.gauges(0.42 * rp, bad.gauges || []);
    if (data.live) this.plate(p => this.moved(p, [0, 0, 0, 0, 0, 0]), rp * 1.02, 0, { side: "none", face: "none", edge: "var(--ink2)", dash: "5 3", width: 1.5 });
    if (data.ghost) this.plate(p => this.moved(p, data.ghost), rp * 1.02, 0, { side: "none", face: "none", edge: "var(--orange)", dash: "5 3", width: 1.5 });
    if (this.bars) {
      this.way(frame, factor);
      const legsAt = aside ? [wide - aside + 50, 60, aside - 110] : [40, tall + 10, wide - 110];
      this.strokes(data.legs[frame], ...legsAt, aside ? 40 : 24);
      const at = k => pose.slice(k, k + 3).map(v => number(v / 1000)).join(", ");
      this.read.textContent = "t = " + (frame * data.step).toFixed(3) + " s: x, y, z = " + at(0) + " µm; θx, θy, θz = " + at(3) + " µrad. Motion magnified " + number(factor) + " times.";
    } else if (!data.live) this.dimensions(rb, rp, on);
    for (const [k, text] of (data.texts || []).entries()) this.text(8, 16 + 17 * k, text, "orange halo", "start");
    for (const [name, button] of this.buttons) button.classList.toggle("on", VIEWS[name].every((v, k) => Math.abs(v - this.turn[k]) < 1e-9));
    this.figure.dataset.points = 12 + this.poses.length;
  }

  // Names of joints from above: outside their circle, away from the other joint of a pair.
  joints(body, places) {
    const unit = (from, to) => { const d = [to[0] - from[0], to[1] - from[1]], l = Math.hypot(...d) || 1; return [d[0] / l, d[1] / l]; };
    const centre = this.project([0, 0, 0]);
    places.forEach((p, k) => {
      const far = q => q === p ? Infinity : Math.hypot(q[0] - p[0], q[1] - p[1]);
      const near = places.reduce((best, q) => far(q) < far(best) ? q : best, places[k ? 0 : 1]);
      const out = unit(centre, p), away = unit(near, p);
      this.text(p[0] + 13 * out[0] + 8 * away[0], p[1] + 13 * out[1] + 8 * away[1] + 4, body + k, "halo");
    });
  }

  axes(length) {
    const from = this.project([0, 0, 0]);
    for (const [name, p] of [["x", [length, 0, 0]], ["y", [0, length, 0]], ["z", [0, 0, length]]]) {
      const to = this.project(p);
      if (Math.hypot(to[0] - from[0], to[1] - from[1]) < 8) continue;
      this.arrow(from, to, "var(--ink2)", 1);
      this.text(to[0] + (to[0] - from[0]) * 0.18, to[1] + (to[1] - from[1]) * 0.18 + 4, name, "");
    }
  }

  // Fixed in the base frame, beside the platform.
  gauges(length, bad) {
    (this.data.gauges || []).forEach((gauge, k) => {
      const color = bad.includes(k) ? "var(--orange)" : "var(--blue)";
      const a = this.project(gauge.p), b = this.project(gauge.p.map((v, i) => v + gauge.d[i] * length));
      element("circle", { cx: a[0], cy: a[1], r: 4, fill: color }, this.svg);
      this.arrow(a, b, color, 2);
      const size = Math.hypot(b[0] - a[0], b[1] - a[1]), [u, v] = size > 6 ? [(b[0] - a[0]) / size, (b[1] - a[1]) / size] : [0.7, -0.7];
      // At the tail of an arrow that points away, so that labels do not overlap.
      const [x, y] = b[2] > a[2] + 1e-6 && Math.abs(gauge.d[2]) < 0.7 ? [a[0] - u * 14, a[1] - v * 14] : [b[0] + u * 13, b[1] + v * 13];
      this.text(x, y + 4, "G" + k, (bad.includes(k) ? "orange" : "blue") + " halo");
    });
  }

  // The work part: visible faces.
  box(on, [cx, cy, cz], size) {
    const corner = (i, j, k) => this.project(on([cx + (i - 0.5) * size, cy + (j - 0.5) * size, cz + k * size]));
    const faces = [[[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], [[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]], [[1, 0, 0], [1, 1, 0], [1, 1, 1], [1, 0, 1]], [[1, 1, 0], [0, 1, 0], [0, 1, 1], [1, 1, 1]], [[0, 1, 0], [0, 0, 0], [0, 0, 1], [0, 1, 1]], [[0, 1, 0], [1, 1, 0], [1, 0, 0], [0, 0, 0]]];
    for (const face of faces) {
      const p = face.map(c => corner(...c));
      const turn = (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[1][1] - p[0][1]) * (p[2][0] - p[0][0]);
      if (turn < 0) element("path", { d: this.path(p), fill: face === faces[0] ? "var(--card)" : "var(--track)", stroke: "var(--edge)" }, this.svg);
    }
  }

  dimensions(rb, rp, on) {
    const { data } = this, [cx] = this.project([0, 0, 0]), level = this.project([0, 0, 0])[1], upper = this.project(on([0, 0, 0]));
    const s = this.scale, flat = Math.abs(Math.sin(this.turn[1])), millimetres = v => number(Math.round(v * 1e4) / 10) + "\u2009mm";
    const measure = (a, b, text, x, y, turn) => {
      this.arrow([(a[0] + b[0]) / 2, (a[1] + b[1]) / 2], a, "var(--ink2)", 1);
      this.arrow([(a[0] + b[0]) / 2, (a[1] + b[1]) / 2], b, "var(--ink2)", 1);
      this.text(x, y, text, "strong halo", "middle", turn ? { transform: "rotate(-90 " + x + " " + y + ")" } : {});
    };
    const down = level + rb * s * flat + 26, left = cx - rb * s;
    this.line([left, level], [left, down + 4], { class: "grid" });
    measure([left, down], [cx, down], "base r " + millimetres(rb), (left + cx) / 2, down - 6);
    // From above it is beyond the names of the joints.
    const far = this.turn[1] > 1.5 ? level - Math.max(rb, rp) * s - 44 : Infinity;
    const up = Math.min(far, upper[1] - rp * s * flat - 30) - (data.gauges ? 0.4 * rp * s * Math.abs(Math.cos(this.turn[1])) : 0), edge = upper[0] + rp * s;
    this.line([edge, upper[1]], [edge, up - 4], { class: "grid" });
    this.line([upper[0], upper[1]], [upper[0], up - 4], { class: "grid" });
    measure([upper[0], up], [edge, up], "platform r " + millimetres(rp), upper[0] + rp * s / 2, up - 7);
    if (Math.abs(level - upper[1]) < 30) return;
    const right = cx + Math.max(rb, rp) * s + 24;
    this.line([cx + rb * s + 4, level], [right + 4, level], { class: "grid" });
    this.line([edge + 4, upper[1]], [right + 4, upper[1]], { class: "grid" });
    measure([right, upper[1]], [right, level], millimetres(data.height), right - 6, (upper[1] + level) / 2, true);
  }

  // Path of the platform's origin: past and future.
  way(frame, factor) {
    const points = this.poses.map(p => this.project([p[0] * 1e-9 * factor, p[1] * 1e-9 * factor, p[2] * 1e-9 * factor + this.data.height]));
    const line = (list, width, color) => list.length > 1 && element("path", { d: this.path(list).slice(0, -1), fill: "none", stroke: color, "stroke-width": width }, this.svg);
    line(points, 1, "var(--edge)");
    line(points.slice(0, frame + 1), 2, "var(--ink)");
    element("circle", { cx: points[frame][0], cy: points[frame][1], r: 4, fill: "var(--ink)" }, this.svg);
  }

  // Position of each leg within its travel.
  strokes(legs, left, top, wide, step) {
    const travel = this.data.travel * 1e9;
    this.text(left, top - 12, "legs, µm of " + number(Number((travel / 1000).toPrecision(3))) + " µm of travel", "strong", "start");
    legs.forEach((v, k) => {
      const y = top + k * step, over = v < 0 || v > travel;
      this.text(left - 10, y + 13, String(k), "strong", "end");
      element("rect", { x: left, y: y + 2, width: wide, height: 14, fill: "var(--track)" }, this.svg);
      element("rect", { x: left, y: y + 2, width: Math.min(Math.max(v / travel, 0), 1) * wide, height: 14, fill: over ? "var(--orange)" : "var(--blue)" }, this.svg);
      this.text(left + wide + 8, y + 13, shown((v / 1000).toFixed(1)), over ? "orange" : "", "start");
    });
  }
}

function hull(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const half = list => {
    const out = [];
    for (const p of list) {
      while (out.length > 1) {
        const [a, b] = [out[out.length - 2], out[out.length - 1]];
        if ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0) break;
        out.pop();
      }
      out.push(p);
    }
    return out.slice(0, -1);
  };
  return half(sorted).concat(half(sorted.reverse()));
}
