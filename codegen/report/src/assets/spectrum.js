// Spectrum of an error from consecutive rows: Hann window, mean power in logarithmic bands.
const LENGTH = 4096, KEPT = 60;

// In-place FFT; lengths are powers of two.
function transform(re, im) {
  const n = re.length;
  for (let i = 1, j = 0; i < n; i++) {
    let bit = n >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) { [re[i], re[j]] = [re[j], re[i]]; [im[i], im[j]] = [im[j], im[i]]; }
  }
  for (let size = 2; size <= n; size <<= 1) {
    const turn = -2 * Math.PI / size, half = size >> 1;
    for (let k = 0; k < half; k++) {
      const c = Math.cos(turn * k), s = Math.sin(turn * k);
      for (let i = k; i < n; i += size) {
        const j = i + half, a = re[j] * c - im[j] * s, b = re[j] * s + im[j] * c;
        [re[j], im[j]] = [re[i] - a, im[i] - b];
        [re[i], im[i]] = [re[i] + a, im[i] + b];
      }
    }
  }
}

class Spectrum {
  constructor(figure, samples, modes) {
    [this.figure, this.samples, this.modes] = [figure, samples, modes];
    this.rows = new Float32Array(6 * LENGTH);
    [this.at, this.whole, this.every, this.axis] = [0, 0, 0, 0];
    [this.re, this.im] = [new Float64Array(LENGTH), new Float64Array(LENGTH)];
    this.window = Float64Array.from({ length: LENGTH }, (_, k) => 0.5 - 0.5 * Math.cos(2 * Math.PI * (k + 0.5) / LENGTH));
    this.power = this.window.reduce((sum, w) => sum + w * w, 0);
  }

  // Adds a row of `every` ticks after a gap of the given length.
  add(every, gap, values, at) {
    if (gap || every !== this.every) [this.whole, this.every, this.bands] = [0, every, every === this.every ? this.bands : null];
    for (let axis = 0; axis < 6; axis++) this.rows[axis * LENGTH + this.at] = values[at + 3 * axis + 1];
    this.at = (this.at + 1) % LENGTH;
    if (this.whole < LENGTH) this.whole++;
  }

  choose(axis) {
    this.axis = axis;
    this.bands = null;
    if (this.plot) this.figure.replaceChildren();
    this.plot = null;
  }

  // Spectrum of the selected axis; none until there are enough rows.
  density() {
    if (this.whole < LENGTH) return null;
    let mean = 0;
    const row = k => this.rows[this.axis * LENGTH + (this.at + k) % LENGTH] * 1e9;
    for (let k = 0; k < LENGTH; k++) mean += row(k) / LENGTH;
    for (let k = 0; k < LENGTH; k++) { this.re[k] = (row(k) - mean) * this.window[k]; this.im[k] = 0; }
    transform(this.re, this.im);
    const rate = 1 / (this.every * this.samples.period), step = rate / LENGTH;
    if (!this.bands) {
      this.bands = [];
      const half = LENGTH / 2;
      for (let k = 0, last = 1; k <= 120 && last < half; k++) {
        const to = Math.min(half, Math.max(last + 1, Math.round(Math.pow(half, k / 120))));
        this.bands.push([last, to]);
        last = to;
      }
      [this.kept, this.second] = [new Float32Array(KEPT * this.bands.length), -1];
    }
    return { x: this.bands.map(([a, b]) => Math.sqrt(a * b) * step), y: this.bands.map(([a, b]) => {
      let sum = 0;
      for (let k = a; k < b; k++) sum += 2 * (this.re[k] * this.re[k] + this.im[k] * this.im[k]);
      return Math.sqrt(sum / (b - a) / (this.power * rate));
    }) };
  }

  // Maximum of each band in the last minute.
  largest(y, now) {
    const second = Math.floor(now / 1000), at = (second % KEPT) * y.length;
    if (second !== this.second) { this.second = second; this.kept.fill(0, at, at + y.length); }
    return y.map((v, k) => {
      if (v > this.kept[at + k]) this.kept[at + k] = v;
      let most = 0;
      for (let i = k; i < this.kept.length; i += y.length) if (this.kept[i] > most) most = this.kept[i];
      return most;
    });
  }

  // Range: two and a half decades.
  limits(most) { const top = Math.ceil(Math.log10(Math.max(...most, 1e-9)) * 2) / 2; return [Math.pow(10, top - 2.5), Math.pow(10, top)]; }

  draw(name, now) {
    const found = this.density();
    if (!found) return "collecting " + Math.round(100 * this.whole / LENGTH) + "\u2009% of " + LENGTH + " rows without a gap";
    const most = this.largest(found.y, now);
    if (!this.plot) {
      const unit = this.axis < 3 ? "nm/√Hz" : "nrad/√Hz", top = found.x[found.x.length - 1], seen = this.modes.map((f, k) => [f, k + 1]).filter(([f]) => f < top);
      this.plot = new Plot(this.figure, { id: "spectrum", title: "error of " + name, label: "Spectrum of the error of " + name, x: { label: "frequency", unit: "Hz", log: true }, y: { label: "error of " + name, unit, log: true }, keys: false, height: Math.max(130, this.figure.clientHeight - 4),
        y_limits: this.limits(most), notes: [{ k: "modes", x: seen.map(([f]) => f), text: seen.map(([, k]) => String(k)) }],
        series: [{ name: "60\u2009s maximum", style: "line", color: 7, x: found.x, y: most }, { name: "live", style: "line", color: 4, x: found.x, y: found.y }] });
    } else {
      [this.plot.series[0].y, this.plot.series[1].y] = [most, found.y];
      delete this.figure.dataset.points;
      this.plot.data.y_limits = this.limits(most);
      this.plot.zoom(this.plot.window);
    }
    return "rows of " + duration(this.every * this.samples.period);
  }
}
