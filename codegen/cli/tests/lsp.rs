//! `specgen lsp` with a real editor (Neovim, if installed) and with hand-written messages.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Command, Stdio};

use serde_json::{Value, json};

use crate::support::{BINARY, Folder, Run, skipped};

/// Runs a session of requests and notifications, and returns the server's messages.
fn session(folder: &Folder, messages: &[Value]) -> Vec<Value> {
    let mut server = folder
        .command()
        .arg("lsp")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::inherit())
        .spawn()
        .unwrap();
    let mut input = server.stdin.take().unwrap();
    let begin = [
        json!({ "jsonrpc": "2.0", "id": 0, "method": "initialize", "params": { "capabilities": {} } }),
        json!({ "jsonrpc": "2.0", "method": "initialized", "params": {} }),
    ];
    let end = [
        json!({ "jsonrpc": "2.0", "id": 99, "method": "shutdown", "params": null }),
        json!({ "jsonrpc": "2.0", "method": "exit", "params": null }),
    ];
    for message in begin.iter().chain(messages).chain(&end) {
        let text = message.to_string();
        write!(input, "Content-Length: {}\r\n\r\n{text}", text.len()).unwrap();
    }
    drop(input);
    let mut output = BufReader::new(server.stdout.take().unwrap());
    let mut answers = Vec::new();
    loop {
        let mut header = String::new();
        if output.read_line(&mut header).unwrap() == 0 {
            break;
        }
        let length: usize = header.trim().trim_start_matches("Content-Length: ").parse().unwrap();
        let mut body = vec![0; length + 2];
        output.read_exact(&mut body).unwrap();
        answers.push(serde_json::from_slice(&body).unwrap());
    }
    assert!(server.wait().unwrap().success());
    answers
}

fn open(folder: &Folder, text: &str) -> Value {
    let uri = format!("file://{}", folder.path("open.toml").display());
    json!({ "jsonrpc": "2.0", "method": "textDocument/didOpen", "params": {
        "textDocument": { "uri": uri, "languageId": "toml", "version": 1, "text": text } } })
}

fn request(folder: &Folder, id: u32, method: &str, text: &str, words: &str) -> Value {
    let at = text.find(words).unwrap() + words.len();
    let line = text[..at].matches('\n').count();
    let column = at - text[..at].rfind('\n').map_or(0, |found| found + 1);
    let uri = format!("file://{}", folder.path("open.toml").display());
    let place = json!({ "line": line, "character": column });
    json!({ "jsonrpc": "2.0", "id": id, "method": method, "params": {
        "textDocument": { "uri": uri }, "position": place, "range": { "start": place, "end": place },
        "context": { "diagnostics": [], "triggerKind": 1 } } })
}

fn answer(answers: &[Value], id: u32) -> &Value {
    &answers.iter().find(|answer| answer["id"] == id && answer["method"].is_null()).unwrap()["result"]
}

#[test]
fn findings_are_those_of_check_and_their_fixes_are_accepted() {
    let folder = Folder::new();
    let good = folder.read("minimal.toml");
    let slips = [("height ", "heigth "), ("\"180 mm\"", "\"180 MM\""), ("\"1.195 kg\"", "1.195kg")];
    for (right, wrong) in slips {
        let text = good.replacen(right, wrong, 1);
        folder.write("open.toml", &text);
        let answers = session(
            &folder,
            &[
                open(&folder, &text),
                request(&folder, 1, "textDocument/codeAction", &text, wrong.trim_end_matches(['"', ' '])),
            ],
        );
        let shown = answers.iter().rfind(|answer| answer["method"] == "textDocument/publishDiagnostics");
        let shown = shown.unwrap()["params"]["diagnostics"].as_array().unwrap().clone();
        let check = folder.json(&["check", "open.toml"]);
        let codes = |list: &[Value]| list.iter().map(|one| one["code"].clone()).collect::<Vec<_>>();
        assert_eq!(codes(&shown), codes(check.findings()), "{wrong}");
        let first = &check.findings()[0];
        assert_eq!(shown[0]["range"]["start"]["line"], first["line"].as_u64().unwrap() - 1, "{wrong}");
        let edits = answer(&answers, 1)[0]["edit"]["changes"].as_object().unwrap();
        let edit = &edits.values().next().unwrap()[0];
        let place = |end: &str| {
            let number = |what: &str| edit["range"][end][what].as_u64().unwrap() as usize;
            let start: usize = text.split_inclusive('\n').take(number("line")).map(str::len).sum();
            start + number("character")
        };
        let fixed = [&text[..place("start")], edit["newText"].as_str().unwrap(), &text[place("end")..]].concat();
        folder.write("open.toml", &fixed);
        assert_eq!(folder.run(&["check", "open.toml"]).code, 0, "{wrong}: {fixed}");
    }
}

#[test]
fn keys_units_choices_and_files_are_offered_and_explained() {
    let folder = Folder::new();
    let text = folder.read("minimal.toml").replace("[timing]", "[adaptation]\nmode = \"\"\n\n[timing]");
    let words = [
        ("textDocument/hover", "strok"),
        ("textDocument/completion", "stroke          = \"60 "),
        ("textDocument/completion", "mode = \""),
        ("textDocument/completion", "records = [\""),
        ("textDocument/completion", "[actuator]\n"),
    ];
    let mut messages = vec![open(&folder, &text)];
    let requests = words.iter().zip(1..).map(|((method, words), id)| request(&folder, id, method, &text, words));
    messages.extend(requests);
    let answers = session(&folder, &messages);
    let hover = answer(&answers, 1)["contents"]["value"].as_str().unwrap();
    assert!(hover.starts_with("`actuator.stroke`") && hover.contains("Free stroke of a leg"), "{hover}");
    let labels = |id: u32| -> Vec<String> {
        let items = answer(&answers, id).as_array().unwrap();
        items.iter().map(|item| item["label"].as_str().unwrap().to_owned()).collect()
    };
    assert_eq!(labels(2), ["m", "mm", "um", "nm", "in", "mil"]);
    assert_eq!(labels(3), ["invhys", "ewma", "pcc"]);
    assert!(labels(4).contains(&"records/reference-forc.csv".to_owned()), "{:?}", labels(4));
    // Existing keys are not offered again.
    assert_eq!(labels(5), ["resonance_gain", "cross_talk", "capacitance"]);
}

/// Neovim opens a spec with an error, shows the hover text and applies the fix.
const SCRIPT: &str = r#"
local out = io.open("out.txt", "w")
local client = vim.lsp.start_client({ name = "specgen", cmd = { os.getenv("SPECGEN"), "lsp" }, root_dir = vim.fn.getcwd() })
vim.cmd("edit open.toml")
vim.lsp.buf_attach_client(0, client)
local function found() return vim.diagnostic.get(0) end
vim.wait(60000, function() return #found() > 0 end)
local first = found()[1]
out:write(#found(), " ", first.code or "", " line ", first.lnum + 1, "\n")
vim.api.nvim_win_set_cursor(0, { first.lnum + 1, first.col })
local function ask(method, more)
  local params = vim.tbl_extend("force", vim.lsp.util.make_range_params(), vim.lsp.util.make_position_params(), more or {})
  return vim.lsp.buf_request_sync(0, method, params, 60000)[client].result
end
local action = ask("textDocument/codeAction", { context = { diagnostics = {} } })[1]
out:write(action.title, "\n")
vim.lsp.util.apply_workspace_edit(action.edit, "utf-16")
vim.wait(60000, function() return #found() == 0 end)
out:write(#found(), " left\n")
out:write(vim.split(ask("textDocument/hover").contents.value, "\n")[1], "\n")
out:close()
vim.cmd("write")
vim.cmd("qa!")
"#;

#[test]
fn neovim_shows_a_slip_and_applies_its_fix() {
    if !Command::new("nvim").arg("--version").output().is_ok_and(|found| found.status.success()) {
        return skipped("no nvim: messages written out are tried by the other tests");
    }
    let folder = Folder::new();
    let good = folder.read("minimal.toml");
    folder.write("open.toml", good.replace("height ", "heigth "));
    folder.write("script.lua", SCRIPT);
    let mut nvim = folder.command();
    let program = std::mem::replace(&mut nvim, Command::new("nvim"));
    nvim.current_dir(program.get_current_dir().unwrap()).env("SPECGEN", BINARY);
    nvim.args(["--headless", "-u", "NONE", "-n", "-c", "luafile script.lua"]);
    let run = Run::of(&mut nvim);
    let out = folder.read("out.txt");
    let line = good.lines().position(|line| line.starts_with("height")).unwrap() + 1;
    let expected = format!("1 E0202 line {line}\nReplace with height\n0 left\n`geometry.height`, P_z in the paper\n");
    assert_eq!(out, expected, "{}", run.stderr);
    assert_eq!(folder.read("open.toml"), good);
}
