// The platform, seen in parallel projection; drawn as SVG, so that it prints and follows the colours of the page.
class View {
  constructor(figure, data) {
    this.figure = figure;
    this.data = data;
    this.turn = [-0.6, 0.42];
    // What stands still, as on paper, shows the largest move.
    const far = p => Math.hypot(p[0], p[1], p[2]);
    this.frame = data.poses.reduce((best, p, k) => (far(p) > far(data.poses[best]) ? k : best), 0);
    this.playing = false;
    // Without a motion there are no bars on the right.
    const still = data.poses.length < 2;
    if (still) figure.classList.add("still");
    this.svg = element("svg", { viewBox: still ? "0 0 600 460" : "0 0 960 460", role: "img", "aria-label": "the platform" }, figure);
    const bar = html("div", figure, "", "bar");
    if (!still) {
      const controls = html("span", bar, "", "controls bar");
      this.button = html("button", controls, "play");
      this.button.addEventListener("click", () => this.play(!this.playing));
      this.time = this.slider(controls, "time", 0, data.poses.length - 1, this.frame, 1, v => { this.play(false); this.frame = v; });
      // Some 30 mm for the longest move at the start.
      const largest = Math.max(1, ...data.poses.flatMap(p => p.slice(0, 3).map(Math.abs)));
      this.by = Math.log10(3e7 / largest);
      this.slider(controls, "exaggeration", 0, 4.3, this.by, 0.02, v => { this.by = v; });
    } else this.by = 0;
    this.read = html("div", bar, "", "read");
    this.events();
    this.draw();
  }

  slider(parent, name, min, max, value, step, set) {
    const label = html("label", parent, name + " ");
    const input = html("input", label);
    Object.assign(input, { type: "range", min, max, step, value });
    input.addEventListener("input", () => { set(Number(input.value)); this.draw(); });
    return input;
  }

  play(on) {
    if (this.button) this.button.textContent = on ? "pause" : "play";
    if (this.playing === on) return;
    this.playing = on;
    let last = null;
    const next = now => {
      if (!this.playing) return;
      if (last !== null) {
        const span = this.data.step * this.data.poses.length;
        // The whole path in five seconds at least.
        this.frame += (now - last) / 1000 / this.data.step / Math.max(1, 5 / span);
        if (this.frame >= this.data.poses.length) this.frame = 0;
        this.time.value = Math.floor(this.frame);
        this.draw();
      }
      last = now;
      requestAnimationFrame(next);
    };
    if (on) requestAnimationFrame(next);
  }

  events() {
    let from = null;
    this.svg.addEventListener("pointerdown", e => { from = [e.clientX, e.clientY]; this.svg.setPointerCapture(e.pointerId); });
    this.svg.addEventListener("pointermove", e => {
      if (!from) return;
      this.turn[0] += (e.clientX - from[0]) * 0.008;
      this.turn[1] = Math.min(Math.max(this.turn[1] + (e.clientY - from[1]) * 0.008, -1.57), 1.57);
      from = [e.clientX, e.clientY];
      this.draw();
    });
    for (const end of ["pointerup", "pointercancel"]) this.svg.addEventListener(end, () => { from = null; });
  }

  // R = Rz Ry Rx of exaggerated angles, about the origin of the platform.
  joint(p, pose) {
    const [a, b, c] = pose.slice(3);
    let [x, y, z] = p;
    [y, z] = [y * Math.cos(a) - z * Math.sin(a), y * Math.sin(a) + z * Math.cos(a)];
    [x, z] = [x * Math.cos(b) + z * Math.sin(b), z * Math.cos(b) - x * Math.sin(b)];
    [x, y] = [x * Math.cos(c) - y * Math.sin(c), x * Math.sin(c) + y * Math.cos(c)];
    return [x + pose[0], y + pose[1], z + pose[2] + this.data.height];
  }

  project([x, y, z]) {
    const [turn, tilt] = this.turn;
    const u = x * Math.cos(turn) - y * Math.sin(turn), v = x * Math.sin(turn) + y * Math.cos(turn);
    const w = z - this.data.height / 2;
    return [300 + u * this.scale, 235 - (w * Math.cos(tilt) + v * Math.sin(tilt)) * this.scale, v * Math.cos(tilt) - w * Math.sin(tilt)];
  }

  draw() {
    const { data, svg } = this;
    svg.replaceChildren();
    const frame = Math.min(Math.floor(this.frame), Math.max(0, data.poses.length - 1));
    const pose = data.poses[frame] || [0, 0, 0, 0, 0, 0], factor = Math.pow(10, this.by);
    const shown = pose.map((v, k) => v * 1e-9 * (data.poses.length ? factor : 1));
    const size = Math.max(data.height, ...data.base.flat().map(Math.abs), ...data.platform.flat().map(Math.abs));
    this.scale = 175 / size;
    const base = data.base.map(p => this.project(p)), top = data.platform.map(p => this.project(this.joint(p, shown)));
    const plate = (points, color) => element("path", { d: "M" + points.map(p => p[0].toFixed(1) + " " + p[1].toFixed(1)).join("L") + "Z", fill: "var(" + color + ")", "fill-opacity": 0.14, stroke: "var(" + color + ")", "stroke-width": 2 }, svg);
    plate(base, "--c5");
    const legs = base.map((p, k) => [p, top[k], k]).sort((a, b) => b[0][2] + b[1][2] - a[0][2] - a[1][2]);
    for (const [from, to, k] of legs) {
      element("line", { x1: from[0], y1: from[1], x2: to[0], y2: to[1], stroke: "var(--c" + k + ")", "stroke-width": 5, "stroke-linecap": "round" }, svg);
    }
    plate(top, "--c0");
    // Joints come in pairs: a quarter up the legs the numbers are apart.
    for (const [from, to, k] of legs) {
      const at = { x: 0.75 * from[0] + 0.25 * to[0] + 9, y: 0.75 * from[1] + 0.25 * to[1] + 4, stroke: "var(--back)", "stroke-width": 4, "paint-order": "stroke" };
      element("text", at, svg).textContent = String(k + 1);
    }
    this.axes();
    if (data.poses.length) this.path(frame, factor);
    if (data.poses.length) this.bars(data.legs[frame]);
    const moved = pose.slice(0, 3).map(v => number(v / 1000)).join(", "), turned = pose.slice(3).map(v => number(v / 1000)).join(", ");
    this.read.textContent = data.poses.length ? "t = " + (frame * data.step).toFixed(3) + " s, x, y, z = " + moved + " µm, θx, θy, θz = " + turned + " µrad, exaggerated " + number(factor) + " times" : "";
    this.figure.dataset.points = 12 + data.poses.length;
  }

  axes() {
    const length = 0.3 * this.data.height, from = this.project([0, 0, 0]);
    [["x", [length, 0, 0]], ["y", [0, length, 0]], ["z", [0, 0, length]]].forEach(([name, p]) => {
      const to = this.project(p);
      element("line", { x1: from[0], y1: from[1], x2: to[0], y2: to[1], stroke: "var(--soft)", "stroke-width": 1.5 }, this.svg);
      element("text", { x: to[0] + 5, y: to[1] + 4 }, this.svg).textContent = name;
    });
  }

  // Way of the platform's origin so far and to come.
  path(frame, factor) {
    const points = this.data.poses.map(p => this.project([p[0] * 1e-9 * factor, p[1] * 1e-9 * factor, p[2] * 1e-9 * factor + this.data.height]));
    const line = (list, width) => list.length > 1 && element("path", { d: "M" + list.map(p => p[0].toFixed(1) + " " + p[1].toFixed(1)).join("L"), fill: "none", stroke: "var(--c4)", "stroke-width": width, "stroke-opacity": width > 1 ? 1 : 0.6 }, this.svg);
    line(points, 0.8);
    line(points.slice(0, frame + 1), 2);
    const here = points[frame];
    element("circle", { cx: here[0], cy: here[1], r: 4, fill: "var(--c4)" }, this.svg);
  }

  bars(legs) {
    const stroke = this.data.stroke * 1e9, [left, top, wide, step] = [640, 96, 250, 46];
    element("text", { x: left, y: top - 34 }, this.svg).textContent = "leg extension in µm, stroke " + number(stroke / 1000) + " µm";
    legs.forEach((v, k) => {
      const y = top + k * step, length = Math.min(Math.max(v / stroke, 0), 1) * wide;
      element("text", { x: left - 8, y: y + 13, "text-anchor": "end" }, this.svg).textContent = String(k + 1);
      element("rect", { x: left, y, width: wide, height: 18, class: "frame" }, this.svg);
      element("rect", { x: left, y, width: length, height: 18, fill: "var(--c" + k + ")" }, this.svg);
      element("text", { x: left + wide + 8, y: y + 13 }, this.svg).textContent = (v / 1000).toFixed(2);
    });
  }
}
