//! The page in headless Chromium, controlled over DevTools: its states with screenshots at all sizes, axe-core, and no console messages.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tungstenite::{Message, WebSocket};

use super::super::ProcessGuard;
use super::{LONG, Panel};
use crate::support;

/// Variable with a folder for screenshots.
const PICTURES: &str = "SPECGEN_PICTURES";

/// Sets the size of a window.
const SIZE: &str = "Emulation.setDeviceMetricsOverride";

/// Faults of the layout, one a line: the page is wider than its window, *Hold* or *Ramp down* is not wholly visible or is covered, parts
/// of the head overlap, a list or chart has no height.
const LAYOUT: &str = r"(() => {
  const by = id => document.getElementById(id), faults = [];
  const wide = document.documentElement.scrollWidth - innerWidth;
  if (wide > 0) faults.push(`${wide} px too wide`);
  for (const id of ['hold', 'down']) {
    const box = by(id).getBoundingClientRect(), seen = document.elementFromPoint((box.left + box.right) / 2, (box.top + box.bottom) / 2);
    if (box.left < 0 || box.top < 0 || box.right > innerWidth + 0.5 || box.bottom > innerHeight || !seen || !by(id).contains(seen)) faults.push(`${id} is hidden`);
  }
  const parts = [...document.querySelectorAll('#top > *, #fields > *, #fields .line > *')].filter(part => part.offsetParent);
  parts.forEach((one, k) => parts.slice(k + 1).forEach(other => {
    if (one.contains(other)) return;
    const a = one.getBoundingClientRect(), b = other.getBoundingClientRect();
    if (Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1 && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 1) faults.push(`${one.textContent} overlaps ${other.textContent}`);
  }));
  for (const [id, least] of [['events', 80], ['spectrum', 130], ['legs', 150]]) if (by(id).clientHeight < least) faults.push(`${id} has a height of ${by(id).clientHeight} px`);
  return faults.join('\n');
})()";

/// A window.
struct Window {
    _process: ProcessGuard,
    socket: WebSocket<TcpStream>,
    _profile: tempfile::TempDir,
    asked: u64,
    /// Console messages, including exceptions.
    console: Vec<String>,
}

impl Window {
    fn open(url: &str, dark: bool) -> Option<Self> {
        let profile = tempfile::tempdir().unwrap();
        let start = |program: &str| {
            let mut command = Command::new(program);
            command.args([
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--no-first-run",
                "--disable-background-networking",
            ]);
            command.args(["--disable-component-update", "--disable-sync", "--remote-debugging-port=0", "about:blank"]);
            command.arg(format!("--user-data-dir={}", profile.path().display()));
            command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().ok()
        };
        let mut process = ["chromium", "chromium-browser", "google-chrome"].into_iter().find_map(start)?;
        let mut said = BufReader::new(process.stderr.take().unwrap()).lines();
        let at = said.find_map(|line| line.ok()?.split_once("ws://")?.1.split('/').next().map(str::to_owned)).unwrap();
        std::thread::spawn(move || said.for_each(drop));
        let mut stream = TcpStream::connect(&at).unwrap();
        stream.set_read_timeout(Some(LONG)).unwrap();
        write!(stream, "GET /json HTTP/1.1\r\nHost: {at}\r\nConnection: close\r\n\r\n").unwrap();
        let mut bytes = Vec::new();
        // Read by Content-Length, because the connection may stay open.
        let list: Value = loop {
            let mut part = [0; 4096];
            let count = stream.read(&mut part).unwrap();
            bytes.extend_from_slice(&part[..count]);
            let text = String::from_utf8_lossy(&bytes);
            let body = text.split_once("\r\n\r\n").and_then(|(_, body)| serde_json::from_str(body).ok());
            if let Some(list) = body {
                break list;
            }
            assert!(count > 0, "{text}");
        };
        let target = list.as_array().unwrap().iter().find(|one| one["type"] == "page").unwrap();
        let address = target["webSocketDebuggerUrl"].as_str().unwrap();
        let (socket, _) = tungstenite::client(address, TcpStream::connect(&at).unwrap()).unwrap();
        socket.get_ref().set_read_timeout(Some(LONG)).unwrap();
        let mut window =
            Self { _process: ProcessGuard(Some(process)), socket, _profile: profile, asked: 0, console: Vec::new() };
        for domain in ["Runtime", "Log", "Page"] {
            window.ask(&format!("{domain}.enable"), json!({}));
        }
        let size = json!({ "width": 1440, "height": 900, "deviceScaleFactor": 1, "mobile": false });
        window.ask(SIZE, size);
        let theme = if dark { "dark" } else { "light" };
        let features = json!({ "features": [{ "name": "prefers-color-scheme", "value": theme }] });
        window.ask("Emulation.setEmulatedMedia", features);
        window.ask("Page.navigate", json!({ "url": url }));
        Some(window)
    }

    fn ask(&mut self, method: &str, parameters: Value) -> Value {
        self.asked += 1;
        let request = json!({ "id": self.asked, "method": method, "params": parameters });
        self.socket.send(Message::text(request.to_string())).unwrap();
        loop {
            let Message::Text(text) = self.socket.read().unwrap() else { continue };
            let message: Value = serde_json::from_str(&text).unwrap();
            let event = message["method"].as_str().unwrap_or("");
            if ["Runtime.exceptionThrown", "Runtime.consoleAPICalled", "Log.entryAdded"].contains(&event) {
                self.console.push(message["params"].to_string());
            }
            if message["id"] == self.asked {
                return message["result"].clone();
            }
        }
    }

    fn evaluated(&mut self, expression: &str) -> Value {
        let asked = json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        self.ask("Runtime.evaluate", asked)
    }

    /// The value of an expression.
    fn value(&mut self, expression: &str) -> Value {
        let result = self.evaluated(expression);
        assert!(result["exceptionDetails"].is_null(), "{expression}: {result}");
        result["result"]["value"].clone()
    }

    /// Waits for a condition; a page that is not loaded yet does not fulfil it.
    #[track_caller]
    fn wait(&mut self, condition: &str) {
        let start = Instant::now();
        while self.evaluated(condition)["result"]["value"] != true {
            let text = self.value("document.body ? document.body.innerText : ''");
            assert!(start.elapsed() < LONG, "{condition}: {text}");
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Requests control until it has it: a browser that was starved of processor time may lose it.
    fn takes_control(&mut self) {
        self.wait(
            "document.getElementById('holder').textContent.startsWith('this page') || (document.getElementById('control').click(), false)",
        );
    }

    fn click(&mut self, id: &str) {
        self.value(&format!("document.getElementById('{id}').click()"));
    }

    /// Presses for slightly more than a second.
    fn press(&mut self, id: &str) {
        self.wait(&format!("!document.getElementById('{id}').disabled"));
        self.value(&format!(
            "(async () => {{ const b = document.getElementById('{id}'), key = kind => b.dispatchEvent(new KeyboardEvent(kind, {{ key: ' ', bubbles: true }})); key('keydown'); await new Promise(done => setTimeout(done, 1400)); key('keyup'); }})()"
        ));
    }

    fn picture(&mut self, name: &str) {
        let data = self.ask("Page.captureScreenshot", json!({ "format": "png" }));
        let bytes = decoded(data["data"].as_str().unwrap());
        assert!(bytes.starts_with(b"\x89PNG") && bytes.len() > 20_000, "{name}: {} bytes", bytes.len());
        if let Some(folder) = std::env::var_os(PICTURES) {
            fs::write(PathBuf::from(folder).join(format!("panel-{name}.png")), bytes).unwrap();
        }
    }

    /// Asserts that the layout has no fault at any width and at 200 % zoom, before and after scrolling, and that axe-core finds no
    /// violation. At 200 %, a window of 1280 px has 640 CSS pixels.
    fn fits(&mut self, state: &str) {
        let axe = support::axe();
        for (width, height, scale) in [
            (320, 640, 1),
            (390, 844, 1),
            (640, 400, 2),
            (720, 450, 2),
            (1280, 800, 1),
            (1440, 900, 1),
            (2560, 1440, 1),
        ] {
            let size = json!({ "width": width, "height": height, "deviceScaleFactor": scale, "mobile": false });
            self.ask(SIZE, size);
            // The charts are drawn again.
            std::thread::sleep(Duration::from_secs(1));
            let name = format!("{state}-{}-{scale}00", width * scale);
            assert_eq!(self.value(LAYOUT), "", "{name}");
            self.picture(&name);
            assert_eq!(self.value(&format!("scrollTo(0, 1e5), {LAYOUT}")), "", "{name}, scrolled");
            self.value("scrollTo(0, 0)");
            if let Some(axe) = &axe {
                let found = self.value(&format!("{axe}; {}", support::VIOLATIONS));
                assert_eq!(found, "", "{name}");
            }
        }
        self.ask(SIZE, json!({ "width": 1440, "height": 900, "deviceScaleFactor": 1, "mobile": false }));
    }

    /// Asserts that there were no errors in the page.
    fn sound(mut self) {
        assert_eq!(self.value("document.documentElement.dataset.errors"), "0", "the page's own count of errors");
        assert_eq!(self.console, Vec::<String>::new(), "console");
    }
}

/// Base64.
fn decoded(text: &str) -> Vec<u8> {
    let value = |byte: u8| match byte {
        b'A'..=b'Z' => u32::from(byte - b'A'),
        b'a'..=b'z' => u32::from(byte - b'a') + 26,
        b'0'..=b'9' => u32::from(byte - b'0') + 52,
        b'+' => 62,
        _ => 63,
    };
    let mut bytes = Vec::new();
    for group in text.trim_end_matches('=').as_bytes().chunks(4) {
        let word = group.iter().fold(0, |word, byte| word << 6 | value(*byte)) << (6 * (4 - group.len()));
        bytes.extend_from_slice(&word.to_be_bytes()[1..group.len()]);
    }
    bytes
}

/// Machine faulted, then running, moving, watched.
pub fn a_browser_draws_it(panel: &Panel) {
    let chip = |phase: &str| format!("document.getElementById('chip').textContent === '{phase}'");
    let Some(mut page) = Window::open(&panel.url(), true) else {
        return support::skipped("no chromium: the panel is not drawn");
    };
    page.wait(&chip("faulted"));
    page.takes_control();
    page.wait("Number(document.documentElement.dataset.shown) > 40");
    page.picture("faulted-dark");
    page.press("acknowledge");
    page.wait(&chip("disarmed"));
    page.fits("disarmed");
    page.click("commission");
    page.wait("document.querySelectorAll('#commission-steps .row').length > 5");
    page.fits("commissioning");
    page.value("document.querySelector('#panel-commission [data-close]').click()");
    // While disarmed there is no error, in the table and in the strips.
    page.wait("[...document.querySelectorAll('#readout .error span')].every(cell => cell.textContent === '–')");
    page.press("arm");
    page.wait(&chip("holding"));
    page.press("run");
    page.wait(&chip("running"));
    page.wait("document.getElementById('message').textContent.includes('Nothing to do')");
    page.value("document.querySelector('#jog button').click()");
    page.wait("document.getElementById('events').textContent.includes('jog y=100nm')");
    // Values, drawing and strip charts follow the machine.
    page.wait("/\\d/.test(document.querySelector('#readout .pose').textContent)");
    page.wait("document.querySelector('#spectrum svg') !== null");
    page.picture("running-dark");
    page.fits("running");
    let drawn = "(id => { const c = document.getElementById(id), d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; return new Set(new Uint32Array(d.buffer)).size; })";
    for canvas in ["strips", "legs"] {
        let colors = page.value(&format!("{drawn}('{canvas}')"));
        assert!(colors.as_u64().unwrap() > 20, "{canvas}: {colors} colours");
    }
    let mut other = Window::open(&panel.url(), false).unwrap();
    other.wait(&chip("running"));
    other.wait("document.getElementById('message').textContent.includes('You are watching')");
    other.wait("document.getElementById('arm').disabled && !document.getElementById('hold').disabled");
    other.wait("Number(document.documentElement.dataset.shown) > 40");
    other.picture("watching-light");
    // Control is handed over.
    other.click("control");
    page.wait("document.getElementById('message').textContent.includes('requests control')");
    page.click("control");
    other.wait("document.getElementById('holder').textContent.startsWith('this page')");
    other.value("document.querySelector('#jog button').click()");
    other.wait("document.getElementById('events').textContent.split('jog y=100nm').length > 2");
    other.picture("moving-light");
    for window in [&mut page, &mut other] {
        let [mean, most] =
            ["shownMean", "shownMost"].map(|key| window.value(&format!("document.documentElement.dataset.{key}")));
        println!("from the panel to the screen: {mean} ms in the mean, {most} ms at most");
    }
    // Hold and Ramp down have the keyboard focus like any button; Esc ramps down from the watching page, and closes a dialog.
    for id in ["hold", "down"] {
        let focus = format!(
            "(b => (b.focus(), document.activeElement === b && b.tabIndex === 0))(document.getElementById('{id}'))"
        );
        assert_eq!(page.value(&focus), true, "{id}");
    }
    page.click("check");
    assert_eq!(page.value("document.querySelectorAll('dialog[open]').length"), 1);
    page.value("document.dispatchEvent(new KeyboardEvent('keydown', { key: 'Escape', bubbles: true }))");
    assert_eq!(page.value("document.querySelectorAll('dialog[open]').length"), 0);
    page.wait(&chip("disarmed"));
    page.sound();
    other.sound();
}
