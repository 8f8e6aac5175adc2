// Data from the link, stored as minimum, mean and maximum per pixel in a fixed amount of memory.
const SPANS = [5, 30, 300, 3600], BINS = 600, CHANNELS = 12;

class Ring {
  constructor(seconds, period) {
    this.seconds = seconds;
    this.ticks = Math.max(1, seconds / BINS / period);
    this.id = new Float64Array(BINS).fill(-1);
    // Number of ticks with voltages, and with errors: without the law there are no errors.
    this.counts = [new Float32Array(BINS), new Float32Array(BINS)];
    [this.least, this.sum, this.most, this.square] = [0, 1, 2, 3].map(() => new Float32Array(BINS * CHANNELS));
  }

  // The slot of a tick's pixel, cleared if it held an older one.
  place(tick) {
    const id = Math.floor(tick / this.ticks), at = id % BINS;
    if (this.id[at] !== id) {
      this.id[at] = id;
      this.counts[0][at] = this.counts[1][at] = 0;
      const from = at * CHANNELS, to = from + CHANNELS;
      this.least.fill(Infinity, from, to);
      this.most.fill(-Infinity, from, to);
      this.sum.fill(0, from, to);
      this.square.fill(0, from, to);
    }
    return at;
  }

  // Adds a row: `values` from `at` on are minimum, mean, maximum of each channel, errors first; it covers the given number of ticks.
  add(tick, every, law, values, at) {
    const bin = this.place(tick), weight = every;
    this.counts[0][bin] += weight;
    if (law) this.counts[1][bin] += weight;
    for (let k = law ? 0 : 6, i = bin * CHANNELS + k; k < CHANNELS; k++, i++) {
      const least = values[at + 3 * k], mean = values[at + 3 * k + 1], most = values[at + 3 * k + 2];
      if (least < this.least[i]) this.least[i] = least;
      if (most > this.most[i]) this.most[i] = most;
      this.sum[i] += weight * mean;
      this.square[i] += weight * mean * mean;
    }
  }

  // For each pixel with data up to `last`, oldest first: its first tick, and minimum, mean, maximum of a channel.
  each(channel, last, seconds, period, see) {
    const counts = this.counts[channel < 6 ? 1 : 0], end = Math.floor(last / this.ticks), count = Math.min(BINS - 1, Math.round(seconds / period / this.ticks));
    for (let id = Math.max(0, end - count); id <= end; id++) {
      const at = id % BINS;
      if (this.id[at] !== id || !counts[at]) continue;
      const i = at * CHANNELS + channel;
      see(id * this.ticks, this.least[i], this.sum[i] / counts[at], this.most[i], this.square[i] / counts[at]);
    }
  }

  range(channel, last, seconds, period) {
    let low = Infinity, high = -Infinity, square = 0, count = 0;
    this.each(channel, last, seconds, period, (tick, least, mean, most, power) => {
      if (least < low) low = least;
      if (most > high) high = most;
      square += power;
      count++;
    });
    return { low, high, rms: count ? Math.sqrt(square / count) : NaN };
  }
}

class Samples {
  constructor(period) {
    this.period = period;
    this.rings = SPANS.map(seconds => new Ring(seconds, period));
    this.last = -1;
    this.rows = 0;
    // Ticks that never reached this page: first, and one after the last.
    this.gaps = [];
    // Ticks with events, and their texts.
    this.marks = [];
  }

  // Adds a row; returns the length of the gap before it, in ticks.
  add(tick, every, law, values, at) {
    if (tick < this.last) this.restart();
    const gap = this.last < 0 ? 0 : tick - this.last;
    if (gap > 0) this.gaps.push([this.last, tick]);
    for (const ring of this.rings) ring.add(tick, every, law, values, at);
    this.last = tick + every;
    this.every = 1.5 * every;
    this.rows++;
    const old = this.last - 1.1 * SPANS[SPANS.length - 1] / this.period;
    while (this.gaps.length && (this.gaps[0][1] < old || this.gaps.length > 2000)) this.gaps.shift();
    while (this.marks.length && this.marks[0][0] < old) this.marks.shift();
    return gap;
  }

  // The device restarted its tick count.
  restart() {
    this.rings = SPANS.map(seconds => new Ring(seconds, this.period));
    [this.last, this.gaps, this.marks] = [-1, [], []];
  }

  // The visible history: for each pixel and channel minimum, mean and maximum.
  csv(span, names) {
    const seconds = SPANS[span], rows = new Map();
    for (let k = 0; k < CHANNELS; k++) this.rings[span].each(k, this.last, seconds, this.period, (tick, ...values) => {
      if (!rows.has(tick)) rows.set(tick, new Array(3 * CHANNELS).fill(""));
      values.slice(0, 3).forEach((v, i) => { rows.get(tick)[3 * k + i] = v; });
    });
    const head = names.flatMap(name => ["least", "mean", "largest"].map(what => name + ", " + what));
    return [["time, s", ...head].map(quoted).join(","), ...[...rows].sort((a, b) => a[0] - b[0]).map(([tick, row]) => [(tick * this.period).toFixed(6), ...row].join(","))].join("\n") + "\n";
  }

  mark(text, bad) { if (this.last >= 0) { this.marks.push([this.last, text, bad]); if (this.marks.length > 200) this.marks.shift(); } }
}

// Theme colours, read when the theme changes.
let inks = {};
function readInks() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["page", "card", "ink", "ink2", "edge", "line", "track", "blue", "blue2", "orange", "orange2", "s3"]) inks[name] = style.getPropertyValue("--" + name).trim();
}

// Rounds up to 1, 2 or 5 times a power of ten.
function round125(v) {
  const decade = Math.pow(10, Math.floor(Math.log10(Math.max(v, 1e-12))));
  return [1, 2, 5, 10].find(f => f * decade >= v * 0.999) * decade;
}

// Sizes are passed in, since reading them would force a layout in every frame.
const sizes = new Map(), resized = new ResizeObserver(entries => { for (const { target, contentRect } of entries) sizes.set(target, [contentRect.width, contentRect.height]); });

function sized(canvas) {
  if (!sizes.has(canvas)) {
    sizes.set(canvas, [canvas.clientWidth, canvas.clientHeight]);
    resized.observe(canvas);
  }
  const scale = window.devicePixelRatio || 1, [wide, tall] = sizes.get(canvas);
  if (canvas.width !== Math.round(wide * scale) || canvas.height !== Math.round(tall * scale)) {
    canvas.width = Math.round(wide * scale);
    canvas.height = Math.round(tall * scale);
  }
  const to = canvas.getContext("2d");
  to.setTransform(scale, 0, 0, scale, 0, 0);
  to.clearRect(0, 0, wide, tall);
  return [to, wide, tall];
}

function written(to, text, x, y, size, color, align, weight) {
  to.font = (weight || 400) + " " + size + "px system-ui, 'Segoe UI', Roboto, 'Noto Sans', sans-serif";
  to.fillStyle = color;
  to.textAlign = align || "left";
  to.fillText(text, x, y);
}

// Gaps as drawn in a lane, oldest first: boxes if at least a pixel wide or touching; otherwise marks at the edge, which hide no data.
function gapsIn(samples, seconds, left, wide) {
  const { last, period } = samples, x = tick => left + wide * (1 - (last - tick) * period / seconds), boxes = [], marks = [];
  for (const [from, to] of samples.gaps) {
    const a = x(from), b = x(to);
    if (b < left) continue;
    if (b - a < 1) { if (!marks.length || a - marks[marks.length - 1] >= 1) marks.push(a); continue; }
    const box = boxes[boxes.length - 1];
    if (box && a <= box[1] + 1) box[1] = b;
    else boxes.push([a, Math.max(b, a + 3)]);
  }
  return { boxes, marks };
}

// A lane: band from minimum to maximum, mean as a line, gaps hatched and never bridged.
function lane(to, samples, ring, channel, box, seconds, scale) {
  const [left, top, wide, tall] = box, { last, period } = samples;
  const x = tick => left + wide * (1 - (last - tick) * period / seconds), y = v => top + tall * (1 - (v - scale[0]) / (scale[1] - scale[0]));
  const gaps = samples.gaps.filter(gap => x(gap[1]) > left);
  to.save();
  to.beginPath();
  to.rect(left, top, wide, tall);
  to.clip();
  let gap = 0, part = [], before = -Infinity;
  const flush = () => {
    if (part.length === 1) part.push([part[0][0] + 1, ...part[0].slice(1)]);
    if (part.length) {
      to.beginPath();
      part.forEach(([px, , , most], k) => (k ? to.lineTo(px, y(most)) : to.moveTo(px, y(most))));
      for (let k = part.length - 1; k >= 0; k--) to.lineTo(part[k][0], y(part[k][1]));
      to.closePath();
      to.fillStyle = inks.blue2;
      to.fill();
      to.strokeStyle = inks.s3;
      to.lineWidth = 0.6;
      to.stroke();
      to.beginPath();
      part.forEach(([px, , mean], k) => (k ? to.lineTo(px, y(mean)) : to.moveTo(px, y(mean))));
      to.strokeStyle = inks.blue;
      to.lineWidth = 1.5;
      to.stroke();
    }
    part = [];
  };
  ring.each(channel, last, seconds, period, (tick, least, mean, most) => {
    while (gap < gaps.length && tick + ring.ticks > gaps[gap][0]) {
      if (tick >= gaps[gap][0]) flush();
      if (tick < gaps[gap][1]) break;
      gap++;
    }
    // No line across pixels without data.
    if (part.length && tick > before + Math.max(1.5 * ring.ticks, samples.every)) flush();
    before = tick;
    part.push([x(tick + ring.ticks / 2), least, mean, most]);
  });
  flush();
  const { boxes, marks } = gapsIn(samples, seconds, left, wide);
  to.fillStyle = inks.ink2;
  for (const at of marks) to.fillRect(at, top, 1.5, 4);
  for (const [a, b] of boxes) {
    to.fillStyle = inks.card;
    to.fillRect(a, top, b - a, tall);
    to.save();
    to.beginPath();
    to.rect(a, top, b - a, tall);
    to.clip();
    to.strokeStyle = inks.edge;
    to.lineWidth = 1;
    to.beginPath();
    for (let p = a - tall; p < b; p += 5) { to.moveTo(p, top + tall); to.lineTo(p + tall, top); }
    to.stroke();
    to.restore();
    to.setLineDash([3, 3]);
    to.strokeRect(a + 0.5, top + 0.5, Math.max(1, b - a - 1), tall - 1);
    to.setLineDash([]);
  }
  to.restore();
}

function duration(seconds) { return seconds < 0.0995 ? shown((seconds * 1e3).toPrecision(2)) + "\u2009ms" : shown(seconds.toFixed(seconds < 9.95 ? 1 : 0)) + "\u2009s"; }

// Error of three axes.
class Strips {
  constructor(canvas, samples) {
    [this.canvas, this.samples] = [canvas, samples];
    [this.first, this.span, this.bound] = [0, 1, 0];
  }

  draw(names, live) {
    const [to, wide, tall] = sized(this.canvas), { samples } = this, ring = samples.rings[this.span], seconds = SPANS[this.span];
    if (wide < 100) return;
    const unit = this.first ? "nrad" : "nm", left = 66, right = 86, foot = 22, head = 12, height = (tall - foot - head) / 3, inner = wide - left - right;
    const stats = [0, 1, 2].map(k => ring.range(this.first + k, samples.last, seconds, samples.period));
    const far = Math.max(...stats.map(s => Math.max(Math.abs(s.low), Math.abs(s.high))).filter(isFinite), 1e-10) * 1e9;
    const wanted = round125(far);
    if (wanted > this.bound || wanted < this.bound / 4) this.bound = wanted;
    for (const [at, text] of ticks(-seconds, 0, false, wide < 420 ? 3 : 6)) {
      const x = left + inner * (1 + at / seconds);
      to.strokeStyle = inks.line;
      to.lineWidth = 1;
      to.beginPath();
      to.moveTo(x, head);
      to.lineTo(x, tall - foot);
      to.stroke();
      written(to, at === 0 ? "now" : text + (Math.abs(at + seconds) < 1e-9 ? "\u2009s" : ""), x, tall - 7, 12, inks.ink2, "center");
    }
    for (let k = 0; k < 3; k++) {
      const top = head + k * height + 3, box = [left, top, inner, height - 8], bound = this.bound / 1e9;
      to.strokeStyle = inks.edge;
      to.lineWidth = 0.5;
      to.beginPath();
      to.moveTo(left, top + box[3] / 2);
      to.lineTo(left + inner, top + box[3] / 2);
      to.stroke();
      lane(to, samples, ring, this.first + k, box, seconds, [-bound, bound]);
      written(to, names[this.first + k], 2, top + box[3] / 2 + 5, 15, inks.ink, "left", 600);
      written(to, number(this.bound), left - 5, top + 9, 11, inks.ink2, "right");
      written(to, number(-this.bound), left - 5, top + box[3], 11, inks.ink2, "right");
      written(to, (live ? (live[k] > 0 ? "+" : "") + fixed(live[k] * 1e9, this.first ? 0 : 1) : "–") + "\u2009" + unit, wide, top + box[3] / 2 - 1, 16, inks.ink, "right", 600);
      written(to, "rms " + (live && isFinite(stats[k].rms) ? fixed(stats[k].rms * 1e9, this.first ? 0 : 1) : "–"), wide, top + box[3] / 2 + 14, 12, inks.ink2, "right");
    }
    const x = tick => left + inner * (1 - (samples.last - tick) * samples.period / seconds);
    // Gaps with touching labels share one, with their number and total duration.
    let group = null;
    const label = () => {
      if (!group) return;
      const text = (group.count > 1 ? group.count + " gaps " : "gap ") + duration(group.ticks * samples.period);
      written(to, text, Math.min(group.from, left + inner - 34), 10, 12, inks.ink, "center", 600);
    };
    for (const [from, behind] of samples.gaps) {
      const middle = x((from + behind) / 2), at = Math.max(middle, left + 48);
      if (middle < left) continue;
      if (group && at - group.from < 140) {
        group.count++;
        group.ticks += behind - from;
        continue;
      }
      label();
      group = { from: at, count: 1, ticks: behind - from };
    }
    label();
    // Newest first; overlapping labels are omitted.
    let edge = Infinity;
    for (const [tick, text, bad] of [...samples.marks].reverse()) {
      const at = x(tick), room = 6.2 * text.length;
      if (at < left) break;
      to.strokeStyle = bad ? inks.orange : inks.ink2;
      to.lineWidth = 1;
      to.setLineDash(bad ? [4, 3] : [1, 3]);
      to.beginPath();
      to.moveTo(at, head);
      to.lineTo(at, tall - foot);
      to.stroke();
      to.setLineDash([]);
      if (at - 4 - room < left || at > edge) continue;
      edge = at - 4 - room;
      written(to, text, at - 4, tall - foot - 3, 12, bad ? inks.orange : inks.ink2, "right", bad ? 600 : 400);
    }
  }
}

// Voltage of each leg between its limits.
class Legs {
  constructor(canvas, samples, limits) { [this.canvas, this.samples, this.limits] = [canvas, samples, limits]; }

  draw(live) {
    const [to, wide, tall] = sized(this.canvas), { samples, limits } = this, height = tall / 6, left = 122, inner = wide - left - 34;
    if (wide < 100) return;
    for (let leg = 0; leg < 6; leg++) {
      const top = leg * height, middle = top + height / 2, box = [left, top + 7, inner, height - 14];
      to.strokeStyle = inks.line;
      to.lineWidth = 1;
      to.beginPath();
      to.moveTo(0, top + 0.5);
      to.lineTo(wide, top + 0.5);
      to.stroke();
      lane(to, samples, samples.rings[1], 6 + leg, box, SPANS[1], limits);
      to.strokeStyle = inks.orange;
      to.lineWidth = 1.5;
      for (const y of [box[1], box[1] + box[3]]) for (const x of [left, left + inner - 12]) {
        to.beginPath();
        to.moveTo(x, y);
        to.lineTo(x + 12, y);
        to.stroke();
      }
      written(to, String(leg), 2, middle + 6, 16, inks.ink, "left", 600);
      written(to, live ? fixed(live[leg], 1) : "–", left - 24, middle + 8, 24, inks.ink, "right", 600);
      written(to, "V", left - 20, middle + 8, 14, inks.ink2);
      written(to, number(limits[1]), wide, box[1] + 9, 12, inks.ink2, "right");
      written(to, number(limits[0]), wide, box[1] + box[3], 12, inks.ink2, "right");
    }
  }
}

// Minimum and maximum of the last ten seconds around zero, and the current value.
function bar(canvas, samples, axis, value) {
  const [to, wide] = sized(canvas), { low, high } = samples.rings[1].range(axis, samples.last, 10, samples.period);
  const bound = round125(Math.max(Math.abs(low), Math.abs(high), 1e-9) * (isFinite(low) ? 1 : 0) || 1e-8);
  const x = v => 4 + (wide - 8) * (0.5 + 0.5 * v / bound);
  to.fillStyle = inks.track;
  to.fillRect(4, 6, wide - 8, 10);
  if (isFinite(low)) {
    to.fillStyle = inks.blue2;
    to.strokeStyle = inks.s3;
    to.fillRect(x(low), 6, x(high) - x(low), 10);
    to.strokeRect(x(low), 6, x(high) - x(low), 10);
  }
  to.strokeStyle = inks.edge;
  to.beginPath();
  to.moveTo(wide / 2, 3);
  to.lineTo(wide / 2, 19);
  to.stroke();
  if (isFinite(value)) { to.fillStyle = inks.blue; to.fillRect(x(Math.max(-bound, Math.min(bound, value))) - 2, 2, 4, 18); }
  if (wide < 100) return written(to, "±" + number(bound * 1e9), wide / 2, 31, 12, inks.ink2, "center");
  written(to, number(-bound * 1e9), 2, 31, 12, inks.ink2);
  written(to, "+" + number(bound * 1e9), wide - 2, 31, 12, inks.ink2, "right");
}
