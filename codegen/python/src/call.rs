//! A command as a function: it runs in a separate thread, without the interpreter, while the calling thread handles signals.

use std::ffi::OsString;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::thread;
use std::time::{Duration, Instant};

use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError};
use pyo3::{Py, PyAny, PyErr, PyResult, Python, pyclass, pyfunction, pymethods};
use specgen::cli::call as perform;
use specgen::ui::Message;

use crate::Error;

/// Interval of checks for signals.
const POLL: Duration = Duration::from_millis(50);
/// How long to wait for the result of an interrupted command. After that its result is discarded.
const PATIENCE: Duration = Duration::from_secs(10);
/// How long to wait for a machine to ramp down.
const DOWN: Duration = Duration::from_secs(90);

/// Output of a running command.
enum Output {
    Progress(String),
    Answers(String),
    Document(String),
}

/// A command in its thread.
struct CommandThread {
    /// In a mutex only because a receiver is not `Sync`.
    words: Mutex<Receiver<Output>>,
    /// Leaked, one byte per command, because the thread may outlive this value.
    stop: &'static AtomicBool,
    patience: Duration,
    progress: Option<Py<PyAny>>,
    /// The error to raise when it has ended, and when it occurred.
    raised: Option<(PyErr, Instant)>,
}

impl CommandThread {
    fn start(
        arguments: Vec<OsString>,
        commands: Option<Receiver<String>>,
        patience: Duration,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Self> {
        let stop: &'static AtomicBool = Box::leak(Box::new(AtomicBool::new(false)));
        let (tell, words) = mpsc::channel();
        thread::Builder::new().name("specgen".to_owned()).spawn(move || {
            let sender = tell.clone();
            let hear = move |message: Message<'_>| {
                let word = match message {
                    Message::Progress(line) => Output::Progress(line.to_owned()),
                    Message::Answers(answers) => Output::Answers(answers.to_string()),
                };
                // Without a receiver the command was already stopped.
                let _ = sender.send(word);
            };
            let document = perform(arguments, stop, hear, commands).to_string();
            let _ = tell.send(Output::Document(document));
        })?;
        Ok(Self { words: Mutex::new(words), stop, patience, progress, raised: None })
    }

    fn stop(&mut self, error: PyErr) {
        self.stop.store(true, Ordering::SeqCst);
        self.raised = Some((error, Instant::now()));
    }

    /// The next output other than progress. An error meanwhile ends the command, and is raised unless it is an interrupt, after which
    /// there may be a partial result.
    fn next(&mut self, py: Python<'_>) -> PyResult<Output> {
        loop {
            let words = &self.words;
            let word = py.detach(|| match words.lock() {
                Ok(words) => words.recv_timeout(POLL),
                Err(_) => Err(RecvTimeoutError::Disconnected),
            });
            match word {
                Ok(Output::Progress(line)) => {
                    if self.raised.is_none()
                        && let Some(progress) = &self.progress
                        && let Err(error) = progress.call1(py, (line,))
                    {
                        self.stop(error);
                    }
                }
                Ok(word) => {
                    let error = self.raised.take().map(|(error, _)| error);
                    let error = error.filter(|error| !error.is_instance_of::<PyKeyboardInterrupt>(py));
                    return error.map_or(Ok(word), Err);
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    let message = "bug in specgen: it panicked; see standard error for the location";
                    return Err(PyRuntimeError::new_err(message));
                }
            }
            match (py.check_signals(), &self.raised) {
                (Err(error), None) => self.stop(error),
                // A second interrupt.
                (Err(error), Some(_)) => return Err(error),
                (Ok(()), Some((_, since))) if since.elapsed() > self.patience => {
                    let error = self.raised.take().map(|(error, _)| error);
                    return Err(error.unwrap_or_else(|| PyKeyboardInterrupt::new_err(())));
                }
                (Ok(()), _) => {}
            }
        }
    }

    fn document(&mut self, py: Python<'_>) -> PyResult<String> {
        loop {
            if let Output::Document(text) = self.next(py)? {
                return Ok(text);
            }
        }
    }
}

/// Runs `specgen ARGUMENTS` and returns the JSON document that the command prints with `--json`.
///
/// `progress` is called with each line of progress. The interpreter is released. After Ctrl-C, a command with a partial result returns
/// it with exit code 130; others return that code without a result.
#[pyfunction]
#[pyo3(signature = (arguments, progress=None))]
pub fn call(py: Python<'_>, arguments: Vec<OsString>, progress: Option<Py<PyAny>>) -> PyResult<String> {
    CommandThread::start(arguments, None, PATIENCE, progress)?.document(py)
}

/// A command that reads lines, and keeps its link alive between them.
#[pyclass(module = "specgen._native")]
pub struct Session {
    /// None once it has ended.
    commands: Option<Sender<String>>,
    running: CommandThread,
}

#[pymethods]
impl Session {
    /// Starts `specgen ARGUMENTS`.
    #[new]
    #[pyo3(signature = (arguments, progress=None))]
    fn new(arguments: Vec<OsString>, progress: Option<Py<PyAny>>) -> PyResult<Self> {
        let (commands, lines) = mpsc::channel();
        let running = CommandThread::start(arguments, Some(lines), DOWN, progress)?;
        Ok(Self { commands: Some(commands), running })
    }

    /// Sends a line and waits for its answers; without a line, waits for the initial ones. Returns whether the command continues, and
    /// JSON: the answers, or the document of a command that has ended.
    #[pyo3(signature = (line=None))]
    fn answers(&mut self, py: Python<'_>, line: Option<String>) -> PyResult<(bool, String)> {
        let Some(commands) = &self.commands else { return Err(Error::new_err("the session has ended")) };
        if let Some(line) = line {
            // If the command has ended, the document below shows it.
            let _ = commands.send(line);
        }
        match self.running.next(py)? {
            Output::Answers(answers) => Ok((true, answers)),
            Output::Document(document) => {
                self.commands = None;
                Ok((false, document))
            }
            // `next` never returns it.
            Output::Progress(_) => Err(PyRuntimeError::new_err("progress is not an answer")),
        }
    }

    /// Ends the session and returns its document; with `down`, like Ctrl-C, it ramps the machine down first.
    fn close(&mut self, py: Python<'_>, down: bool) -> PyResult<Option<String>> {
        let Some(commands) = self.commands.take() else { return Ok(None) };
        if down {
            self.running.stop.store(true, Ordering::SeqCst);
        }
        // Only now: at the end of its lines, the command checks `stop`.
        drop(commands);
        self.running.document(py).map(Some)
    }
}
