// The panel page: draws data from the socket and turns buttons into commands. A displayed number is never stale.
(function () {
  counted();
  const root = document.documentElement, facts = JSON.parse(by("facts").textContent);
  const NAMES = ["x", "y", "z", "θx", "θy", "θz"], GAUGES = 0x3f00, STALE = 300, DIGITS = 200, SPECTRUM = 500;
  const samples = new Samples(facts.period), strips = new Strips(by("strips"), samples), legs = new Legs(by("legs"), samples, facts.volts);
  const spectrum = new Spectrum(by("spectrum"), samples, facts.modes);
  const shownAfter = { count: 0, sum: 0, most: 0 };
  let socket = null, state = null, left = null, lost = null, ended = "", you = "", row = null, standing = null, arrived = -Infinity, measured = -Infinity, stated = -Infinity, sent = 0, asked = 0, answers = {};
  let wave = null, pending = null, gapped = 0, lastEvent = 0, pose = null, delay = 500;

  // Live platform view, with motion magnified by a round factor.
  const reach = Math.max(...facts.view.base.map(p => Math.hypot(p[0], p[1])));
  facts.view.live = 0.12 * facts.view.height;
  facts.view.label = "The platform of " + facts.name + ", live, with magnified motion.";
  const view = new View(by("view"), facts.view);
  const larger = 1000;
  by("larger").textContent = "×" + number(larger);
  by("spec").textContent = facts.name;
  by("device").textContent = facts.device;
  by("leg-note").textContent = "30\u2009s · limits " + number(facts.volts[0]) + " and " + number(facts.volts[1]) + "\u2009V";

  // Rows of the readout table.
  const cells = NAMES.map((name, k) => {
    const tr = html("tr", document.querySelector("#readout tbody"));
    html("td", tr).innerHTML = k < 3 ? name : "θ<sub>" + name[1] + "</sub>";
    const cell = (kind, unit) => { const td = html("td", tr, "", kind), value = html("span", td, "–"); html("i", td, unit); return value; };
    const made = { pose: cell("pose", k < 3 ? "µm" : "µrad"), target: cell("target", k < 3 ? "µm" : "µrad"), error: cell("error", k < 3 ? "nm" : "nrad") };
    made.bar = html("canvas", html("td", tr));
    return made;
  });
  const axisBox = by("axis");
  NAMES.forEach((name, k) => { const b = html("button", axisBox); b.innerHTML = k < 3 ? name : "θ<sub>" + name[1] + "</sub>"; b.dataset.value = k; b.classList.toggle("on", k === 0); });

  // ── The socket ──
  function connect() {
    const token = new URLSearchParams(location.search).get("token") || "";
    socket = new WebSocket("ws://" + location.host + "/socket?token=" + encodeURIComponent(token));
    socket.binaryType = "arraybuffer";
    socket.onopen = () => { delay = 500; };
    socket.onmessage = e => (typeof e.data === "string" ? told(JSON.parse(e.data)) : taken(e.data));
    socket.onclose = () => { socket = null; state = null; left = null; draw(); if (!ended) { setTimeout(connect, delay); delay = Math.min(5000, 2 * delay); } };
  }

  function say(what) { if (socket && socket.readyState === 1) socket.send(JSON.stringify(what)); else note("error", "Not sent: no link to the panel."); }

  // A command with a reply; a refusal becomes an event on this page.
  function command(what, then) {
    const id = ++asked;
    answers[id] = then || (() => {});
    say(Object.assign({ id }, what));
  }

  function told(message) {
    if (message.k === "hello") {
      you = message.you;
      by("events").replaceChildren();
      lastEvent = 0;
      message.events.forEach(event);
    } else if (message.k === "event") event(message);
    else if (message.k === "answer") {
      const then = answers[message.id];
      delete answers[message.id];
      if (!message.ok) note("warning", message.why + (/[.!]$/.test(message.why) ? "" : "."));
      if (then) then(message);
    } else if (message.k === "end") { ended = message.why; state = null; }
    else if (message.k === "lost") { lost = message; state = left = null; stated = performance.now(); say({ do: "seen", number: sent }); controls(); unlinked(); allow(by("hold"), "", "sent when the link is back"); }
    else {
      const now = performance.now();
      stated = now;
      lost = null;
      if (message.k === "left") left = message; else { state = message; left = null; }
      if (message.k === "left") state = Object.assign({}, state, { holder: message.holder, mine: message.mine, asked: message.asked, offered: message.offered, pages: message.pages });
      say({ do: "seen", number: sent });
      controls();
    }
  }

  function taken(buffer) {
    const at = new DataView(buffer);
    if (at.getUint32(0, true) === 2) { save(facts.name + "-" + new Date().toISOString().replace(/[:.]/g, "-") + ".rec", URL.createObjectURL(new Blob([buffer.slice(4)]))); return; }
    const blocks = at.getUint32(4, true), number = at.getUint32(8, true), out = at.getFloat64(16, true);
    standing = [0, 1, 2, 3, 4, 5].map(k => at.getFloat64(24 + 8 * k, true));
    let place = 72;
    for (let b = 0; b < blocks; b++) {
      const tick = at.getFloat64(place, true), every = at.getUint32(place + 12, true), rows = at.getUint32(place + 16, true);
      place += 24;
      for (let r = 0; r < rows; r++) {
        const values = new Float32Array(buffer, place + 8, 48), phase = at.getUint32(place + 4, true), status = at.getUint32(place, true);
        // If a gauge has no valid reading, the pose is an old one and there is no error.
        const read = !(status & GAUGES), law = phase === 2 && read, gap = samples.add(tick + r * every, every, law, values, 12);
        spectrum.add(every, gap || !law, values, 12);
        if (gap) missing(gap);
        if (read) measured = performance.now();
        row = { status, phase, values };
        place += 200;
      }
    }
    sent = number;
    arrived = performance.now();
    say({ do: "seen", number });
    pending = pending || out;
    wake();
  }

  // A gap in this page's data, as opposed to the machine's: the panel reports which.
  function missing(ticks) {
    gapped += ticks;
    root.dataset.gaps = String((Number(root.dataset.gaps) || 0) + 1);
    if (missing.timer) return;
    missing.timer = setTimeout(() => { missing.timer = null; note("note", "No data on this page for " + duration(gapped * facts.period) + ". The machine kept running."); gapped = 0; }, 300);
  }

  // ── Events ──
  function note(kind, text, advice) { event({ t: Date.now(), kind, text, do: advice || "" }); }

  function event(e) {
    const box = by("events"), time = new Date(e.t).toTimeString().slice(0, 8);
    const one = document.createElement("div");
    one.className = "event";
    one.innerHTML = '<svg class="mark"><use href="#m-' + e.kind + '"/></svg>';
    html("time", one, time);
    html("span", one, e.text.charAt(0).toUpperCase() + e.text.slice(1) + (e.do ? " Do: " + e.do.charAt(0).toLowerCase() + e.do.slice(1) : "") + (e.code ? " (" + e.code + ")" : ""));
    box.prepend(one);
    while (box.children.length > 100) box.lastChild.remove();
    lastEvent = Math.max(lastEvent, e.t);
    by("event-note").textContent = "newest first · " + box.children.length;
    if (Date.now() - e.t < 2000 && !/late tick|No data/.test(e.text)) samples.mark(e.text.length > 28 ? e.text.slice(0, 27) + "…" : e.text, e.kind === "error");
  }

  // ── Drawing: on new data, in the next animation frame ──
  let woken = false;
  function wake() { if (!woken) { woken = true; requestAnimationFrame(() => { woken = false; draw(); }); } }

  let digits = 0, spectra = 0;
  function draw() {
    const now = performance.now(), live = row && now - arrived < STALE && !left;
    const bad = row ? row.status & GAUGES : GAUGES, read = live && !bad;
    // Without a gauge reading, pose and output tracking are unknown.
    const law = row && row.phase === 2, error = read && law ? NAMES.map((_, k) => row.values[13 + 3 * k]) : null, volts = live && bad !== GAUGES ? NAMES.map((_, k) => row.values[31 + 3 * k]) : null;
    root.dataset.measured = String(Boolean(read));
    by("view").classList.toggle("old", !read);
    by("pose-age").textContent = read ? "" : "not measured" + (isFinite(measured) ? " for " + duration((now - measured) / 1000) + ": last pose" : "");
    // First, because it reads the width, which must happen before other changes to the layout.
    if (standing && read && standing.every(isFinite)) {
      facts.view.pose = standing.map(v => v * larger);
      view.draw();
    }
    if (now - digits >= DIGITS || !live) {
      digits = now;
      shownDigits(read, error);
      heading(now);
    }
    strips.draw(NAMES, shown5.error);
    // For 30 s and more, a pixel is longer than that.
    if (now - shown5.at >= DIGITS || !live) {
      Object.assign(shown5, { at: now, error, volts });
      legs.draw(volts);
    }
    if (!live) Object.assign(shown5, { error: null, volts: null });
    if (now - spectra >= SPECTRUM) {
      spectra = now;
      by("spectrum").classList.toggle("old", !error);
      by("spectrum-note").textContent = !live ? "no data" : !read ? "no live spectrum: the pose is not measured" : law ? spectrum.draw(NAMES[spectrum.axis], now) : "no live spectrum: the law is suspended";
    }
    if (pending !== null) {
      const after = Date.now() - pending;
      pending = null;
      shownAfter.count++;
      shownAfter.sum += after;
      if (after > shownAfter.most) shownAfter.most = after;
      root.dataset.shown = String(shownAfter.count);
      root.dataset.shownMean = (shownAfter.sum / shownAfter.count).toFixed(2);
      root.dataset.shownMost = String(shownAfter.most);
      root.dataset.rows = String(samples.rows);
    }
  }
  const shown5 = { at: 0, error: null, volts: null };

  // Show no digits below the noise.
  function shownDigits(read, error) {
    cells.forEach((cell, k) => {
      const places = k < 3 ? 4 : 3;
      cell.pose.textContent = read ? fixed(row.values[k] * 1e6, places) : "–";
      cell.target.textContent = error ? fixed(row.values[6 + k] * 1e6, places) : "–";
      cell.error.textContent = error ? (error[k] > 0 ? "+" : "") + fixed(error[k] * 1e9, k < 3 ? 1 : 0) : "–";
      bar(cell.bar, samples, k, error ? error[k] : NaN);
    });
  }

  // ── Message line and chip ──
  function heading(now) {
    const line = by("message"), chip = by("chip"), texts = line.querySelectorAll("p b, p span");
    const put = (kind, what, more, right) => {
      line.className = kind;
      line.querySelector("use").setAttribute("href", "#m-" + kind);
      texts[0].textContent = what;
      texts[1].textContent = more || "";
      line.querySelector(".note").textContent = right || "";
    };
    const events = lastEvent ? "last event " + new Date(lastEvent).toTimeString().slice(0, 8) : "";
    const age = now - arrived, link = socket && now - stated < 1000;
    const known = state && link && !left && ticks(state.status);
    chip.className = "chip" + (!known ? " none" : state.phase === "faulted" ? " bad" : "");
    chip.textContent = known ? state.phase : "–";
    if (!link || lost) blank();
    if (ended) put("error", "The panel was stopped.", ended);
    else if (link && lost) put("error", "No link to the machine.", "Reconnecting. Use the hardware stop if the machine must stop." + (lost.why ? " (" + lost.why + ")" : ""));
    else if (!link) put("error", "No link to the panel.", "Use the hardware stop if the machine must stop.", state ? "" : "connecting");
    else if (left) put("warning", "The controlling page is gone.", "The machine holds" + (left.left > 0 ? ", and ramps down in " + left.left.toFixed(0) + "\u2009s" : " or is at rest") + ". Hold, Ramp down and Request control work from here.");
    else if (age > STALE) put("error", "No data for " + (isFinite(age) ? duration(age / 1000) : "any time") + ".", "Readouts are blank until data arrive.");
    else if (state) {
      const said = state.said, watch = !state.mine && state.holder;
      let more = said.do;
      if (state.phase === "running" && wave && state.wave) more = "Wave " + state.wave.name + " controls the set-point.";
      else if (watch && said.kind !== "error") more = state.holder + " is in control. Hold and Ramp down work from here, too.";
      else if (!state.holder && said.kind !== "error") more = (more ? more + " " : "") + "Request control first.";
      if (state.asked && state.mine) put("warning", state.asked.by + " requests control.", "Hand over or keep control: " + state.asked.left.toFixed(0) + "\u2009s left.", said.code || events);
      else put(said.kind, watch && said.kind === "ok" ? "You are watching." : said.what, more, [row && row.status & GAUGES ? by("pose-age").textContent : "", said.code, events].filter(Boolean).join(" · ") || "no condition present");
    }
    const down = by("down").querySelector("span"), volts = shown5.volts ? Math.max(...shown5.volts.map(Math.abs)) : NaN;
    const time = facts.ramp && isFinite(volts) ? (volts / facts.ramp).toFixed(1) + "\u2009s to 0\u2009V" : "";
    down.textContent = !link || lost ? "No link: use the hardware stop" : state && !state.status.amplifiers_on && !left ? "already at rest" : (state && state.phase === "ramping down" ? "ramping down, " : "") + (time ? time + " · " : "") + "key Esc";
  }

  // The last message of the machine is still current.
  const ticks = status => status && status.age !== null && status.age * 1000 < STALE;

  // Without a link the state of the machine is unknown: clear all readouts.
  function blank() {
    for (const id of ["amplifiers", "mode", "holder", "pages", "link", "late", "record-note"]) by(id).textContent = "–";
    for (const id of ["reach", "record-room"]) by(id).textContent = "";
    by("stop").textContent = "Hardware stop: –.";
  }

  // ── Controls ──
  let moves = [];

  // Nothing but a stop can be asked of a machine without a link.
  function unlinked() {
    moves.forEach(one => { one.disabled = true; });
    ["arm", "run", "acknowledge", "bias", "play", "record", "download", "apply", "restore", "commission-begin"].forEach(id => allow(by(id), "no link"));
  }

  function controls() {
    by("banner").hidden = !(state && state.known && (state.known.differ || []).length);
    if (!state || !state.status) return;
    const { status, phase, mine, holder, known } = state, on = status.amplifiers_on, cause = state.said.code;
    const control = mine ? "" : holder ? "in control: " + holder : "request control";
    by("amplifiers").textContent = !ticks(status) ? "–" : on ? "on" : "off";
    const mode = known.gains && known.gains.mode || "–";
    by("mode").textContent = mode.toUpperCase().replace("PF", "P/F").replace("-", " with ").replace("INVHYS", "Invhys");
    by("holder").textContent = mine ? "this page (" + you + ")" : holder || "nobody";
    by("pages").textContent = mine ? state.pages - 1 + " other" + (state.pages === 2 ? "" : "s") : "this page, " + (state.pages - 1) + " other" + (state.pages === 2 ? "" : "s");
    by("link").textContent = "20\u2009ms, " + (status.link_errors + status.damaged_frames) + " lost";
    by("late").textContent = shown(status.late);
    const button = by("control");
    button.textContent = mine ? (state.asked ? "Hand over" : state.offered !== null ? "Offered" : "Hand over") : state.asked && state.asked.mine ? "Requested, " + state.asked.left.toFixed(0) + "\u2009s" : holder && state.offered === null ? "Request control" : "Take control";
    button.disabled = !mine && !!state.asked;
    by("keep").hidden = !(mine && (state.asked || state.offered !== null));
    const steps = ["disarmed", "arming", "holding", "running"], step = steps.indexOf(phase);
    [...by("steps").children].forEach((span, k) => { span.className = k === step ? "on" : k < step ? "past" : ""; });
    const held = ["running", "driving", "arming", "holding"].includes(phase);
    allow(by("hold"), held ? "" : "not armed", "immediate · key H");
    allow(by("arm"), phase === "faulted" ? "faulted" : phase !== "disarmed" ? "armed" : control, "press 1\u2009s");
    allow(by("run"), phase === "running" ? "running" : phase !== "holding" && phase !== "arming" ? (phase === "driving" ? "open drive" : "not armed") : control, "press 1\u2009s");
    allow(by("acknowledge"), phase !== "faulted" && status.cause !== 16 ? "no fault" : control, "press 1\u2009s");
    for (const [id, next] of [["arm", "disarmed"], ["run", "holding"], ["acknowledge", "faulted"]]) by(id).classList.toggle("next", phase === next && !by(id).disabled);
    const events = known.standing && known.standing.health ? known.standing.health.events_in_words : null;
    by("stop").textContent = "Hardware stop: " + (events ? (events.includes("emergency stop") ? "pressed" : "not pressed") : "–") + ".";
    const busy = row && (row.status & 1 << 18), waving = wave && state.wave;
    const move = phase !== "running" ? "not running" : control || (waving ? "moved by the wave" : "");
    by("move-note").textContent = move || "press, or arrow keys";
    moves.forEach(one => { one.disabled = move !== ""; one.title = move; });
    by("bias").textContent = waving ? "Stop wave" : "Go to bias";
    allow(by("bias"), phase !== "running" ? "not running" : control);
    const away = v => number(Number(Math.max(0, v).toPrecision(2)));
    if (known.reach) by("reach").innerHTML = known.reach.limits.map(([low, high], k) => "<span>" + (k < 3 ? NAMES[k] : "θ<sub>" + NAMES[k][1] + "</sub>") + " −" + away(known.reach.from[k] - low) + ", +" + away(high - known.reach.from[k]) + "</span>").join("");
    by("banner").querySelector("span").textContent = (known.differ || []).join(", ") + ". They stay in force after disarming, until the controller restarts.";
    allow(by("restore"), control);
    // The wave started by the panel, and its remaining time.
    if (!state.wave) wave = wave && wave.trajectory && busy ? wave : null;
    by("wave-name").textContent = chosen ? chosen.name : "";
    by("wave-note").textContent = wave ? (wave.trajectory ? "playing" : "running") : "not playing";
    const played = wave && wave.seconds && state.wave ? (samples.last - state.wave.tick) * facts.period / wave.seconds : 0;
    if (wave && wave.seconds && played >= 1) wave = null;
    by("wave-bar").style.width = Math.min(100, 100 * played) + "%";
    if (wave && wave.seconds) by("wave-note").textContent = (played * wave.seconds).toFixed(1) + " of " + number(wave.seconds) + "\u2009s";
    by("play").textContent = wave ? "Stop" : "Play";
    allow(by("play"), control || (wave ? (wave.trajectory ? "the trajectory ends by itself; Hold stops it" : "") : phase !== "running" ? "not running" : chosen ? "" : "choose one first"));
    allow(by("choose"), "");
    // Recorder.
    const recorder = known.recorder;
    if (recorder) {
      by("record-room").textContent = shown(recorder.capacity) + " ticks";
      by("record-bar").style.width = Math.min(100, 100 * recorder.ticks / recorder.capacity) + "%";
      by("record-note").textContent = recorder.running ? (recorder.triggered ? "recording after the trigger" : "waiting for a fault") : recorder.triggered ? "complete, with trigger" : "stopped";
      by("record").textContent = recorder.running ? "Stop" : "Record";
    }
    allow(by("record"), recorder ? control : "no recorder");
    allow(by("download"), !recorder ? "no recorder" : recorder.running ? "recording: stop it first" : control);
    // Gain.
    by("gain-note").textContent = "all axes; computed margin " + (facts.gain_margin ? "×" + number(Number(facts.gain_margin.toPrecision(3))) : "above the searched range");
    allow(by("apply"), control || (facts.gain_margin && gain.factor >= facts.gain_margin ? "unstable: above the computed margin" : state.busy ? "a command is running" : ""));
    checked(state.check, phase, control);
    commissioned(state.commission, phase, control);
  }

  // The steps with their state, what the command says, findings, and the result.
  function commissioned(now, phase, control) {
    by("commission").hidden = !now;
    if (!now) return;
    const plan = now.outlook, steps = plan.steps || [], open = steps.filter(step => step.next);
    const left = plan.seconds ? "about " + (plan.seconds / 60).toFixed(0) + "\u2009min of machine time" : "";
    by("commission-note").textContent = now.runs ? "running" + (left ? " · " + left : "") : left;
    by("commission-begin").querySelector("b").textContent = steps.some(step => step.date) ? "Continue" : "Begin";
    const why = plan.refused || (open.length ? "" : plan.other ? "build and start the new controller" : "all steps are done");
    allow(by("commission-begin"), now.runs ? "running" : phase !== "disarmed" ? "ramp down first" : why ? why : control, "press 1\u2009s");
    allow(by("commission-end"), now.runs ? "" : "not running");
    by("commission-said").textContent = now.runs ? now.message : now.ended ? "Ended: " + now.ended : "";
    const page = by("commission-page");
    page.hidden = !plan.page;
    page.href = "/commission" + location.search;
    const text = JSON.stringify([plan, now.runs]);
    if (commissioned.shown === text) return;
    commissioned.shown = text;
    const list = by("commission-steps"), found = by("commission-found");
    list.replaceChildren();
    found.replaceChildren();
    let first = true;
    for (const step of steps) {
      const does = step.next && now.runs && first, line = html("div", list, "", "row");
      if (step.next) first = false;
      line.innerHTML = '<svg class="mark"><use href="#m-' + (step.skipped ? "note" : step.date && !step.next ? "ok" : "none") + '"/></svg>';
      html("span", line, step.name + (step.skipped ? ": skipped, " + step.skipped : ""));
      html("span", line, step.date && !step.next ? step.date : does ? "now" : "open");
    }
    const findings = [...(plan.findings || []), ...(plan.missed ? [plan.missed] : []), ...(plan.refused ? [plan.refused] : [])];
    if (plan.other) findings.push("Build the commissioned spec, start its controller, and a panel with that spec: acceptance is left.");
    for (const finding of findings) {
      const line = html("div", found, "", "row");
      line.innerHTML = '<svg class="mark"><use href="#m-warning"/></svg>';
      html("span", line, finding);
    }
  }

  function checked(check, phase, control) {
    allow(by("check"), "");
    const runs = check && check.runs;
    by("check-bar").style.width = (check ? (check.runs ? 100 * check.done / 6 : check.verdict ? 100 : 0) : 0) + "%";
    by("check-note").textContent = runs ? "leg " + Math.min(check.done, 5) + " moves" : "";
    allow(by("check-begin"), runs ? "running" : phase !== "disarmed" ? "ramp down first" : control, "press 1\u2009s");
    allow(by("check-end"), runs ? control : "not running");
    const verdict = check && check.verdict, text = JSON.stringify(verdict || null);
    if (checked.shown === text) return;
    checked.shown = text;
    const box = by("verdict");
    box.replaceChildren();
    if (!verdict) return;
    const line = html("div", box, "", "row");
    line.innerHTML = '<svg class="mark"><use href="#m-' + (verdict.good ? "ok" : "error") + '"/></svg>';
    html("span", line, verdict.what.charAt(0).toUpperCase() + verdict.what.slice(1) + (verdict.advice ? " Do: " + verdict.advice : ""));
  }

  // ── Buttons and keys ──
  const urgent = what => say({ do: what });
  by("down").addEventListener("click", () => urgent("ramp-down"));
  by("hold").addEventListener("click", () => urgent("hold"));
  document.addEventListener("keydown", e => {
    if (e.key === "Escape") {
      e.preventDefault();
      urgent("ramp-down");
      document.querySelectorAll("dialog[open]").forEach(dialog => dialog.close());
      return;
    }
    if (e.ctrlKey || e.metaKey || e.altKey || e.repeat) return;
    if (e.key === "h" || e.key === "H") { urgent("hold"); return; }
    const arrow = { ArrowRight: ["x", 1], ArrowLeft: ["x", -1], ArrowUp: ["y", 1], ArrowDown: ["y", -1], PageUp: ["z", 1], PageDown: ["z", -1] }[e.key];
    // In a focused figure the arrow keys rotate it.
    if (arrow && !moves[0].disabled && !e.target.closest("svg, input, dialog")) { e.preventDefault(); step(...arrow); }
  });
  let size = 100;
  const step = (axis, sign) => command({ do: "command", line: "jog " + axis + "=" + sign * size * (axis[0] === "r" ? 10 : 1) + (axis[0] === "r" ? "nrad" : "nm") });
  moves = jog(by("jog"), step);
  choose(by("step"), value => { size = Number(value); });
  choose(by("unit"), value => { strips.first = Number(value); strips.bound = 0; wake(); });
  choose(by("span"), value => { strips.span = Number(value); strips.bound = 0; spanNote(); wake(); });
  choose(axisBox, value => { spectrum.choose(Number(value)); spectra = 0; wake(); });
  const spanNote = () => { by("strip-note").textContent = "line: mean, band: minimum and maximum of " + duration(SPANS[strips.span] / BINS); };
  spanNote();
  for (const request of ["arm", "run", "acknowledge"]) slow(by(request), () => command({ do: "begin", request }));
  by("control").addEventListener("click", () => { if (!state) return; say({ do: state.mine ? (state.asked ? "grant-control" : "offer-control") : "request-control" }); });
  by("keep").addEventListener("click", () => say({ do: "keep-control" }));
  by("bias").addEventListener("click", () => command({ do: "command", line: wave && state.wave ? "wave stop" : "goto zero" }));
  by("restore").addEventListener("click", () => command({ do: "restore" }));
  by("csv").addEventListener("click", () => download(facts.name + "-history.csv", samples.csv(strips.span, [...NAMES.map((name, k) => "error of " + name + (k < 3 ? ", m" : ", rad")), ...[0, 1, 2, 3, 4, 5].map(leg => "leg " + leg + ", V")])));
  by("record").addEventListener("click", () => command({ do: "command", line: state.known.recorder.running ? "record stop" : "record arm" }));
  by("download").addEventListener("click", () => command({ do: "download" }));
  const gain = new Gain(by("gain"), facts.gain_margin);
  gain.changed = controls;
  by("apply").addEventListener("click", () => command({ do: "gain", factor: gain.factor }));

  // Selection: a trajectory of the spec, or a wave from a local file.
  let chosen = null;
  const pick = what => { chosen = what; by("panel-choose").close(); controls(); };
  const list = by("choices");
  if (!(facts.trajectories || []).length) html("p", list, "The spec has no trajectories.");
  for (const name of facts.trajectories || []) html("button", list, "Trajectory " + name).addEventListener("click", () => pick({ name, trajectory: true }));
  by("file").addEventListener("change", e => {
    const file = e.target.files[0];
    if (file) file.text().then(text => pick({ name: file.name, text, seconds: Number((/^\s*seconds\s*=\s*([\d.eE+-]+)/m.exec(text) || [])[1]) || 0 }));
    e.target.value = "";
  });
  by("play").addEventListener("click", () => {
    if (wave) command({ do: "command", line: "wave stop" }, () => { wave = null; });
    else if (chosen.trajectory) command({ do: "command", line: "play " + chosen.name }, done => { if (done.ok) wave = { trajectory: true }; });
    else command({ do: "wave", name: chosen.name, text: chosen.text }, done => { if (done.ok) wave = { seconds: chosen.seconds }; });
  });
  by("choose").addEventListener("click", () => by("panel-choose").show());
  by("check").addEventListener("click", () => by("panel-check").show());
  slow(by("check-begin"), () => command({ do: "check" }));
  by("check-end").addEventListener("click", () => say({ do: "end-check" }));
  by("commission").addEventListener("click", () => by("panel-commission").show());
  slow(by("commission-begin"), () => command({ do: "commission" }));
  by("commission-end").addEventListener("click", () => urgent("ramp-down"));
  for (const button of document.querySelectorAll("[data-close]")) button.addEventListener("click", () => button.closest("dialog").close());

  // ── Themes, sizes, time ──
  const again = () => { readInks(); gain.draw(); view.draw(); if (spectrum.plot) { spectrum.choose(spectrum.axis); } wake(); };
  themed(by("theme"));
  by("theme").addEventListener("click", again);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", again);
  window.addEventListener("resize", again);
  again();
  // Stale data must be detected even if no more data arrive.
  setInterval(() => { if (performance.now() - arrived > STALE) draw(); }, 100);
  connect();
})();
