//! `specgen lsp`: findings, meanings and completions of a spec in an editor, by the Language Server Protocol on standard input and
//! output. What it says comes from the compiler and the key table, as what `specgen check` says does.

mod complete;
mod text;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::Args;
use lsp_server::{Connection, ErrorCode, Message, Notification, Request, Response};
use lsp_types::notification::{self, Notification as _};
use lsp_types::request::{self, Request as _};
use lsp_types::{
    CodeAction, CodeActionKind, CodeActionOrCommand, CodeActionParams, CodeActionProviderCapability, CompletionOptions,
    CompletionParams, CompletionResponse, Diagnostic as Shown, DiagnosticSeverity, DidChangeTextDocumentParams,
    DidCloseTextDocumentParams, DidOpenTextDocumentParams, Hover, HoverContents, HoverParams, HoverProviderCapability,
    MarkupContent, MarkupKind, NumberOrString, PublishDiagnosticsParams, Range, ServerCapabilities,
    TextDocumentSyncCapability, TextDocumentSyncKind, TextEdit, Uri, WorkspaceEdit,
};
use serde::Serialize;
use serde_json::Value;

use super::ui::Failure;
use specgen_compiler::compile;
use specgen_language::diagnostic::{Diagnostic, Place, Severity};
use specgen_language::spec::{SpecSource, key_markdown};
use text::{Lines, Spot};

/// Arguments of `lsp`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::LSP)]
pub struct Arguments {
    /// As editors pass it; there is no other way.
    #[arg(long, hide = true)]
    stdio: bool,
}

pub fn run(_: &Arguments) -> Result<(), Failure> {
    let (connection, threads) = Connection::stdio();
    let failed = |error: &dyn std::fmt::Display| Failure::Environment(format!("the editor's connection: {error}"));
    let capabilities = serde_json::to_value(capabilities()).map_err(|error| failed(&error))?;
    connection.initialize(capabilities).map_err(|error| failed(&error))?;
    Server { connection: &connection, open: BTreeMap::new() }.serve().map_err(|error| failed(&error))?;
    drop(connection);
    threads.join().map_err(|error| failed(&error))
}

fn capabilities() -> ServerCapabilities {
    let triggers = ["\"", " ", "=", "["].map(str::to_owned).to_vec();
    ServerCapabilities {
        text_document_sync: Some(TextDocumentSyncCapability::Kind(TextDocumentSyncKind::FULL)),
        hover_provider: Some(HoverProviderCapability::Simple(true)),
        completion_provider: Some(CompletionOptions { trigger_characters: Some(triggers), ..Default::default() }),
        code_action_provider: Some(CodeActionProviderCapability::Simple(true)),
        ..Default::default()
    }
}

/// A document that an editor has open.
struct Open {
    uri: Uri,
    text: String,
    /// What was found when it was last looked at.
    findings: Vec<Diagnostic>,
    /// Whether it has changed since.
    changed: bool,
}

struct Server<'a> {
    connection: &'a Connection,
    /// By the text of the URI.
    open: BTreeMap<String, Open>,
}

type Served = Result<(), Box<dyn std::error::Error + Sync + Send>>;

impl Server<'_> {
    fn serve(&mut self) -> Served {
        while let Ok(message) = self.connection.receiver.recv() {
            if self.take(message)? {
                return Ok(());
            }
            // Who types fast is answered once for all that has come.
            while let Ok(message) = self.connection.receiver.try_recv() {
                if self.take(message)? {
                    return Ok(());
                }
            }
            self.check()?;
        }
        Ok(())
    }

    /// Whether the editor has ended.
    fn take(&mut self, message: Message) -> Result<bool, Box<dyn std::error::Error + Sync + Send>> {
        match message {
            Message::Request(request) => {
                // What is answered is of the text as it is now.
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
            notification::DidOpenTextDocument::METHOD => {
                let DidOpenTextDocumentParams { text_document } = serde_json::from_value(params)?;
                self.put(text_document.uri, text_document.text);
            }
            notification::DidChangeTextDocument::METHOD => {
                let changed: DidChangeTextDocumentParams = serde_json::from_value(params)?;
                if let Some(last) = changed.content_changes.into_iter().next_back() {
                    self.put(changed.text_document.uri, last.text);
                }
            }
            // The records of a spec may have changed, too.
            notification::DidSaveTextDocument::METHOD => self.open.values_mut().for_each(|open| open.changed = true),
            notification::DidCloseTextDocument::METHOD => {
                let DidCloseTextDocumentParams { text_document } = serde_json::from_value(params)?;
                self.open.remove(text_document.uri.as_str());
                self.publish(text_document.uri, Vec::new())?;
            }
            _ => {}
        }
        Ok(())
    }

    fn put(&mut self, uri: Uri, text: String) {
        self.open.insert(uri.as_str().to_owned(), Open { uri, text, findings: Vec::new(), changed: true });
    }

    /// Compiles what has changed and shows what was found.
    fn check(&mut self) -> Served {
        let mut shown = Vec::new();
        for open in self.open.values_mut().filter(|open| open.changed) {
            open.changed = false;
            open.findings = findings(open);
            let lines = Lines::new(&open.text);
            shown.push((open.uri.clone(), open.findings.iter().map(|found| show(found, &lines)).collect()));
        }
        shown.into_iter().try_for_each(|(uri, findings)| self.publish(uri, findings))
    }

    fn publish(&self, uri: Uri, diagnostics: Vec<Shown>) -> Served {
        let params = PublishDiagnosticsParams { uri, diagnostics, version: None };
        let shown = Notification::new(notification::PublishDiagnostics::METHOD.to_owned(), params);
        Ok(self.connection.sender.send(Message::Notification(shown))?)
    }

    fn answer(&self, request: Request) -> Response {
        let Request { id, method, params } = request;
        let result = match method.as_str() {
            request::HoverRequest::METHOD => reply(params, |params| self.hover(&params)),
            request::Completion::METHOD => reply(params, |params| self.completions(&params)),
            request::CodeActionRequest::METHOD => reply(params, |params| self.actions(&params)),
            _ => {
                let message = format!("`{method}` is not offered");
                return Response::new_err(id, ErrorCode::MethodNotFound as i32, message);
            }
        };
        match result {
            Ok(value) => Response::new_ok(id, value),
            Err(error) => Response::new_err(id, ErrorCode::InvalidParams as i32, error.to_string()),
        }
    }

    /// The open spec called `uri`.
    fn spec(&self, uri: &Uri) -> Option<&Open> {
        self.open.get(uri.as_str()).filter(|open| is_spec(&open.text))
    }

    fn hover(&self, params: &HoverParams) -> Option<Hover> {
        let at = &params.text_document_position_params;
        let open = self.spec(&at.text_document.uri)?;
        let spot = Spot::at(&open.text, Lines::new(&open.text).offset(at.position));
        let value = match (spot.key, spot.section) {
            (Some(key), _) => key_markdown(&spot.path(), key),
            (None, Some(section)) if spot.is_header => format!("`{}`\n\n{}\n", section.header(), section.doc),
            _ => return None,
        };
        let contents = HoverContents::Markup(MarkupContent { kind: MarkupKind::Markdown, value });
        Some(Hover { contents, range: None })
    }

    fn completions(&self, params: &CompletionParams) -> Option<CompletionResponse> {
        let at = &params.text_document_position;
        let open = self.spec(&at.text_document.uri)?;
        let spot = Spot::at(&open.text, Lines::new(&open.text).offset(at.position));
        Some(CompletionResponse::Array(complete::at(&open.text, &spot, &folder(&open.uri))))
    }

    /// The fixes that are as simple as another text in the place of a finding.
    #[expect(clippy::mutable_key_type, reason = "the protocol's types: its URIs keep what they have parsed")]
    fn actions(&self, params: &CodeActionParams) -> Option<Vec<CodeActionOrCommand>> {
        let open = self.spec(&params.text_document.uri)?;
        let lines = Lines::new(&open.text);
        let asked = &params.range;
        let fix = |found: &Diagnostic| {
            let (Place::Spec(span), Some(new_text)) = (&found.place, found.replacement.clone()) else { return None };
            let range = Range::new(lines.position(span.start), lines.position(span.end));
            if range.end < asked.start || asked.end < range.start {
                return None;
            }
            let title = format!("Replace by {new_text}");
            let edits = [(open.uri.clone(), vec![TextEdit { range, new_text }])].into_iter().collect();
            Some(CodeActionOrCommand::CodeAction(CodeAction {
                title,
                kind: Some(CodeActionKind::QUICKFIX),
                diagnostics: Some(vec![show(found, &lines)]),
                edit: Some(WorkspaceEdit { changes: Some(edits), ..Default::default() }),
                is_preferred: Some(true),
                ..Default::default()
            }))
        };
        Some(open.findings.iter().filter_map(fix).collect())
    }
}

fn reply<P: serde::de::DeserializeOwned, R: Serialize>(
    params: Value,
    answer: impl FnOnce(P) -> R,
) -> serde_json::Result<Value> {
    serde_json::to_value(answer(serde_json::from_value(params)?))
}

/// Whether a TOML file is a spec: an editor opens others, too.
fn is_spec(text: &str) -> bool {
    let line = |line: &str| line.starts_with("#:schema") && line.contains("platform.schema.json");
    text.lines().any(|found| line(found) || found.split('=').next().is_some_and(|name| name.trim() == "schema"))
}

/// Folder of the file that `uri` names.
fn folder(uri: &Uri) -> PathBuf {
    let path = text::decoded(uri.as_str().strip_prefix("file://").unwrap_or_default());
    Path::new(&path).parent().map_or_else(|| PathBuf::from("."), Path::to_path_buf)
}

/// What `specgen check` finds in the text as it stands in the editor.
fn findings(open: &Open) -> Vec<Diagnostic> {
    if !is_spec(&open.text) {
        return Vec::new();
    }
    let source =
        SpecSource { display_name: open.uri.as_str().to_owned(), text: open.text.clone(), dir: folder(&open.uri) };
    match compile::compile_source(source) {
        Ok(compiled) => [compiled.missed(), compiled.findings].concat(),
        Err(refused) => refused.findings,
    }
}

/// A finding as an editor shows it. One about a record stands at the key that names it.
fn show(found: &Diagnostic, lines: &Lines<'_>) -> Shown {
    let (range, file) = match &found.place {
        Place::Spec(span) => (Range::new(lines.position(span.start), lines.position(span.end)), String::new()),
        Place::File { path, line } => {
            let at = line.map_or_else(String::new, |line| format!(":{line}"));
            let span = lines.find(&format!("\"{path}\""));
            (Range::new(lines.position(span.start), lines.position(span.end)), format!("{path}{at}: "))
        }
        Place::Whole => (Range::default(), String::new()),
    };
    Shown {
        range,
        severity: Some(match found.severity {
            Severity::Error => DiagnosticSeverity::ERROR,
            Severity::Warning => DiagnosticSeverity::WARNING,
            Severity::Note => DiagnosticSeverity::INFORMATION,
        }),
        code: Some(NumberOrString::String(found.code.to_owned())),
        source: Some("specgen".to_owned()),
        message: format!("{file}{}\nhelp: {}", found.message, found.help),
        ..Default::default()
    }
}
