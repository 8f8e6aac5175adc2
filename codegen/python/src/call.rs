//! A command as a function: it runs in a thread of its own, without the interpreter, while the calling one looks after signals.

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

/// How often signals are looked after.
const GLANCE: Duration = Duration::from_millis(50);
/// How long an interrupted command may take to come to a result. One that takes longer goes on to the end of what it is at, unheard.
const PATIENCE: Duration = Duration::from_secs(10);
/// The same for a machine that is ramped down.
const DOWN: Duration = Duration::from_secs(90);

/// What a running command says.
enum Word {
    Progress(String),
    Answers(String),
    Document(String),
}

/// A command in its thread.
struct Running {
    /// Behind a lock that nobody else takes: a receiver by itself is not shared between threads.
    words: Mutex<Receiver<Word>>,
    /// A byte a command, which a thread may look at when nobody waits for it any more.
    stop: &'static AtomicBool,
    patience: Duration,
    progress: Option<Py<PyAny>>,
    /// What is raised when it has ended.
    raised: Option<(PyErr, Instant)>,
}

impl Running {
    fn start(
        arguments: Vec<OsString>,
        orders: Option<Receiver<String>>,
        patience: Duration,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Self> {
        let stop: &'static AtomicBool = Box::leak(Box::new(AtomicBool::new(false)));
        let (tell, words) = mpsc::channel();
        thread::Builder::new().name("specgen".to_owned()).spawn(move || {
            let told = tell.clone();
            let hear = move |message: Message<'_>| {
                let word = match message {
                    Message::Progress(line) => Word::Progress(line.to_owned()),
                    Message::Answers(answers) => Word::Answers(answers.to_string()),
                };
                // Where nobody listens any more, it was told to stop.
                let _ = told.send(word);
            };
            let document = perform(arguments, stop, hear, orders).to_string();
            let _ = tell.send(Word::Document(document));
        })?;
        Ok(Self { words: Mutex::new(words), stop, patience, progress, raised: None })
    }

    fn stop(&mut self, error: PyErr) {
        self.stop.store(true, Ordering::SeqCst);
        self.raised = Some((error, Instant::now()));
    }

    /// The next word that is no progress. What was raised meanwhile ends the command, and is raised unless it is an interrupt, after
    /// which there may be a part of a result.
    fn next(&mut self, py: Python<'_>) -> PyResult<Word> {
        loop {
            let words = &self.words;
            let word = py.detach(|| match words.lock() {
                Ok(words) => words.recv_timeout(GLANCE),
                Err(_) => Err(RecvTimeoutError::Disconnected),
            });
            match word {
                Ok(Word::Progress(line)) => {
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
                    let message = "specgen has a defect here: it panicked; standard error says where";
                    return Err(PyRuntimeError::new_err(message));
                }
            }
            match (py.check_signals(), &self.raised) {
                (Err(error), None) => self.stop(error),
                // Pressed once more, or for long enough.
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
            if let Word::Document(text) = self.next(py)? {
                return Ok(text);
            }
        }
    }
}

/// Runs `specgen ARGUMENTS` and returns the JSON document that the command prints with `--json`.
///
/// `progress` is called with each line of progress. The interpreter is free meanwhile. After Ctrl-C, a command that has a result on
/// the way returns it with exit code 130; another returns none with it.
#[pyfunction]
#[pyo3(signature = (arguments, progress=None))]
pub fn call(py: Python<'_>, arguments: Vec<OsString>, progress: Option<Py<PyAny>>) -> PyResult<String> {
    Running::start(arguments, None, PATIENCE, progress)?.document(py)
}

/// A command that takes orders line by line, and keeps its link alive in between.
#[pyclass(module = "specgen._native")]
pub struct Session {
    /// None: it has ended.
    orders: Option<Sender<String>>,
    running: Running,
}

#[pymethods]
impl Session {
    /// Starts `specgen ARGUMENTS`.
    #[new]
    #[pyo3(signature = (arguments, progress=None))]
    fn new(arguments: Vec<OsString>, progress: Option<Py<PyAny>>) -> PyResult<Self> {
        let (orders, lines) = mpsc::channel();
        let running = Running::start(arguments, Some(lines), DOWN, progress)?;
        Ok(Self { orders: Some(orders), running })
    }

    /// Gives a line and waits for its answers, without one for those that come first: whether the command goes on, and JSON: the
    /// answers, or the document of a command that has ended.
    #[pyo3(signature = (line=None))]
    fn answers(&mut self, py: Python<'_>, line: Option<String>) -> PyResult<(bool, String)> {
        let Some(orders) = &self.orders else { return Err(Error::new_err("the session has ended")) };
        if let Some(line) = line {
            // One that has ended says so below.
            let _ = orders.send(line);
        }
        match self.running.next(py)? {
            Word::Answers(answers) => Ok((true, answers)),
            Word::Document(document) => {
                self.orders = None;
                Ok((false, document))
            }
            // `next` passed it on.
            Word::Progress(_) => Err(PyRuntimeError::new_err("progress is no answer")),
        }
    }

    /// Ends the session and returns its document; with `down` as Ctrl-C ends it, which ramps a machine down.
    fn close(&mut self, py: Python<'_>, down: bool) -> PyResult<Option<String>> {
        let Some(orders) = self.orders.take() else { return Ok(None) };
        if down {
            self.running.stop.store(true, Ordering::SeqCst);
        }
        // After that: where lines end, the command looks at it.
        drop(orders);
        self.running.document(py).map(Some)
    }
}
