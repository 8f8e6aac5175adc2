//! `specgen lsp`: a language server for specs, on standard input and output. Its findings, documentation and completions come
//! from the compiler and the key table, like those of `specgen check`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::Args;
use lsp_server::{Connection, ErrorCode, Message, Notification, Request, Response};
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use specgen_compiler::compile;
use specgen_language::diagnostic::{Diagnostic, Place, Severity};
use specgen_language::editor::{Lines, Part, Spot, complete, decoded};
use specgen_language::outcome::Failure;
use specgen_language::spec::{SpecSource, key_markdown};

/// Arguments of `lsp`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::LSP)]
pub struct Arguments {
    /// The only transport; editors pass it.
    #[arg(long, hide = true)]
    stdio: bool,
}

pub fn run(_: &Arguments) -> Result<(), Failure> {
    let (connection, threads) = Connection::stdio();
    let failed = |error: &dyn std::fmt::Display| Failure::Environment(format!("the editor's connection: {error}"));
    connection.initialize(capabilities()).map_err(|error| failed(&error))?;
    Server { connection: &connection, open: BTreeMap::new() }.serve().map_err(|error| failed(&error))?;
    drop(connection);
    threads.join().map_err(|error| failed(&error))
}

fn capabilities() -> Value {
    json!({
        // A change comes as the whole text.
        "textDocumentSync": 1,
        "hoverProvider": true,
        "completionProvider": { "triggerCharacters": ["\"", " ", "=", "["] },
        "codeActionProvider": true,
    })
}

/// A document that an editor has open.
struct Open {
    uri: String,
    text: String,
    /// Findings of the last check.
    findings: Vec<Diagnostic>,
    /// Whether it has changed since then.
    changed: bool,
}

struct Server<'a> {
    connection: &'a Connection,
    /// By URI.
    open: BTreeMap<String, Open>,
}

type Served = Result<(), Box<dyn std::error::Error + Sync + Send>>;

/// The result of a request, if there is one.
type Answer = serde_json::Result<Option<Value>>;

/// JSON pointer to the document of a message.
const URI: &str = "/textDocument/uri";

impl Server<'_> {
    fn serve(&mut self) -> Served {
        while let Ok(message) = self.connection.receiver.recv() {
            if self.take(message)? {
                return Ok(());
            }
            // Check once for all changes that are waiting.
            while let Ok(message) = self.connection.receiver.try_recv() {
                if self.take(message)? {
                    return Ok(());
                }
            }
            self.check()?;
        }
        Ok(())
    }

    /// Handles a message; whether the editor has shut down.
    fn take(&mut self, message: Message) -> Result<bool, Box<dyn std::error::Error + Sync + Send>> {
        match message {
            Message::Request(request) => {
                // The answer must be about the current text.
                self.check()?;
                if self.connection.handle_shutdown(&request)? {
                    return Ok(true);
                }
                let response = self.answer(request);
                self.connection.sender.send(Message::Response(response))?;
            }
            Message::Notification(notification) => self.note(notification)?,
            Message::Response(_) => {}
        }
        Ok(false)
    }

    fn note(&mut self, Notification { method, params }: Notification) -> Served {
        match method.as_str() {
            "textDocument/didOpen" => self.put(of(&params, URI)?, of(&params, "/textDocument/text")?),
            "textDocument/didChange" => {
                if let Some(last) = of::<Vec<Value>>(&params, "/contentChanges")?.last() {
                    self.put(of(&params, URI)?, of(last, "/text")?);
                }
            }
            // The records of a spec may also have changed.
            "textDocument/didSave" => self.open.values_mut().for_each(|open| open.changed = true),
            "textDocument/didClose" => {
                let uri: String = of(&params, URI)?;
                self.open.remove(&uri);
                self.publish(&uri, &[])?;
            }
            _ => {}
        }
        Ok(())
    }

    fn put(&mut self, uri: String, text: String) {
        self.open.insert(uri.clone(), Open { uri, text, findings: Vec::new(), changed: true });
    }

    /// Compiles changed documents and publishes their findings.
    fn check(&mut self) -> Served {
        let mut shown = Vec::new();
        for open in self.open.values_mut().filter(|open| open.changed) {
            open.changed = false;
            open.findings = findings(open);
            let lines = Lines::new(&open.text);
            shown.push((open.uri.clone(), open.findings.iter().map(|found| show(found, &lines)).collect::<Vec<_>>()));
        }
        shown.iter().try_for_each(|(uri, findings)| self.publish(uri, findings))
    }

    fn publish(&self, uri: &str, findings: &[Value]) -> Served {
        let params = json!({ "uri": uri, "diagnostics": findings });
        let shown = Notification::new("textDocument/publishDiagnostics".to_owned(), params);
        Ok(self.connection.sender.send(Message::Notification(shown))?)
    }

    fn answer(&self, request: Request) -> Response {
        let Request { id, method, params } = request;
        let result = match method.as_str() {
            "textDocument/hover" => self.hover(&params),
            "textDocument/completion" => self.completions(&params),
            "textDocument/codeAction" => self.actions(&params),
            _ => {
                let message = format!("`{method}` is not supported");
                return Response::new_err(id, ErrorCode::MethodNotFound as i32, message);
            }
        };
        match result {
            Ok(value) => Response::new_ok(id, value),
            Err(error) => Response::new_err(id, ErrorCode::InvalidParams as i32, error.to_string()),
        }
    }

    /// The open spec of a request.
    fn spec(&self, params: &Value) -> serde_json::Result<Option<&Open>> {
        Ok(self.open.get(&of::<String>(params, URI)?).filter(|open| is_spec(&open.text)))
    }

    /// The open spec of a request, and the element at its position.
    fn spot(&self, params: &Value) -> serde_json::Result<Option<(&Open, Spot)>> {
        let position = of(params, "/position")?;
        let at = |open: &Open| Spot::at(&open.text, Lines::new(&open.text).offset(position));
        Ok(self.spec(params)?.map(|open| (open, at(open))))
    }

    fn hover(&self, params: &Value) -> Answer {
        let Some((_, spot)) = self.spot(params)? else { return Ok(None) };
        let value = match (spot.key, spot.section) {
            (Some(key), _) => key_markdown(&spot.path(), key),
            (None, Some(section)) if spot.is_header => format!("`{}`\n\n{}\n", section.header(), section.doc),
            _ => return Ok(None),
        };
        Ok(Some(json!({ "contents": { "kind": "markdown", "value": value } })))
    }

    fn completions(&self, params: &Value) -> Answer {
        let offered = |(open, spot): (&Open, Spot)| complete::at(&open.text, &spot, &folder(&open.uri)).into();
        Ok(self.spot(params)?.map(offered))
    }

    /// Fixes that replace the text at a finding.
    fn actions(&self, params: &Value) -> Answer {
        let asked: Part = of(params, "/range")?;
        let Some(open) = self.spec(params)? else { return Ok(None) };
        let lines = Lines::new(&open.text);
        let fix = |found: &Diagnostic| {
            let (Place::Spec(span), Some(text)) = (&found.place, &found.replacement) else { return None };
            let range = lines.part(span);
            if range.end < asked.start || asked.end < range.start {
                return None;
            }
            Some(json!({
                "title": format!("Replace with {text}"),
                "kind": "quickfix",
                "diagnostics": [show(found, &lines)],
                "edit": { "changes": { &open.uri: [{ "range": range, "newText": text }] } },
                "isPreferred": true,
            }))
        };
        Ok(Some(open.findings.iter().filter_map(fix).collect()))
    }
}

/// Part of a message.
fn of<T: DeserializeOwned>(params: &Value, pointer: &str) -> serde_json::Result<T> {
    serde_json::from_value(params.pointer(pointer).cloned().unwrap_or_default())
}

/// Whether a TOML file is a spec; an editor may open others.
fn is_spec(text: &str) -> bool {
    let line = |line: &str| line.starts_with("#:schema") && line.contains("platform.schema.json");
    text.lines().any(|found| line(found) || found.split('=').next().is_some_and(|name| name.trim() == "schema"))
}

/// Folder of the file that `uri` names.
fn folder(uri: &str) -> PathBuf {
    let path = decoded(uri.strip_prefix("file://").unwrap_or_default());
    Path::new(&path).parent().map_or_else(|| PathBuf::from("."), Path::to_path_buf)
}

/// Findings of `specgen check` about the text in the editor.
fn findings(open: &Open) -> Vec<Diagnostic> {
    if !is_spec(&open.text) {
        return Vec::new();
    }
    let source = SpecSource { display_name: open.uri.clone(), text: open.text.clone(), dir: folder(&open.uri) };
    match compile::compile_source(source) {
        Ok(compiled) => [compiled.unmet_requirements(), compiled.findings].concat(),
        Err(refused) => refused.findings,
    }
}

/// A finding in the protocol's form. A finding about a record is placed at the key that names the record.
fn show(found: &Diagnostic, lines: &Lines<'_>) -> Value {
    let (range, file) = match &found.place {
        Place::Spec(span) => (lines.part(span), String::new()),
        Place::File { path, line } => {
            let at = line.map_or_else(String::new, |line| format!(":{line}"));
            (lines.part(&lines.find(&format!("\"{path}\""))), format!("{path}{at}: "))
        }
        Place::Whole => (Part::default(), String::new()),
    };
    json!({
        "range": range,
        "severity": match found.severity {
            Severity::Error => 1,
            Severity::Warning => 2,
            Severity::Note => 3,
        },
        "code": found.code,
        "source": "specgen",
        "message": format!("{file}{}\nhelp: {}", found.message, found.help),
    })
}
